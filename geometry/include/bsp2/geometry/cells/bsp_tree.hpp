#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// A binary space partition: inner nodes are hyperplanes, leaves are cells of a solid mesh or empty space.
///
/// A child >= 0 is the index of a node; a child < 0 is the leaf ~child. Leaf 0 is space that no mesh cell
/// fills, leaf k >= 1 is cell k - 1 of the mesh, counted through its batches. Source: the paper, section 3.1.
struct BspTree {
  struct Node {
    std::uint32_t hyperplane;  ///< index into hyperplanes
    std::int32_t negative, positive;
  };
  static constexpr std::int32_t empty_leaf = ~0;

  int dimension = 3;
  std::int32_t root = empty_leaf;
  std::vector<Node> nodes;
  std::vector<HyperplaneId> ids;  ///< of the hyperplanes in the model's table, where there is one
  std::vector<double>
      hyperplanes;  ///< D + 1 rounded coefficients each, constant first, the normal of unit length

  /// Appends the nodes of another tree, whose children are numbered as those of this one already.
  void append(const BspTree& more);
  /// Signed distance (rounded) of a point from a hyperplane; negative on the negative side.
  [[nodiscard]] double distance(std::uint32_t hyperplane, std::span<const double> point) const;
  /// The leaf that holds the point; on a hyperplane, the negative side. By the rounded hyperplanes: a point
  /// within rounding of one may be found in the leaf across it.
  [[nodiscard]] std::int32_t locate(std::span<const double> point) const;
  /// The leaf that holds the point, exactly, by the hyperplanes of the table that `ids` name.
  template <int D>
  [[nodiscard]] std::int32_t locate(const HyperplaneTable<D>& table,
                                    const std::array<double, D>& point) const {
    std::int32_t at = root;
    while (at >= 0) {
      const Node& node = nodes[at];
      at = table.side(point, ids[node.hyperplane]) <= 0 ? node.negative : node.positive;
    }
    return ~at;
  }
  /// Visits all leaves but leaf 0 from the farthest to the nearest, seen from `eye` (or, with `parallel`,
  /// looking along the direction `eye`): no leaf hides a later one.
  void visit_back_to_front(std::span<const double> eye, bool parallel,
                           const std::function<void(std::int32_t leaf)>& visit) const {
    visit_back_to_front(root, eye, parallel, visit);
  }
  /// Visits the leaves below `from`, a node or a leaf, from the farthest to the nearest.
  void visit_back_to_front(std::int32_t from, std::span<const double> eye, bool parallel,
                           const std::function<void(std::int32_t leaf)>& visit) const;
};

}  // namespace bsp2::geometry
