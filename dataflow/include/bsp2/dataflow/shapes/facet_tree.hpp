#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace bsp2::dataflow {

/// A tree over boxes of facets, in the order of a space-filling curve, to find the few that a segment may
/// cross, or those that may meet.
class FacetTree {
 public:
  using Point = std::array<double, 3>;
  struct Box {
    Point low, high;
  };

  FacetTree() = default;
  explicit FacetTree(const std::vector<Box>& boxes);

  /// Calls visit(facet) for the facets in no branch whose box `misses` says true of, until it answers false.
  /// @param misses of a box; what it says of a box holds for all boxes within.
  template <typename Misses, typename Visit>
  void visit(Misses&& misses, Visit&& visit) const {
    if (order_.empty()) return;
    std::array<Branch, most_open> open;
    std::size_t count = 0;
    open[count++] = {0, 0, static_cast<std::uint32_t>(order_.size())};
    while (count > 0) {
      const Branch branch = open[--count];
      if (misses(nodes_[branch.node])) continue;
      if (branch.is_leaf()) {
        for (std::uint32_t i = branch.begin; i < branch.end; ++i)
          if (!visit(order_[i])) return;
      } else {
        for (const Branch& half : branch.halves()) open[count++] = half;
      }
    }
  }

  /// Calls visit(a, b) for each two facets whose boxes are not farther apart than `gap` along any axis, until
  /// it answers false.
  template <typename Visit>
  void visit_pairs(double gap, Visit&& visit) const {
    if (order_.empty()) return;
    std::vector<std::array<Branch, 2>> open;
    const Branch root{0, 0, static_cast<std::uint32_t>(order_.size())};
    open.push_back({root, root});
    while (!open.empty()) {
      const auto [a, b] = open.back();
      open.pop_back();
      const bool same = a.node == b.node;
      if (!same && are_apart(nodes_[a.node], nodes_[b.node], gap)) continue;
      if (a.is_leaf() && b.is_leaf()) {
        for (std::uint32_t i = a.begin; i < a.end; ++i)
          for (std::uint32_t k = same ? i + 1 : b.begin; k < b.end; ++k)
            if (!are_apart(leaves_[i], leaves_[k], gap) && !visit(order_[i], order_[k])) return;
        continue;
      }
      if (same) {
        const auto [low, high] = a.halves();
        open.push_back({low, low});
        open.push_back({high, high});
        open.push_back({low, high});
        continue;
      }
      const bool divides_a = b.is_leaf() || (!a.is_leaf() && a.end - a.begin >= b.end - b.begin);
      for (const Branch& half : (divides_a ? a : b).halves())
        open.push_back({divides_a ? half : a, divides_a ? b : half});
    }
  }

 private:
  /// A node, and the part of `order_` below it. Node i has the children 2 i + 1 and 2 i + 2.
  struct Branch {
    std::size_t node;
    std::uint32_t begin, end;
    [[nodiscard]] bool is_leaf() const { return end - begin <= most_in_leaf; }
    [[nodiscard]] std::array<Branch, 2> halves() const {
      const std::uint32_t middle = begin + (end - begin) / 2;
      return {Branch{2 * node + 1, begin, middle}, Branch{2 * node + 2, middle, end}};
    }
  };
  static constexpr std::uint32_t most_in_leaf = 4;
  static constexpr std::size_t most_open = 64;  ///< one more than the tree is deep is enough

  static bool are_apart(const Box& a, const Box& b, double gap) {
    for (std::size_t k = 0; k < 3; ++k)
      if (a.low[k] > b.high[k] + gap || b.low[k] > a.high[k] + gap) return true;
    return false;
  }
  Box build(const Branch& branch);

  std::vector<Box> nodes_, leaves_;  // leaves_: the facets' own, in the order of order_
  std::vector<std::uint32_t> order_;
};

/// A tree that is built when it is first asked for, by whichever thread does so: most meshes never need one.
class LazyFacetTree {
 public:
  template <typename MakeBoxes>
  const FacetTree& get(MakeBoxes&& make_boxes) const {
    std::call_once(once_, [&] { tree_ = FacetTree(make_boxes()); });
    return tree_;
  }

 private:
  mutable std::once_flag once_;
  mutable FacetTree tree_;
};

}  // namespace bsp2::dataflow
