#pragma once

#include <cstdint>
#include <span>
#include <string>

namespace bsp2::supersteps {

/// The bytes of a PNG file. @param pixels 0xaarrggbb, row by row, colours multiplied by the opacity.
/// @param has_opacity else it is left out.
std::string png_file(std::span<const std::uint32_t> pixels, int width, int height, bool has_opacity);

}  // namespace bsp2::supersteps
