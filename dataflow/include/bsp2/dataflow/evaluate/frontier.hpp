#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::dataflow {

/// What is left to do in a region: the pending part of its BSP tree, in flat arrays.
///
/// Cells are not stored: a split is deterministic, so all of them come back by splitting the region's cell
/// along the tree. Shape: `nodes` in prefix order, a split before its negative and its positive subtree;
/// `programs` holds the words of the tokens one after the other, in the order of the nodes. Without nodes:
/// nothing is left. Source: the paper, section 4.2 (the FUZZY cells of a region).
struct Frontier {
  enum class Kind : std::uint8_t {
    split,  ///< value: the hyperplane's id; two subtrees follow
    token,  ///< a FUZZY cell; value: how many words its localized expression has
    held,   ///< a decided cell that is not emitted yet, since its parent may be given back whole; value: its
            ///< owner (see alike.hpp)
    emitted,   ///< a subtree whose cells have been emitted; value: its root in the recorded tree, as BspTree
               ///< has children
    elsewhere  ///< a subtree that belongs to another portion of the frontier; value: whether cells of it are
               ///< known to have been emitted. See portion.hpp
  };
  struct Node {
    Kind kind = Kind::token;
    geometry::Label label = geometry::Label::fuzzy;  ///< of a held cell
    std::uint16_t ended = 0;  ///< 1: a token that will not be cut, as it is deep, thin or small enough
    std::int32_t value = 0;
    friend bool operator==(const Node&, const Node&) = default;
  };
  std::vector<Node> nodes;
  std::vector<Word> programs;

  [[nodiscard]] bool empty() const { return nodes.empty(); }
  friend bool operator==(const Frontier&, const Frontier&) = default;
};

}  // namespace bsp2::dataflow
