#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"

namespace bsp2::io {

/// Can a surface be written under this name? By its ending: .vtp, .stl, .ply or .obj.
bool is_surface_file(const std::filesystem::path& path);

/// Could `write_surface` succeed, as far as the format goes? Asked before a long run. @throws bsp2::Error if
/// not.
void check_surface_file(const std::filesystem::path& path);

/// Writes the boundary of a solid, in the format that the file's ending names:
///   .vtp  VTK's PolyData, coordinates in double precision, cell array `part` and field array `part_names`
///   .ply  binary, coordinates in double precision, property `part` of each face, a comment for each name
///   .obj  text with all digits, a group for each part, called like it
///   .stl  binary; the format knows single precision and no parts. Corners are rounded first; then no
///   triangle is without area, and
///         the surface is as closed as it was, told by the coordinates in the file alone.
/// Where no part has a name the whole is part 0, and its group is called `part_0`.
/// The file appears under its name when it is complete.
/// @param part_names of the owners; none: no part has a name.
/// @return a warning where single precision changes the volume or the size of a connected part of the surface
/// by more than a hundred-thousandth; else empty.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or a coordinate is too large for
/// its precision.
[[nodiscard]] std::string write_surface(const std::filesystem::path& path,
                                        const geometry::TriangleSurface& surface,
                                        const std::vector<std::string>& part_names = {});

}  // namespace bsp2::io
