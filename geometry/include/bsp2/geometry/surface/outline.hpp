#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace bsp2::geometry {

/// The boundary of one part of a plane solid: closed paths with the part on their left, outer ones
/// counter-clockwise, holes clockwise. They may touch themselves and each other in points, never cross.
struct PartOutline {
  std::int32_t part = 0;
  std::vector<std::vector<std::array<double, 2>>> paths;  ///< rounded corners; model units
};

}  // namespace bsp2::geometry
