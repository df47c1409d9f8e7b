#pragma once

#include <vector>

#include "bsp2/supersteps/render/rendering.hpp"
#include "render/camera.hpp"

namespace bsp2::supersteps {

/// What of a polygon a section leaves.
/// @param cut gets the points in which the polygon's edges cross the section.
std::vector<Vector> part_of(const std::vector<Vector>& polygon, const PictureSection& section,
                            std::vector<Vector>& cut);

/// Corners of a convex polygon in a section, each at least once: counter-clockwise, seen from where nothing
/// is left.
std::vector<Vector> around(std::vector<Vector> points, const PictureSection& section);

}  // namespace bsp2::supersteps
