#pragma once

#include <array>
#include <cstddef>

/// Arithmetic of vectors, in whatever numbers: rounded where those are.
namespace bsp2::geometry {

/// The scalar product, summed from the first entry on.
template <typename Number, std::size_t N>
Number dot(const std::array<Number, N>& a, const std::array<Number, N>& b) {
  Number sum = a[0] * b[0];
  for (std::size_t i = 1; i < N; ++i) sum += a[i] * b[i];
  return sum;
}

/// The vector product: counter-clockwise from a to b as seen from its tip.
template <typename Number>
std::array<Number, 3> cross(const std::array<Number, 3>& a, const std::array<Number, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

template <typename Number>
std::array<Number, 3> minus(const std::array<Number, 3>& a, const std::array<Number, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

}  // namespace bsp2::geometry
