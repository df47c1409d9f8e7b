#include "bsp2/dataflow/shapes/facet_tree.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "bsp2/geometry/support/curve_order.hpp"

namespace bsp2::dataflow {

FacetTree::FacetTree(const std::vector<Box>& boxes) {
  if (boxes.empty()) return;
  order_ = geometry::curve_order(boxes.size(), [&](std::uint32_t i) {
    Point middle;
    for (std::size_t k = 0; k < 3; ++k) middle[k] = boxes[i].low[k] / 2 + boxes[i].high[k] / 2;
    return middle;
  });
  nodes_.resize(2 * std::bit_ceil((boxes.size() + most_in_leaf - 1) / most_in_leaf));
  build({0, 0, static_cast<std::uint32_t>(order_.size())}, boxes);
  for (std::size_t k = 0; k < 3; ++k) {
    middle_[k] = nodes_[0].low[k] / 2 + nodes_[0].high[k] / 2;
    slack_ = std::max({slack_, -0x1p-50 * nodes_[0].low[k], 0x1p-50 * nodes_[0].high[k]});
  }
  leaves_.reserve(boxes.size());
  for (const std::uint32_t i : order_) leaves_.push_back(bounds_of(boxes[i]));
}

/// Depth: log2 of the number of boxes.
FacetTree::Box FacetTree::build(const Branch& branch, const std::vector<Box>& boxes) {
  Box all;
  const auto add = [&](const Box& box) {
    for (std::size_t k = 0; k < 3; ++k) {
      all.low[k] = std::min(all.low[k], box.low[k]);
      all.high[k] = std::max(all.high[k], box.high[k]);
    }
  };
  if (branch.is_leaf()) {
    all = boxes[order_[branch.begin]];
    for (std::uint32_t i = branch.begin + 1; i < branch.end; ++i) add(boxes[order_[i]]);
  } else {
    const auto [low, high] = branch.halves();
    all = build(low, boxes);
    add(build(high, boxes));
  }
  return nodes_[branch.node] = all;
}

/// Little more than the number.
float FacetTree::rounded_up(double x) {
  constexpr float most = std::numeric_limits<float>::max();
  const double above = x + 0x1p-22 * std::fabs(x) + 0x1p-126;
  if (above > most) return std::numeric_limits<float>::infinity();
  return above < -most ? -most : static_cast<float>(above);
}

FacetTree::Bounds FacetTree::bounds_of(const Box& box) const {
  Bounds bounds{};
  for (std::size_t k = 0; k < 3; ++k) {
    bounds.low[k] = -rounded_up(middle_[k] - box.low[k] + slack_);
    bounds.opposite_high[k] = -rounded_up(box.high[k] - middle_[k] + slack_);
  }
  return bounds;
}

auto FacetTree::bounds_of_nodes() const -> std::vector<Bounds> {
  std::vector<Bounds> bounds;
  bounds.reserve(nodes_.size());
  for (const Box& box : nodes_) bounds.push_back(bounds_of(box));
  return bounds;
}

}  // namespace bsp2::dataflow
