#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace bsp2::dataflow {

/// An axis-parallel box; empty where lower > upper, unbounded where infinite.
template <int D>
struct Box {
  std::array<double, D> lower, upper;

  static Box empty() {
    Box box;
    box.lower.fill(std::numeric_limits<double>::infinity());
    box.upper.fill(-std::numeric_limits<double>::infinity());
    return box;
  }
  static Box everything() {
    Box box = empty();
    std::swap(box.lower, box.upper);
    return box;
  }
  [[nodiscard]] bool is_empty() const {
    for (int i = 0; i < D; ++i)
      if (lower[i] > upper[i]) return true;
    return false;
  }
  [[nodiscard]] bool is_finite() const {
    for (int i = 0; i < D; ++i)
      if (!std::isfinite(lower[i]) || !std::isfinite(upper[i])) return false;
    return true;
  }
  /// Whether the boxes have no point in common.
  [[nodiscard]] bool misses(const Box& other) const {
    for (int i = 0; i < D; ++i)
      if (upper[i] < other.lower[i] || lower[i] > other.upper[i]) return true;
    return false;
  }
  [[nodiscard]] bool contains(const Box& other) const {
    for (int i = 0; i < D; ++i)
      if (lower[i] > other.lower[i] || upper[i] < other.upper[i]) return false;
    return true;
  }
  void unite(const Box& other) {
    if (other.is_empty()) return;
    for (int i = 0; i < D; ++i) {
      lower[i] = std::min(lower[i], other.lower[i]);
      upper[i] = std::max(upper[i], other.upper[i]);
    }
  }
  void intersect(const Box& other) {
    for (int i = 0; i < D; ++i) {
      lower[i] = std::max(lower[i], other.lower[i]);
      upper[i] = std::min(upper[i], other.upper[i]);
    }
  }
};

}  // namespace bsp2::dataflow
