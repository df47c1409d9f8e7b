#include "surfaces/edges.hpp"

#include <algorithm>
#include <cmath>

namespace bsp2::io {
namespace {

using Vector = std::array<double, 3>;

template <typename Real>
Vector minus(const Point3Of<Real>& a, const Point3Of<Real>& b) {
  return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]};
}

Vector cross(const Vector& u, const Vector& v) {
  return {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
}

double dot(const Vector& u, const Vector& v) { return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]; }

struct Spoke {
  HalfEdge at;
  bool is_turned;      ///< runs from the higher corner to the lower one
  double angle = 0.0;  ///< of its triangle about the edge
};

/// Spokes in the order in which one meets them around the edge from `low` to `high`.
template <typename Real>
void sort_around(std::vector<Spoke>& spokes, const std::vector<Point3Of<Real>>& points,
                 std::span<const CornerIndices> triangles, std::uint32_t low, std::uint32_t high) {
  const Vector axis = minus(points[high], points[low]);
  const double length = std::sqrt(dot(axis, axis));
  Vector first{}, second{};
  for (std::size_t i = 0; i < spokes.size(); ++i) {
    const HalfEdge third = next_of(next_of(spokes[i].at));
    const Vector along = minus(points[triangles[third / 3][third % 3]], points[low]);
    if (i == 0) {
      second = cross(axis, along);  // length times as long as the way from the axis
      first = cross(second, axis);
      for (double& x : first) x /= length;
    }
    spokes[i].angle = i == 0 ? 0 : std::atan2(dot(along, second), dot(along, first));
  }
  std::sort(spokes.begin(), spokes.end(), [](const Spoke& a, const Spoke& b) {
    return a.angle != b.angle ? a.angle < b.angle : a.is_turned != b.is_turned ? b.is_turned : a.at < b.at;
  });
}

/// Going around the edge, the solid begins at a turned spoke and ends at one that is not: as brackets that
/// open and close.
void pair_around(const std::vector<Spoke>& spokes, std::vector<HalfEdge>& partner) {
  std::vector<HalfEdge> open;
  for (int round = 0; round < 2; ++round)  // what is open at the end is closed at the beginning
    for (const Spoke& spoke : spokes) {
      if (partner[spoke.at] != no_half_edge) continue;
      if (spoke.is_turned) {
        if (round == 0) open.push_back(spoke.at);
      } else if (!open.empty()) {
        partner[spoke.at] = open.back();
        partner[open.back()] = spoke.at;
        open.pop_back();
      }
    }
}

}  // namespace

template <typename Real>
EdgePairs pair_edges(const std::vector<Point3Of<Real>>& points, std::span<const CornerIndices> triangles) {
  struct Named {
    std::uint64_t name;
    HalfEdge at;
    bool is_turned;
  };
  std::vector<Named> all;
  all.reserve(3 * triangles.size());
  for (HalfEdge h = 0; h < 3 * triangles.size(); ++h) {
    const HalfEdge next = next_of(h);
    const std::uint32_t from = triangles[h / 3][h % 3], to = triangles[next / 3][next % 3];
    const auto [low, high] = std::minmax(from, to);
    all.push_back({std::uint64_t{low} << 32 | high, h, from > to});
  }
  std::sort(all.begin(), all.end(),
            [](const Named& a, const Named& b) { return a.name != b.name ? a.name < b.name : a.at < b.at; });
  EdgePairs pairs;
  pairs.partner.assign(all.size(), no_half_edge);
  std::vector<Spoke> spokes;
  for (std::size_t first = 0, end = 0; first < all.size(); first = end) {
    while (end < all.size() && all[end].name == all[first].name) ++end;
    if (end - first == 2 && all[first].is_turned != all[first + 1].is_turned) {
      pairs.partner[all[first].at] = all[first + 1].at;
      pairs.partner[all[first + 1].at] = all[first].at;
    }
    if (end - first <= 2) continue;
    spokes.clear();
    for (std::size_t i = first; i < end; ++i) {
      spokes.push_back({all[i].at, all[i].is_turned});
      pairs.crowded.push_back(all[i].at);
    }
    ++pairs.crowded_edges;
    sort_around(spokes, points, triangles, static_cast<std::uint32_t>(all[first].name >> 32),
                static_cast<std::uint32_t>(all[first].name));
    pair_around(spokes, pairs.partner);
  }
  return pairs;
}

template EdgePairs pair_edges(const std::vector<Point3Of<float>>&, std::span<const CornerIndices>);
template EdgePairs pair_edges(const std::vector<Point3Of<double>>&, std::span<const CornerIndices>);

}  // namespace bsp2::io
