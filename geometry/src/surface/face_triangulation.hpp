#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"

namespace bsp2::geometry {

/// The triangles of faces, one face after the other.
struct FaceTriangles {
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< of points, counter-clockwise seen from outside
  std::vector<std::pair<std::uint32_t, std::uint32_t>> faces;  ///< the first edge; the end of its triangles
};

/// Triangulates each face by itself, on several threads. Where edges of one face cross, points are added at
/// which to divide edges, and the triangles are not all.
/// @param edges those of each face follow each other; no vertex lies inside one.
/// @param done is told how many edges have been used, by any of the threads.
/// @throws std::logic_error if the edges of a face bound no region.
FaceTriangles triangulated_faces(ExactPoints& exact, unsigned threads, PointSet& points,
                                 std::span<const Skin::Face> faces, std::span<const Skin::Edge> edges,
                                 const std::function<void(std::size_t)>& done);

}  // namespace bsp2::geometry
