#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "predicates.hpp"

namespace bsp2::model {

struct Box3 {
  Point3 low, high;
  [[nodiscard]] bool meets(const Box3& other) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (low[k] > other.high[k] || other.low[k] > high[k]) return false;
    return true;
  }
  [[nodiscard]] bool contains(const Box3& other) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (other.low[k] < low[k] || other.high[k] > high[k]) return false;
    return true;
  }
  void unite(const Box3& other) {
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], other.low[k]), high[k] = std::max(high[k], other.high[k]);
  }
};

/// A tree over boxes, halved at the median along the longest axis. Node i has the children 2 i + 1 and 2 i + 2.
class BoxTree {
 public:
  explicit BoxTree(std::vector<Box3> boxes) : boxes_(std::move(boxes)), order_(boxes_.size()) {
    std::iota(order_.begin(), order_.end(), 0u);
    if (!boxes_.empty()) build(0, order_);
  }

  [[nodiscard]] const Box3& operator[](std::uint32_t box) const { return boxes_[box]; }

  /// Calls visit(i) for the boxes that meet this one until it answers true. @return whether it did.
  template <typename Visit>
  bool visit_meeting(const Box3& box, Visit&& visit) const {
    std::vector<std::pair<std::size_t, std::span<const std::uint32_t>>> open{{0, order_}};
    while (!open.empty()) {
      const auto [node, items] = open.back();
      open.pop_back();
      if (items.empty() || !nodes_[node].meets(box)) continue;
      if (items.size() <= leaf) {
        for (const std::uint32_t i : items)
          if (boxes_[i].meets(box) && visit(i)) return true;
        continue;
      }
      open.emplace_back(2 * node + 1, items.first(items.size() / 2));
      open.emplace_back(2 * node + 2, items.subspan(items.size() / 2));
    }
    return false;
  }

 private:
  static constexpr std::size_t leaf = 4;

  void build(std::size_t node, std::span<std::uint32_t> items) {  // depth: log2 of the number of boxes
    if (node >= nodes_.size()) nodes_.resize(node + 1);
    Box3 all = boxes_[items[0]];
    for (const std::uint32_t i : items) all.unite(boxes_[i]);
    nodes_[node] = all;
    if (items.size() <= leaf) return;
    std::size_t axis = 0;
    for (std::size_t k = 1; k < 3; ++k)
      if (all.high[k] - all.low[k] > all.high[axis] - all.low[axis]) axis = k;
    const std::size_t half = items.size() / 2;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(half), items.end(), [&](std::uint32_t a, std::uint32_t b) {
      return boxes_[a].low[axis] + boxes_[a].high[axis] < boxes_[b].low[axis] + boxes_[b].high[axis];
    });
    build(2 * node + 1, items.first(half));
    build(2 * node + 2, items.subspan(half));
  }

  std::vector<Box3> boxes_, nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace bsp2::model
