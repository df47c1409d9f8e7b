#include "bsp2/dataflow/shapes/facet_tree.hpp"

#include <algorithm>
#include <numeric>

namespace bsp2::dataflow {

FacetTree::FacetTree(std::vector<Box> boxes) : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!order_.empty()) build(boxes, 0, order_);
}

void FacetTree::build(const std::vector<Box>& boxes, std::size_t node,
                      std::span<std::uint32_t> items) {  // depth: log2 of the number of boxes
  if (node >= nodes_.size()) nodes_.resize(node + 1);
  Box all = boxes[items[0]];
  for (const std::uint32_t i : items)
    for (std::size_t k = 0; k < 3; ++k) {
      all.low[k] = std::min(all.low[k], boxes[i].low[k]);
      all.high[k] = std::max(all.high[k], boxes[i].high[k]);
    }
  nodes_[node] = all;
  if (items.size() <= most_in_leaf) return;
  std::size_t axis = 0;
  for (std::size_t k = 1; k < 3; ++k)
    if (all.high[k] - all.low[k] > all.high[axis] - all.low[axis]) axis = k;
  const std::size_t half = items.size() / 2;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(),
                   [&](std::uint32_t a, std::uint32_t b) {
                     return boxes[a].low[axis] + boxes[a].high[axis] <
                            boxes[b].low[axis] + boxes[b].high[axis];
                   });
  build(boxes, 2 * node + 1, items.first(half));
  build(boxes, 2 * node + 2, items.subspan(half));
}

}  // namespace bsp2::dataflow
