#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bsp2::model {

/// A set of numbers below a bound that finds the next one in time logarithmic in the bound: a bit for each,
/// above these a bit for each word that is not 0, and so on.
class IndexSet {
 public:
  /// All numbers below the bound.
  void fill(std::uint32_t bound) {
    levels_.clear();
    for (std::size_t size = bound;; size = (size + 63) / 64) {
      auto& words = levels_.emplace_back((size + 63) / 64, ~std::uint64_t{0});
      if (size % 64 != 0) words.back() = (std::uint64_t{1} << size % 64) - 1;
      if (size <= 64) return;
    }
  }

  void insert(std::uint32_t i) {
    for (auto& words : levels_) {
      words[i / 64] |= std::uint64_t{1} << i % 64;
      i /= 64;
    }
  }

  void erase(std::uint32_t i) {
    for (auto& words : levels_) {
      words[i / 64] &= ~(std::uint64_t{1} << i % 64);
      if (words[i / 64] != 0) return;
      i /= 64;
    }
  }

  static constexpr std::uint32_t none = ~0u;

  /// @return the least number of the set that is not below i, or none.
  [[nodiscard]] std::uint32_t next(std::uint32_t i) const {
    for (std::size_t level = 0; level < levels_.size(); ++level) {
      if (i / 64 >= levels_[level].size()) return none;
      if (const std::uint64_t rest = levels_[level][i / 64] >> i % 64; rest != 0)
        return lowest_below(level, i + static_cast<std::uint32_t>(std::countr_zero(rest)));
      i = i / 64 + 1;
    }
    return none;
  }

 private:
  /// The least number that a bit of a level stands for.
  [[nodiscard]] std::uint32_t lowest_below(std::size_t level, std::uint32_t i) const {
    while (level-- > 0) i = 64 * i + static_cast<std::uint32_t>(std::countr_zero(levels_[level][i]));
    return i;
  }

  std::vector<std::vector<std::uint64_t>> levels_;
};

}  // namespace bsp2::model
