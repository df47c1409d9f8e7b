#include "bsp2/geometry/families/round_family.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::geometry {

// Numbers: the radial hyperplanes of each ordered pair of axes (i, a), t from -n to n at the finest level;
// then, level by level and wedge by wedge, the tangent and the chord.

template <int D>
std::uint64_t RoundFamily<D>::size_with(int axes, std::uint32_t levels) {
  std::uint64_t size = static_cast<std::uint64_t>(axes) * static_cast<std::uint64_t>(axes - 1) *
                       ((std::uint64_t{2} << levels) + 1);
  for (std::uint32_t level = 0; level <= levels; ++level) {
    const auto bits = level * static_cast<std::uint32_t>(axes - 1);
    if (bits > 50) return std::numeric_limits<std::uint64_t>::max();
    size += static_cast<std::uint64_t>(4 * axes) << bits;
  }
  return size;
}

template <int D>
RoundFamily<D>::RoundFamily(int axes, double bottom, double top, std::uint64_t limit)
    : axes_(axes), bottom_(bottom), top_(top) {
  // NOLINTNEXTLINE(misc-redundant-expression): it is so for D = 1 alone
  if (axes < 2 || axes > D) throw std::logic_error("a round solid has 2 to D round axes");
  if (is_tapered() && axes == D) throw std::logic_error("a cone has an axis");
  while (levels_ < most_levels && size_with(axes, levels_ + 1) <= limit) ++levels_;
  count_ = static_cast<std::uint32_t>(size_with(axes, levels_));
  radials_ = static_cast<std::uint32_t>(axes * (axes - 1)) * ((2U << levels_) + 1);
  first_of_level_[0] = radials_;
  for (std::uint32_t level = 0; level <= levels_; ++level)
    first_of_level_[level + 1] = first_of_level_[level] + (static_cast<std::uint32_t>(4 * axes)
                                                           << (level * static_cast<std::uint32_t>(axes - 1)));
}

template <int D>
std::uint32_t RoundFamily<D>::number_of(const Wedge& wedge) const {
  std::uint32_t place = wedge.face;
  for (int j = axes_ - 2; j >= 0; --j) place = (place << wedge.level) + wedge.at[static_cast<std::size_t>(j)];
  return first_of_level_[wedge.level] + 2 * place;
}

/// N x_i - t x_a, N = 2^levels; equal hyperplanes get one number.
template <int D>
typename RoundFamily<D>::Radial RoundFamily<D>::radial(int i, int a, std::int64_t t) const {
  const std::int64_t n = std::int64_t{1} << levels_;
  bool flipped = false;
  if (std::abs(t) == n && i > a) {  // x_i - x_a = -(x_a - x_i), x_i + x_a = x_a + x_i
    std::swap(i, a);
    flipped = t > 0;
  }
  if (t == 0) a = i == 0 ? 1 : 0;
  const int pair = i * (axes_ - 1) + (a < i ? a : a - 1);
  return {static_cast<std::uint32_t>(pair * (2 * n + 1) + t + n), flipped};
}

template <int D>
typename RoundFamily<D>::Radial RoundFamily<D>::halving(const Wedge& wedge, int place) const {
  const std::int64_t n = std::int64_t{1} << wedge.level;
  const std::int64_t t = (2 * std::int64_t{wedge.at[static_cast<std::size_t>(place)]} + 1 - n)
                         << (levels_ - wedge.level);
  return radial(axis_at(wedge, place), wedge.axis(), wedge.sign() * t);
}

template <int D>
typename RoundFamily<D>::Radial RoundFamily<D>::bound(const Wedge& wedge, int place, int side) const {
  const std::int64_t n = std::int64_t{1} << wedge.level;
  const std::int64_t t =
      (2 * (std::int64_t{wedge.at[static_cast<std::size_t>(place)]} + (side > 0 ? 1 : 0)) - n) *
      (std::int64_t{1} << (levels_ - wedge.level));
  return radial(axis_at(wedge, place), wedge.axis(), wedge.sign() * t);
}

template <int D>
std::array<double, D> RoundFamily<D>::direction(const Wedge& wedge) const {
  std::array<double, D> d{};
  const double n = std::ldexp(1.0, static_cast<int>(wedge.level));
  for (int j = 0; j + 1 < axes_; ++j)
    d[axis_at(wedge, j)] = 2 * static_cast<double>(wedge.at[static_cast<std::size_t>(j)]) + 1 - n;
  d[wedge.axis()] = wedge.sign() * n;
  return d;
}

