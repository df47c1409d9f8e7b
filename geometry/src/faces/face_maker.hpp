#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/geometry/surface/exact_points.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"
#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {

/// A connected face at one of its edges, which it is on the left of.
struct BoundOfFace {
  std::uint32_t from, to;  ///< points of the skin
  std::uint32_t apex;      ///< the third corner of the triangle beside it
  std::uint32_t face;      ///< of the skin, all of its plane
};

/// Finds the connected faces of a skin and their loops: fills in what `piece` has of them, but edges. Nothing
/// depends on how points or faces are numbered, but on their order.
///
/// What of a plane's skin is connected, its triangles tell: they have their sides in common, or on an edge.
/// @return the bounds of all faces, loop by loop.
std::vector<BoundOfFace> make_faces(ExactPoints& exact, const TriangulatedSkin& skin, BrepPiece& piece);

}  // namespace bsp2::geometry
