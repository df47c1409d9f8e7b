#pragma once

#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::geometry {

/// Makes the shells of a complex, of which all else is there, and the solids that they bound.
void make_shells(Brep& brep);

}  // namespace bsp2::geometry
