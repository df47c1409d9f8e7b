#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace bsp2::geometry {

/// 0 ... count - 1 in the order of `is_before`: by counting where most have small keys, shared by few; then
/// those of one key are sorted.
/// @param key(i) a whole number; what is before something else has no larger one.
template <typename Key, typename Before>
std::vector<std::uint32_t> counted_order(std::size_t count, const Key& key, const Before& is_before) {
  const std::size_t most = 4 * count;  // larger keys are counted together
  const auto bucket = [&](std::size_t i) { return std::min<std::size_t>(key(i), most); };
  std::vector<std::uint32_t> order(count), begin(most + 2);
  for (std::size_t i = 0; i < count; ++i) ++begin[bucket(i) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  for (std::uint32_t i = 0; i < count; ++i) order[begin[bucket(i)]++] = i;  // begins become ends
  for (std::size_t i = 0, first = 0; i <= most; first = begin[i++])
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(first),
              order.begin() + static_cast<std::ptrdiff_t>(begin[i]), is_before);
  return order;
}

}  // namespace bsp2::geometry
