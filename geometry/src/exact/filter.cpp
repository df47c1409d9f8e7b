#include "exact/filter.hpp"

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <limits>
#include <utility>

namespace bsp2::geometry::filter {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The values at four points, into `value`. (A vector as the result would be a matter of the binary
/// interface.)
[[gnu::always_inline]] inline void evaluate_four(const Points& points, std::size_t at, const Hyperplane<3>& h,
                                                 Lanes& value) {
  Lanes x, y, z;
  std::memcpy(&x, points.x + at, sizeof x);
  std::memcpy(&y, points.y + at, sizeof y);
  std::memcpy(&z, points.z + at, sizeof z);
  value = h.offset + h.normal[0] * x + h.normal[1] * y + h.normal[2] * z;
}

[[gnu::always_inline]] inline Range range_of(const Lanes& low, const Lanes& high) {
  return {std::min(std::min(low[0], low[1]), std::min(low[2], low[3])),
          std::max(std::max(high[0], high[1]), std::max(high[2], high[3]))};
}

[[gnu::always_inline]] inline Range find_range_inline(const Points& points, const Hyperplane<3>& h,
                                                      double bound, std::uint64_t& looked_at) {
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
  return range.least < -bound && range.largest > bound ? both
         : range.largest < -bound                      ? all_negative
         : range.least > bound                         ? all_positive
                                                       : doubtful;
}

/// Some hyperplanes, one a lane. `Numbers` and `Whole` are vectors of one length.
template <typename Numbers, typename Whole>
class SeveralHyperplanes {
 public:
  static constexpr std::size_t lanes = sizeof(Numbers) / sizeof(double);

  /// On which sides of each of the first planes the points are. @return the number of values looked at.
  [[gnu::always_inline]] static std::size_t find_sides(const Points& points, double error_of_points,
                                                       const Hyperplane<3>* hyperplanes,
                                                       std::span<const OrientedHyperplane> planes,
                                                       Sides* sides) {
    const std::size_t last = (planes.size() < lanes ? planes.size() : lanes) - 1;  // it fills up the lanes
    const auto at = [&](std::size_t lane) __attribute__((always_inline))->const Hyperplane<3>& {
      return hyperplanes[planes[lane < last ? lane : last].id()];
    };
    const SeveralHyperplanes several(at, std::make_index_sequence<lanes>());
    return (last + 1) * several.find_sides(points, several.error_ + error_of_points, sides);
  }

 private:
  Numbers x_, y_, z_, offset_, error_;

  template <typename At, std::size_t... Lane>
  [[gnu::always_inline]] SeveralHyperplanes(const At& at, std::index_sequence<Lane...>)
      : error_{at(Lane).error...} {
    std::array<Lanes, 4> first;
    read_four(at, 0, first);
    if constexpr (lanes == 4) {
      x_ = first[0], y_ = first[1], z_ = first[2], offset_ = first[3];
    } else {
      std::array<Lanes, 4> last;
      read_four(at, 4, last);
      join(first[0], last[0], x_);
      join(first[1], last[1], y_);
      join(first[2], last[2], z_);
      join(first[3], last[3], offset_);
    }
  }

  /// Each hyperplane in one piece: a number of each at a time is twice the instructions.
  template <typename At>
  [[gnu::always_inline]] static void read_four(const At& at, std::size_t first,
                                               std::array<Lanes, 4>& columns) {
    static_assert(offsetof(Hyperplane<3>, offset) == 3 * sizeof(double));
    for (std::size_t lane = 0; lane < 4; ++lane)
      std::memcpy(&columns[lane], &at(first + lane), sizeof(Lanes));
    transpose(columns);
  }

  [[gnu::always_inline]] static void join(const Lanes& low, const Lanes& high, Numbers& all) {
    all = __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
  }

  [[gnu::always_inline]] void evaluate(const Points& points, std::size_t at, Numbers& value) const {
    value = offset_ + x_ * points.x[at] + y_ * points.y[at] + z_ * points.z[at];
  }

  /// @return how many points were looked at: not all where each plane has some far beyond the bound on both
  /// sides.
  [[gnu::always_inline]] std::size_t find_sides(const Points& points, const Numbers& bound,
                                                Sides* sides) const {
    constexpr std::size_t at_once = 256;
    Numbers low, high, value;
    evaluate(points, 0, low);
    high = low;
    std::size_t v = 1;
    do {
      for (const std::size_t end = points.count < v + at_once ? points.count : v + at_once; v < end; ++v) {
        evaluate(points, v, value);
        low = value < low ? value : low;
        high = value > high ? value : high;
      }
      write(low, high, bound, sides);
    } while (v < points.count && !all_are_both(sides));
    return v;
  }

  static bool all_are_both(const Sides* sides) {
    bool all = true;
    for (std::size_t lane = 0; lane < lanes; ++lane) all = all && sides[lane] == both;
    return all;
  }

  /// Each comparison is a choice between constants: others the compiler makes one lane at a time.
  [[gnu::always_inline]] static void write(const Numbers& low, const Numbers& high, const Numbers& bound,
                                           Sides* sides) {
    const Numbers zero{}, one = zero + 1, two = zero + 2, three = zero + 3;
    const Numbers some = (low < -bound ? one : zero) + (high > bound ? two : zero);
    const Numbers all = (high < -bound ? one : zero) + (low > bound ? two : zero);
    const Numbers found = (some == three ? three : all) + 0x1p52;  // now the lowest bits are the number
    Whole bits;
    std::memcpy(&bits, &found, sizeof bits);
    bits &= std::uint64_t{both};
    std::memcpy(sides, &bits, sizeof bits);
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
    const WideLanes found = (value < -bound ? one : zero) + (value > bound ? two : zero) +
                            0x1p52;  // now the lowest bits are the number
    WideBits bits;
    std::memcpy(&bits, &found, sizeof bits);
    const auto bytes = __builtin_convertvector(bits, WideBytes);
    std::memcpy(marks + at, &bytes, sizeof bytes);
  }
}

BSP2_VECTOR_CLONES Range find_range(const Points& points, const Hyperplane<3>& h, double bound,
                                    std::uint64_t& looked_at) {
  return find_range_inline(points, h, bound, looked_at);
}

BSP2_VECTOR_CLONES std::size_t find_sides(const Points& points, double error,
                                          const Hyperplane<3>* hyperplanes,
                                          std::span<const OrientedHyperplane> planes, Sides* sides) {
  using Four = SeveralHyperplanes<Lanes, Bits>;
  using Eight = SeveralHyperplanes<WideLanes, WideBits>;
  std::uint64_t looked_at = 0;
  std::size_t i = 0;
  for (; i + Four::lanes < planes.size(); i += Eight::lanes)
    looked_at += Eight::find_sides(points, error, hyperplanes, planes.subspan(i), sides + i);
  for (; i + 1 < planes.size(); i += Four::lanes)
    looked_at += Four::find_sides(points, error, hyperplanes, planes.subspan(i), sides + i);
  if (i >= planes.size()) return looked_at;
  const Hyperplane<3>& h = hyperplanes[planes[i].id()];
  sides[i] = sides_of(find_range_inline(points, h, h.error + error, looked_at), h.error + error);
  return looked_at;
}

}  // namespace bsp2::geometry::filter
