#pragma once

#include <array>

namespace bsp2::io {

/// Sign of the volume of the tetrahedron a b c d of rounded points: 1 if a b c is counter-clockwise seen from
/// d, 0 if the four lie in one plane. Exact for the doubles as they are, by doubles where these tell for sure
/// and by integers else.
int orientation(const std::array<double, 3>& a, const std::array<double, 3>& b,
                const std::array<double, 3>& c, const std::array<double, 3>& d);

}  // namespace bsp2::io
