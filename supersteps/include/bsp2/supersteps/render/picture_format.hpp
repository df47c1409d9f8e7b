#pragma once

#include <cstdint>

namespace bsp2::supersteps {

enum class PictureFormat : std::uint8_t { png, svg, pdf };

}  // namespace bsp2::supersteps
