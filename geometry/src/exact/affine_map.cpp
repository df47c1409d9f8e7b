#include "bsp2/geometry/exact/affine_map.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::geometry {
namespace {

/// value * 2^-exponent rounded to the nearest integer, halves away from 0.
Int128 on_grid(Float128 value, int exponent) {
  using Bits = Float128Bits::Bits;
  constexpr int fraction = Float128Bits::fraction_size;
  const Float128Bits bits(value);
  const int field = bits.exponent_field();
  const int shift = field - Float128Bits::bias - fraction - exponent;
  if (shift > 12)
    throw std::logic_error(
        "an affine map exceeds the model's grid");  // at most 2^125; also what is not finite
  if (field == 0 || shift < -fraction - 2) return 0;
  const Bits mantissa = bits.fraction() | Bits{1} << fraction;
  const Bits size = shift >= 0 ? mantissa << shift : (mantissa + (Bits{1} << (-shift - 1))) >> -shift;
  return bits.is_negative() ? -static_cast<Int128>(size) : static_cast<Int128>(size);
}

/// The nearest number: of two that are exact the sum is rounded once. static_cast without a call.
long double nearest(Int128 x) {
  return static_cast<long double>(static_cast<std::int64_t>(x >> 64)) * 0x1p64L +
         static_cast<long double>(static_cast<std::uint64_t>(x));
}

/// Determinant of the n x n minor of `m` without row and column, by cofactors, and the sum of its terms'
/// sizes.
template <int D>
void minor(const std::array<std::array<long double, D>, D>& m, unsigned rows, unsigned columns,
           long double& value, long double& magnitude) {
  if (rows == 0) {
    value = magnitude = 1;
    return;
  }
  const int row = std::countr_zero(rows);
  value = magnitude = 0;
  int position = 0;
  for (int column = 0; column < D; ++column) {
    if (!(columns >> column & 1u)) continue;
    long double v, g;
    minor<D>(m, rows & ~(1u << row), columns & ~(1u << column), v, g);
    value += (position % 2 == 0 ? m[row][column] : -m[row][column]) * v;
    magnitude += std::fabs(m[row][column]) * g;
    ++position;
  }
}

/// The minor without one row and one column; in space, where models have millions of maps, without the
/// recursion.
template <int D>
void minor_without(const std::array<std::array<long double, D>, D>& m, int row, int column,
                   long double& value, long double& magnitude) {
  if constexpr (D == 3) {
    const auto &a = m[row == 0 ? 1 : 0], &b = m[row == 2 ? 1 : 2];
    const int k = column == 0 ? 1 : 0, l = column == 2 ? 1 : 2;
    value = a[k] * b[l] - a[l] * b[k];
    magnitude = std::fabs(a[k]) * std::fabs(b[l]) + std::fabs(a[l]) * std::fabs(b[k]);
  } else {
    constexpr unsigned all = (1u << D) - 1;
    minor<D>(m, all & ~(1u << row), all & ~(1u << column), value, magnitude);
  }
}

template <std::size_t D>
std::array<std::array<long double, D>, D> linear_part(
    const std::array<std::array<Int128, D + 1>, D>& entries) {
  std::array<std::array<long double, D>, D> linear;
  for (std::size_t i = 0; i < D; ++i)
    for (std::size_t j = 0; j < D; ++j) linear[i][j] = nearest(entries[i][j]);
  return linear;
}

/// Of at least one row and column.
template <int D, typename Integer>
Integer exact_minor(const std::array<std::array<Int128, D + 1>, D>& m, unsigned rows, unsigned columns) {
  const int row = std::countr_zero(rows);
  if (rows == (1u << row)) return Integer(m[row][std::countr_zero(columns)]);
  Integer value = 0;
  int position = 0;
  for (int column = 0; column < D; ++column) {
    if (!(columns >> column & 1u)) continue;
    if (m[row][column] != 0) {
      const Integer term = Integer(m[row][column]) *
                           exact_minor<D, Integer>(m, rows & ~(1u << row), columns & ~(1u << column));
      value += position % 2 == 0 ? term : Integer(-term);
    }
    ++position;
  }
  return value;
}

}  // namespace

