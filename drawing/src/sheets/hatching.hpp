#pragma once

#include <array>
#include <vector>

#include "bsp2/drawing/views/views.hpp"

namespace bsp2::drawing {

/// Lines of 45 degrees, or 135, over what lies within an odd number of loops; on the sheet, in millimetres.
///
/// They lie on one grid of the sheet, so areas of one part are hatched alike wherever they are.
/// @param number of the part: direction and distance of the lines tell neighbours apart.
std::vector<std::array<Point2, 2>> hatching(const std::vector<std::vector<Point2>>& loops,
                                            std::size_t number);

}  // namespace bsp2::drawing
