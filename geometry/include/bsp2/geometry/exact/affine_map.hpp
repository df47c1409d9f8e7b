#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <span>

#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/geometry/exact/exact.hpp"
#include "bsp2/geometry/support/quad.hpp"

namespace bsp2::geometry {

/// An affine map from a primitive's frame to the model, as a D x (D+1) matrix, translation last, in model
/// units.
template <int D>
using Matrix = std::array<std::array<Float128, D + 1>, D>;

/// Holds any minor of a linear part on the grid: D factors of 122 bits.
template <int D>
using MinorInteger = FixedInteger<D <= 3 ? 384 : 768>;

/// The affine map on the model's grid: the same matrix as integers, in units of 2^grid_exponent.
///
/// The grid is 2^-100 of the largest coordinate: every map is rounded to it once, and all that follows is
/// exact. Maps covectors by the product with the adjugate matrix (paper, section 4.1: transformers).
template <int D>
class AffineMap {
 public:
  /// The map in long double: enough for all rounded images, and more than twice as large as the map itself.
  /// Magnitudes are the sums of the sizes of the terms of something, for the bound of its error: doubles are
  /// enough.
  struct Rounding {
    std::array<std::array<long double, D>, D> adjugate;
    std::array<std::array<double, D>, D> magnitude;  ///< of the adjugate
    long double determinant = 0;
    double determinant_magnitude = 0;
    std::array<long double, D> translation;
  };

  AffineMap() = default;  ///< none yet
  /// @pre no entry exceeds 2^(grid_exponent + 122): a primitive may be modelled a million times its reach
  /// away from its place.
  AffineMap(const Matrix<D>& matrix, int grid_exponent);
  [[nodiscard]] Rounding rounding() const;

  /// Orientation of the linear part: +1, -1, or 0 where it is singular on the grid.
  [[nodiscard]] int orientation() const { return orientation_; }
  /// The covector in the model's frame, exact, with respect to points in grid units.
  void map(const Covector<D>& local, ExactCovector<D>& world) const;

  /// A number that is the same for all covectors of one hyperplane, and seldom for those of two. 0: the
  /// covector has no normal.
  ///
  /// Residues modulo a prime of the covector in the model's frame, divided by the first that is not 0: so no
  /// multiple makes a difference, and nothing long is computed.
  struct Residues {
    std::array<std::array<std::uint64_t, D>, D> adjugate;
    std::uint64_t determinant = 0;
    std::array<std::uint64_t, D> translation;
  };
  [[nodiscard]] Residues residues() const;
  [[nodiscard]] std::uint64_t mark(const Covector<D>& local, const Residues& residues) const;

  /// The image of the point p 2^-53, |p| <= 2^53, exactly: in units of 2^(grid_exponent - 53).
  [[nodiscard]] std::array<FixedInteger<192>, D> image(const std::array<std::int64_t, D>& p) const {
    std::array<FixedInteger<192>, D> point;
    for (int i = 0; i < D; ++i) {
      point[i] = FixedInteger<192>(entries_[i][D]) << 53;
      for (int j = 0; j < D; ++j) point[i] += FixedInteger<192>(entries_[i][j]) * p[j];
    }
    return point;
  }

  /// The image of a point in homogeneous coordinates, the weight last, exactly: in units of 2^grid_exponent.
  /// @pre the integers hold 125 bits more than the point's.
  template <typename Integer>
  [[nodiscard]] std::array<Integer, D + 1> image(const std::array<Integer, D + 1>& p) const {
    std::array<Integer, D + 1> point;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j <= D; ++j)
        if (entries_[i][j] != 0) point[i] += Integer(entries_[i][j]) * p[j];
    point[D] = p[D];
    return point;
  }

  /// The covector in the model's frame in long double, and a bound of each coefficient's error.
  struct Rounded {
    std::array<long double, D + 1> value;
    std::array<double, D + 1> error;
  };
  /// @param rounding of this map.
  [[nodiscard]] Rounded map_rounded(const std::array<long double, D + 1>& local,
                                    const Rounding& rounding) const;
  /// The first step of mapping a covector: the normal, which is one for all translates of this map.
  struct RoundedNormal {
    std::array<long double, D> value;
    std::array<double, D> error, magnitude;
  };
  [[nodiscard]] RoundedNormal map_normal_rounded(const std::array<long double, D + 1>& local,
                                                 const Rounding& rounding) const;
  struct RoundedConstant {
    long double value;
    double error;
  };
  /// @param rounding of this map, or that of a translate with this map's `translation`.
  [[nodiscard]] RoundedConstant map_constant_rounded(const std::array<long double, D + 1>& local,
                                                     const RoundedNormal& normal,
                                                     const Rounding& rounding) const {
    long double value = (orientation_ < 0 ? -rounding.determinant : rounding.determinant) * local[D];
    double magnitude = rounding.determinant_magnitude * std::fabs(static_cast<double>(local[D]));
    for (int j = 0; j < D; ++j) {
      value -= normal.value[j] * rounding.translation[j];
      magnitude += normal.magnitude[j] * std::fabs(static_cast<double>(rounding.translation[j]));
    }
    return {value, magnitude * unit_roundoff};
  }
  [[nodiscard]] std::array<long double, D> translation() const;

  /// Whether the two maps differ by a translation alone.
  [[nodiscard]] bool is_translate_of(const AffineMap& other) const;
  /// A hash that all translates of the map have in common.
  [[nodiscard]] std::uint64_t hash_of_linear_part() const;

  /// The inverse map, from the model to the frame: y = matrix (x - origin).
  struct Inverse {
    std::array<std::array<double, D>, D> matrix;
    std::array<double, D> origin;
    double error = 0;  ///< of each coordinate of y as computed in doubles, where |x_i| <= radius; infinite if
                       ///< the map is too flat
    double scale = 0;  ///< distances in the frame are at most so many times those in the model
    [[nodiscard]] std::array<double, D> image(const std::array<double, D>& x) const {
      std::array<double, D> y{};
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) y[i] += matrix[i][j] * (x[j] - origin[j]);
      return y;
    }
  };
  [[nodiscard]] Inverse inverse(double radius) const;

 private:
  /// Of coefficients in long double: up to 40 operations, in D = 6, take 0.63 of it, magnitudes in doubles
  /// much less than the rest.
  static constexpr double unit_roundoff = 0x1p-58;

  int grid_exponent_;
  std::array<std::array<Int128, D + 1>, D> entries_;  // linear part, translation last
  int orientation_;
  using Minor = MinorInteger<D>;
  void exact_adjugate(std::array<std::array<Minor, D>, D>& adjugate, Minor& determinant) const;
};

}  // namespace bsp2::geometry
