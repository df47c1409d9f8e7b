#pragma once

#include <array>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// The weights of the corners in the point of a triangle that is nearest to a place.
std::array<double, 3> nearest_weights(const std::array<Point, 3>& corner, const Point& place);

inline Point point_at(const std::array<Point, 3>& corner, const std::array<double, 3>& weight) {
  Point point{};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis) point[axis] += weight[k] * corner[k][axis];
  return point;
}

}  // namespace bsp2::meshing
