#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace bsp2::geometry {

/// Names an unoriented hyperplane of a table; the same on all ranks and threads.
using HyperplaneId = std::uint32_t;

/// A hyperplane id and an orientation: the value is 2 id, plus 1 where the hyperplane is taken with the
/// opposite sign.
struct OrientedHyperplane {
  std::uint32_t code = 0;
  [[nodiscard]] HyperplaneId id() const { return code >> 1; }
  [[nodiscard]] bool flipped() const { return (code & 1u) != 0; }
  [[nodiscard]] OrientedHyperplane opposite() const { return {code ^ 1u}; }
  friend bool operator==(OrientedHyperplane, OrientedHyperplane) = default;
};
inline OrientedHyperplane oriented(HyperplaneId id, bool flipped = false) {
  return {id << 1 | (flipped ? 1u : 0u)};
}

/// The rounded copy of a hyperplane normal . x + offset = 0, for filters: the negative side is inside.
///
/// Invariant: for every point x within the table's bounds, `at(x)` differs from the exact hyperplane's value
/// at x, divided by the length of its exact normal, by at most `error`.
template <int D>
struct Hyperplane {
  std::array<double, D> normal;  ///< of unit length, rounded
  double offset;
  double error;
  [[nodiscard]] double at(const std::array<double, D>& x) const {
    double sum = offset;
    for (int i = 0; i < D; ++i) sum += normal[i] * x[i];
    return sum;
  }
  [[nodiscard]] Hyperplane opposite() const {
    Hyperplane h{{}, -offset, error};
    for (int i = 0; i < D; ++i) h.normal[i] = -normal[i];
    return h;
  }
};

}  // namespace bsp2::geometry
