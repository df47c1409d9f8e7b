#pragma once

#include "bsp2/supersteps/render/rendering.hpp"
#include "render/camera.hpp"
#include "render/canvas.hpp"

namespace bsp2::supersteps {

/// The colour of a cell under full light, and how much of what is behind it is hidden.
Ink ink_of(const RunResult& result, const geometry::CellBatch& batch, std::size_t cell, Shade shade);

/// As the light makes it look: from the upper left, before the solid, and a dim sky so that nothing is black.
/// @param normal of unit length, in the picture's axes.
Ink lit(const Ink& ink, const Vector& normal);

}  // namespace bsp2::supersteps
