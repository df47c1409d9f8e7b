#include "bsp2/dataflow/evaluate/split_position.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bsp2::dataflow {

namespace {

constexpr std::size_t places = 64;

double share(std::size_t below, std::size_t above, std::size_t all) {
  return static_cast<double>(std::max(below, above)) / static_cast<double>(all);
}

/// At one of the places that lie evenly over what the stretches cover.
SplitPosition split_evenly(std::span<const Interval> stretches, double lower, double upper) {
  std::array<std::uint32_t, places> begin{}, end{};
  const double scale = places / (upper - lower);
  for (const Interval& stretch : stretches) {
    const auto first = static_cast<std::int32_t>((stretch.lower - lower) * scale);
    const double reach = (stretch.upper - lower) * scale;
    auto last = static_cast<std::int32_t>(reach);
    if (last == reach && last > 0) --last;  // one that ends at a place does not reach above it
    ++begin[static_cast<std::size_t>(std::min<std::int32_t>(first, places - 1))];
    ++end[static_cast<std::size_t>(std::min<std::int32_t>(last, places - 1))];
  }
  std::size_t below = 0, above = stretches.size(), least = stretches.size(), best = 0;
  for (std::size_t place = 1; place < places; ++place) {
    below += begin[place - 1];
    above -= end[place - 1];
    if (std::max(below, above) >= least) continue;
    least = std::max(below, above);
    best = place;
  }
  return {share(least, 0, stretches.size()), lower + static_cast<double>(best) / scale};
}

/// The end with as many ends below it as stretches, so in the middle: it is looked for only among those as
/// near as one of the places.
double median_of_ends(std::span<const Interval> stretches, double lower, double upper) {
  const double scale = places / (upper - lower);
  const auto place_of = [&](double end) {
    return static_cast<std::size_t>(
        std::min<std::int32_t>(static_cast<std::int32_t>((end - lower) * scale), places - 1));
  };
  std::array<std::size_t, places> ends{};
  for (const Interval& stretch : stretches) {
    ++ends[place_of(stretch.lower)];
    ++ends[place_of(stretch.upper)];
  }
  std::size_t place = 0, left = stretches.size();
  for (; left >= ends[place]; ++place) left -= ends[place];
  std::vector<double> near;
  near.reserve(ends[place]);
  for (const Interval& stretch : stretches)
    for (const double end : {stretch.lower, stretch.upper})
      if (place_of(end) == place) near.push_back(end);
  const auto middle = near.begin() + static_cast<std::ptrdiff_t>(left);
  std::nth_element(near.begin(), middle, near.end());
  return *middle;
}

SplitPosition split_at_median(std::span<const Interval> stretches, double lower, double upper) {
  const double middle = median_of_ends(stretches, lower, upper);
  std::size_t below = 0, above = 0;
  for (const Interval& stretch : stretches) {
    below += stretch.lower < middle ? 1 : 0;
    above += stretch.upper > middle ? 1 : 0;
  }
  return {share(below, above, stretches.size()), middle};
}

}  // namespace

SplitPosition best_split_position(std::span<const Interval> stretches) {
  constexpr std::size_t many = 64;
  constexpr double poor = 0.9;
  double lower = stretches.front().lower, upper = stretches.front().upper;
  for (const Interval& stretch : stretches) {
    lower = std::min(lower, stretch.lower);
    upper = std::max(upper, stretch.upper);
  }
  if (!(upper > lower)) return {1, lower};
  const SplitPosition parting = split_evenly(stretches, lower, upper);
  if (parting.share <= poor || stretches.size() <= many) return parting;
  const SplitPosition other = split_at_median(stretches, lower, upper);
  return other.share < parting.share ? other : parting;
}

}  // namespace bsp2::dataflow
