#include "bsp2/geometry/surface/brep.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "bsp2/geometry/support/disjoint_sets.hpp"
#include "surface/no_index.hpp"
#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {
namespace {

using Point = std::array<double, 3>;
using Triangle = std::array<std::uint32_t, 3>;

/// The connected faces of a skin, with their loops.
///
/// What of a plane's skin is connected, its triangles tell: they have their sides in common, or on an edge.
class FaceMaker {
 public:
  FaceMaker(ExactPoints& exact, const TriangulatedSkin& skin, Brep& brep)
      : exact_(exact),
        skin_(skin),
        brep_(brep),
        surface_of_(skin.points.size(), none),
        position_(skin.points.size(), none) {
    for (std::uint32_t i = 0; i < skin.point_of_surface.size(); ++i)
      surface_of_[skin.point_of_surface[i]] = i;
  }

  void run() {
    const auto& edges = skin_.edges;
    const auto& face_of = skin_.face_of_triangle;
    for (std::size_t edge = 0, edge_end = 0, triangle = 0, end = 0; edge < edges.size();
         edge = edge_end, triangle = end) {
      while (edge_end < edges.size() && edges[edge_end].face == edges[edge].face) ++edge_end;
      while (end < face_of.size() && face_of[end] == edges[edge].face) ++end;
      add_faces({edges.data() + edge, edge_end - edge}, triangle, end);
    }
  }

  /// The third corner of the triangle beside a use: a point of the face that is not on its edge.
  [[nodiscard]] const std::vector<std::uint32_t>& apexes() const { return apex_; }
  /// The hyperplane of each face.
  [[nodiscard]] const std::vector<OrientedHyperplane>& planes() const { return planes_; }
  /// The ends of each use, in the order of the loop.
  [[nodiscard]] const std::vector<std::array<std::uint32_t, 2>>& ends() const { return ends_; }

 private:
  /// A side of a triangle, or an edge.
  struct Side {
    std::uint32_t low, high;
    bool forward, is_edge;
    std::uint32_t number;  // of the triangle, or of the edge
    std::uint32_t apex;
    friend bool operator<(const Side& a, const Side& b) {
      return std::tie(a.low, a.high, a.forward, a.is_edge, a.number) <
             std::tie(b.low, b.high, b.forward, b.is_edge, b.number);
    }
  };
  struct Bound {  // an edge of the plane at hand, in the points of the surface
    std::uint32_t component, from, to, apex;
    bool is_used;
  };

  ExactPoints& exact_;
  const TriangulatedSkin& skin_;
  Brep& brep_;
  std::vector<std::uint32_t> surface_of_;
  std::vector<std::uint32_t> apex_;
  std::vector<OrientedHyperplane> planes_;
  std::vector<std::array<std::uint32_t, 2>> ends_;
  // Of the plane at hand.
  std::vector<Side> sides_;
  std::vector<Bound> bounds_;
  std::vector<std::uint32_t> position_;  // of a vertex on the way so far
  std::vector<std::uint32_t> path_;
  std::vector<std::vector<std::uint32_t>> cycles_;

  void add_faces(std::span<const Skin::Edge> edges, std::size_t first, std::size_t end) {
    DisjointSets classes(end - first);
    collect(edges, first, end);
    connect(edges, classes);
    std::stable_sort(bounds_.begin(), bounds_.end(), [](const Bound& a, const Bound& b) {
      return std::tie(a.component, a.from, a.to) < std::tie(b.component, b.from, b.to);
    });
    const Skin::Face& face = skin_.faces[edges.front().face];
    std::vector<std::uint32_t> number(end - first, none);
    for (std::size_t begin = 0, stop = 0; begin < bounds_.size(); begin = stop) {
      while (stop < bounds_.size() && bounds_[stop].component == bounds_[begin].component) ++stop;
      number[bounds_[begin].component] = static_cast<std::uint32_t>(brep_.faces.size());
      add_face(face, {bounds_.data() + begin, stop - begin});
    }
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_face;  // face, triangle
    for (std::size_t i = first; i < end; ++i)
      by_face.emplace_back(number[classes.find(static_cast<std::uint32_t>(i - first))],
                           static_cast<std::uint32_t>(i));
    std::sort(by_face.begin(), by_face.end());
    for (const auto& [of, triangle] : by_face) {
      brep_.triangles.push_back(skin_.surface.triangles[triangle]);
      brep_.face_of_triangle.push_back(of);
    }
  }

