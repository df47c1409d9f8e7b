#include "process/transformer.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Float128;
using geometry::is_one;
using geometry::is_zero;
using geometry::Matrix;
using geometry::to_long_double;

template <int D>
Transformer<D>::Transformer() : matrix_{} {
  for (int i = 0; i < D; ++i) matrix_[i][i] = 1;
}

template <int D>
Transformer<D>::Transformer(std::span<const double> matrix) {
  for (int i = 0; i < D; ++i)
    for (int j = 0; j <= D; ++j)
      matrix_[i][j] = geometry::to_quad(matrix[static_cast<std::size_t>(i * (D + 1) + j)]);
}

template <int D>
Transformer<D> Transformer<D>::scaling(const std::array<double, D>& factors,
                                       const std::array<double, D>& shift) {
  Matrix<D> m{};
  for (int i = 0; i < D; ++i) {
    m[i][i] = geometry::to_quad(factors[i]);
    m[i][D] = geometry::to_quad(shift[i]);
  }
  return Transformer(m);
}

template <int D>
Transformer<D> Transformer<D>::after(const Transformer& inner) const {
  Matrix<D> result{};
  for (int i = 0; i < D; ++i) {
    result[i][D] = matrix_[i][D];
    for (int k = 0; k < D; ++k) {
      const Float128 factor = matrix_[i][k];
      if (is_zero(factor)) continue;  // most matrices are full of zeros and ones
      for (int j = 0; j <= D; ++j) {
        const Float128 entry = inner.matrix_[k][j];
        if (is_zero(entry)) continue;
        const Float128 product = is_one(factor) ? entry : is_one(entry) ? factor : factor * entry;
        result[i][j] = is_zero(result[i][j]) ? product : result[i][j] + product;
      }
    }
  }
  return Transformer(result);
}

/// The translation with all that reaches below and above it, rounded outward.
template <int D>
Box<D> Transformer<D>::around(const std::array<std::pair<long double, long double>, D>& reach) const {
  Box<D> image;
  for (int i = 0; i < D; ++i) {
    const auto translation = to_long_double(matrix_[i][D]);
    const long double low = translation + reach[i].first, high = translation + reach[i].second;
    const long double slack = 0x1p-50L * std::max(std::fabs(low), std::fabs(high));
    image.lower[i] = static_cast<double>(low - slack);
    image.upper[i] = static_cast<double>(high + slack);
  }
  return image;
}

template <int D>
Box<D> Transformer<D>::image(const Box<D>& box) const {
  std::array<std::pair<long double, long double>, D> reach{};
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      const auto factor = to_long_double(matrix_[i][j]);
      const long double a = factor * box.lower[j], b = factor * box.upper[j];
      reach[i].first += std::min(a, b);
      reach[i].second += std::max(a, b);
    }
  return around(reach);
}

template <int D>
Box<D> Transformer<D>::image(std::span<const std::pair<double, double>> rings) const {
  std::array<std::pair<long double, long double>, D> reach{};
  if constexpr (D == 3)
    for (int i = 0; i < D; ++i) {
      const auto x = to_long_double(matrix_[i][0]), y = to_long_double(matrix_[i][1]);
      const long double across =
          std::sqrt(x * x + y * y);  // squares of what doubles hold are far from the limits
      const auto along = to_long_double(matrix_[i][2]);
      auto& [low, high] = reach[i];
      low = std::numeric_limits<long double>::infinity();
      high = -low;
      for (const auto& [radius, z] : rings) {
        low = std::min(low, along * z - across * radius);
        high = std::max(high, along * z + across * radius);
      }
    }
  return around(reach);
}

template <int D>
Box<D> Transformer<D>::image_of_round(int axes) const {
  std::array<std::pair<long double, long double>, D> reach{};
  for (int i = 0; i < D; ++i) {
    auto& [low, high] = reach[i];
    long double square = 0;
    for (int j = 0; j < axes; ++j) square += to_long_double(matrix_[i][j]) * to_long_double(matrix_[i][j]);
    high = std::sqrt(square);
    low = -high;
    for (int j = axes; j < D; ++j) {
      const auto along = to_long_double(matrix_[i][j]);
      (along < 0 ? low : high) += along;
    }
  }
  return around(reach);
}

#define BSP2_INSTANTIATE(D) template class Transformer<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
