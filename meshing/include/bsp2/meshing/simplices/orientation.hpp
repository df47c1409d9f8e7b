#pragma once

#include <array>

namespace bsp2::meshing {

/// Sign of the volume of the tetrahedron a b c d of doubles as they are: 1 if a b c turns counter-clockwise
/// seen from the side that d is not on (so that (b-a) x (c-a) points to d), 0 if the four lie in one plane.
/// Exact: by doubles where these tell for sure, else by integers.
int orientation(const std::array<double, 3>& a, const std::array<double, 3>& b,
                const std::array<double, 3>& c, const std::array<double, 3>& d);

}  // namespace bsp2::meshing
