#include "builder/convex_hull.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "bsp2/geometry/exact/exact.hpp"
#include "bsp2/geometry/support/vectors.hpp"
#include "mesh/predicates.hpp"

// Quickhull: Barber, Dobkin, Huhdanpaa, "The quickhull algorithm for convex hulls" (1996). The farthest point
// outside a facet is added next; the facets it sees are replaced by a fan around it. Which facets it sees is
// decided exactly, and those whose plane it lies on count as seen: so coplanar points never leave a facet
// without area.

namespace bsp2::model {
namespace {

using geometry::cross;
using geometry::dot;

constexpr double tolerance = 0x1p-46;

using Plane = std::vector<std::array<double, 2>>;

/// Corners between a and b on the right of the line a b, in this order, without those that lie on it within
/// `distance`.
void add_chain(const Plane& points, const std::vector<std::uint32_t>& candidates, std::uint32_t a,
               std::uint32_t b, double distance, std::vector<std::uint32_t>& chain) {
  struct Span {
    std::uint32_t a, b;
    std::vector<std::uint32_t> candidates;
  };
  std::vector<Span> stack;
  stack.push_back({a, b, candidates});
  while (!stack.empty()) {
    const Span span = std::move(stack.back());
    stack.pop_back();
    const auto &p = points[span.a], &q = points[span.b];
    const double dx = q[0] - p[0], dy = q[1] - p[1], length = std::hypot(dx, dy);
    double farthest = distance * length;
    std::uint32_t top = span.a;
    Span first{span.a, 0, {}}, second{0, span.b, {}};
    for (const std::uint32_t i : span.candidates) {
      const double out = (points[i][0] - p[0]) * dy - (points[i][1] - p[1]) * dx;
      if (out > farthest) farthest = out, top = i;
    }
    if (top == span.a) {
      chain.push_back(span.b);
      continue;
    }
    first.b = second.a = top;
    for (const std::uint32_t i : span.candidates) {
      const auto beyond = [&](std::uint32_t u, std::uint32_t v) {
        const auto &s = points[u], &t = points[v];
        return (points[i][0] - s[0]) * (t[1] - s[1]) - (points[i][1] - s[1]) * (t[0] - s[0]) > 0;
      };
      if (i == top) continue;
      if (beyond(span.a, top))
        first.candidates.push_back(i);
      else if (beyond(top, span.b))
        second.candidates.push_back(i);
    }
    stack.push_back(std::move(second));
    stack.push_back(std::move(first));
  }
}

/// Removes corners that make no exact turn to the left.
Plane exactly_convex(Plane corners) {
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  if (corners.size() < 3) return {};
  Plane hull;
  const auto extend = [&](const std::array<double, 2>& p, std::size_t keep) {
    const auto turns_left = [&](const auto& a, const auto& b) {
      return orientation({a[0], a[1]}, {b[0], b[1]}, {p[0], p[1]}) > 0;
    };
    while (hull.size() > keep && !turns_left(hull[hull.size() - 2], hull.back())) hull.pop_back();
    hull.push_back(p);
  };
  for (const auto& p : corners) extend(p, 1);
  const std::size_t lower = hull.size();
  for (std::size_t i = corners.size() - 1; i-- > 0;) extend(corners[i], lower);
  hull.pop_back();
  return hull;
}

double farthest_coordinate(const auto& points) {
  double largest = 0;
  for (const auto& point : points)
    for (const double x : point) largest = std::max(largest, std::fabs(x));
  return largest;
}

/// The hull of points on a grid of 2^53 steps.
class Quickhull {
 public:
  using GridPoint = std::array<std::int64_t, 3>;
  using Corners = std::array<std::uint32_t, 3>;

  explicit Quickhull(std::vector<GridPoint> points) : points_(std::move(points)) {}

  /// The facets, counter-clockwise seen from outside; none where the points are flat.
  std::vector<Corners> run() {
    if (!start()) return {};
    while (!pending_.empty()) {
      const std::uint32_t facet = pending_.back();
      if (!facets_[facet].alive || facets_[facet].outside.empty()) {
        pending_.pop_back();
        continue;
      }
      add_farthest(facet);
    }
    std::vector<Corners> result;
    for (const Facet& facet : facets_)
      if (facet.alive) result.push_back(facet.corners);
    return result;
  }

 private:
  using Real = long double;
  struct Facet {
    Corners corners;
    Corners neighbours{};  // across the edge from corner k to corner k + 1
    std::array<Real, 3> normal{};
    bool alive = true;
    std::uint32_t seen_by = none;
    std::vector<std::uint32_t> outside;
  };
  static constexpr std::uint32_t none = ~std::uint32_t{0};
  static constexpr Real grid_tolerance = 0x1p53L * tolerance;

  std::vector<GridPoint> points_;
  std::vector<Facet> facets_;
  std::vector<std::uint32_t> pending_;

