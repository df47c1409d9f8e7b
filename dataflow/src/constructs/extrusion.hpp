#pragma once

#include "bsp2/model/expression/expression.hpp"
#include "constructs/outline.hpp"

namespace bsp2::dataflow {

/// A twisted or tapered extrusion: side facets between `slices` turned and scaled copies of the outline, cut
/// along the shorter diagonal, as OpenSCAD 2021.01 does.
/// @param coincidence as CompileOptions have it: where it merges nothing, slices get their corners on one
/// grid, so that they fit exactly, and those that are convex but for rounding have no creases.
model::Expression extrude_outline(const model::LinearExtrusion& extrusion, const Outline& outline,
                                  double coincidence);

/// The outline turned around z. A point is inside if an odd number of the outline's edges lie farther out
/// than it at its height: so the solid is the symmetric difference of the cones (and prisms) between the
/// edges and the axis. Edges that are horizontal but for rounding are horizontal.
/// @pre no corner has a negative radius. @param start degrees from +x. @param coincidence as above.
model::Expression revolve_outline(const Outline& outline, double start, double angle, std::uint32_t segments,
                                  double coincidence);

}  // namespace bsp2::dataflow
