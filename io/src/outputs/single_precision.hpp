#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"

namespace bsp2::io {

/// A surface whose corners are what single precision can hold, and which is as closed as the one it was made
/// of: told by the coordinates alone, as every reader of a file must.
struct SingleSurface {
  std::vector<std::array<float, 3>> points;             ///< all different
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of points; none is without area
  std::vector<std::int32_t> owner;                      ///< one a triangle: the part of the solid behind it
};

/// Rounds the corners of a surface to single precision.
///
/// Corners that become one are one: triangles with two such corners are gone, and their other two sides run
/// along each other in opposite directions. A triangle of which the corners come to lie on one line is gone,
/// too: its neighbour at the longest side takes in the third corner. Triangles that come to lie on each other
/// with opposite sides cancel. So each edge of the result is used equally often in both directions if that is
/// so in the surface; the volume inside is that of the rounded corners. All this is decided exactly.
/// @pre no coordinate is beyond the largest float.
SingleSurface rounded_to_single(const geometry::TriangleSurface& surface);

/// What the rounding does to the connected parts of a surface; parts of the solid that touch are several
/// where each is closed by itself.
struct SingleLoss {
  std::size_t parts = 0,
              changed = 0;  ///< all, and those whose volume or size changes by more than a hundred-thousandth
  // Of the one that changes most:
  std::array<double, 3> lower{}, upper{};
  double volume = 0, rounded_volume = 0;
  double moved = 0;  ///< by how much a coordinate of its corners moves, at most
};

SingleLoss loss_in_single(const geometry::TriangleSurface& surface);

}  // namespace bsp2::io