template <int D>
AffineMap<D>::AffineMap(const Matrix<D>& matrix, int grid_exponent) : grid_exponent_(grid_exponent) {
  for (int i = 0; i < D; ++i)
    for (int j = 0; j <= D; ++j) entries_[i][j] = on_grid(matrix[i][j], grid_exponent);
  const auto linear = linear_part<D>(entries_);
  long double determinant = 0, magnitude = 0;  // along the first row
  for (int j = 0; j < D; ++j) {
    long double value, size;
    minor_without<D>(linear, 0, j, value, size);
    determinant += linear[0][j] * (j % 2 == 0 ? value : -value);
    magnitude += std::fabs(linear[0][j]) * size;
  }
  if (std::fabs(determinant) > magnitude * unit_roundoff)
    orientation_ = determinant < 0 ? -1 : 1;
  else
    orientation_ = exact_minor<D, MinorInteger<D>>(entries_, (1u << D) - 1, (1u << D) - 1).sign();
}

template <int D>
typename AffineMap<D>::Rounding AffineMap<D>::rounding() const {
  Rounding result;
  const auto linear = linear_part<D>(entries_);
  result.translation = translation();
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      long double magnitude;
      minor_without<D>(linear, j, i, result.adjugate[i][j], magnitude);
      result.magnitude[i][j] = static_cast<double>(magnitude);
      if ((i + j) % 2 != 0) result.adjugate[i][j] = -result.adjugate[i][j];
    }
  // Along the first row.
  for (int j = 0; j < D; ++j) {
    result.determinant += linear[0][j] * result.adjugate[j][0];
    result.determinant_magnitude += std::fabs(static_cast<double>(linear[0][j])) * result.magnitude[j][0];
  }
  return result;
}

template <int D>
void AffineMap<D>::exact_adjugate(std::array<std::array<MinorInteger<D>, D>, D>& adjugate,
                                  MinorInteger<D>& determinant) const {
  std::array<std::array<MinorInteger<D>, D>, D> m;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) m[i][j] = MinorInteger<D>(entries_[i][j]);
  if constexpr (D == 3) {  // the next rows and columns in a circle: so signs are right
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        const auto &a = m[(i + 1) % 3], &b = m[(i + 2) % 3];
        const int k = (j + 1) % 3, l = (j + 2) % 3;
        adjugate[j][i] = a[k] * b[l] - a[l] * b[k];
      }
    determinant = m[0][0] * adjugate[0][0] + m[0][1] * adjugate[1][0] + m[0][2] * adjugate[2][0];
    return;
  }
  // Row by row without row `skip`: minors of the first rows over the sets of columns used so far.
  std::array<MinorInteger<D>, 1u << D> minor;
  for (int skip = 0; skip < D; ++skip) {
    minor[0] = 1;
    for (unsigned set = 1; set + 1 < (1u << D); ++set) {
      const int place = std::popcount(set) - 1, row = place < skip ? place : place + 1;
      minor[set] = 0;
      int position = 0;  // of the column within the set
      for (int column = 0; column < D; ++column) {
        if (!(set >> column & 1u)) continue;
        const MinorInteger<D>& rest = minor[set & ~(1u << column)];
        if (entries_[row][column] != 0 && !rest.is_zero()) {
          const MinorInteger<D> term = m[row][column] * rest;
          if ((place + position) % 2 == 0)
            minor[set] += term;
          else
            minor[set] -= term;
        }
        ++position;
      }
    }
    for (int column = 0; column < D; ++column) {
      MinorInteger<D>& cofactor = adjugate[column][skip];
      cofactor = minor[((1u << D) - 1) & ~(1u << column)];
      if ((skip + column) % 2 != 0) cofactor = -cofactor;
    }
  }
  determinant = 0;
  for (int j = 0; j < D; ++j) determinant += m[0][j] * adjugate[j][0];
}

