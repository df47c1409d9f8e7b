#include "surface/skin_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>
#include <vector>

#include "support/counted_order.hpp"
#include "surface/no_index.hpp"
#include "surface/shared_ranges.hpp"

namespace bsp2::geometry {

bool is_before(const Skin::Face& a, const Skin::Face& b) {
  return std::tuple(a.outward.code, a.owner, a.other) < std::tuple(b.outward.code, b.owner, b.other);
}

void sort_faces(Skin& skin) {
  std::vector<std::uint32_t> place(skin.faces.size());
  const auto order = counted_order(
      skin.faces.size(), [&](std::size_t i) { return skin.faces[i].outward.code; },
      [&](std::uint32_t a, std::uint32_t b) { return is_before(skin.faces[a], skin.faces[b]); });
  std::vector<Skin::Face> faces;
  for (const std::uint32_t old : order) {
    if (faces.empty() || faces.back() != skin.faces[old]) faces.push_back(skin.faces[old]);
    place[old] = static_cast<std::uint32_t>(faces.size() - 1);
  }
  for (Skin::Edge& edge : skin.edges) edge.face = place[edge.face];
  skin.faces = std::move(faces);
}

PointSet take_points(const HyperplaneTable<3>& table, unsigned threads, Skin& skin) {
  PointSet points;
  points.vertices.resize(skin.vertices.size());
  ExactPoints unused(table);
  SharedRanges(skin.vertices.size(), threads)
      .run(unused, [&](ExactPoints&, std::size_t, std::size_t first, std::size_t end) {
        const std::span names(skin.vertices);
        const auto some = make_vertices(table, names.subspan(first, end - first));
        std::copy(some.begin(), some.end(), points.vertices.begin() + static_cast<std::ptrdiff_t>(first));
      });
  points.offset = std::exchange(skin.incident_offset, {0});
  points.planes = std::exchange(skin.incident, {});
  skin.vertices = {};
  return points;
}

std::vector<std::uint32_t> unite_points(const HyperplaneTable<3>& table, PointSet& points, Skin& skin) {
  auto map = ExactPoints(table).unify(points);  // whose memory is free again then
  for (Skin::Edge& edge : skin.edges) {
    edge.from = map[edge.from];
    edge.to = map[edge.to];
  }
  return map;
}

void add_up_lines(ExactPoints& exact, unsigned threads, const PointSet& points, Skin& skin) {
  group_by_face(skin.edges);
  const auto plane = [&](std::size_t edge) { return skin.faces[skin.edges[edge].face].outward.id(); };
  const SharedRanges ranges(skin.edges.size(), threads);
  std::vector<EdgeChain> sums(ranges.size());
  // Those of the planes that begin in a range.
  ranges.run(exact, [&](ExactPoints& own, std::size_t range, std::size_t first, std::size_t last) {
    LineAdder adder(own);
    EdgeChain edges;
    std::size_t begin = first, end = first;
    if (first > 0)
      while (begin < last && plane(begin) == plane(first - 1)) ++begin;
    for (; begin < last; begin = end) {
      for (end = begin; end < skin.edges.size() && plane(end) == plane(begin);) ++end;
      edges.assign(skin.edges.begin() + static_cast<std::ptrdiff_t>(begin),
                   skin.edges.begin() + static_cast<std::ptrdiff_t>(end));
      adder.add_up(points, plane(begin), edges);
      sums[range].insert(sums[range].end(), edges.begin(), edges.end());
    }
  });
  skin.edges.clear();
  for (EdgeChain& sum : sums) {
    skin.edges.insert(skin.edges.end(), sum.begin(), sum.end());
    sum = EdgeChain();  // its memory, too
  }
}

namespace {

class Straightener {
 public:
  /// @param skin its edges are used up.
  Straightener(ExactPoints& exact, unsigned threads, const PointSet& points, std::size_t own_faces,
               Skin& skin)
      : exact_(exact), threads_(threads), points_(points), own_faces_(own_faces), skin_(skin) {}

