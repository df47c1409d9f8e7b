#include "surface/triangulated_skin.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "surface/no_index.hpp"
#include "surface/sweep_triangulation.hpp"

namespace bsp2::geometry {
namespace {

/// Tells how far a work of several steps is.
class Steps {
 public:
  explicit Steps(const ToldShare& told) : told_(told) {}
  /// The next step leads from one share to another one.
  void begin(double from, double to) {
    from_ = from;
    to_ = to;
    Interruption::check();
    if (told_) told_(from);
  }
  void within(std::size_t done, std::size_t all) const {
    constexpr std::size_t seldom = 1024;
    if (++calls_ % seldom != 0) return;
    Interruption::check();
    if (told_) told_(from_ + (to_ - from_) * static_cast<double>(done) / static_cast<double>(all));
  }

 private:
  const ToldShare& told_;
  double from_ = 0, to_ = 0;
  mutable std::size_t calls_ = 0;
};

/// Puts the faces in an order that does not depend on how they were found.
void sort_faces(Skin& skin) {
  std::vector<std::uint32_t> order(skin.faces.size()), place(skin.faces.size());
  std::iota(order.begin(), order.end(), 0u);
  const auto key = [&](std::uint32_t i) {
    return std::tuple(skin.faces[i].outward.code, skin.faces[i].owner, skin.faces[i].other);
  };
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<Skin::Face> faces;
  for (const std::uint32_t old : order) {
    if (faces.empty() || faces.back() != skin.faces[old]) faces.push_back(skin.faces[old]);
    place[old] = static_cast<std::uint32_t>(faces.size() - 1);
  }
  for (Skin::Edge& edge : skin.edges) edge.face = place[edge.face];
  skin.faces = std::move(faces);
}

/// The vertices of a skin, equal ones once; the edges are renumbered.
PointSet unite_points(const HyperplaneTable<3>& table, Skin& skin) {
  PointSet points;
  points.vertices = make_vertices(table, skin.vertices);  // named by ascending ids
  points.offset = std::move(skin.incident_offset);
  points.planes = std::move(skin.incident);
  skin.vertices = {};
  const auto map = ExactPoints(table).unify(points);
  for (Skin::Edge& edge : skin.edges) {
    edge.from = map[edge.from];
    edge.to = map[edge.to];
  }
  return points;
}

/// Adds up the edges of each plane line by line: those on both sides of a cut between regions were added up
/// apart.
void add_up_lines(ExactPoints& exact, const PointSet& points, Skin& skin) {
  const auto plane = [&](const Skin::Edge& edge) { return skin.faces[edge.face].outward.id(); };
  std::sort(skin.edges.begin(), skin.edges.end(),
            [&](const Skin::Edge& a, const Skin::Edge& b) { return plane(a) < plane(b); });
  LineAdder adder(exact);
  EdgeChain sum, edges;
  sum.reserve(skin.edges.size());
  for (std::size_t begin = 0, end = 0; begin < skin.edges.size(); begin = end) {
    while (end < skin.edges.size() && plane(skin.edges[end]) == plane(skin.edges[begin])) ++end;
    edges.assign(skin.edges.begin() + static_cast<std::ptrdiff_t>(begin),
                 skin.edges.begin() + static_cast<std::ptrdiff_t>(end));
    adder.add_up(points, plane(skin.edges[begin]), edges);
    sum.insert(sum.end(), edges.begin(), edges.end());
  }
  skin.edges = std::move(sum);
}

/// Joins the edges at vertices in which no more happens than that straight edges go on, in all faces: one, or
/// several that cross. Whether a vertex is where edges only cross depends on how the skin was found.
/// @pre no vertex lies inside an edge.
class Straightener {
 public:
  /// @param skin its edges are used up.
  Straightener(ExactPoints& exact, const PointSet& points, Skin& skin)
      : exact_(exact), points_(points), skin_(skin) {}

  EdgeChain run() {
    find_straight();
    EdgeChain edges = std::move(skin_.edges);
    sort_by_face(edges, [](const Skin::Edge& a, const Skin::Edge& b) {
      return std::tie(a.from, a.to) < std::tie(b.from, b.to);
    });
    EdgeChain joined;
    joined.reserve(edges.size());
    for (const Skin::Edge& edge : edges) {
      if (straight_[edge.from]) continue;
      Skin::Edge whole = edge;
      while (straight_[whole.to]) whole.to = next(edges, whole);
      joined.push_back(whole);
    }
    return joined;
  }

 private:
  struct Neighbour {
    std::uint32_t point, edge;  ///< edge: one that leads there
  };

  ExactPoints& exact_;
  const PointSet& points_;
  Skin& skin_;
  std::vector<bool> straight_;
  // Of the point at hand.
  std::vector<Neighbour> neighbours_;
  std::vector<std::pair<std::uint32_t, int>> changes_;