  void collect(std::span<const Skin::Edge> edges, std::size_t first, std::size_t end) {
    sides_.clear();
    const auto add = [&](std::uint32_t from, std::uint32_t to, bool is_edge, std::size_t number,
                         std::uint32_t apex) {
      sides_.push_back({std::min(from, to), std::max(from, to), from < to, is_edge,
                        static_cast<std::uint32_t>(number), apex});
    };
    for (std::size_t i = first; i < end; ++i) {
      const Triangle& t = skin_.surface.triangles[i];
      for (std::size_t k = 0; k < 3; ++k) add(t[k], t[(k + 1) % 3], false, i - first, t[(k + 2) % 3]);
    }
    for (std::size_t i = 0; i < edges.size(); ++i)
      add(surface_of_[edges[i].from], surface_of_[edges[i].to], true, i, none);
    std::sort(sides_.begin(), sides_.end());
  }

  /// Unites triangles that have a side in common, and finds out beside which one each edge is.
  void connect(std::span<const Skin::Edge> edges, DisjointSets& classes) {
    std::vector<std::uint32_t> beside(edges.size(), none);
    bounds_.clear();
    for (const Skin::Edge& edge : edges)
      bounds_.push_back({0, surface_of_[edge.from], surface_of_[edge.to], none, false});
    for (std::size_t begin = 0, end = 0; begin < sides_.size(); begin = end) {
      while (end < sides_.size() && sides_[end].low == sides_[begin].low &&
             sides_[end].high == sides_[begin].high)
        ++end;
      std::uint32_t inner = none;  // a triangle with this side inside of the skin
      for (std::size_t i = begin; i < end; ++i) {
        const Side& side = sides_[i];
        if (side.is_edge) continue;
        const bool is_bound = i + 1 < end && sides_[i + 1].is_edge && sides_[i + 1].forward == side.forward;
        if (is_bound) {
          beside[sides_[i + 1].number] = side.number;
          bounds_[sides_[i + 1].number].apex = side.apex;
        } else if (inner == none) {
          inner = side.number;
        } else {
          classes.unite(inner, side.number);
        }
      }
    }
    for (std::size_t i = 0; i < edges.size(); ++i) {
      if (beside[i] == none) throw std::logic_error("an edge of the boundary has no triangle");
      bounds_[i].component = classes.find(beside[i]);
    }
  }

  void add_face(const Skin::Face& of, std::span<Bound> bounds) {
    find_cycles(bounds);
    if (cycles_.size() > 1) {
      const auto outer = std::find_if(cycles_.begin(), cycles_.end(),
                                      [&](const auto& cycle) { return is_outer(of.outward, bounds, cycle); });
      if (outer == cycles_.end()) throw std::logic_error("a face of the boundary has no outline");
      std::rotate(cycles_.begin(), outer, outer + 1);
    }
    auto plane = exact_.table().rounded(of.outward.id());
    if (of.outward.flipped()) plane = plane.opposite();
    brep_.faces.push_back({plane.normal, plane.offset, of.owner, of.other,
                           static_cast<std::uint32_t>(brep_.loops.size()),
                           static_cast<std::uint32_t>(cycles_.size())});
    planes_.push_back(of.outward);
    for (const auto& cycle : cycles_) {
      brep_.loops.push_back(
          {static_cast<std::uint32_t>(brep_.uses.size()), static_cast<std::uint32_t>(cycle.size())});
      for (const std::uint32_t i : cycle) {
        brep_.uses.push_back(
            {none, static_cast<std::uint32_t>(brep_.faces.size() - 1), bounds[i].from < bounds[i].to, 0});
        ends_.push_back({bounds[i].from, bounds[i].to});
        apex_.push_back(bounds[i].apex);
      }
    }
  }

