#pragma once

#include <array>
#include <filesystem>
#include <vector>

namespace bsp2::io {

/// Reads sizes by place: lines of `x y z size`, by spaces or commas; what follows `#` is a comment, and a
/// first line of words is a heading. @throws bsp2::Error that names the file and the line.
std::vector<std::array<double, 4>> read_size_field(const std::filesystem::path& path);

}  // namespace bsp2::io
