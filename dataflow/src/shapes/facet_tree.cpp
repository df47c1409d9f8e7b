#include "bsp2/dataflow/shapes/facet_tree.hpp"

#include <algorithm>
#include <bit>

#include "bsp2/geometry/support/curve_order.hpp"

namespace bsp2::dataflow {

FacetTree::FacetTree(const std::vector<Box>& boxes) {
  if (boxes.empty()) return;
  order_ = geometry::curve_order(boxes.size(), [&](std::uint32_t i) {
    Point middle;
    for (std::size_t k = 0; k < 3; ++k) middle[k] = boxes[i].low[k] / 2 + boxes[i].high[k] / 2;
    return middle;
  });
  leaves_.reserve(boxes.size());
  for (const std::uint32_t i : order_) leaves_.push_back(boxes[i]);
  nodes_.resize(2 * std::bit_ceil((boxes.size() + most_in_leaf - 1) / most_in_leaf));
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