template <int D>
void AffineMap<D>::map(const Covector<D>& local, ExactCovector<D>& world) const {
  // The covectors that are asked for one after the other are mostly of one primitive.
  struct Last {
    std::array<std::array<Int128, D + 1>, D> entries{};
    std::array<std::array<MinorInteger<D>, D>, D> adjugate;
    MinorInteger<D> determinant;
  };
  static thread_local Last last;  // all 0 belongs to entries that are all 0
  if (last.entries != entries_) {
    exact_adjugate(last.adjugate, last.determinant);
    last.entries = entries_;
  }
  const auto& adjugate = last.adjugate;
  using Integer = FixedInteger<covector_bits<D>>;
  std::array<Integer, D + 1> result;
  result[D] = Integer(last.determinant) * Integer(local.exact[D]);
  for (int j = 0; j < D; ++j) {
    for (int i = 0; i < D; ++i)
      if (!local.exact[i].is_zero()) result[j] += Integer(local.exact[i]) * Integer(adjugate[i][j]);
    if (entries_[j][D] != 0) result[D] -= result[j] * Integer(entries_[j][D]);
  }
  for (int j = 0; j <= D; ++j) {
    world[j] = result[j];
    if (orientation_ < 0) world[j].backend().negate();
  }
}

namespace {

constexpr std::uint64_t prime = (std::uint64_t{1} << 61) - 1;
__extension__ using Unsigned128 = unsigned __int128;

std::uint64_t times(std::uint64_t a, std::uint64_t b) {
  return static_cast<std::uint64_t>(static_cast<Unsigned128>(a) * b % prime);
}
std::uint64_t plus(std::uint64_t a, std::uint64_t b) { return (a + b) % prime; }
std::uint64_t minus(std::uint64_t a, std::uint64_t b) { return (a + prime - b) % prime; }

/// 1 / a, by Fermat.
std::uint64_t inverse_of(std::uint64_t a) {
  std::uint64_t result = 1;
  for (std::uint64_t power = prime - 2; power != 0; power >>= 1, a = times(a, a))
    if ((power & 1) != 0) result = times(result, a);
  return result;
}

std::uint64_t residue(Int128 x) {
  const auto size = static_cast<std::uint64_t>(
      (x < 0 ? -static_cast<Unsigned128>(x) : static_cast<Unsigned128>(x)) % prime);
  return x < 0 ? minus(0, size) : size;
}

template <typename Integer>
std::uint64_t residue_of(const Integer& x) {
  const auto& limbs = x.backend();
  std::uint64_t sum = 0;
  for (unsigned i = limbs.size(); i-- > 0;) {
    static_assert(sizeof(limbs.limbs()[0]) == 8);
    sum = static_cast<std::uint64_t>((static_cast<Unsigned128>(sum) << 64 | limbs.limbs()[i]) % prime);
  }
  return x.sign() < 0 ? minus(0, sum) : sum;
}

}  // namespace

template <int D>
typename AffineMap<D>::Residues AffineMap<D>::residues() const {
  Residues result;
  std::array<std::array<MinorInteger<D>, D>, D> adjugate;
  MinorInteger<D> determinant;
  exact_adjugate(adjugate, determinant);
  result.determinant = residue_of(determinant);
  for (int i = 0; i < D; ++i) {
    result.translation[i] = residue(entries_[i][D]);
    for (int j = 0; j < D; ++j) result.adjugate[i][j] = residue_of(adjugate[i][j]);
  }
  return result;
}

template <int D>
std::uint64_t AffineMap<D>::mark(const Covector<D>& local, const Residues& residues) const {
  std::array<std::uint64_t, D + 1> world{};
  world[D] = times(residues.determinant, residue_of(local.exact[D]));
  for (int i = 0; i < D; ++i) {
    if (local.exact[i].is_zero()) continue;
    const std::uint64_t coefficient = residue_of(local.exact[i]);
    for (int j = 0; j < D; ++j) world[j] = plus(world[j], times(coefficient, residues.adjugate[i][j]));
  }
  for (int j = 0; j < D; ++j) world[D] = minus(world[D], times(world[j], residues.translation[j]));
  const auto first_of = [&] { return std::ranges::find_if(world, [](std::uint64_t x) { return x != 0; }); };
  auto first = first_of();
  if (first == world.end()) {  // or all are multiples of the prime, which has to be divided out
    ExactCovector<D> exact;
    map(local, exact);
    if (std::all_of(exact.begin(), exact.end() - 1, [](const auto& x) { return x.is_zero(); })) return 0;
    while (first == world.end()) {
      for (int j = 0; j <= D; ++j) world[j] = residue_of(exact[j] /= prime);
      first = first_of();
    }
  }
  const std::uint64_t inverse = inverse_of(*first);
  std::uint64_t hash = static_cast<std::uint64_t>(first - world.begin());
  for (; first != world.end(); ++first) {
    hash = (hash ^ times(*first, inverse)) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  }
  return hash == 0 ? 1 : hash;
}