  /// The edges of a face as cycles that go through each vertex once. As the face is connected, its cycles
  /// have at most one vertex in common two by two, and are found whichever edge is taken there.
  void find_cycles(std::span<Bound> bounds) {
    cycles_.clear();
    for (std::uint32_t start = 0; start < bounds.size(); ++start) {
      if (bounds[start].is_used) continue;
      std::uint32_t next = start;
      do {
        bounds[next].is_used = true;
        position_[bounds[next].from] = static_cast<std::uint32_t>(path_.size());
        path_.push_back(next);
        const std::uint32_t vertex = bounds[next].to;
        if (position_[vertex] != none) close(bounds, position_[vertex]);
        next = path_.empty() ? none : unused_from(bounds, vertex);
      } while (next != none);
    }
    for (auto& cycle : cycles_)
      std::rotate(
          cycle.begin(),
          std::min_element(cycle.begin(), cycle.end(),
                           [&](std::uint32_t a, std::uint32_t b) { return bounds[a].from < bounds[b].from; }),
          cycle.end());
  }
  /// The way from this position on is a cycle.
  void close(std::span<const Bound> bounds, std::uint32_t position) {
    const auto begin = path_.begin() + position;
    cycles_.emplace_back(begin, path_.end());
    for (auto at = begin; at != path_.end(); ++at) position_[bounds[*at].from] = none;
    path_.erase(begin, path_.end());
  }
  static std::uint32_t unused_from(std::span<const Bound> bounds, std::uint32_t vertex) {
    auto at = std::lower_bound(bounds.begin(), bounds.end(), vertex,
                               [](const Bound& bound, std::uint32_t v) { return bound.from < v; });
    while (at != bounds.end() && at->from == vertex && at->is_used) ++at;
    if (at == bounds.end() || at->from != vertex)
      throw std::logic_error("the boundary of a face does not close");
    return static_cast<std::uint32_t>(at - bounds.begin());
  }

  /// Whether a cycle turns counter-clockwise: as it does at the vertex that is farthest to the left.
  bool is_outer(OrientedHyperplane outward, std::span<const Bound> bounds,
                const std::vector<std::uint32_t>& cycle) {
    const PlaneFrame frame(exact_, outward);
    const auto at = [&](std::size_t i) -> const Vertex<3>& {
      return skin_.points.vertices[skin_.point_of_surface[bounds[cycle[i % cycle.size()]].from]];
    };
    std::size_t left = 0;
    for (std::size_t i = 1; i < cycle.size(); ++i)
      if (frame.is_left_of(at(i), at(left))) left = i;
    return frame.orientation(at(left + cycle.size() - 1), at(left), at(left + 1)) > 0;
  }
};

/// The edges of a complex, and the faces about each.
class EdgeMaker {
 public:
  EdgeMaker(ExactPoints& exact, const TriangulatedSkin& skin, const FaceMaker& faces, Brep& brep)
      : exact_(exact), skin_(skin), faces_(faces), brep_(brep) {}

