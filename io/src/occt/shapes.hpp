#pragma once

#include <TopoDS_Solid.hxx>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::io {

/// The solids of a complex as Open CASCADE has them. They have faces, edges and vertices of their own, also
/// where they touch; an edge of a solid has two faces.
struct Shapes {
  std::vector<TopoDS_Solid> solids;  ///< one for each of the complex; none in the place of a thin one
  std::uint64_t short_edges = 0;     ///< that are points
  std::uint64_t thin_solids = 0;     ///< of which nothing is left then
};

/// Edges that Open CASCADE takes for points are points: their ends are one vertex, and faces that become
/// lines go, as one between an outline and a hole that is as large.
/// @param wanted which solids are to be made; none is in the place of the others.
/// @param is_over asked before each face; once it says so, what follows is not made.
[[nodiscard]] Shapes shapes_of(const geometry::Brep& brep, const std::vector<bool>& wanted,
                               bool (*is_over)());

}  // namespace bsp2::io
