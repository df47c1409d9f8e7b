#include "builder/polygon.hpp"

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/box_tree.hpp"
#include "mesh/mesh_triangulation.hpp"

namespace bsp2::model {
namespace {

using Plane = std::vector<std::array<double, 2>>;

Point2 at(const Plane& points, std::uint32_t i) { return {points[i][0], points[i][1]}; }

int turn(const Plane& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return orientation(at(points, a), at(points, b), at(points, c));
}

/// Whether the way a b c turns to the left or goes straight on, neither right nor back.
bool is_left_or_straight(const Plane& points, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const int side = turn(points, a, b, c);
  return side > 0 || (side == 0 && (points[a] < points[b]) == (points[b] < points[c]));
}

/// Whether the cycle goes around its points once, without a turn to the right: then its edges go up and down
/// in x once.
bool is_convex(const Plane& points, std::span<const std::uint32_t> cycle) {
  const std::size_t n = cycle.size();
  int changes = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const std::uint32_t a = cycle[i], b = cycle[(i + 1) % n], c = cycle[(i + 2) % n];
    if (turn(points, a, b, c) < 0) return false;
    changes += (points[a] < points[b]) != (points[b] < points[c]);
  }
  return changes == 2;
}

/// Whether two edges share a point. Exact.
bool touch(const Plane& points, const std::array<std::uint32_t, 2>& e,
           const std::array<std::uint32_t, 2>& f) {
  for (int k = 0; k < 2; ++k) {
    const auto [e_low, e_high] = std::minmax(points[e[0]][k], points[e[1]][k]);
    const auto [f_low, f_high] = std::minmax(points[f[0]][k], points[f[1]][k]);
    if (e_high < f_low || f_high < e_low) return false;
  }
  return turn(points, e[0], e[1], f[0]) * turn(points, e[0], e[1], f[1]) <= 0 &&
         turn(points, f[0], f[1], e[0]) * turn(points, f[0], f[1], e[1]) <= 0;
}

/// Whether no two edges share a point, but neighbours their corner. The cycle has no spikes.
bool is_simple(const Plane& points, std::span<const std::uint32_t> cycle) {
  const auto n = static_cast<std::uint32_t>(cycle.size());
  const auto edge = [&](std::uint32_t i) { return std::array{cycle[i], cycle[(i + 1) % n]}; };
  std::vector<geometry::Box3> boxes(n);
  for (std::uint32_t i = 0; i < n; ++i) {
    const auto &p = points[edge(i)[0]], &q = points[edge(i)[1]];
    boxes[i] = {{p[0], p[1], 0}, {p[0], p[1], 0}};
    boxes[i].unite({{q[0], q[1], 0}, {q[0], q[1], 0}});
  }
  const geometry::BoxTree tree(std::move(boxes));
  const auto touches_another = [&](std::uint32_t i) {
    return tree.visit_meeting(tree[i], [&](std::uint32_t j) {
      return j + 1 < i && (j + n != i + 1) && touch(points, edge(i), edge(j));
    });
  };
  for (std::uint32_t i = 0; i < n; ++i)
    if (touches_another(i)) return false;
  return true;
}

/// Joins triangles across common edges as long as the union is convex (Hertel and Mehlhorn 1983: at most four
/// times as many pieces as necessary).
class Joiner {
 public:
  Joiner(const Plane& points, std::span<const Triangle> triangles) : points_(points) {
    for (const Triangle& t : triangles) {
      const int side = turn(points, t[0], t[1], t[2]);
      if (side > 0)
        add(t);
      else if (side < 0)
        add({t[2], t[1], t[0]});
    }
  }

  void run(double scale, std::vector<ConvexPolygon>& pieces) {
    for (const auto& [a, b] : twins()) join(a, b);
    std::vector<bool> seen(edges_.size());
    for (std::uint32_t i = 0; i < edges_.size(); ++i) {
      if (seen[i] || edges_[i].gone) continue;
      ConvexPolygon piece{{}, scale};
      for (std::uint32_t e = i; !seen[e]; e = edges_[e].next) {
        seen[e] = true;
        piece.points.push_back(points_[edges_[e].from]);
      }
      pieces.push_back(std::move(piece));
    }
  }

 private:
  struct Edge {
    std::uint32_t from, next, previous, polygon;
    bool gone = false;
  };
  const Plane& points_;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> parent_;  // of polygons that were joined

  void add(const Triangle& t) {
    const auto first = static_cast<std::uint32_t>(edges_.size());
    const auto polygon = static_cast<std::uint32_t>(parent_.size());
    for (std::uint32_t k = 0; k < 3; ++k)
      edges_.push_back({t[k], first + (k + 1) % 3, first + (k + 2) % 3, polygon});
    parent_.push_back(polygon);
  }

