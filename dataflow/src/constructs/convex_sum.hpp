#pragma once

#include "operands/nested.hpp"

namespace bsp2::dataflow {

/// Sums of a corner of one convex polytope and one of another, all corners of the sum of both among them.
///
/// Of large polyhedra in space those are left out that are surely no corners. Where p + q is a corner, some
/// direction has p and q as its farthest points: so if there is an edge from p along which all directions go
/// that have q farthest, it is none. Corners with their directions are points and regions on a sphere, the
/// Gauss map.
/// @param a the corners, D coordinates each; other points in the polytope do no harm.
Points sums_of_corners(int dimension, const Points& a, const Points& b);

}  // namespace bsp2::dataflow