template <int D>
typename AffineMap<D>::RoundedNormal AffineMap<D>::map_normal_rounded(
    const std::array<long double, D + 1>& local, const Rounding& rounding) const {
  RoundedNormal normal{};
  for (int i = 0; i < D; ++i) {
    if (local[i] == 0) continue;  // as most are of boxes
    const double size = std::fabs(static_cast<double>(local[i]));
    for (int j = 0; j < D; ++j) {
      normal.value[j] += local[i] * rounding.adjugate[i][j];
      normal.magnitude[j] += size * rounding.magnitude[i][j];
    }
  }
  for (int j = 0; j < D; ++j) {
    if (orientation_ < 0) normal.value[j] = -normal.value[j];
    normal.error[j] = normal.magnitude[j] * unit_roundoff;
  }
  return normal;
}

template <int D>
typename AffineMap<D>::Rounded AffineMap<D>::map_rounded(const std::array<long double, D + 1>& local,
                                                         const Rounding& rounding) const {
  const RoundedNormal normal = map_normal_rounded(local, rounding);
  const RoundedConstant constant = map_constant_rounded(local, normal, rounding);
  Rounded world;
  std::copy_n(normal.value.begin(), D, world.value.begin());
  std::copy_n(normal.error.begin(), D, world.error.begin());
  world.value[D] = constant.value;
  world.error[D] = constant.error;
  return world;
}

template <int D>
std::array<long double, D> AffineMap<D>::translation() const {
  std::array<long double, D> result;
  for (int i = 0; i < D; ++i) result[i] = nearest(entries_[i][D]);
  return result;
}

template <int D>
bool AffineMap<D>::is_translate_of(const AffineMap& other) const {
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      if (entries_[i][j] != other.entries_[i][j]) return false;
  return true;
}

template <int D>
std::uint64_t AffineMap<D>::hash_of_linear_part() const {
  std::uint64_t hash = 0;
  const auto add = [&](std::uint64_t word) {
    hash = (hash ^ word) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      add(static_cast<std::uint64_t>(entries_[i][j]));
      add(static_cast<std::uint64_t>(entries_[i][j] >> 64));
    }
  return hash;
}

template <int D>
typename AffineMap<D>::Inverse AffineMap<D>::inverse(double radius) const {
  const Rounding rounding = this->rounding();
  // In grid units the linear part is A = `entries_`, its inverse adjugate / determinant.
  Inverse result;
  const long double unit = std::ldexp(1.0L, grid_exponent_);
  const long double slack = rounding.determinant_magnitude * unit_roundoff;  // of the determinant
  const long double determinant = std::fabs(rounding.determinant) - slack;
  for (int j = 0; j < D; ++j)
    result.origin[j] = static_cast<double>(static_cast<long double>(entries_[j][D]) * unit);
  if (!(determinant > 0)) {
    result.matrix = {};
    result.error = std::numeric_limits<double>::infinity();
    return result;
  }
  long double square = 0;
  for (int i = 0; i < D; ++i) {
    long double error = 0;
    for (int j = 0; j < D; ++j) {
      const long double entry = rounding.adjugate[i][j] / rounding.determinant / unit,
                        size = std::fabs(entry);
      const long double entry_error =
          (rounding.magnitude[i][j] * unit_roundoff / unit + size * slack) / determinant + size * 0x1p-52L;
      const long double reach =
          static_cast<long double>(radius) + std::fabs(static_cast<long double>(result.origin[j]));
      result.matrix[i][j] = static_cast<double>(entry);
      // Of the entry, of the origin and the difference, of the product and the sum.
      error += entry_error * reach + size * reach * ((D + 4) * 0x1p-52L);
      square += (size + entry_error) * (size + entry_error);
    }
    result.error = std::max(result.error, static_cast<double>(error * 1.01L));
  }
  result.scale = static_cast<double>(std::sqrt(square) * 1.01L);
  return result;
}

#define BSP2_INSTANTIATE(D) template class AffineMap<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
