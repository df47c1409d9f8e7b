#include "filter.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace bsp2::geometry::filter {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The values at four points, into `value`. (A vector as the result would be a matter of the binary interface.)
[[gnu::always_inline]] inline void evaluate_four(const Points& points, std::size_t at, const Hyperplane<3>& h, Lanes& value) {
  Lanes x, y, z;
  std::memcpy(&x, points.x + at, sizeof x);
  std::memcpy(&y, points.y + at, sizeof y);
  std::memcpy(&z, points.z + at, sizeof z);
  value = h.offset + h.normal[0] * x + h.normal[1] * y + h.normal[2] * z;
}

[[gnu::always_inline]] inline Range range_of(const Lanes& low, const Lanes& high) {
  return {std::min(std::min(low[0], low[1]), std::min(low[2], low[3])), std::max(std::max(high[0], high[1]), std::max(high[2], high[3]))};
}

[[gnu::always_inline]] inline Range find_range_inline(const Points& points, const Hyperplane<3>& h, double bound, std::uint64_t& looked_at) {
  constexpr std::size_t at_once = 32;
  Lanes low = {infinity, infinity, infinity, infinity}, high = -low;
  Range range{};
  std::size_t at = 0;
  do {
    for (const std::size_t end = std::min(at + at_once, points.count); at < end; at += 4) {
      Lanes value;
      evaluate_four(points, at, h, value);
      low = value < low ? value : low;
      high = value > high ? value : high;
    }
    range = range_of(low, high);
  } while (at < points.count && !(range.least < -bound && range.largest > bound));
  looked_at += std::min(at, points.count);
  return range;
}

[[gnu::always_inline]] inline Sides sides_of(const Range& range, double bound) {
  return range.least < -bound && range.largest > bound ? both : range.largest < -bound ? all_negative : range.least > bound ? all_positive : doubtful;
}

/// The same for eight, into `sides`. Each comparison is a choice between constants: others the compiler makes one lane at a time.
[[gnu::always_inline]] inline void find_sides_of(const WideLanes& low, const WideLanes& high, const WideLanes& bound, Sides* sides) {
  const WideLanes zero{}, one = zero + 1, two = zero + 2, three = zero + 3;
  const WideLanes some = (low < -bound ? one : zero) + (high > bound ? two : zero);
  const WideLanes all = (high < -bound ? one : zero) + (low > bound ? two : zero);
  const WideLanes found = (some == three ? three : all) + 0x1p52;  // now the lowest bits are the number
  WideBits bits;
  std::memcpy(&bits, &found, sizeof bits);
  const auto bytes = __builtin_convertvector(bits, WideBytes);
  std::memcpy(sides, &bytes, sizeof bytes);
}

/// Eight hyperplanes, one a lane.
struct EightHyperplanes {
  WideLanes x{}, y{}, z{}, offset{}, error{};
  [[gnu::always_inline]] void evaluate(const Points& points, std::size_t at, WideLanes& value) const {
    value = offset + x * points.x[at] + y * points.y[at] + z * points.z[at];
  }
};

}  // namespace

BSP2_VECTOR_CLONES Range evaluate(const Points& points, const Hyperplane<3>& h, double* values) {
  Lanes low = {infinity, infinity, infinity, infinity}, high = -low;
  for (std::size_t at = 0; at < points.count; at += 4) {
    Lanes value;
    evaluate_four(points, at, h, value);
    std::memcpy(values + at, &value, sizeof value);
    low = value < low ? value : low;
    high = value > high ? value : high;
  }
  return range_of(low, high);
}

BSP2_VECTOR_CLONES void mark(const double* values, std::size_t count, double bound, std::uint8_t* marks) {
  const WideLanes zero{}, one = zero + 1, two = zero + 2;
  for (std::size_t at = 0; at < count; at += wide) {
    WideLanes value;
    std::memcpy(&value, values + at, sizeof value);
    const WideLanes found = (value < -bound ? one : zero) + (value > bound ? two : zero) + 0x1p52;  // now the lowest bits are the number
    WideBits bits;
    std::memcpy(&bits, &found, sizeof bits);
    const auto bytes = __builtin_convertvector(bits, WideBytes);
    std::memcpy(marks + at, &bytes, sizeof bytes);
  }
}

BSP2_VECTOR_CLONES Range find_range(const Points& points, const Hyperplane<3>& h, double bound, std::uint64_t& looked_at) {
  return find_range_inline(points, h, bound, looked_at);
}

BSP2_VECTOR_CLONES std::size_t find_sides(const Points& points, double error, const Hyperplane<3>* hyperplanes, std::span<const OrientedHyperplane> planes,
                                          Sides* sides) {
  constexpr std::size_t least_worth = 5, at_once = 256;
  std::uint64_t looked_at = 0;
  std::size_t i = 0;
  for (; i + least_worth <= planes.size(); i += wide) {
    EightHyperplanes eight;
    for (std::size_t lane = 0; lane < wide; ++lane) {
      if (i + wide + lane < planes.size()) __builtin_prefetch(hyperplanes + planes[i + wide + lane].id());
      const Hyperplane<3>& h = hyperplanes[planes[std::min(i + lane, planes.size() - 1)].id()];
      eight.x[lane] = h.normal[0];
      eight.y[lane] = h.normal[1];
      eight.z[lane] = h.normal[2];
      eight.offset[lane] = h.offset;
      eight.error[lane] = h.error;
    }
    const WideLanes bound = eight.error + error;
    WideLanes low, high, value;
    eight.evaluate(points, 0, low);
    high = low;
    std::size_t v = 1;
    bool all_cross = false;
    while (v < points.count && !all_cross) {
      for (const std::size_t end = std::min(points.count, v + at_once); v < end; ++v) {
        eight.evaluate(points, v, value);
        low = value < low ? value : low;
        high = value > high ? value : high;
      }
      if (v == points.count) break;
      all_cross = true;
      for (std::size_t lane = 0; lane < wide; ++lane) all_cross = all_cross && low[lane] < -bound[lane] && high[lane] > bound[lane];
    }
    find_sides_of(low, high, bound, sides + i);
    looked_at += std::min(wide, planes.size() - i) * v;
  }
  for (; i < planes.size(); ++i) {
    const Hyperplane<3>& h = hyperplanes[planes[i].id()];
    sides[i] = sides_of(find_range_inline(points, h, h.error + error, looked_at), h.error + error);
  }
  return looked_at;
}

}  // namespace bsp2::geometry::filter
