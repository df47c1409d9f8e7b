#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// Faces that solvers for finite volumes refuse, as OpenFOAM's checkMesh measures them: turned (a cell's
/// middle is not behind its face), or skew (the line between two middles misses the middle of the face by
/// more than four times the distance from there to the face's rim).
[[nodiscard]] std::vector<std::uint32_t> wrong_faces(const Complex& complex);

}  // namespace bsp2::meshing
