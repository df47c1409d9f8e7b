#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/drawing/lines/hidden_lines.hpp"

namespace bsp2::drawing {

/// What a sheet can show; in millimetres.
inline constexpr double finest = 0.01;

/// Draws each line once, where several are in one place the strongest, and puts pieces that follow each other
/// together: straight on they are one, and through small bends one stroke, so that dashes go on.
/// @param pieces on the sheet, in millimetres.
/// @param dropped is increased by the strokes that are shorter than what a sheet can show, and left out.
std::vector<Stroke> joined(std::vector<Piece> pieces, std::uint64_t& dropped);

}  // namespace bsp2::drawing
