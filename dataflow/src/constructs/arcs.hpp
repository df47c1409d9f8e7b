#pragma once

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/outline.hpp"
#include "constructs/circle_skins.hpp"
#include "constructs/outline_tracer.hpp"

namespace bsp2::dataflow {

/// Adds the paths of a part to its outline, with arcs in the place of the polygons within the skins of
/// circles, where that is certain.
///
/// A path is divided into lines, beyond which there is nothing, pieces in the skin of one circle, and what
/// lies between them, where several things are undecided. A piece of a circle becomes an arc. It ends where
/// its circle meets the line or circle of the next piece, if it bounds the solid as far as there
/// (CircleSkins::bounds), and the other one does: of a line nothing is undecided. Elsewhere the polygon
/// stays, and the arc ends beside it. So the area within the path is that of the true solid, but for
/// polygons.
void add_arcs(const Network<2>& network, const CircleSkins& skins, OutlineTracer& tracer,
              geometry::PartOutline& outline);

}  // namespace bsp2::dataflow