  EdgeChain run() {
    find_straight();
    EdgeChain edges = std::move(skin_.edges);
    sort_by_face(edges, [](const Skin::Edge& a, const Skin::Edge& b) {
      return std::tie(a.from, a.to) < std::tie(b.from, b.to);
    });
    EdgeChain joined;
    joined.reserve(edges.size());
    for (const Skin::Edge& edge : edges) {
      if (edge.face >= own_faces_) {  // not all of the face is there
        joined.push_back(edge);
        continue;
      }
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
  unsigned threads_;
  const PointSet& points_;
  std::size_t own_faces_;
  Skin& skin_;
  std::vector<unsigned char> straight_;  // no bits: several threads write
  /// Of the point at hand, on one thread.
  struct Scratch {
    ExactPoints& exact;
    std::vector<Neighbour> neighbours;
    std::vector<std::pair<std::uint32_t, int>> changes;
  };

  void find_straight() {
    std::vector<std::uint32_t> end_at(points_.size() + 1), edges_at(2 * skin_.edges.size());
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to}) ++end_at[point + std::size_t{1}];
    std::partial_sum(end_at.begin(), end_at.end(), end_at.begin());
    for (std::uint32_t i = 0; i < skin_.edges.size(); ++i)
      for (const std::uint32_t point : {skin_.edges[i].from, skin_.edges[i].to})
        edges_at[end_at[point]++] = i;
    straight_.resize(points_.size());
    SharedRanges(points_.size(), threads_)
        .run(exact_, [&](ExactPoints& exact, std::size_t, std::size_t first, std::size_t end) {
          Scratch scratch{exact, {}, {}};
          for (std::size_t point = first; point < end; ++point) {
            const std::uint32_t begin = point > 0 ? end_at[point - 1] : 0;
            straight_[point] = all_go_on(scratch, static_cast<std::uint32_t>(point),
                                         std::span(edges_at).subspan(begin, end_at[point] - begin));
          }
        });
  }

  [[nodiscard]] std::uint32_t other_end(std::uint32_t edge, std::uint32_t point) const {
    const Skin::Edge& e = skin_.edges[edge];
    return e.from == point ? e.to : e.from;
  }

  bool all_go_on(Scratch& scratch, std::uint32_t point, std::span<const std::uint32_t> edges) {
    auto& neighbours = scratch.neighbours;
    neighbours.clear();
    for (const std::uint32_t edge : edges) neighbours.push_back({other_end(edge, point), edge});
    std::ranges::sort(neighbours, {}, &Neighbour::point);
    // Not the one of std::ranges: clang 14, which builds the fuzz targets, cannot read libstdc++'s subrange.
    const auto is_same = [](const Neighbour& a, const Neighbour& b) { return a.point == b.point; };
    neighbours.erase(std::unique(neighbours.begin(), neighbours.end(), is_same), neighbours.end());
    if (neighbours.empty() || neighbours.size() % 2 != 0) return false;
    while (!neighbours.empty()) {
      const Neighbour here = neighbours.back();
      neighbours.pop_back();
      const auto beyond = std::ranges::find_if(neighbours, [&](const Neighbour& other) {
        const Skin::Edge& edge = skin_.edges[here.edge];
        return scratch.exact.side(points_, other.point, skin_.faces[edge.face].outward.id()) == 0 &&
               scratch.exact.side(points_, other.point, edge.across) == 0;
      });
      if (beyond == neighbours.end() || !goes_on(scratch.changes, point, edges, here.point, beyond->point))
        return false;
      neighbours.erase(beyond);
    }
    return true;
  }

