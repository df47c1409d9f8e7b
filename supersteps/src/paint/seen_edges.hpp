#pragma once

#include "paint/lighting.hpp"
#include "render/polygons.hpp"

namespace bsp2::supersteps {

/// The edges of the solid in a drawing, as far as they are seen: its lines are made of its polygons.
///
/// A line is where two facets are seen side by side between which Lighting::is_edge wants one. There the
/// nearer of them ends, which is drawn after the other: so of each polygon's sides those pieces are lines
/// before which nothing was drawn later, and beyond which something was drawn earlier, or nothing. Clear
/// polygons neither have lines nor hide any. Pieces that follow each other are one line. @pre `facets` of all
/// polygons; they are convex.
void add_seen_edges(Polygons& all, const Lighting& lighting, int width, int height);

}  // namespace bsp2::supersteps
