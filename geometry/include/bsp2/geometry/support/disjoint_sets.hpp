#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace bsp2::geometry {

/// Which of some numbered things belong together. The lowest of a set stands for all of it.
/// Source: Galler, Fischer, "An improved equivalence algorithm" (1964).
class DisjointSets {
 public:
  /// Each by itself.
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0U); }
  /// What stands for the set of `i`.
  std::uint32_t find(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(std::uint32_t a, std::uint32_t b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace bsp2::geometry
