#pragma once

#include <span>

namespace bsp2::dataflow {

struct Interval {
  double lower, upper;
};

/// A place at which to part stretches: those that reach below it are in one half, those that reach above it
/// in the other one.
struct SplitPosition {
  double share;  ///< of all the stretches that the larger half has
  double place;
};

/// The best of many places, within a sixty-fourth of what the stretches cover; for many stretches close
/// together at least as good as the median of their ends. Linear in their number. @pre there are some.
SplitPosition best_split_position(std::span<const Interval> stretches);

}  // namespace bsp2::dataflow
