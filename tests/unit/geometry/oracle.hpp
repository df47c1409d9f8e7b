#pragma once

// Oracles of the geometry tests: the same questions in rational arithmetic, without any code of the kernel.

#include <array>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <optional>
#include <random>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry::oracle {

using Rational = boost::multiprecision::cpp_rational;
using BigInteger = boost::multiprecision::cpp_int;
using Real = boost::multiprecision::cpp_bin_float_100;

inline Rational rational(double x) { return Rational(x); }

inline Rational rational(Float128 x) {
  Rational sum = 0;
  for (int i = 0; i < 4 && x != 0; ++i) {
    const auto part = static_cast<double>(x);
    sum += Rational(part);
    x -= static_cast<Float128>(part);
  }
  return sum;
}

inline Rational rational(const LocalInteger& x) { return Rational(BigInteger(x)); }

inline Rational power_of_two(int exponent) {
  const BigInteger power = BigInteger(1) << std::abs(exponent);
  return exponent < 0 ? Rational(BigInteger(1), power) : Rational(power);
}

/// The nearest multiple of 2^exponent, halves away from zero.
inline Rational round_to_grid(const Rational& x, int exponent) {
  const Rational scaled = abs(x) / power_of_two(exponent) + Rational(1, 2);
  const Rational whole =
      Rational(BigInteger(numerator(scaled) / denominator(scaled))) * power_of_two(exponent);
  return x < 0 ? Rational(-whole) : whole;
}

/// normal . x + offset, inside negative.
template <int D>
struct Plane {
  std::array<Rational, D> normal;
  Rational offset;
  [[nodiscard]] Rational at(const std::array<Rational, D>& x) const {
    Rational sum = offset;
    for (int i = 0; i < D; ++i) sum += normal[i] * x[i];
    return sum;
  }
  [[nodiscard]] int side(const std::array<Rational, D>& x) const { return at(x).sign(); }
  [[nodiscard]] Real length() const {
    Rational square = 0;
    for (const Rational& n : normal) square += n * n;
    return sqrt(Real(numerator(square)) / Real(denominator(square)));
  }
};

/// The solution of m x = b by Gaussian elimination, if there is exactly one.
template <int D>
std::optional<std::array<Rational, D>> solve(std::array<std::array<Rational, D>, D> m,
                                             std::array<Rational, D> b) {
  for (int k = 0; k < D; ++k) {
    int pivot = k;
    while (pivot < D && m[pivot][k].is_zero()) ++pivot;
    if (pivot == D) return std::nullopt;
    std::swap(m[k], m[pivot]);
    std::swap(b[k], b[pivot]);
    for (int i = 0; i < D; ++i) {
      if (i == k || m[i][k].is_zero()) continue;
      const Rational factor = m[i][k] / m[k][k];
      for (int j = k; j < D; ++j) m[i][j] -= factor * m[k][j];
      b[i] -= factor * b[k];
    }
  }
  for (int k = 0; k < D; ++k) b[k] /= m[k][k];
  return b;
}

template <int D>
std::optional<std::array<Rational, D>> meeting_point(const std::array<Plane<D>, D>& planes) {
  std::array<std::array<Rational, D>, D> m;
  std::array<Rational, D> b;
  for (int i = 0; i < D; ++i) {
    m[i] = planes[i].normal;
    b[i] = -planes[i].offset;
  }
  return solve<D>(m, b);
}

/// The image of a covector's half-space under the map x = A y + t, whose entries are rounded to multiples of
/// 2^grid_exponent: n A^-1 and c - n A^-1 t. Nothing if the rounded map is singular.
template <int D>
std::optional<Plane<D>> place(const Matrix<D>& matrix, int grid_exponent, const Covector<D>& covector) {
  std::array<std::array<Rational, D>, D> transposed;
  std::array<Rational, D> translation, normal;
  for (int i = 0; i < D; ++i) {
    for (int j = 0; j < D; ++j) transposed[j][i] = round_to_grid(rational(matrix[i][j]), grid_exponent);
    translation[i] = round_to_grid(rational(matrix[i][D]), grid_exponent);
    normal[i] = rational(covector.exact[i]);
  }
  const auto world = solve<D>(transposed, normal);
  if (!world) return std::nullopt;
  Plane<D> plane{*world, rational(covector.exact[D])};
  for (int i = 0; i < D; ++i) plane.offset -= (*world)[i] * translation[i];
  return plane;
}

/// Axis-parallel cut x_axis = value, negative below.
template <int D>
Plane<D> axis_plane(int axis, double value) {
  Plane<D> plane;
  for (Rational& n : plane.normal) n = 0;
  plane.normal[axis] = 1;
  plane.offset = -rational(value);
  return plane;
}