  /// Whether each face has as many edges on the one side of a point of a line as on the other.
  bool goes_on(std::vector<std::pair<std::uint32_t, int>>& changes, std::uint32_t point,
               std::span<const std::uint32_t> edges, std::uint32_t a, std::uint32_t b) {
    changes.clear();
    for (const std::uint32_t edge : edges)
      if (const std::uint32_t other = other_end(edge, point); other == a || other == b)
        changes.emplace_back(skin_.edges[edge].face, skin_.edges[edge].to == point ? 1 : -1);
    std::ranges::sort(changes);
    for (std::size_t begin = 0, end = 0; begin < changes.size(); begin = end) {
      int sum = 0;
      for (; end < changes.size() && changes[end].first == changes[begin].first; ++end)
        sum += changes[end].second;
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

class Renaming {
 public:
  Renaming(ExactPoints& exact, unsigned threads, PointSet& points, Skin& skin,
           std::vector<std::uint8_t> is_named)
      : exact_(exact), threads_(threads), points_(points), skin_(skin), is_named_(std::move(is_named)) {
    is_named_.resize(points.size());
  }

  void run() {
    find_planes();
    const SharedRanges ranges(points_.size(), threads_);
    std::vector<std::vector<std::uint32_t>> flat(ranges.size());  // points whose planes are nearly parallel
    ranges.run(exact_, [&](ExactPoints&, std::size_t range, std::size_t first, std::size_t end) {
      for (std::size_t point = first; point < end; ++point) {
        if (planes_[point].count < 3) continue;
        if (const auto name = name_of(point))
          rename(point, *name);
        else
          flat[range].push_back(static_cast<std::uint32_t>(point));
      }
    });
    for (const auto& some : flat)
      for (const std::uint32_t point : some)
        if (const auto name = first_independent(all_planes(point))) rename(point, *name);
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
  unsigned threads_;
  PointSet& points_;
  Skin& skin_;
  std::vector<std::uint8_t> is_named_;
  std::vector<Planes> planes_;
  std::vector<std::uint32_t> end_at_;  // of each point among all_at_
  std::vector<HyperplaneId> all_at_;

  void find_planes() {
    planes_.resize(points_.size());
    for (const Skin::Edge& edge : skin_.edges)
      for (const std::uint32_t point : {edge.from, edge.to})
        if (is_named_[point] == 0) planes_[point].add(skin_.faces[edge.face].outward.id());
  }

  void rename(std::size_t point, const std::array<HyperplaneId, 3>& name) {
    if (name != points_.vertices[point].hyperplanes)
      points_.vertices[point] = canonical_vertex(exact_.table(), name);
  }

  /// Three of the planes; nothing where none of those known are far from parallel. By several threads.
  [[nodiscard]] std::optional<std::array<HyperplaneId, 3>> name_of(std::size_t point) const {
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
    return largest > surely_independent ? name : std::nullopt;
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
    std::vector<std::uint32_t> number(points_.size(), none);
    std::vector<std::pair<double, std::uint32_t>> order;  // most differ in the first coordinate
    for (std::uint32_t point = 0; point < points_.size(); ++point)
      if (planes_[point].count > 0 || is_named_[point] != 0)
        order.emplace_back(points_.vertices[point].x[0], point);
    std::sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
      if (a.first != b.first) return a.first < b.first;
      const Vertex<3>&p = points_.vertices[a.second], &q = points_.vertices[b.second];
      return std::tie(p.x, p.hyperplanes) < std::tie(q.x, q.hyperplanes);
    });
    PointSet used;
    used.vertices.reserve(order.size());
    for (const auto& [x, point] : order) {
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

}  // namespace

void join_straight_edges(ExactPoints& exact, unsigned threads, const PointSet& points, std::size_t own_faces,
                         Skin& skin) {
  skin.edges = Straightener(exact, threads, points, own_faces, skin).run();
}

void rename_points(ExactPoints& exact, unsigned threads, PointSet& points, Skin& skin,
                   std::vector<std::uint8_t> is_named) {
  Renaming(exact, threads, points, skin, std::move(is_named)).run();
}

void divide_at(ExactPoints& exact, PointSet& points, std::size_t first, Skin& skin) {
  const auto map = unite_points(exact.table(), points, skin);
  std::vector<std::uint32_t> crossings(map.begin() + static_cast<std::ptrdiff_t>(first), map.end());
  // Not at the ends of others: what goes straight on there was one before, but for edges of faces that are
  // not there as a whole.
  EdgeSplitter(exact).split_at(crossings, points, skin.faces, skin.edges);
  add_up(skin.edges);
}

}  // namespace bsp2::geometry