  std::uint32_t to(std::uint32_t e) const { return edges_[edges_[e].next].from; }

  std::uint32_t polygon_of(std::uint32_t e) {
    std::uint32_t p = edges_[e].polygon;
    while (parent_[p] != p) p = parent_[p] = parent_[parent_[p]];
    return p;
  }

  /// Pairs of edges between the same corners in opposite directions, the longest first: what they part is
  /// thin.
  std::vector<std::array<std::uint32_t, 2>> twins() const {
    std::vector<std::uint32_t> order(edges_.size());
    for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto key = [&](std::uint32_t e) {
      const std::uint32_t a = edges_[e].from, b = to(e);
      return std::array{std::min(a, b), std::max(a, b)};
    };
    std::stable_sort(order.begin(), order.end(), [&](auto a, auto b) { return key(a) < key(b); });
    std::vector<std::array<std::uint32_t, 2>> pairs;
    std::vector<std::uint32_t> forward, backward;
    const auto flush = [&] {
      for (std::size_t i = 0; i < std::min(forward.size(), backward.size()); ++i)
        pairs.push_back({forward[i], backward[i]});
      forward.clear();
      backward.clear();
    };
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i > 0 && key(order[i]) != key(order[i - 1])) flush();
      (edges_[order[i]].from < to(order[i]) ? forward : backward).push_back(order[i]);
    }
    flush();
    const auto length = [&](const auto& pair) {
      const auto &p = points_[edges_[pair[0]].from], &q = points_[edges_[pair[1]].from];
      return std::hypot(q[0] - p[0], q[1] - p[1]);
    };
    std::stable_sort(pairs.begin(), pairs.end(),
                     [&](const auto& a, const auto& b) { return length(a) > length(b); });
    return pairs;
  }

  void join(std::uint32_t e, std::uint32_t f) {
    const std::uint32_t p = polygon_of(e), q = polygon_of(f);
    if (p == q) return;
    Edge &a = edges_[e], &b = edges_[f];
    // Straight corners of both may lie on each other where a path touches itself: a corner of 360 degrees,
    // that goes back.
    if (!is_left_or_straight(points_, edges_[a.previous].from, a.from, to(b.next))) return;
    if (!is_left_or_straight(points_, edges_[b.previous].from, b.from, to(a.next))) return;
    edges_[a.previous].next = b.next;
    edges_[b.next].previous = a.previous;
    edges_[b.previous].next = a.next;
    edges_[a.next].previous = b.previous;
    a.gone = b.gone = true;
    parent_[q] = p;
  }
};

}  // namespace

double scale_of(const Plane& points) {
  double largest = 0;
  for (const auto& point : points)
    for (const double x : point) largest = std::max(largest, std::fabs(x));
  int exponent = 0;
  std::frexp(largest, &exponent);
  return std::ldexp(1.0, exponent);
}

namespace {

/// Equal points get one index.
FaceCycles with_equal_points_merged(const Plane& points, const FaceCycles& paths) {
  std::vector<std::uint32_t> order(points.size()), first(points.size());
  for (std::uint32_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return points[a] != points[b] ? points[a] < points[b] : a < b; });
  for (std::size_t i = 0; i < order.size(); ++i)
    first[order[i]] = i > 0 && points[order[i]] == points[order[i - 1]] ? first[order[i - 1]] : order[i];
  FaceCycles merged = paths;
  for (std::uint32_t& corner : merged.corners) corner = first[corner];
  return merged;
}

}  // namespace

PolygonPieces convex_pieces(const std::vector<std::array<double, 2>>& points, const FaceCycles& paths) {
  const double scale = scale_of(points);
  std::vector<Point3> flat;
  flat.reserve(points.size());
  for (const auto& point : points) flat.push_back({point[0] + 0.0, point[1] + 0.0, 0});
  const FaceCycles cycles = without_degenerate(flat, with_equal_points_merged(points, paths));
  PolygonPieces result;
  Triangulator triangulator(flat);
  for (std::size_t i = 0; i < cycles.size(); ++i) {
    std::vector<std::uint32_t> cycle(cycles[i].begin(), cycles[i].end());
    std::vector<std::uint32_t> back(cycle.rbegin(), cycle.rend());
    if (is_convex(points, back)) cycle.swap(back);
    if (is_convex(points, cycle)) {
      ConvexPolygon piece{{}, scale};
      for (const std::uint32_t corner : cycle) piece.points.push_back(points[corner]);
      result.pieces.push_back(std::move(piece));
      continue;
    }
    result.disjoint = result.disjoint && is_simple(points, cycle);
    std::vector<Triangle> triangles;
    triangulator.triangulate(cycle, triangles);
    Joiner(points, triangles).run(scale, result.pieces);
  }
  if (cycles.size() > 1) result.disjoint = false;
  return result;
}

}  // namespace bsp2::model
