#pragma once

#include <TopoDS_Shape.hxx>
#include <vector>

#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::io {

/// The solids of a complex as Open CASCADE has them, one each. Solids have faces, edges and vertices of their
/// own, also where they touch; an edge of a solid has two faces.
[[nodiscard]] std::vector<TopoDS_Shape> shapes_of(const geometry::Brep& brep);

}  // namespace bsp2::io
