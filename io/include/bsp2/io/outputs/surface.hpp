#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"

namespace bsp2::io {

/// A format of files for surfaces. All hold closed triangles, or the plane faces that they are of (cad.hpp),
/// or the outlines of plane solids (outline.hpp).
struct SurfaceFormat {
  std::string_view ending;       ///< with the dot, in small letters
  std::string_view description;  ///< what it is, and what for
  bool is_single;                ///< numbers have single precision: corners are rounded to it first
  bool holds_parts, holds_colours;
  bool has_faces = false;
  bool is_plane = false;
  bool closes_parts = false;  ///< each part is an object, closed by itself
};

/// All formats, by ending: the one place that knows them.
std::span<const SurfaceFormat> surface_formats();

/// The format that a file's ending names, in letters of any case; null if none does.
const SurfaceFormat* surface_format(const std::filesystem::path& path);

/// How long the edges of a surface should be at least in a file, where nobody says, as a share of the
/// coordinates of their ends: a sixteenth of a step of single precision, far below what it rounds by,
/// or 0 where a format keeps all digits.
[[nodiscard]] double least_step(const std::filesystem::path& path);

/// For messages: ".3mf, .amf, ... or .x3d", and of these those for plane solids, ".dxf, .pdf or .svg".
std::string surface_endings();
std::string plane_endings();

/// The formats as a table, a line each, of at most 80 columns.
std::string surface_format_table();

/// Could `write_surface` succeed, as far as the format goes? Asked before a long run. @throws bsp2::Error if
/// not.
void check_surface_file(const std::filesystem::path& path);

/// What the numbers of parts stand for.
struct SurfaceParts {
  using Colour = std::array<std::uint8_t, 4>;  ///< red, green, blue, opacity
  std::vector<std::string> names;              ///< none: nothing has a name, and the whole is part 0
  std::vector<std::optional<Colour>> colours;  ///< one a name; or empty
  Colour other_colour{255, 255, 255, 255};     ///< of parts without one, beside those that have one
};

/// What there is to tell of a file, in sentences.
struct SurfaceRemarks {
  std::string warning;             ///< what single precision costs; empty: nothing worth telling
  std::vector<std::string> notes;  ///< what is as it should be, but may surprise
};

/// Writes the boundary of a solid, in the format that the file's ending names: docs/formats.md tells what
/// each of them holds. The file appears under its name when it is complete. A `.obj` with colours has them in
/// a second file, of the ending `.mtl`, which is there before it.
/// Of a format in single precision the corners are rounded first; then no triangle is without area, and the
/// surface is as closed as it was, told by the coordinates in the file alone.
/// @param surface closes parts that touch if the format does (geometry::TriangleSurface::closes_parts).
/// @param found what the surface was made of, if it is not the one that was found: what is lost is lost of
/// that.
/// @return a warning where single precision changes the volume or the size of a connected part of the surface
/// by more than a hundred-thousandth, and notes.
/// @throws bsp2::Error if it cannot be written, its ending is another one, or of a format of faces or
/// outlines, or a coordinate is too large for its precision.
[[nodiscard]] SurfaceRemarks write_surface(const std::filesystem::path& path,
                                           const geometry::TriangleSurface& surface,
                                           const SurfaceParts& parts = {},
                                           const geometry::TriangleSurface* found = nullptr);

/// Whether single precision changes the volume or the size of a connected part by more than a
/// hundred-thousandth.
[[nodiscard]] bool changes_in_single(const geometry::TriangleSurface& surface);

}  // namespace bsp2::io