  std::array<Real, 3> difference(std::uint32_t a, std::uint32_t b) const {
    std::array<Real, 3> d;
    for (int i = 0; i < 3; ++i) d[i] = static_cast<Real>(points_[a][i] - points_[b][i]);
    return d;
  }

  Real distance(const Facet& facet, std::uint32_t point) const {
    return dot(facet.normal, difference(point, facet.corners[0]));
  }

  /// Sign of the volume of a b c d: > 0 if d is on the side from which a b c turn counter-clockwise. Exact.
  int side(const Corners& facet, std::uint32_t point) const {
    const auto u = difference(facet[1], facet[0]), v = difference(facet[2], facet[0]),
               w = difference(point, facet[0]);
    Real value = 0, magnitude = 0;
    for (int i = 0; i < 3; ++i) {
      const Real a = u[(i + 1) % 3] * v[(i + 2) % 3], b = u[(i + 2) % 3] * v[(i + 1) % 3];
      value += w[i] * (a - b);
      magnitude += std::fabs(w[i]) * (std::fabs(a) + std::fabs(b));
    }
    if (std::fabs(value) > magnitude * 0x1p-60L) return value > 0 ? 1 : -1;
    using Integer = geometry::LocalInteger;
    const auto exact = [&](std::uint32_t p, int i) { return Integer(points_[p][i] - points_[facet[0]][i]); };
    Integer sum = 0;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      sum += exact(point, i) *
             (exact(facet[1], j) * exact(facet[2], k) - exact(facet[1], k) * exact(facet[2], j));
    }
    return sum.sign();
  }

  std::uint32_t add_facet(const Corners& corners) {
    Facet facet;
    facet.corners = corners;
    facet.normal = cross(difference(corners[1], corners[0]), difference(corners[2], corners[0]));
    const Real length = std::sqrt(dot(facet.normal, facet.normal));
    if (length > 0)
      for (Real& x : facet.normal) x /= length;
    facets_.push_back(std::move(facet));
    return static_cast<std::uint32_t>(facets_.size() - 1);
  }

  void assign(std::span<const std::uint32_t> points, std::uint32_t first_facet) {
    for (const std::uint32_t point : points)
      for (std::uint32_t f = first_facet; f < facets_.size(); ++f)
        if (distance(facets_[f], point) > grid_tolerance) {
          facets_[f].outside.push_back(point);
          break;
        }
    for (std::uint32_t f = first_facet; f < facets_.size(); ++f)
      if (!facets_[f].outside.empty()) pending_.push_back(f);
  }

  /// A tetrahedron of points far from each other. @return false if all points lie in a plane.
  bool start() {
    if (points_.size() < 4) return false;
    const auto count = static_cast<std::uint32_t>(points_.size());
    const auto farthest = [&](auto measure) {
      std::uint32_t best = 0;
      Real most = -1;
      for (std::uint32_t i = 0; i < count; ++i)
        if (const Real m = measure(i); m > most) most = m, best = i;
      return std::pair{best, most};
    };
    const std::uint32_t a =
        farthest([&](std::uint32_t i) { return static_cast<Real>(points_[i][0]) + 0x1p60L; }).first;
    const std::uint32_t b =
        farthest([&](std::uint32_t i) { return dot(difference(i, a), difference(i, a)); }).first;
    const auto axis = difference(b, a);
    const Real length = std::sqrt(dot(axis, axis));
    const auto [c, width] = farthest([&](std::uint32_t i) {
      const auto n = cross(difference(i, a), axis);
      return std::sqrt(dot(n, n));
    });
    if (length == 0 || width <= grid_tolerance * length) return false;
    auto normal = cross(axis, difference(c, a));
    const Real size = std::sqrt(dot(normal, normal));
    const auto [d, height] =
        farthest([&](std::uint32_t i) { return std::fabs(dot(difference(i, a), normal)); });
    if (height <= grid_tolerance * size) return false;
    const int above = side({a, b, c}, d);
    if (above == 0) return false;
    const Corners base = above < 0 ? Corners{a, b, c} : Corners{a, c, b};
    add_facet(base);
    for (int k = 0; k < 3; ++k) add_facet({base[(k + 1) % 3], base[k], d});
    for (std::uint32_t k = 0; k < 3; ++k) {
      facets_[0].neighbours[k] = k + 1;
      facets_[k + 1].neighbours = {0, 1 + (k + 2) % 3, 1 + (k + 1) % 3};
    }
    std::vector<std::uint32_t> all(count);
    for (std::uint32_t i = 0; i < count; ++i) all[i] = i;
    assign(all, 0);
    return true;
  }

  struct HorizonEdge {
    std::uint32_t from, to, beyond;  // the facet on the other side
  };

