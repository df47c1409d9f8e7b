#include "bsp2/dataflow/transformer.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "bsp2/geometry/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Matrix;
using geometry::Quad;

namespace {

__extension__ using Bits = unsigned __int128;

// From the bits: arithmetic of 113 bits is slow.
bool is_zero(Quad x) { return std::bit_cast<Bits>(x) << 1 == 0; }
bool is_one(Quad x) { return std::bit_cast<Bits>(x) == Bits{0x3fff} << 112; }

}  // namespace

template <int D>
Transformer<D>::Transformer() : matrix_{} {
  for (int i = 0; i < D; ++i) matrix_[i][i] = 1;
}

template <int D>
Transformer<D>::Transformer(std::span<const double> matrix) {
  for (int i = 0; i < D; ++i)
    for (int j = 0; j <= D; ++j) matrix_[i][j] = matrix[static_cast<std::size_t>(i * (D + 1) + j)];
}

template <int D>
Transformer<D> Transformer<D>::scaling(const std::array<double, D>& factors, const std::array<double, D>& shift) {
  Matrix<D> m{};
  for (int i = 0; i < D; ++i) {
    m[i][i] = factors[i];
    m[i][D] = shift[i];
  }
  return Transformer(m);
}

template <int D>
Transformer<D> Transformer<D>::after(const Transformer& inner) const {
  Matrix<D> result{};
  for (int i = 0; i < D; ++i) {
    result[i][D] = matrix_[i][D];
    for (int k = 0; k < D; ++k) {
      const Quad factor = matrix_[i][k];
      if (is_zero(factor)) continue;  // most matrices are full of zeros and ones
      for (int j = 0; j <= D; ++j) {
        const Quad entry = inner.matrix_[k][j];
        if (is_zero(entry)) continue;
        const Quad product = is_one(factor) ? entry : is_one(entry) ? factor : factor * entry;
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
    const auto translation = static_cast<long double>(matrix_[i][D]);
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
      const auto factor = static_cast<long double>(matrix_[i][j]);
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
      const long double across = std::hypot(static_cast<long double>(matrix_[i][0]), static_cast<long double>(matrix_[i][1]));
      const auto along = static_cast<long double>(matrix_[i][2]);
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
    for (int j = 0; j < axes; ++j) square += static_cast<long double>(matrix_[i][j]) * static_cast<long double>(matrix_[i][j]);
    high = std::sqrt(square);
    low = -high;
    for (int j = axes; j < D; ++j) {
      const auto along = static_cast<long double>(matrix_[i][j]);
      (along < 0 ? low : high) += along;
    }
  }
  return around(reach);
}

template <int D>
std::optional<std::uint32_t> Transformer<D>::emit(geometry::HyperplaneTable<D>& table, std::uint32_t first, std::uint32_t count,
                                                  const Box<D>& bounds) const {
  const std::uint32_t map = table.add_map(matrix_, bounds.lower, bounds.upper);
  if (table.orientation(map) == 0) return std::nullopt;
  std::optional<std::uint32_t> occurrence;
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t next = table.add_occurrence(map, first + i);
    if (!occurrence) occurrence = next;
  }
  return occurrence;
}

#define BSP2_INSTANTIATE(D) template class Transformer<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
