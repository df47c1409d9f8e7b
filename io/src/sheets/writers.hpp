#pragma once

#include <string>

#include "bsp2/io/outputs/sheet.hpp"

namespace bsp2::io {

std::string to_svg(const Sheet& sheet);
std::string to_dxf(const Sheet& sheet);

}  // namespace bsp2::io
