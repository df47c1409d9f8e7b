#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/error.hpp"
#include "bsp2/outputs.hpp"

/// What endings of files mean, and what can be told of options before anything is computed. Part of bsp2.hpp,
/// which says what holds of all.
namespace bsp2 {

/// Of an ending in letters of any case: what files that have it are. See docs/formats.md.
struct FileFormat {
  bool surface = false;  ///< of solids
  bool outline = false;  ///< of plane ones alone
  bool picture = false, animation = false;
  bool drawing = false;
  bool solver_mesh = false;   ///< also a folder, which has no ending
  bool openfoam = false;      ///< such a mesh is a case of OpenFOAM
  bool gmsh = false;          ///< such a mesh is a .msh file
  bool polyhedra = false;     ///< it may be of polyhedra
  bool second_order = false;  ///< it may be of second order
  bool triangles = false;     ///< of a surface, which can be cleaned
};
BSP2_API FileFormat file_format(const std::filesystem::path& path);

/// Whether it is taken for a snapshot, not for a model: by its first bytes, or because it is called .h5.
BSP2_API bool is_snapshot(const std::filesystem::path& file);

/// Lists for messages: ".3mf, .amf, ... or .x3d".
struct Endings {
  std::string surfaces, outlines, solver_meshes;
};
BSP2_API Endings endings();
/// Tables of what can be written (surfaces) and read, a line a format, of at most 80 columns.
BSP2_API std::string surface_format_table();
BSP2_API std::string import_format_table();

/// @param dashes before names of options in messages. @throws Error for what makes no sense.
BSP2_API void check(const DrawingOptions& drawing, std::string_view dashes = "");
/// "NAME=WHERE" of SolverMeshOptions::groups. @throws Error that says what is wrong, and at which character.
BSP2_API void check_group(const std::string& group);
/// What an animation needs is there. @throws Error if not.
BSP2_API void check_animation(const std::filesystem::path& path);

/// Reads a size field: rows of x, y, z and a length above 0. Of a .vtu it is the array `size` of points or
/// cells (which count where their middle is), or the only one of one number each; of a .msh the first data of
/// one number of nodes or elements; all else is a text of such rows, by spaces or commas, in which what
/// follows `#` is a comment and a first line of words a heading. @throws Error that names the file, and the
/// line if there are lines.
BSP2_API std::vector<std::array<double, 4>> read_size_field(const std::filesystem::path& path);

}  // namespace bsp2
