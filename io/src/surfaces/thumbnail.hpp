#pragma once

#include <string>

#include "outputs/single_precision.hpp"
#include "surfaces/labels.hpp"

namespace bsp2::io {

/// A small picture of a surface, seen from the front, right and above, as the bytes of a PNG file.
std::string thumbnail(const SingleSurface& surface, const PartLabels& labels);

}  // namespace bsp2::io