  void run() {
    std::vector<std::uint32_t> order(brep_.uses.size());
    std::iota(order.begin(), order.end(), 0U);
    const auto key = [&](std::uint32_t use) {
      const auto [a, b] = faces_.ends()[use];
      return std::pair(std::min(a, b), std::max(a, b));
    };
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return std::pair(key(a), a) < std::pair(key(b), b); });
    for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
      while (end < order.size() && key(order[end]) == key(order[begin])) ++end;
      const std::span<std::uint32_t> uses(order.data() + begin, end - begin);
      if (uses.size() > 2) sort_about(uses);
      const bool is_one = are_about_one_edge(uses) || !make_pairs(uses);
      const std::size_t count = is_one ? uses.size() : 2;
      for (std::size_t at = begin; at < end; at += count) add_edge(key(order[at]), order, at, count);
    }
    brep_.uses_of_edges = std::move(order);
  }

 private:
  ExactPoints& exact_;
  const TriangulatedSkin& skin_;
  const FaceMaker& faces_;
  Brep& brep_;

  void add_edge(const std::pair<std::uint32_t, std::uint32_t>& ends, std::span<std::uint32_t> order,
                std::size_t first, std::size_t count) {
    const std::span uses = order.subspan(first, count);
    for (const std::uint32_t use : uses)
      brep_.uses[use].edge = static_cast<std::uint32_t>(brep_.edges.size());
    brep_.edges.push_back(
        {{ends.first, ends.second}, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(count)});
    find_angles(uses);
  }

  /// The part that is next to a face on its counter-clockwise side about an edge, or on the other one.
  [[nodiscard]] std::int32_t part_beside(std::uint32_t use, bool counter_clockwise) const {
    const Brep::Face& face = brep_.faces[brep_.uses[use].face];
    return brep_.uses[use].forward == counter_clockwise ? face.other : face.part;
  }
  /// Whether all faces that follow each other have the same part between them. If not, these are several
  /// edges whose ends have become the same by rounding.
  [[nodiscard]] bool are_about_one_edge(std::span<const std::uint32_t> uses) const {
    for (std::size_t i = 0; i < uses.size(); ++i)
      if (part_beside(uses[i], true) != part_beside(uses[(i + 1) % uses.size()], false)) return false;
    return true;
  }
  /// Puts the faces of several edges in pairs that have a part between them, like brackets. @return whether
  /// that can be done; if not, they stay as they are.
  [[nodiscard]] bool make_pairs(std::span<std::uint32_t> uses) const {
    std::map<std::int32_t, std::vector<std::uint32_t>> open;
    std::vector<std::uint32_t> pairs, closing;
    const auto close = [&](std::uint32_t use) {
      auto& opened = open[part_beside(use, false)];
      if (opened.empty()) return false;
      pairs.insert(pairs.end(), {opened.back(), use});
      opened.pop_back();
      return true;
    };
    for (const std::uint32_t use : uses) {
      const bool opens = part_beside(use, true) != Brep::outside,
                 closes = part_beside(use, false) != Brep::outside;
      if (opens == closes) return false;  // a face between two parts
      if (opens)
        open[part_beside(use, true)].push_back(use);
      else if (!close(use))
        closing.push_back(use);  // by one that follows, around the edge
    }
    if (!std::ranges::all_of(closing, close) || pairs.size() != uses.size()) return false;
    std::ranges::copy(pairs, uses.begin());
    return true;
  }

  [[nodiscard]] OrientedHyperplane plane(std::uint32_t use) const {
    return faces_.planes()[brep_.uses[use].face];
  }
  /// On which side of the plane of one face another one leaves their edge: 1 = counter-clockwise of it, seen
  /// from the edge's higher vertex, by less than half a turn; 0 = in its plane. Exact.
  int side(std::uint32_t of, std::uint32_t other) {
    const OrientedHyperplane outward = plane(of);
    if (outward.id() == plane(other).id()) return 0;
    const int side = exact_.side(skin_.points, skin_.point_of_surface[faces_.apexes()[other]], outward.id());
    return outward.flipped() == brep_.uses[of].forward ? -side : side;
  }
  /// The quarter of the turn from one face that another one leaves the edge in: 0 = with it, 1 = in the first
  /// half, 2 = opposite to it, 3 = in the second half.
  int quarter(std::uint32_t of, std::uint32_t other) {
    const int where = side(of, other);
    if (where != 0) return where > 0 ? 1 : 3;
    const bool is_opposite =
        (plane(of) == plane(other)) != (brep_.uses[of].forward == brep_.uses[other].forward);
    return is_opposite ? 2 : 0;
  }
  void sort_about(std::span<std::uint32_t> uses) {
    const std::uint32_t first = uses.front();
    std::stable_sort(uses.begin() + 1, uses.end(), [&](std::uint32_t a, std::uint32_t b) {
      const int of_a = quarter(first, a), of_b = quarter(first, b);
      return of_a != of_b ? of_a < of_b : side(a, b) > 0;
    });
  }

  /// From each face to the next one. How far it is to the nearer side, their normals tell; on which side that
  /// is, the predicate.
  void find_angles(std::span<const std::uint32_t> uses) {
    constexpr double half = std::numbers::pi;
    for (std::size_t i = 0; i < uses.size(); ++i) {
      const std::uint32_t next = uses[(i + 1) % uses.size()];
      Brep::Use& use = brep_.uses[uses[i]];
      const Point &a = brep_.faces[use.face].normal, &b = brep_.faces[brep_.uses[next].face].normal;
      const double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
                   sine = std::hypot(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                                     a[0] * b[1] - a[1] * b[0]);
      const double nearer = std::atan2(sine, use.forward == brep_.uses[next].forward ? cosine : -cosine);
      switch (uses.size() == 1 ? 0 : quarter(uses[i], next)) {
        case 0:
          use.angle = 2 * half;
          break;
        case 1:
          use.angle = nearer;
          break;
        case 2:
          use.angle = half;
          break;
        default:
          use.angle = 2 * half - nearer;
      }
    }
  }
};