  void find_straight() {
    std::vector<std::uint32_t> end_at(points_.size() + 1), edges_at(2 * skin_.edges.size());
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to}) ++end_at[point + std::size_t{1}];
    std::partial_sum(end_at.begin(), end_at.end(), end_at.begin());
    for (std::uint32_t i = 0; i < skin_.edges.size(); ++i)
      for (const std::uint32_t point : {skin_.edges[i].from, skin_.edges[i].to})
        edges_at[end_at[point]++] = i;
    straight_.assign(points_.size(), false);
    for (std::uint32_t point = 0, begin = 0; point < points_.size(); begin = end_at[point++])
      straight_[point] = all_go_on(point, std::span(edges_at).subspan(begin, end_at[point] - begin));
  }

  [[nodiscard]] std::uint32_t other_end(std::uint32_t edge, std::uint32_t point) const {
    const Skin::Edge& e = skin_.edges[edge];
    return e.from == point ? e.to : e.from;
  }

  bool all_go_on(std::uint32_t point, std::span<const std::uint32_t> edges) {
    neighbours_.clear();
    for (const std::uint32_t edge : edges) neighbours_.push_back({other_end(edge, point), edge});
    std::ranges::sort(neighbours_, {}, &Neighbour::point);
    // Not the one of std::ranges: clang 14, which builds the fuzz targets, cannot read libstdc++'s subrange.
    const auto is_same = [](const Neighbour& a, const Neighbour& b) { return a.point == b.point; };
    neighbours_.erase(std::unique(neighbours_.begin(), neighbours_.end(), is_same), neighbours_.end());
    if (neighbours_.empty() || neighbours_.size() % 2 != 0) return false;
    while (!neighbours_.empty()) {
      const Neighbour here = neighbours_.back();
      neighbours_.pop_back();
      const auto beyond = std::ranges::find_if(neighbours_, [&](const Neighbour& other) {
        const Skin::Edge& edge = skin_.edges[here.edge];
        return exact_.side(points_, other.point, skin_.faces[edge.face].outward.id()) == 0 &&
               exact_.side(points_, other.point, edge.across) == 0;
      });
      if (beyond == neighbours_.end() || !goes_on(point, edges, here.point, beyond->point)) return false;
      neighbours_.erase(beyond);
    }
    return true;
  }

  /// Whether each face has as many edges on the one side of a point of a line as on the other.
  bool goes_on(std::uint32_t point, std::span<const std::uint32_t> edges, std::uint32_t a, std::uint32_t b) {
    changes_.clear();
    for (const std::uint32_t edge : edges)
      if (const std::uint32_t other = other_end(edge, point); other == a || other == b)
        changes_.emplace_back(skin_.edges[edge].face, skin_.edges[edge].to == point ? 1 : -1);
    std::ranges::sort(changes_);
    for (std::size_t begin = 0, end = 0; begin < changes_.size(); begin = end) {
      int sum = 0;
      for (; end < changes_.size() && changes_[end].first == changes_[begin].first; ++end)
        sum += changes_[end].second;
      if (sum != 0) return false;
    }
    return true;
  }

  /// Where an edge goes on to from its end.
  std::uint32_t next(const EdgeChain& edges, const Skin::Edge& edge) {
    auto at = std::lower_bound(
        edges.begin(), edges.end(), std::pair(edge.face, edge.to),
        [](const Skin::Edge& e, const auto& key) { return std::pair(e.face, e.from) < key; });
    for (; at != edges.end() && at->face == edge.face && at->from == edge.to; ++at)
      if (exact_.side(points_, at->to, edge.across) == 0) return at->to;
    throw std::logic_error("the boundary of a face does not close");
  }
};

/// Gives the points names and numbers that do not depend on how the skin was found, and so their coordinates:
/// of the planes of faces that meet in a point those three that are furthest from parallel.
class Renaming {
 public:
  Renaming(ExactPoints& exact, PointSet& points, Skin& skin) : exact_(exact), points_(points), skin_(skin) {}

  void run() {
    find_planes();
    for (std::uint32_t point = 0; point < points_.size(); ++point)
      if (planes_[point].count >= 3) rename(point);
    renumber();
  }

 private:
  /// The lowest ids of planes with faces that have an edge at a point.
  struct Planes {
    static constexpr std::size_t most = 8;
    std::array<HyperplaneId, most> ids;
    std::size_t count = 0;
    void add(HyperplaneId id) {
      const auto end = ids.begin() + static_cast<std::ptrdiff_t>(count);
      const auto at = std::lower_bound(ids.begin(), end, id);
      if (at != end && *at == id) return;
      if (count == most && at == end) return;
      if (count < most) ++count;
      std::copy_backward(at, ids.begin() + static_cast<std::ptrdiff_t>(count) - 1,
                         ids.begin() + static_cast<std::ptrdiff_t>(count));
      *at = id;
    }
  };
  ExactPoints& exact_;
  PointSet& points_;
  Skin& skin_;
  std::vector<Planes> planes_;
  std::vector<std::uint32_t> end_at_;  // of each point among all_at_
  std::vector<HyperplaneId> all_at_;

