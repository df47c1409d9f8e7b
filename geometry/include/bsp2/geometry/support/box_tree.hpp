#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <iterator>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/curve_order.hpp"

namespace bsp2::geometry {

struct Box3 {
  std::array<double, 3> low, high;
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
    for (std::size_t k = 0; k < 3; ++k)
      low[k] = std::min(low[k], other.low[k]), high[k] = std::max(high[k], other.high[k]);
  }
};

/// A tree over boxes in the order of a curve that fills space. Node i has the children 2 i + 1 and 2 i + 2.
class BoxTree {
 public:
  /// A node and the boxes below it.
  struct Branch {
    std::size_t node;
    std::span<const std::uint32_t> items;
    [[nodiscard]] bool is_leaf() const { return items.size() <= most_in_leaf; }
    [[nodiscard]] std::array<Branch, 2> halves() const {
      const std::size_t half = items.size() / 2;
      return {{{2 * node + 1, items.first(half)}, {2 * node + 2, items.subspan(half)}}};
    }
  };

  static constexpr std::size_t most_in_leaf = 4;

  explicit BoxTree(std::vector<Box3> boxes) : boxes_(std::move(boxes)) {
    if (boxes_.empty()) return;
    order_ = curve_order(boxes_.size(), [&](std::uint32_t i) {
      std::array<double, 3> middle;
      for (std::size_t k = 0; k < 3; ++k) middle[k] = boxes_[i].low[k] / 2 + boxes_[i].high[k] / 2;
      return middle;
    });
    nodes_.resize(2 * std::bit_ceil((boxes_.size() + most_in_leaf - 1) / most_in_leaf));
    build({0, order_});
  }

  [[nodiscard]] const Box3& operator[](std::uint32_t box) const { return boxes_[box]; }

  /// Calls visit(i) for the boxes that meet this one until it answers true. @return whether it did.
  template <typename Visit>
  bool visit_meeting(const Box3& box, Visit&& visit) const {
    std::vector<Branch> open{{0, order_}};
    while (!open.empty()) {
      const Branch branch = open.back();
      open.pop_back();
      if (branch.items.empty() || !nodes_[branch.node].meets(box)) continue;
      if (branch.is_leaf()) {
        for (const std::uint32_t i : branch.items)
          if (boxes_[i].meets(box) && visit(i)) return true;
      } else {
        std::ranges::copy(branch.halves(), std::back_inserter(open));
      }
    }
    return false;
  }

  /// Parts of the tree that have all boxes together: at least so many, unless all of them are leaves.
  [[nodiscard]] std::vector<Branch> branches(std::size_t least) const {
    std::vector<Branch> all;
    if (!order_.empty()) all.push_back({0, order_});
    while (all.size() < least && !std::ranges::all_of(all, &Branch::is_leaf)) {
      std::vector<Branch> next;
      for (const Branch& branch : all) {
        if (branch.is_leaf())
          next.push_back(branch);
        else
          std::ranges::copy(branch.halves(), std::back_inserter(next));
      }
      all = std::move(next);
    }
    return all;
  }

  /// Calls visit(i, j) for each pair of boxes that meet, one of branch k and the other one of it, too, or of
  /// a later branch, until it answers true. @return whether it did.
  template <typename Visit>
  bool visit_meeting_pairs(std::span<const Branch> branches, std::size_t k, Visit&& visit) const {
    std::vector<std::pair<Branch, Branch>> open;
    for (std::size_t j = k; j < branches.size(); ++j) open.emplace_back(branches[k], branches[j]);
    while (!open.empty()) {
      const auto [one, other] = open.back();
      open.pop_back();
      const bool same = one.node == other.node;
      if (!same && !nodes_[one.node].meets(nodes_[other.node])) continue;
      if (one.is_leaf() && other.is_leaf()) {
        for (std::size_t i = 0; i < one.items.size(); ++i)
          for (std::size_t j = same ? i + 1 : 0; j < other.items.size(); ++j)
            if (boxes_[one.items[i]].meets(boxes_[other.items[j]]) && visit(one.items[i], other.items[j]))
              return true;
      } else if (same) {
        const auto [a, b] = one.halves();
        open.insert(open.end(), {{a, a}, {a, b}, {b, b}});
      } else {
        const bool first = one.items.size() >= other.items.size();  // and so no leaf
        for (const Branch& half : (first ? one : other).halves())
          open.emplace_back(half, first ? other : one);
      }
    }
    return false;
  }

 private:
  const Box3& build(const Branch& branch) {  // depth: log2 of the number of boxes
    Box3 all;
    if (branch.is_leaf()) {
      all = boxes_[branch.items[0]];
      for (const std::uint32_t i : branch.items) all.unite(boxes_[i]);
    } else {
      const auto [low, high] = branch.halves();
      all = build(low);
      all.unite(build(high));
    }
    return nodes_[branch.node] = all;
  }

  std::vector<Box3> boxes_, nodes_;
  std::vector<std::uint32_t> order_;
};

}  // namespace bsp2::geometry
