#include "surfaces/edges.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bsp2/geometry/support/vectors.hpp"

namespace bsp2::io {
namespace {

using Vector = std::array<double, 3>;

template <typename Real>
Vector minus(const Point3Of<Real>& a, const Point3Of<Real>& b) {
  return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]};
}

using geometry::cross;
using geometry::dot;

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
  const auto count = static_cast<HalfEdge>(3 * triangles.size());
  // Sorted by their lower ends first, which is counting, then by the higher ones, of which each has few.
  struct Use {
    std::uint32_t high;
    HalfEdge at;
    bool is_turned;
  };
  const auto ends_of = [&](HalfEdge h) {
    const HalfEdge next = next_of(h);
    return std::pair{triangles[h / 3][h % 3], triangles[next / 3][next % 3]};
  };
  std::vector<std::uint32_t> end_of_low(points.size() + 1);
  for (HalfEdge h = 0; h < count; ++h) {
    const auto [from, to] = ends_of(h);
    ++end_of_low[std::min(from, to) + 1];
  }
  for (std::size_t i = 1; i < end_of_low.size(); ++i) end_of_low[i] += end_of_low[i - 1];
  std::vector<Use> uses(count);
  for (HalfEdge h = 0; h < count; ++h) {
    const auto [from, to] = ends_of(h);
    uses[end_of_low[std::min(from, to)]++] = {std::max(from, to), h, from > to};
  }
  EdgePairs pairs;
  pairs.partner.assign(count, no_half_edge);
  std::vector<Spoke> spokes;
  std::size_t first = 0;
  for (std::uint32_t low = 0; low < points.size(); ++low) {
    const std::size_t end_of_all = end_of_low[low];
    std::sort(uses.begin() + static_cast<std::ptrdiff_t>(first),
              uses.begin() + static_cast<std::ptrdiff_t>(end_of_all),
              [](const Use& a, const Use& b) { return a.high != b.high ? a.high < b.high : a.at < b.at; });
    for (std::size_t end = first; first < end_of_all; first = end) {
      while (end < end_of_all && uses[end].high == uses[first].high) ++end;
      if (end - first == 2 && uses[first].is_turned != uses[first + 1].is_turned) {
        pairs.partner[uses[first].at] = uses[first + 1].at;
        pairs.partner[uses[first + 1].at] = uses[first].at;
      }
      if (end - first <= 2) continue;
      spokes.clear();
      for (std::size_t i = first; i < end; ++i) {
        spokes.push_back({uses[i].at, uses[i].is_turned});
        pairs.crowded.push_back(uses[i].at);
      }
      ++pairs.crowded_edges;
      sort_around(spokes, points, triangles, low, uses[first].high);
      pair_around(spokes, pairs.partner);
    }
  }
  return pairs;
}

template EdgePairs pair_edges(const std::vector<Point3Of<float>>&, std::span<const CornerIndices>);
template EdgePairs pair_edges(const std::vector<Point3Of<double>>&, std::span<const CornerIndices>);

}  // namespace bsp2::io