/// The shells of a complex, and the solids that they bound.
class ShellMaker {
 public:
  explicit ShellMaker(Brep& brep) : brep_(brep), classes_(2 * brep.faces.size()) {}

  void run() {
    connect();
    make_shells();
    make_solids();
  }

 private:
  struct Found {
    Brep::Shell shell;
    std::vector<Brep::Side> sides;
    Point low{}, high{};
    bool is_sure = true;  ///< whether the volume is more than corners are rounded by
  };

  Brep& brep_;
  DisjointSets classes_;
  std::vector<Found> found_;
  std::vector<std::uint32_t> first_triangle_;  // of each face, and the end

  /// The number of a side of a face: behind it, or in front.
  static std::uint32_t number(std::uint32_t face, bool is_front) { return 2 * face + (is_front ? 1 : 0); }
  [[nodiscard]] std::int32_t part(std::uint32_t side) const {
    const Brep::Face& face = brep_.faces[side / 2];
    return side % 2 == 1 ? face.other : face.part;
  }

  /// Between two faces that follow each other about an edge, the one's side that is counter-clockwise and the
  /// other's that is clockwise look into the same space.
  void connect() {
    for (const Brep::Edge& edge : brep_.edges) {
      const std::span uses(brep_.uses_of_edges.data() + edge.first, edge.count);
      for (std::size_t i = 0; i < uses.size(); ++i) {
        const Brep::Use &one = brep_.uses[uses[i]], &next = brep_.uses[uses[(i + 1) % uses.size()]];
        const std::uint32_t a = number(one.face, one.forward), b = number(next.face, !next.forward);
        if (part(a) != part(b)) brep_.is_closed = false;
        if (part(a) != Brep::outside && part(a) == part(b)) classes_.unite(a, b);
      }
    }
  }

  void make_shells() {
    first_triangle_.assign(brep_.faces.size() + 1, 0);
    for (const std::uint32_t face : brep_.face_of_triangle) ++first_triangle_[face + 1];
    std::partial_sum(first_triangle_.begin(), first_triangle_.end(), first_triangle_.begin());
    std::vector<std::uint32_t> shell_of(2 * brep_.faces.size(), none);
    for (std::uint32_t side = 0; side < shell_of.size(); ++side) {
      if (part(side) == Brep::outside) continue;
      std::uint32_t& shell = shell_of[classes_.find(side)];
      if (shell == none) {
        shell = static_cast<std::uint32_t>(found_.size());
        found_.push_back({{part(side), none, 0, 0, false, 0}, {}});
      }
      found_[shell].sides.push_back({side / 2, side % 2 == 1});
    }
    for (Found& found : found_) measure(found);
    for (Found& found : found_)
      if (!found.is_sure) found.shell.is_cavity = is_in_solid(found);
  }

  template <typename See>
  void for_each_triangle(const Found& found, const See& see) const {
    for (const Brep::Side& side : found.sides)
      for (std::uint32_t i = first_triangle_[side.face]; i < first_triangle_[side.face + 1]; ++i)
        see(brep_.triangles[i], side.is_front);
  }

