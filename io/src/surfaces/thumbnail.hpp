#pragma once

#include <string>
#include <vector>

#include "surfaces/division.hpp"
#include "surfaces/labels.hpp"

namespace bsp2::io {

/// A small picture of all objects, seen from the front, right and above, as the bytes of a PNG file.
std::string thumbnail(const std::vector<PrintedObject>& objects, const PartLabels& labels);

}  // namespace bsp2::io
