#pragma once

#include <utility>
#include <vector>

#include "outputs/single_precision.hpp"
#include "surfaces/edges.hpp"

namespace bsp2::io {

/// Two triangles whose planes meet in a larger angle meet in a sharp edge.
inline constexpr double sharp_angle = 30;  // degrees

/// A surface for viewers: its points once for each direction in which they look.
struct ShadedSurface {
  std::vector<std::uint32_t> point;                       ///< of each vertex
  std::vector<SinglePoint3> normal;                       ///< of each vertex; of length 1
  std::vector<CornerIndices> triangles;                   ///< indices of vertices
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;  ///< indices of points
};

/// Normals are means of those around a point, as far as no sharp edge is between.
ShadedSurface shaded(const SingleSurface& surface);

}  // namespace bsp2::io
