#pragma once

#include <cstdint>
#include <span>

#include "surface/operand_facets.hpp"

namespace bsp2::dataflow {

/// A facet of a mesh that meets no other operand.
struct WholeFacet {
  std::uint32_t facet;
  bool reversed;  ///< the solid is on its outer side
};

/// Adds facets to a skin as they are: their corners are points of the mesh, and have names already. Those
/// that have all facets of the mesh around them are untouched.
/// @param facets different ones.
void add_whole_facets(const OperandFacets& source, std::span<const WholeFacet> facets, unsigned threads,
                      geometry::Skin& skin);

}  // namespace bsp2::dataflow
