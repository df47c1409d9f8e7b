#pragma once

#include <array>
#include <bit>
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
  /// it answers false. It may be called for some whose boxes are a little farther apart.
  template <typename Visit>
  void visit_pairs(double gap, Visit&& visit) const {
    if (order_.empty()) return;
    const float rounded = rounded_up(gap);
    const Pairs<Visit> pairs{*this, bounds_of_nodes(), {rounded, rounded, rounded, rounded}, visit};
    pairs.within({0, 0, static_cast<std::uint32_t>(order_.size())});
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

  using Four [[gnu::vector_size(16)]] = float;
  /// A box from the middle of all of them, rounded outward, its upper ends with the opposite sign: so two are
  /// held against each other in a few steps without a branch. The last of four is 0.
  struct Bounds {
    Four low, opposite_high;
    /// Whether two are farther apart than a gap along an axis.
    [[nodiscard]] bool misses(const Bounds& other, const Four& gap) const {
      const auto apart = (low + other.opposite_high > gap) | (other.low + opposite_high > gap);
      return std::bit_cast<std::array<std::uint64_t, 2>>(apart) != std::array<std::uint64_t, 2>{};
    }
  };

  template <typename Visit>
  struct Pairs {
    const FacetTree& tree;
    std::vector<Bounds> nodes;
    Four gap;
    Visit& visit;

    /// @return whether to go on. Depth: twice that of the tree.
    bool within(const Branch& branch) const {
      if (branch.is_leaf()) {
        for (std::uint32_t i = branch.begin; i < branch.end; ++i)
          if (!visit_those_at(i, i + 1, branch.end)) return false;
        return true;
      }
      const auto [low, high] = branch.halves();
      return within(low) && within(high) && between(low, high);
    }
    bool between(const Branch& a, const Branch& b) const {
      if (nodes[a.node].misses(nodes[b.node], gap)) return true;
      if (a.is_leaf() && b.is_leaf()) {
        for (std::uint32_t i = a.begin; i < a.end; ++i)
          if (!visit_those_at(i, b.begin, b.end)) return false;
        return true;
      }
      const bool divides_a = b.is_leaf() || (!a.is_leaf() && a.end - a.begin >= b.end - b.begin);
      const auto [low, high] = (divides_a ? a : b).halves();
      return divides_a ? between(low, b) && between(high, b) : between(a, low) && between(a, high);
    }
    bool visit_those_at(std::uint32_t i, std::uint32_t begin, std::uint32_t end) const {
      for (std::uint32_t k = begin; k < end; ++k)
        if (!tree.leaves_[i].misses(tree.leaves_[k], gap) && !visit(tree.order_[i], tree.order_[k]))
          return false;
      return true;
    }
  };

  Box build(const Branch& branch, const std::vector<Box>& boxes);
  [[nodiscard]] Bounds bounds_of(const Box& box) const;
  [[nodiscard]] std::vector<Bounds> bounds_of_nodes() const;
  static float rounded_up(double x);

  std::vector<Box> nodes_;
  Point middle_{};              // of all boxes
  double slack_ = 0;            // more than a difference to it is rounded by
  std::vector<Bounds> leaves_;  // the facets' own, in the order of order_
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
