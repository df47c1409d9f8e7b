#pragma once

#include <string>

#include "bsp2/supersteps/run.hpp"

namespace bsp2::supersteps {

/// Draws a solid: its IN cells, from the back to the front, so that no depth buffer is needed.
///
/// D = 3: a parallel projection seen from the front, the right and above (z is up). D = 2: the plane itself.
/// Other cells are not drawn. The image is a square of `size` pixels.
/// Not collective. @return the bytes of a PNG file.
/// @throws bsp2::Error for other dimensions, which cannot be drawn.
/// Source: the paper, section 4.2, "Rendering".
std::string render_png(const SolidMesh& mesh, const geometry::BspTree& tree, int size = 1000);

/// The same on all ranks: each draws the cells that it holds, in the order of its own BSP tree; the master puts the layers
/// over each other in the order of the partition. No depths are exchanged. The picture is that which one rank would draw.
/// Collective, within Ranks::together. @return the bytes of a PNG file on the master, nothing elsewhere.
std::string render_png(Ranks& ranks, const RunResult& result, int size = 1000);

}  // namespace bsp2::supersteps
