#pragma once

#include <cstdint>
#include <functional>

#include "bsp2/geometry/surface/exact_points.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"
#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {

/// Of a point of the skin: whether other pieces may have it, too.
using IsShared = std::function<bool(std::uint32_t)>;

SurfacePiece surface_piece_of(TriangulatedSkin&& skin, const IsShared& is_shared);
BrepPiece brep_piece_of(ExactPoints& exact, TriangulatedSkin&& skin, const IsShared& is_shared);

}  // namespace bsp2::geometry