template <int D>
std::array<Rational, D> point(const std::array<double, D>& x) {
  std::array<Rational, D> p;
  for (int i = 0; i < D; ++i) p[i] = rational(x[i]);
  return p;
}

inline Real real(const Rational& x) { return Real(numerator(x)) / Real(denominator(x)); }

}  // namespace bsp2::geometry::oracle

namespace bsp2::geometry {

/// A table filled by a test, and what its ids mean in rationals.
template <int D>
struct Model {
  struct Placed {
    Matrix<D> matrix;
    std::vector<Covector<D>> covectors;
  };
  HyperplaneTable<D> table;
  std::vector<oracle::Plane<D>> planes;  ///< of each occurrence
  std::vector<OrientedHyperplane> codes;
  std::vector<std::vector<OrientedHyperplane>> codes_of;  ///< of each placed polytope

  Model(const std::array<double, D>& lower, const std::array<double, D>& upper, double reach,
        const std::vector<Placed>& placed, double tolerance)
      : table(lower, upper, reach) {
    for (const Placed& one : placed) {
      codes_of.emplace_back();
      if (!oracle::place<D>(one.matrix, table.grid_exponent(), one.covectors[0])) continue;  // singular
      const std::uint32_t map = table.add_map(one.matrix), first = table.add_covectors(one.covectors);
      for (std::uint32_t k = 0; k < one.covectors.size(); ++k) {
        table.add_occurrence(map, first + k);
        planes.push_back(*oracle::place<D>(one.matrix, table.grid_exponent(), one.covectors[k]));
        codes_of.back().push_back(
            {static_cast<std::uint32_t>(planes.size() - 1)});  // for now, the occurrence
      }
    }
    codes = table.merge(tolerance);
    for (auto& own : codes_of)
      for (OrientedHyperplane& code : own) code = codes[code.code];
    by_id_.resize(table.size());
    for (std::size_t i = planes.size(); i-- > 0;)
      by_id_[codes[i].id()] = i;  // the first occurrence represents it
  }

  /// The hyperplane of an id as its first occurrence, in that one's orientation.
  [[nodiscard]] oracle::Plane<D> plane(HyperplaneId id) const {
    if (id < by_id_.size()) {
      oracle::Plane<D> plane = planes[by_id_[id]];
      if (codes[by_id_[id]].flipped()) {
        for (auto& n : plane.normal) n = -n;
        plane.offset = -plane.offset;
      }
      return plane;
    }
    for (int axis = 0; axis < D; ++axis) {
      const HyperplaneId first = table.axis_hyperplane(axis, 0),
                         last = table.axis_hyperplane(axis, table.axis_steps);
      if (id >= first && id <= last) return oracle::axis_plane<D>(axis, table.axis_value(axis, id - first));
    }
    throw std::logic_error("an unknown hyperplane");
  }
  [[nodiscard]] std::optional<std::array<oracle::Rational, D>> vertex(
      const std::array<HyperplaneId, D>& ids) const {
    std::array<oracle::Plane<D>, D> own;
    for (int i = 0; i < D; ++i) own[i] = plane(ids[i]);
    return oracle::meeting_point<D>(own);
  }

 private:
  std::vector<std::size_t> by_id_;
};

using Random = std::mt19937_64;

inline double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}
inline int pick(Random& random, int low, int high) {
  return std::uniform_int_distribution<int>(low, high)(random);
}

template <int D>
Matrix<D> identity() {
  Matrix<D> m{};
  for (int i = 0; i < D; ++i) m[i][i] = 1;
  return m;
}

/// outer after inner, to 113 bits.
template <int D>
Matrix<D> product(const Matrix<D>& outer, const Matrix<D>& inner) {
  Matrix<D> result{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j <= D; ++j) {
      Float128 sum = j == D ? outer[i][D] : Float128{0};
      for (int k = 0; k < D; ++k) sum += outer[i][k] * inner[k][j];
      result[i][j] = sum;
    }
  return result;
}

/// Rotation in the plane of two axes; small angles keep their own 64 bits.
template <int D>
Matrix<D> rotation(int a, int b, long double angle) {
  Matrix<D> m = identity<D>();
  m[a][a] = m[b][b] = static_cast<Float128>(std::cos(angle));
  m[b][a] = static_cast<Float128>(std::sin(angle));
  m[a][b] = -m[b][a];
  return m;
}

template <int D>
Matrix<D> translation(const std::array<double, D>& t) {
  Matrix<D> m = identity<D>();
  for (int i = 0; i < D; ++i) m[i][D] = t[i];
  return m;
}

using samples::new_seed;

}  // namespace bsp2::geometry