  void add_farthest(std::uint32_t start) {
    auto& candidates = facets_[start].outside;
    const auto top = std::max_element(candidates.begin(), candidates.end(), [&](auto a, auto b) {
      return distance(facets_[start], a) < distance(facets_[start], b);
    });
    const std::uint32_t point = *top;
    std::swap(*top, candidates.back());
    candidates.pop_back();
    if (side(facets_[start].corners, point) <= 0) return;  // a facet so thin that its distances mean nothing

    std::vector<std::uint32_t> seen{start}, left;
    std::vector<HorizonEdge> horizon;
    facets_[start].seen_by = point;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      Facet& facet = facets_[seen[i]];
      for (int k = 0; k < 3; ++k) {
        Facet& next = facets_[facet.neighbours[k]];
        if (next.seen_by == point) continue;
        if (side(next.corners, point) >= 0) {
          next.seen_by = point;
          seen.push_back(facet.neighbours[k]);
        }
      }
    }
    for (const std::uint32_t f : seen) {
      Facet& facet = facets_[f];
      for (int k = 0; k < 3; ++k)
        if (facets_[facet.neighbours[k]].seen_by != point)
          horizon.push_back({facet.corners[k], facet.corners[(k + 1) % 3], facet.neighbours[k]});
      facet.alive = false;
      left.insert(left.end(), facet.outside.begin(), facet.outside.end());
      facet.outside = {};
    }
    close(horizon, point);
    assign(left, static_cast<std::uint32_t>(facets_.size() - horizon.size()));
  }

  /// The fan of new facets between the horizon and a point.
  void close(std::vector<HorizonEdge>& horizon, std::uint32_t point) {
    // The horizon is one cycle: order it, each edge beginning where the one before ends.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_start;
    for (std::uint32_t i = 0; i < horizon.size(); ++i) by_start.emplace_back(horizon[i].from, i);
    std::sort(by_start.begin(), by_start.end());
    const auto after = [&](std::uint32_t corner) {
      return std::lower_bound(by_start.begin(), by_start.end(), std::pair{corner, 0u})->second;
    };
    const auto first = static_cast<std::uint32_t>(facets_.size());
    for (const HorizonEdge& edge : horizon) add_facet({edge.from, edge.to, point});
    for (std::uint32_t i = 0; i < horizon.size(); ++i) {
      const HorizonEdge& edge = horizon[i];
      const std::uint32_t next = after(edge.to);
      facets_[first + i].neighbours[0] = edge.beyond;
      facets_[first + i].neighbours[1] = first + next;
      facets_[first + next].neighbours[2] = first + i;
      Facet& beyond = facets_[edge.beyond];
      for (int k = 0; k < 3; ++k)
        if (beyond.corners[k] == edge.to && beyond.corners[(k + 1) % 3] == edge.from)
          beyond.neighbours[k] = first + i;
    }
  }
};

}  // namespace

std::vector<std::array<double, 2>> hull_corners(const Plane& points) {
  if (points.size() < 3) return {};
  const double distance = tolerance * farthest_coordinate(points);
  std::vector<std::uint32_t> all(points.size()), chain;
  for (std::uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  const auto less = [&](auto a, auto b) { return points[a] < points[b]; };
  const std::uint32_t low = *std::min_element(all.begin(), all.end(), less),
                      high = *std::max_element(all.begin(), all.end(), less);
  add_chain(points, all, low, high, distance, chain);
  add_chain(points, all, high, low, distance, chain);
  Plane corners;
  for (const std::uint32_t i : chain) corners.push_back(points[i]);
  return exactly_convex(std::move(corners));
}

std::optional<TriangleMesh> hull_mesh(const std::vector<std::array<double, 3>>& points) {
  int exponent = 0;
  std::frexp(farthest_coordinate(points), &exponent);
  std::vector<std::pair<Quickhull::GridPoint, std::uint32_t>> on_grid;
  for (std::uint32_t p = 0; p < points.size(); ++p) {
    Quickhull::GridPoint rounded;
    for (int i = 0; i < 3; ++i) rounded[i] = std::llround(std::ldexp(points[p][i], 53 - exponent));
    on_grid.emplace_back(rounded, p);
  }
  std::sort(on_grid.begin(), on_grid.end());
  on_grid.erase(std::unique(on_grid.begin(), on_grid.end(),
                            [](const auto& a, const auto& b) { return a.first == b.first; }),
                on_grid.end());
  std::vector<Quickhull::GridPoint> grid;
  for (const auto& [point, index] : on_grid) grid.push_back(point);
  const auto facets = Quickhull(grid).run();
  if (facets.size() < 4) return std::nullopt;
  TriangleMesh mesh;
  mesh.convex = true;
  std::vector<std::uint32_t> number(grid.size(), ~std::uint32_t{0});
  for (const auto& facet : facets) {
    auto& triangle = mesh.triangles.emplace_back();
    for (int k = 0; k < 3; ++k) {
      std::uint32_t& n = number[facet[k]];
      if (n == ~std::uint32_t{0}) {
        n = static_cast<std::uint32_t>(mesh.points.size());
        auto& point = mesh.points.emplace_back();
        for (int i = 0; i < 3; ++i)
          point[i] = std::ldexp(static_cast<double>(grid[facet[k]][i]), exponent - 53);
      }
      triangle[k] = n;
    }
  }
  return mesh;
}

}  // namespace bsp2::model
