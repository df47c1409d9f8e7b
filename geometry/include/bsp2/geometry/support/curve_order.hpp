#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

namespace bsp2::geometry {

namespace curve {

constexpr unsigned bits = 10;  // an axis

/// Two zeros between each two of the lowest bits.
constexpr std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ff;
  x = (x | x << 8) & 0x0300f00f;
  x = (x | x << 4) & 0x030c30c3;
  return (x | x << 2) & 0x09249249;
}

/// Sorted by their places, digit by digit.
inline std::vector<std::uint32_t> order_of(const std::vector<std::uint32_t>& places) {
  std::vector<std::uint32_t> order(places.size()), sorted(places.size());
  std::iota(order.begin(), order.end(), 0U);
  for (unsigned shift = 0; shift < 3 * bits; shift += bits) {
    const auto digit_of = [&](std::uint32_t i) { return places[i] >> shift & ((1U << bits) - 1); };
    std::array<std::uint32_t, (1U << bits) + 1> begin{};
    for (const std::uint32_t i : order) ++begin[digit_of(i) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const std::uint32_t i : order) sorted[begin[digit_of(i)]++] = i;
    order.swap(sorted);
  }
  return order;
}

}  // namespace curve

/// Numbers 0 ... count - 1 in the order in which a curve that fills space passes their points: what is near
/// to each other in it is near in space, mostly. Source: Morton, 1966.
/// @param point_of finite points of space, by number. Linear in the count.
template <typename PointOf>
std::vector<std::uint32_t> curve_order(std::size_t count, const PointOf& point_of) {
  std::array<double, 3> low, high;
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::array<double, 3> p = point_of(i);
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], p[k]);
      high[k] = std::max(high[k], p[k]);
    }
  }
  double extent = 0;  // of halves: that of all may be more than a double holds
  for (std::size_t k = 0; k < 3; ++k) extent = std::max(extent, high[k] / 2 - low[k] / 2);
  constexpr double most = (1U << curve::bits) - 1;
  std::vector<std::uint32_t> places(count);
  for (std::uint32_t i = 0; i < count && extent > 0; ++i) {
    const std::array<double, 3> p = point_of(i);
    for (std::size_t k = 0; k < 3; ++k)
      places[i] |= curve::spread(static_cast<std::uint32_t>((p[k] / 2 - low[k] / 2) / extent * most)) << k;
  }
  return curve::order_of(places);
}

}  // namespace bsp2::geometry
