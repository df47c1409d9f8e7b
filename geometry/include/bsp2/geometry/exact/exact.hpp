#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <limits>

namespace bsp2::geometry {

__extension__ using Int128 = __int128;

namespace mp = boost::multiprecision;

template <unsigned Bits>
using FixedInteger =
    mp::number<mp::cpp_int_backend<Bits, Bits, mp::signed_magnitude, mp::unchecked, void>, mp::et_off>;

/// Coefficients of a local covector: see covector.hpp for how many bits a producer needs.
using LocalInteger = FixedInteger<256>;

/// Bits that no exact computation in E^D exceeds (affine_map.hpp and covector.hpp bound its inputs).
///
/// With grid entries of 122 bits and local coefficients of 216 bits, a world normal has (D-1) 122 + 216 + 4
/// bits, a world constant D 122 + 216 + 6, and the predicate is a determinant of D normals and one constant:
/// for D = 3, below 1990 bits. Above D = 3 there are no polyhedra, and local coefficients have at most 114
/// bits, those of cones: for D = 6, 731 and 855 bits, and below 5260.
template <int D>
inline constexpr unsigned exact_bits = D <= 3 ? 2048 : 5312;
template <int D>
inline constexpr unsigned covector_bits = D <= 3 ? 640 : 896;

template <int D>
using ExactInteger = FixedInteger<exact_bits<D>>;

/// D + 1 exact coefficients of an oriented hyperplane on the model's grid: constant last.
template <int D>
using ExactCovector = std::array<ExactInteger<D>, D + 1>;

/// value * 2^-shift rounded to double, with a relative error below 2^-52; any size of value, no overflow in
/// between.
template <typename Integer>
double scaled_to_double(const Integer& value, long shift) {
  if (value.is_zero()) return 0.0;
  const Integer magnitude = mp::abs(value);
  const long top = static_cast<long>(mp::msb(magnitude)) - 63;
  const std::uint64_t leading =
      top > 0 ? static_cast<std::uint64_t>(Integer(magnitude >> top)) : static_cast<std::uint64_t>(magnitude);
  const double result =
      std::ldexp(static_cast<double>(leading), static_cast<int>((top > 0 ? top : 0) - shift));
  return value.sign() < 0 ? -result : result;
}

/// Divides a covector by the largest power of two that leaves it whole: the same hyperplane, in fewer words.
template <typename Integer, std::size_t N>
void divide_by_common_power_of_two(std::array<Integer, N>& covector) {
  std::size_t power = std::numeric_limits<std::size_t>::max();
  for (const Integer& coefficient : covector)
    if (!coefficient.is_zero()) power = std::min<std::size_t>(power, mp::lsb(Integer(mp::abs(coefficient))));
  for (Integer& coefficient : covector)
    if (!coefficient.is_zero()) coefficient >>= power;
}

/// The point in which D hyperplanes meet, as D + 1 homogeneous coordinates (the weight last, of either sign,
/// 0 where they do not meet in one point).
///
/// The coordinates are the D x D minors of the hyperplanes' coefficients with alternating signs, expanded row
/// by row over the sets of columns used so far: no division, and no value is larger than a minor.
template <int D, typename Integer>
std::array<Integer, D + 1> meeting_point(const std::array<std::array<Integer, D + 1>, D>& hyperplanes) {
  constexpr unsigned columns = D + 1;
  std::array<Integer, 1u << columns> minor;  // minor[set]: the first |set| rows and these columns
  for (unsigned column = 0; column < columns; ++column) minor[1u << column] = hyperplanes[0][column];
  for (unsigned set = 1; set + 1 < (1u << columns); ++set) {
    const int row = std::popcount(set) - 1;
    if (row == 0) continue;
    minor[set] = Integer();
    int position = 0;  // of the column within the set
    for (unsigned column = 0; column < columns; ++column) {
      if (!(set >> column & 1u)) continue;
      const Integer& entry = hyperplanes[row][column];
      const Integer& rest = minor[set & ~(1u << column)];
      if (!entry.is_zero() && !rest.is_zero()) {
        if ((row + position) % 2 == 0)
          minor[set] += entry * rest;
        else
          minor[set] -= entry * rest;
      }
      ++position;
    }
  }
  std::array<Integer, D + 1> point;
  for (unsigned column = 0; column < columns; ++column) {
    point[column] = minor[((1u << columns) - 1) & ~(1u << column)];
    if ((D - static_cast<int>(column)) % 2 != 0) point[column] = -point[column];
  }
  return point;
}

}  // namespace bsp2::geometry