/// The least multiple of 2^-40 above |d| that is found without big integers; |d| itself if that is an
/// integer.
template <int D>
std::int64_t RoundFamily<D>::tangent_offset(const std::array<std::int64_t, D>& d) const {
  std::int64_t square = 0;  // below 2^45
  for (const std::int64_t x : d) square += x * x;
  const double root = std::sqrt(static_cast<double>(square));
  const auto whole = static_cast<std::int64_t>(std::llround(root));
  if (whole * whole == square) return whole << fraction_bits;
  return static_cast<std::int64_t>(std::ceil(std::ldexp(root * (1 + 0x1p-50), fraction_bits)));
}

/// Below the least d.v / |v| over the corners v of the wedge. Sums are exact in doubles; three roundings
/// follow.
template <int D>
std::int64_t RoundFamily<D>::chord_offset(const Wedge& wedge, const std::array<std::int64_t, D>& d) const {
  const double n = std::ldexp(1.0, static_cast<int>(wedge.level));
  double least = std::numeric_limits<double>::infinity();
  for (unsigned corner = 0; corner < 1U << (axes_ - 1); ++corner) {
    double product = n * n, square = n * n;
    for (int j = 0; j + 1 < axes_; ++j) {
      const double v =
          2 * (static_cast<double>(wedge.at[static_cast<std::size_t>(j)]) + (corner >> j & 1U)) - n;
      product += v * static_cast<double>(d[axis_at(wedge, j)]);
      square += v * v;
    }
    least = std::min(least, product / std::sqrt(square));
  }
  return static_cast<std::int64_t>(std::floor(std::ldexp(least * (1 - 0x1p-49), fraction_bits)));
}

template <int D>
typename RoundFamily<D>::Small RoundFamily<D>::small(std::uint32_t number) const {
  Small plane;
  if (number < radials_) {
    const std::uint32_t per_pair = (2U << levels_) + 1;
    const int pair = static_cast<int>(number / per_pair), i = pair / (axes_ - 1), rest = pair % (axes_ - 1);
    plane.normal[i] = std::int64_t{1} << levels_;
    plane.normal[rest < i ? rest : rest + 1] =
        -(static_cast<std::int64_t>(number % per_pair) - (std::int64_t{1} << levels_));
    return plane;
  }
  Wedge wedge;
  while (number >= first_of_level_[wedge.level + 1]) ++wedge.level;
  std::uint32_t place = (number - first_of_level_[wedge.level]) / 2;
  const bool is_chord = (number - first_of_level_[wedge.level]) % 2 != 0;
  for (int j = 0; j + 1 < axes_; ++j) {
    wedge.at[static_cast<std::size_t>(j)] = place & ((1U << wedge.level) - 1);
    place >>= wedge.level;
  }
  wedge.face = place;
  const auto d = direction(wedge);
  for (int i = 0; i < D; ++i) plane.normal[i] = static_cast<std::int64_t>(d[i]);
  plane.offset = -(is_chord ? chord_offset(wedge, plane.normal) : tangent_offset(plane.normal));
  for (std::int64_t& x : plane.normal) x *= std::int64_t{1} << fraction_bits;
  return plane;
}

template <int D>
std::array<LocalInteger, D + 1> RoundFamily<D>::exact(std::uint32_t number) const {
  const Small plane = small(number);
  std::array<LocalInteger, D + 1> covector;
  if (!is_tapered() || plane.offset == 0) {
    for (int i = 0; i < D; ++i) covector[i] = plane.normal[i];
    covector[D] = plane.offset;
    return covector;
  }
  const LocalInteger low = static_cast<std::int64_t>(std::ldexp(bottom_, 53)),
                     high = static_cast<std::int64_t>(std::ldexp(top_, 53));
  for (int i = 0; i < D; ++i) covector[i] = LocalInteger(plane.normal[i]) << 53;
  covector[axes_] = LocalInteger(plane.offset) * (high - low);
  covector[D] = LocalInteger(plane.offset) * low;
  return covector;
}

template <int D>
std::array<long double, D + 1> RoundFamily<D>::rounded(std::uint32_t number) const {
  const Small plane = small(number);
  std::array<long double, D + 1> covector;
  const bool tapered = is_tapered() && plane.offset != 0;
  for (int i = 0; i < D; ++i) covector[i] = static_cast<long double>(plane.normal[i]);
  covector[D] = static_cast<long double>(plane.offset);
  if (!tapered) return covector;
  covector[axes_] = covector[D] * (static_cast<long double>(top_) - static_cast<long double>(bottom_));
  covector[D] *= static_cast<long double>(bottom_);
  return covector;
}

#define BSP2_INSTANTIATE(D) template class RoundFamily<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
