#pragma once

#include <array>
#include <utility>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::dataflow {

/// The model's own hyperplanes across axes, to be taken in the place of cuts of the same direction that
/// nearly coincide with them: between two that do lie cells that are too thin for the corners of a mesh to
/// decide, and that the solid does not have.
///
/// Holds 16 bytes a hyperplane across an axis. Once made, any number of threads may read it.
template <int D>
class AxialPlanes {
 public:
  AxialPlanes() = default;
  /// @param coincidence as CompileOptions have it.
  AxialPlanes(const geometry::HyperplaneTable<D>& table, double coincidence);

  /// The cut at a position of the table's grid, or the model's hyperplane nearest to it that is within the
  /// tolerance or little more than a step of the grid.
  [[nodiscard]] geometry::HyperplaneId cut(const geometry::HyperplaneTable<D>& table, int axis,
                                           std::uint32_t position) const;

 private:
  std::array<double, D> reach_{};
  std::array<std::vector<std::pair<double, geometry::HyperplaneId>>, D> planes_;  // where, in order
};

}  // namespace bsp2::dataflow
