#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <future>
#include <vector>

namespace bsp2::geometry {

/// Parts 0 ... count - 1 into ranges of `grain`, which threads take one after the other, and calls `work(first, end)` for each. One of the
/// threads is the one that calls; it waits for the others, and passes on what one throws.
template <typename Work>
void for_each_range(std::size_t count, std::size_t grain, unsigned threads, const Work& work) {
  std::atomic<std::size_t> next = 0;
  const auto take_ranges = [&] {
    for (std::size_t first; (first = next.fetch_add(grain, std::memory_order_relaxed)) < count;) work(first, std::min(first + grain, count));
  };
  const std::size_t ranges = (count + grain - 1) / grain;
  std::vector<std::future<void>> others;  // which waits in its destructor, too
  for (std::size_t i = 1; i < std::min<std::size_t>(threads, ranges); ++i) others.push_back(std::async(std::launch::async, take_ranges));
  take_ranges();
  for (auto& other : others) other.get();
}

}  // namespace bsp2::geometry