  void measure(Found& found) const {
    using Sum = long double;
    const Point& o = brep_.points[brep_.triangles[first_triangle_[found.sides.front().face]][0]];
    found.low = found.high = o;
    Sum sum = 0;
    double area = 0, largest = 0;
    for_each_triangle(found, [&](const Triangle& triangle, bool is_front) {
      std::array<std::array<Sum, 3>, 3> p;
      for (std::size_t corner = 0; corner < 3; ++corner)
        for (std::size_t k = 0; k < 3; ++k) {
          const double x = brep_.points[triangle[corner]][k];
          p[corner][k] = static_cast<Sum>(x) - o[k];
          found.low[k] = std::min(found.low[k], x);
          found.high[k] = std::max(found.high[k], x);
        }
      const Sum six = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                      p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                      p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
      sum += is_front ? -six : six;
      area += area_of(triangle);
    });
    for (std::size_t k = 0; k < 3; ++k)
      largest = std::max({largest, std::fabs(found.low[k]), std::fabs(found.high[k])});
    found.shell.volume = static_cast<double>(sum / 6);
    found.shell.is_cavity = found.shell.volume < 0;
    constexpr double rounded_by = 0x1p-45;  // of where a corner is: much more than it is
    found.is_sure = std::fabs(found.shell.volume) > area * largest * rounded_by;
  }
  [[nodiscard]] double area_of(const Triangle& triangle) const {
    const Point &a = brep_.points[triangle[0]], &b = brep_.points[triangle[1]],
                &c = brep_.points[triangle[2]];
    Point u, v;
    for (std::size_t k = 0; k < 3; ++k) {
      u[k] = b[k] - a[k];
      v[k] = c[k] - a[k];
    }
    return std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }

  /// Where a shell bounds next to nothing: whether all others of its part say that this is in the solid.
  [[nodiscard]] bool is_in_solid(const Found& thin) const {
    const Point inside = centre_of_largest_triangle(thin);
    double sum = 0;
    for (const Found& found : found_)
      if (found.is_sure && found.shell.part == thin.shell.part) sum += winding(found, inside);
    return sum > 0.5;
  }

  /// How often a shell winds around a point. Source: van Oosterom, Strackee, "The solid angle of a plane
  /// triangle" (1983).
  [[nodiscard]] double winding(const Found& found, const Point& x) const {
    double sum = 0;
    for_each_triangle(found, [&](const Triangle& triangle, bool is_front) {
      std::array<Point, 3> p;
      std::array<double, 3> r;
      for (std::size_t corner = 0; corner < 3; ++corner) {
        for (std::size_t k = 0; k < 3; ++k) p[corner][k] = brep_.points[triangle[corner]][k] - x[k];
        r[corner] = std::hypot(p[corner][0], p[corner][1], p[corner][2]);
      }
      const auto dot = [&](std::size_t a, std::size_t b) {
        return p[a][0] * p[b][0] + p[a][1] * p[b][1] + p[a][2] * p[b][2];
      };
      const double determinant = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                                 p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                                 p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
      const double angle = 2 * std::atan2(determinant, r[0] * r[1] * r[2] + dot(0, 1) * r[2] +
                                                           dot(1, 2) * r[0] + dot(2, 0) * r[1]);
      sum += is_front ? -angle : angle;
    });
    return sum / (4 * std::numbers::pi);
  }

  /// The outer shell around a cavity: of those that wind around it, the innermost one.
  /// @param outer shells of the same part.
  [[nodiscard]] std::optional<std::uint32_t> around(const Found& cavity,
                                                    const std::vector<std::uint32_t>& outer) const {
    const auto holds = [&](const Found& shell) {
      for (std::size_t k = 0; k < 3; ++k)
        if (shell.low[k] > cavity.low[k] || shell.high[k] < cavity.high[k]) return false;
      return shell.is_sure;
    };
    std::vector<std::uint32_t> candidates;
    for (const std::uint32_t shell : outer)
      if (holds(found_[shell])) candidates.push_back(shell);
    if (candidates.size() > 1) {
      const Point inside = centre_of_largest_triangle(cavity);
      std::erase_if(candidates, [&](std::uint32_t shell) { return winding(found_[shell], inside) < 0.5; });
    }
    const auto least = std::min_element(candidates.begin(), candidates.end(), [&](auto a, auto b) {
      return found_[a].shell.volume < found_[b].shell.volume;
    });
    return least == candidates.end() ? std::nullopt : std::optional(*least);
  }
  /// A point that is on no other shell.
  [[nodiscard]] Point centre_of_largest_triangle(const Found& found) const {
    Point centre{};
    double largest = -1;
    for_each_triangle(found, [&](const Triangle& triangle, bool) {
      const double area = area_of(triangle);
      if (area <= largest) return;
      largest = area;
      centre = {};
      for (const std::uint32_t corner : triangle)
        for (std::size_t k = 0; k < 3; ++k) centre[k] += brep_.points[corner][k] / 3;
    });
    return centre;
  }