  void find_planes() {
    planes_.resize(points_.size());
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to})
        planes_[point].add(skin_.faces[edge.face].outward.id());
  }

  void rename(std::uint32_t point) {
    const auto name = name_of(point);
    if (name && *name != points_.vertices[point].hyperplanes)
      points_.vertices[point] = canonical_vertex(exact_.table(), *name);
  }

  /// Three of the planes; where none of those known are far from parallel, the first that are independent.
  [[nodiscard]] std::optional<std::array<HyperplaneId, 3>> name_of(std::uint32_t point) {
    constexpr double surely_independent = 0x1p-20;
    const Planes& planes = planes_[point];
    std::array<std::array<double, 3>, Planes::most> normals;
    for (std::size_t i = 0; i < planes.count; ++i) normals[i] = exact_.table().rounded(planes.ids[i]).normal;
    double largest = 0;
    std::optional<std::array<HyperplaneId, 3>> name;
    for (std::size_t i = 0; i < planes.count; ++i)
      for (std::size_t j = i + 1; j < planes.count; ++j)
        for (std::size_t k = j + 1; k < planes.count; ++k) {
          const auto &a = normals[i], &b = normals[j], &c = normals[k];
          const double size =
              std::fabs(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                        a[2] * (b[0] * c[1] - b[1] * c[0]));
          if (size <= largest) continue;
          largest = size;
          name = {planes.ids[i], planes.ids[j], planes.ids[k]};
        }
    return largest > surely_independent ? name : first_independent(all_planes(point));
  }
  std::vector<HyperplaneId> all_planes(std::uint32_t point) {
    if (end_at_.empty()) find_all_planes();
    const auto begin = all_at_.begin() + (point > 0 ? end_at_[point - 1] : 0),
               end = all_at_.begin() + end_at_[point];
    std::vector<HyperplaneId> ids(begin, end);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
  }
  /// Only where they are asked for.
  void find_all_planes() {
    std::vector<std::uint32_t> next(points_.size() + 1);
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to}) ++next[point + std::size_t{1}];
    std::partial_sum(next.begin(), next.end(), next.begin());
    all_at_.resize(next.back());
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to})
        all_at_[next[point]++] = skin_.faces[edge.face].outward.id();
    end_at_ = std::move(next);
  }
  [[nodiscard]] std::optional<std::array<HyperplaneId, 3>> first_independent(
      std::span<const HyperplaneId> ids) {
    for (std::size_t i = 0; i < ids.size(); ++i)
      for (std::size_t j = i + 1; j < ids.size(); ++j)
        for (std::size_t k = j + 1; k < ids.size(); ++k) {
          const std::array<HyperplaneId, 3> name{ids[i], ids[j], ids[k]};
          if (!exact_.coordinates().point({{}, 0, name})[3].is_zero()) return name;
        }
    return std::nullopt;
  }

  void renumber() {
    std::vector<std::uint32_t> order, number(points_.size(), none);
    for (std::uint32_t point = 0; point < points_.size(); ++point)
      if (planes_[point].count > 0) order.push_back(point);
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
      const Vertex<3>&p = points_.vertices[a], &q = points_.vertices[b];
      return std::tie(p.x, p.hyperplanes) < std::tie(q.x, q.hyperplanes);
    });
    PointSet used;
    used.vertices.reserve(order.size());
    for (const std::uint32_t point : order) {
      number[point] = static_cast<std::uint32_t>(used.size());
      used.add(points_.vertices[point], points_.planes_of(point));
    }
    points_ = std::move(used);
    for (Skin::Edge& edge : skin_.edges) {
      edge.from = number[edge.from];
      edge.to = number[edge.to];
    }
    sort_by_face(skin_.edges, [](const Skin::Edge& a, const Skin::Edge& b) {
      return std::tie(a.from, a.to) < std::tie(b.from, b.to);
    });
  }
};

