#pragma once

#include <filesystem>
#include <string>

#include "bsp2/geometry/boundary.hpp"

namespace bsp2::io {

/// Can a surface be written under this name? By its ending: .vtp, .stl, .ply or .obj.
bool is_surface_file(const std::filesystem::path& path);

/// Could `write_surface` succeed, as far as the format goes? Asked before a long run. @throws bsp2::Error if not.
void check_surface_file(const std::filesystem::path& path);

/// Writes the boundary of a solid, in the format that the file's ending names:
///   .vtp  VTK's PolyData, coordinates in double precision, cell array `part`
///   .ply  binary, coordinates in double precision, property `part` of each face
///   .obj  text with all digits, a group `part_N` for each part
///   .stl  binary; the format knows single precision and no parts. Corners are rounded first; then no triangle is without area, and
///         the surface is as closed as it was, told by the coordinates in the file alone.
/// The file appears under its name when it is complete.
/// @return a warning where single precision changes the volume or the size of a connected part of the surface by more than a
/// hundred-thousandth; else empty.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or a coordinate is too large for its precision.
[[nodiscard]] std::string write_surface(const std::filesystem::path& path, const geometry::TriangleSurface& surface);

}  // namespace bsp2::io
