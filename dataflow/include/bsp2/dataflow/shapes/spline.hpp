#pragma once

#include <memory>

#include "bsp2/dataflow/shapes/patch_tree.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"

namespace bsp2::dataflow {

/// A placed spline or subdivision surface (model::Spline, model::SubdivisionSurface).
template <int D>
struct Spline {
  std::shared_ptr<const PatchTree<D>> tree;  // shared: the hyperplane table has it too
  geometry::HyperplaneId first;              ///< id of the tree's hyperplane number 0

  /// A hyperplane of a patch, the patch on its negative side.
  [[nodiscard]] geometry::OrientedHyperplane plane(std::uint32_t patch, std::uint32_t index) const {
    return geometry::oriented(first + patch * tree->hyperplanes() + index);
  }
};

}  // namespace bsp2::dataflow
