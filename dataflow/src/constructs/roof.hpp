#pragma once

#include "bsp2/model/expression/expression.hpp"
#include "constructs/outline.hpp"

namespace bsp2::dataflow {

/// Convex pieces that leave a roof of a prism over an outline: faces that rise at 45 degrees from its edges.
///
/// A roof is the prism over the outline without a piece above each edge, so it is as exact as any Boolean:
/// - `straight`: the roof of the straight skeleton. The piece of an edge is what lies above the edge's plane,
/// as far as the
///   plane reaches: up to the tracks of the reflex corners at its ends. A track (of a "motorcycle") ends
///   where it meets another one that was there earlier, or an edge. O((n + r) r log r) for n edges and r
///   reflex corners. Source: S. Huber, M. Held, "Theoretical and practical results on straight skeletons of
///   planar straight-line graphs", SoCG 2011 (the lower envelope of slabs); S.-W. Cheng, A. Vigneron,
///   "Motorcycle graphs and straight skeletons", 2007.
/// - `voronoi`: the height of a point is its distance from the outline. The piece of an edge is what lies
/// above its
///   distance function: two planes that end in cones, which have sides like circles of the roof's height.
/// @param height of the prism; no lower than the largest distance of a point inside from the outline.
/// @throws bsp2::Error for too many sides of the cones.
std::vector<model::Expression> pieces_above_roof(const model::Roof& roof, const Outline& outline,
                                                 double height);

}  // namespace bsp2::dataflow
