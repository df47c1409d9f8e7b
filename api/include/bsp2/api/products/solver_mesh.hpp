#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// A mesh for solvers in figures.
struct MeshSummary {
  bool polyhedra = false;
  std::uint64_t points = 0, cells = 0, faces = 0;
  std::uint64_t outer_faces = 0, overused_faces = 0;          ///< of one cell, and of more than two
  std::vector<std::pair<std::string, double>> volumes;        ///< content by name
  std::vector<std::pair<std::string, std::uint64_t>> groups;  ///< faces by name
  double volume = 0;
  double size = 0, clean = 0;
  // Of tetrahedra.
  std::uint64_t cells_at_first = 0, moved_points = 0, taken_away = 0;
  double largest_move = 0;
  double smallest_angle = 0, largest_angle = 0, mean_smallest_angle = 0;
  double smallest_aspect = 0, mean_aspect = 0;  ///< see meshing::Quality
  std::array<std::uint64_t, 18> histogram{};
  std::array<std::uint64_t, 3> below{};  ///< tetrahedra with an angle below 1, 5 and 10 degrees
  double seconds_of_cells = 0, seconds_of_shape = 0;

  void take(const meshing::Quality& quality);
};

/// A mesh, and what there is to tell of it.
struct MadeSolverMesh {
  io::SolverMesh mesh;
  MeshSummary summary;
  std::vector<std::string> warnings, notes;
};

/// Makes the mesh of a finished run. On the master alone, which has all cells.
/// @param dashes before names of options in messages: "--" in those of the program.
/// @throws bsp2::Error if there is nothing to mesh; std::runtime_error if no valid mesh was found.
MadeSolverMesh make_solver_mesh(const SolverMeshOptions& options, const supersteps::RunResult& result,
                                std::string_view dashes = "");

/// Which share of the tolerance what is round may have by place, so that its facets have these lengths to each
/// other: that of the squares. @param size_field x, y, z and a length above 0. @param size of which the
/// tolerance is, and nothing is longer; none or 0: the largest. @return null without any.
std::shared_ptr<const meshing::SizeField> tolerance_shares(
    const std::vector<std::array<double, 4>>& size_field, std::optional<double> size);

/// What was found of a mesh in a file.
struct CheckedMesh {
  MeshSummary summary;
  std::vector<std::string> faults, notes;  ///< valid if there are no faults
};

/// Looks at any mesh of tetrahedra in a file of gmsh: whether each is right side out, which is decided
/// exactly, and whether faces are used once or twice, from two sides; triangles in groups have to be faces.
/// Of second order the corners count.
/// @throws bsp2::Error if it cannot be read, or is no mesh of tetrahedra.
CheckedMesh check_solver_mesh(const std::filesystem::path& path);

}  // namespace bsp2::api
