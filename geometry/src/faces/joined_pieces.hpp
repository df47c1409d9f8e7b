#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/skin_share.hpp"

namespace bsp2::geometry {

/// A surface that was put together, and how.
struct JoinedPieces {
  TriangleSurface surface;
  std::vector<std::uint32_t> piece_of_face;         ///< of all pieces' faces, in their order
  std::vector<std::vector<std::uint32_t>> numbers;  ///< for each piece, of its points in the surface
};

JoinedPieces join(std::span<const SurfacePiece* const> pieces);

}  // namespace bsp2::geometry