  void make_solids() {
    std::vector<std::uint32_t> outer;
    std::map<std::int32_t, std::vector<std::uint32_t>> outer_of_part;
    for (std::uint32_t i = 0; i < found_.size(); ++i)
      if (!found_[i].shell.is_cavity) {
        outer.push_back(i);
        outer_of_part[found_[i].shell.part].push_back(i);
      }
    std::map<std::uint32_t, std::vector<std::uint32_t>> cavities;  // by outer shell
    for (std::uint32_t i = 0; i < found_.size(); ++i) {
      if (!found_[i].shell.is_cavity) continue;
      if (const auto shell = around(found_[i], outer_of_part[found_[i].shell.part]))
        cavities[*shell].push_back(i);
      else
        brep_.is_closed = false;
    }
    for (const std::uint32_t shell : outer) {
      Brep::Solid solid{found_[shell].shell.part, static_cast<std::uint32_t>(brep_.shells.size()), 1,
                        found_[shell].shell.volume};
      add(found_[shell]);
      for (const std::uint32_t cavity : cavities[shell]) {
        add(found_[cavity]);
        solid.volume += found_[cavity].shell.volume;
        ++solid.shells;
      }
      brep_.solids.push_back(solid);
    }
  }
  void add(Found& found) {
    found.shell.solid = static_cast<std::uint32_t>(brep_.solids.size());
    found.shell.first = static_cast<std::uint32_t>(brep_.faces_of_shells.size());
    found.shell.count = static_cast<std::uint32_t>(found.sides.size());
    brep_.shells.push_back(found.shell);
    brep_.faces_of_shells.insert(brep_.faces_of_shells.end(), found.sides.begin(), found.sides.end());
  }
};

bool has_interfaces(const Skin& skin) {
  return std::any_of(skin.faces.begin(), skin.faces.end(),
                     [](const Skin::Face& face) { return face.other != Skin::outside; });
}

Skin without_interfaces(Skin skin) {
  std::erase_if(skin.edges,
                [&](const Skin::Edge& edge) { return skin.faces[edge.face].other != Skin::outside; });
  return skin;
}

}  // namespace

Brep brep_of(const HyperplaneTable<3>& table, Skin skin, TriangleSurface* surface, const ToldShare& told,
             unsigned threads) {
  const bool is_divided = has_interfaces(skin);
  if (surface != nullptr && is_divided) *surface = triangulate(table, without_interfaces(skin), {}, threads);
  TriangulatedSkin triangles = triangulated(table, std::move(skin), told, threads);
  ExactPoints exact(table);
  Brep brep;
  brep.points = triangles.surface.points;
  brep.triangles.reserve(triangles.surface.triangles.size());
  brep.face_of_triangle.reserve(triangles.surface.triangles.size());
  FaceMaker faces(exact, triangles, brep);
  faces.run();
  EdgeMaker(exact, triangles, faces, brep).run();
  ShellMaker(brep).run();
  if (surface != nullptr && !is_divided) *surface = std::move(triangles.surface);
  return brep;
}

bool has_interfaces(const Brep& brep) {
  return std::any_of(brep.faces.begin(), brep.faces.end(),
                     [](const Brep::Face& face) { return face.other != Brep::outside; });
}

TriangleSurface surface_by_part(const Brep& brep) {
  TriangleSurface surface;
  surface.closes_parts = true;
  surface.points = brep.points;
  surface.triangles.reserve(brep.triangles.size());
  surface.owner.reserve(brep.triangles.size());
  for (std::size_t t = 0; t < brep.triangles.size(); ++t) {
    const auto& [a, b, c] = brep.triangles[t];
    const Brep::Face& face = brep.faces[brep.face_of_triangle[t]];
    surface.triangles.push_back({a, b, c});
    surface.owner.push_back(face.part);
    if (face.other == Brep::outside) continue;
    surface.triangles.push_back({a, c, b});
    surface.owner.push_back(face.other);
  }
  return surface;
}

}  // namespace bsp2::geometry
