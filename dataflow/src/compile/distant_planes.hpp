#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::dataflow {

/// Solids of fewer facets are cut as they are.
inline constexpr std::size_t facets_to_part = 64;

/// A solid in the model, and the hyperplanes that represent its facets since `merge`.
template <int D>
struct PlacedPlanes {
  const Box<D>* box;
  std::uint32_t map, first_covector;  ///< in the table
  std::span<geometry::OrientedHyperplane> planes;
  bool is_convex;
};

/// Takes merging back for convex solids of many facets, of which a few are represented by hyperplanes that
/// are not quite theirs, and that no other solid near them has.
///
/// There is nothing to simplify between solids that are not near each other, as balls on a grid, whose facets
/// are in one plane here and there but for the last bits. And a solid all of whose hyperplanes are its own is
/// its shape at another place, so what is known of the shape is known of the solid (PolytopeFacets).
/// @param tolerance of merging, a length: solids are near each other if their boxes are no farther apart.
template <int D>
void part_distant_planes(geometry::HyperplaneTable<D>& table, std::span<const PlacedPlanes<D>> solids,
                         double tolerance, unsigned threads);

}  // namespace bsp2::dataflow
