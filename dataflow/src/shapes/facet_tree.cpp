#include "bsp2/dataflow/shapes/facet_tree.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

namespace bsp2::dataflow {

namespace {

constexpr unsigned bits = 10;  // an axis

/// Two zeros between each two of the lowest bits.
std::uint32_t spread(std::uint32_t x) {
  x = (x | x << 16) & 0x030000ff;
  x = (x | x << 8) & 0x0300f00f;
  x = (x | x << 4) & 0x030c30c3;
  return (x | x << 2) & 0x09249249;
}

/// The places of the boxes' middles along a curve that fills space (Morton, 1966).
std::vector<std::uint32_t> places_of(const std::vector<FacetTree::Box>& boxes) {
  FacetTree::Box all = boxes[0];
  for (const auto& box : boxes)
    for (std::size_t k = 0; k < 3; ++k) {
      all.low[k] = std::min(all.low[k], box.low[k]);
      all.high[k] = std::max(all.high[k], box.high[k]);
    }
  double extent = 0;
  for (std::size_t k = 0; k < 3; ++k) extent = std::max(extent, all.high[k] - all.low[k]);
  const double scale = extent > 0 ? ((1U << bits) - 1) / extent : 0;
  std::vector<std::uint32_t> places;
  places.reserve(boxes.size());
  for (const auto& box : boxes) {
    std::uint32_t place = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double middle = (box.low[k] - all.low[k] + (box.high[k] - all.low[k])) / 2;
      place |= spread(static_cast<std::uint32_t>(middle * scale)) << k;
    }
    places.push_back(place);
  }
  return places;
}

/// Sorted by their places: digit by digit.
std::vector<std::uint32_t> order_of(const std::vector<std::uint32_t>& places) {
  constexpr unsigned digit = 10;
  std::vector<std::uint32_t> order(places.size()), sorted(places.size());
  std::iota(order.begin(), order.end(), 0U);
  for (unsigned shift = 0; shift < 3 * bits; shift += digit) {
    std::array<std::uint32_t, (1U << digit) + 1> begin{};
    const auto digit_of = [&](std::uint32_t i) { return places[i] >> shift & ((1U << digit) - 1); };
    for (const std::uint32_t i : order) ++begin[digit_of(i) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    for (const std::uint32_t i : order) sorted[begin[digit_of(i)]++] = i;
    order.swap(sorted);
  }
  return order;
}

}  // namespace

FacetTree::FacetTree(const std::vector<Box>& boxes) {
  if (boxes.empty()) return;
  order_ = order_of(places_of(boxes));
  leaves_.reserve(boxes.size());
  for (const std::uint32_t i : order_) leaves_.push_back(boxes[i]);
  nodes_.resize(2 * std::bit_ceil(boxes.size()));
  build({0, 0, static_cast<std::uint32_t>(order_.size())});
}

FacetTree::Box FacetTree::build(const Branch& branch) {  // depth: log2 of the number of boxes
  Box all;
  const auto add = [&](const Box& box) {
    for (std::size_t k = 0; k < 3; ++k) {
      all.low[k] = std::min(all.low[k], box.low[k]);
      all.high[k] = std::max(all.high[k], box.high[k]);
    }
  };
  if (branch.is_leaf()) {
    all = leaves_[branch.begin];
    for (std::uint32_t i = branch.begin + 1; i < branch.end; ++i) add(leaves_[i]);
  } else {
    const auto [low, high] = branch.halves();
    all = build(low);
    add(build(high));
  }
  return nodes_[branch.node] = all;
}

}  // namespace bsp2::dataflow
