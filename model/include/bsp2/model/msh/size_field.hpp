#pragma once

#include <array>
#include <filesystem>
#include <vector>

namespace bsp2::model {

/// Reads sizes by place, each x, y, z and a length above 0, by the ending of the file:
/// - `.vtu`: the array `size` of its points or cells (cells count where their middle is), or the only array
///   of one number each;
/// - `.msh` of gmsh: the first data of one number of nodes or elements;
/// - else a text: lines of `x y z size`, by spaces or commas; what follows `#` is a comment, and a first line
///   of words is a heading.
/// @throws bsp2::Error that names the file, and the line if there are lines.
std::vector<std::array<double, 4>> read_size_field(const std::filesystem::path& path);

}  // namespace bsp2::model
