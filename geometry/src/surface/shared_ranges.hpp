#pragma once

#include <algorithm>
#include <cstddef>

#include "bsp2/geometry/support/parallel.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// How threads share 0 ... count - 1: by ranges, whose results are put together in their order, so that they
/// do not depend on the number of threads.
class SharedRanges {
 public:
  SharedRanges(std::size_t count, unsigned threads)
      : count_(count),
        threads_(threads),
        grain_(threads <= 1 ? std::max<std::size_t>(1, count) : std::max(least, count / (8 * threads) + 1)) {}

  [[nodiscard]] std::size_t size() const { return (count_ + grain_ - 1) / grain_; }
  /// Calls work(exact, range, first, end) for each range. One range is asked with what is given, each of
  /// several with points of its own.
  template <typename Work>
  void run(ExactPoints& exact, const Work& work) const {
    if (size() <= 1) {
      if (count_ > 0) work(exact, std::size_t{0}, std::size_t{0}, count_);
      return;
    }
    for_each_range(count_, grain_, threads_, [&](std::size_t first, std::size_t end) {
      ExactPoints own(exact.table());
      work(own, first / grain_, first, end);
    });
  }

 private:
  static constexpr std::size_t least = 2048;  // below it, another thread's help costs more than it gives
  std::size_t count_;
  unsigned threads_;
  std::size_t grain_;
};

}  // namespace bsp2::geometry
