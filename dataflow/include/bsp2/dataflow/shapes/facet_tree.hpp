#pragma once

#include <array>
#include <cstdint>
#include <mutex>
#include <span>
#include <vector>

namespace bsp2::dataflow {

/// A tree over boxes of facets, halved at the median along the longest axis, to find the few that a segment
/// may cross.
class FacetTree {
 public:
  using Point = std::array<double, 3>;
  struct Box {
    Point low, high;
  };

  FacetTree() = default;
  explicit FacetTree(std::vector<Box> boxes);

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
      if (branch.end - branch.begin <= most_in_leaf) {
        for (std::uint32_t i = branch.begin; i < branch.end; ++i)
          if (!visit(order_[i])) return;
      } else {
        const std::uint32_t middle = branch.begin + (branch.end - branch.begin) / 2;
        open[count++] = {2 * branch.node + 2, middle, branch.end};
        open[count++] = {2 * branch.node + 1, branch.begin, middle};
      }
    }
  }

 private:
  /// A node, and the part of `order_` below it. Node i has the children 2 i + 1 and 2 i + 2.
  struct Branch {
    std::size_t node;
    std::uint32_t begin, end;
  };
  static constexpr std::uint32_t most_in_leaf = 4;
  static constexpr std::size_t most_open = 64;  ///< one more than the tree is deep is enough

  void build(const std::vector<Box>& boxes, std::size_t node, std::span<std::uint32_t> items);

  std::vector<Box> nodes_;
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