/// Where edges of one face cross though none ends there: three lines through a point with every other one of
/// the six sectors in the face, so that each line goes straight on. Looked for only where a face could not be
/// triangulated.
void add_crossings(ExactPoints& exact, std::span<const Skin::Edge> edges, OrientedHyperplane outward,
                   PointSet& points) {
  const auto part = [&](const Skin::Edge& a, const Skin::Edge& b) {
    return exact.side(points, a.from, b.across) * exact.side(points, a.to, b.across) < 0;
  };
  // Most edges of a large face are far from each other, which their boxes tell.
  std::vector<std::array<double, 6>> boxes;
  for (const Skin::Edge& edge : edges) {
    const Vertex<3>&u = points.vertices[edge.from], &v = points.vertices[edge.to];
    std::array<double, 6> box{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      box[axis] = std::min(u.x[axis] - u.error, v.x[axis] - v.error);
      box[3 + axis] = std::max(u.x[axis] + u.error, v.x[axis] + v.error);
    }
    boxes.push_back(box);
  }
  const auto are_apart = [&](std::size_t i, std::size_t k) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (boxes[i][axis] > boxes[k][3 + axis] || boxes[k][axis] > boxes[i][3 + axis]) return true;
    return false;
  };
  for (std::size_t i = 0; i < edges.size(); ++i)
    for (std::size_t k = 0; k < i; ++k) {
      if (are_apart(i, k) || !part(edges[i], edges[k]) || !part(edges[k], edges[i])) continue;
      const Vertex<3> vertex =
          canonical_vertex(exact.table(), {outward.id(), edges[i].across, edges[k].across});
      points.add(vertex, vertex.hyperplanes);
    }
}

/// The triangles of all faces. @return whether all could be made; else the points are more, to divide edges
/// at.
bool triangulate_faces(ExactPoints& exact, const Skin& skin, TriangulatedSkin& result, const Steps& steps) {
  const EdgeChain& edges = skin.edges;
  PointSet& points = result.points;
  TriangleSurface& surface = result.surface = {};
  result.face_of_triangle.clear();
  result.point_of_surface.clear();
  surface.points.reserve(points.size());
  surface.triangles.reserve(edges.size());
  surface.owner.reserve(edges.size());
  const std::size_t known = points.size();
  SweepTriangulator triangulator;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> number(known, none);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    const Skin::Face& face = skin.faces[edges[begin].face];
    while (end < edges.size() && edges[end].face == edges[begin].face) ++end;
    steps.within(begin, edges.size());
    const auto of_face = std::span(edges).subspan(begin, end - begin);
    triangles.clear();
    try {
      triangulator.triangulate(exact, points, face.outward, of_face, triangles);
    } catch (const std::logic_error&) {
      const std::size_t before = points.size();
      add_crossings(exact, of_face, face.outward, points);
      if (points.size() == before) throw;
    }
    for (auto& triangle : triangles) {
      for (std::uint32_t& point : triangle) {
        if (number[point] == none) {
          number[point] = static_cast<std::uint32_t>(surface.points.size());
          result.point_of_surface.push_back(point);
          const auto& x = points.vertices[point].x;
          surface.points.push_back({x[0] + 0.0, x[1] + 0.0, x[2] + 0.0});  // no negative zeros
        }
        point = number[point];
      }
      surface.triangles.push_back(triangle);
      surface.owner.push_back(face.owner);
      result.face_of_triangle.push_back(edges[begin].face);
    }
  }
  return points.size() == known;
}

/// Divides edges at the points from `first` on, which may be the same as others.
void divide_at(ExactPoints& exact, PointSet& points, std::size_t first, Skin& skin) {
  const auto map = exact.unify(points);
  for (Skin::Edge& edge : skin.edges) {
    edge.from = map[edge.from];
    edge.to = map[edge.to];
  }
  std::vector<std::uint32_t> crossings(map.begin() + static_cast<std::ptrdiff_t>(first), map.end());
  EdgeSplitter(exact).split(points, skin.faces, skin.edges, crossings);
  add_up(skin.edges);
}

}  // namespace

TriangulatedSkin triangulated(const HyperplaneTable<3>& table, Skin skin, const ToldShare& told) {
  Steps steps(told);
  ExactPoints exact(table);
  sort_faces(skin);
  skin.weld();
  TriangulatedSkin result;
  PointSet& points = result.points = unite_points(table, skin);
  steps.begin(0.25, 0.4);
  add_up_lines(exact, points, skin);
  add_up(skin.edges);
  steps.begin(0.4, 0.55);
  EdgeSplitter(exact).split(points, skin.faces, skin.edges);
  add_up(skin.edges);
  steps.begin(0.55, 0.7);
  skin.edges = Straightener(exact, points, skin).run();
  for (;;) {
    Renaming(exact, points, skin).run();
    const std::size_t known = points.size();
    steps.begin(0.7, 1);
    if (triangulate_faces(exact, skin, result, steps)) break;
    const std::size_t undivided = skin.edges.size();
    divide_at(exact, points, known, skin);
    if (skin.edges.size() <= undivided)
      throw std::logic_error("edges of a face of the boundary that cross cannot be divided");
  }
  result.faces = std::move(skin.faces);
  result.edges = std::move(skin.edges);
  return result;
}

}  // namespace bsp2::geometry
