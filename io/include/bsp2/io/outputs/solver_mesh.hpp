#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::io {

/// A mesh for solvers, as it is written: tetrahedra, or polyhedra.
struct SolverMesh {
  std::vector<std::string> volumes, groups;  ///< names; groups are of faces

  std::vector<std::int32_t> volume;  ///< of each cell

  // Tetrahedra.
  meshing::Tetrahedra tetrahedra;
  std::vector<std::int32_t> group_of_triangle;
  /// Of second order: the points in the middle of edges 01 12 02 03 13 23 (01 12 02 of triangles), which
  /// follow the corners among the points. Else empty.
  std::vector<std::array<std::uint32_t, 6>> middles;
  std::vector<std::array<std::uint32_t, 3>> triangle_middles;

  // Polyhedra.
  std::optional<meshing::Complex> polyhedra;
  std::vector<std::int32_t> group_of_face;  ///< -1: of none

  [[nodiscard]] const std::vector<meshing::Point>& points() const {
    return polyhedra ? polyhedra->points : tetrahedra.points;
  }
};

/// Adds the points of second order: straight edges, so each is in the middle of its edge.
void add_middles(SolverMesh& mesh);

enum class SolverFormat : std::uint8_t { openfoam, vtu, gmsh, abaqus, xdmf };

/// By the ending of a path: a folder, `.foam` or no ending is an OpenFOAM case.
std::optional<SolverFormat> solver_format(const std::filesystem::path& path);
/// The file by which a mesh is opened: the path itself, or of an OpenFOAM case the empty NAME.foam in its
/// folder NAME, for ParaView. `x.foam` and `x/x.foam` are of the folder `x`. @pre solver_format(path)
std::filesystem::path solver_file(const std::filesystem::path& path);
/// All files that writing a mesh replaces: that one, and what comes with it. @pre solver_format(path)
std::vector<std::filesystem::path> solver_files(const std::filesystem::path& path);
/// "a folder, .foam, .vtu, .msh, .inp or .xdmf", for messages.
std::string solver_endings();
/// Whether a format knows polyhedra, tetrahedra of second order, and groups of faces.
bool holds_polyhedra(SolverFormat format);
bool holds_second_order(SolverFormat format);
bool holds_groups(SolverFormat format);

/// Writes a mesh. Files appear under their names when they are complete; `.xdmf` has a `.h5` beside it.
/// @param gmsh_version 41 or 22.
/// @pre the format holds what the mesh is of. @throws bsp2::Error if a file cannot be written.
void write_solver_mesh(const std::filesystem::path& path, const SolverMesh& mesh, int gmsh_version = 41);

/// Names as solvers take them: what is no letter, digit, `-` or `.` becomes `_`. Different ones that are one
/// then, but for upper and lower case, which CalculiX takes for one, get `_2`, `_3`, ...
/// @param taken names of others, in lower case, that none shall have.
std::vector<std::string> plain_names(const std::vector<std::string>& names, std::set<std::string> taken = {});

}  // namespace bsp2::io
