#pragma once

#include <vector>

#include "bsp2/drawing/views/views.hpp"
#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::drawing {

/// The axis of something round, as long as that is.
struct RoundAxis {
  Point3 from{}, to{};
  double radius = 0;
};

/// The axes of cylinders, cones, spheres and holes, and of pieces of them: rows of facets whose edges are
/// parallel and on one circle, or meet in one point, around half of the axis or more. What a model calls them
/// does not matter, nor whether they are of a mesh.
std::vector<RoundAxis> round_axes(const geometry::Brep& brep, double smooth_angle);

}  // namespace bsp2::drawing
