#pragma once

#include <TopoDS_Solid.hxx>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"
#include "bsp2/geometry/surface/round_solid.hpp"

namespace bsp2::io {

/// Round solids as Open CASCADE has them, and what they take the place of.
struct RoundShapes {
  std::vector<std::pair<std::int32_t, TopoDS_Solid>> solids;  ///< by part, with true surfaces
  std::vector<bool> others;  ///< of each solid of the complex: whether it is none of these
};

/// What is so small that Open CASCADE takes some of it for a point keeps its faces.
[[nodiscard]] RoundShapes round_shapes(const geometry::Brep& brep,
                                       std::span<const geometry::RoundSolid> rounds);

}  // namespace bsp2::io
