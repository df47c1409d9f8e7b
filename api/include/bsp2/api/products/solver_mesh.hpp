#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/figures.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"
#include "bsp2/outputs.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// A mesh, and what there is to tell of it.
struct MadeSolverMesh {
  io::SolverMesh mesh;
  MeshFigures summary;
  std::vector<std::string> warnings, notes;
};

/// Makes the mesh of a finished run. On the master alone, which has all cells.
/// @param dashes before names of options in messages: "--" in those of the program.
/// @throws bsp2::Error if there is nothing to mesh; std::runtime_error if no valid mesh was found.
MadeSolverMesh make_solver_mesh(const SolverMeshOptions& options, const supersteps::RunResult& result,
                                std::string_view dashes = "");

/// @throws bsp2::Error unless places are finite, and sizes are and above 0.
void check_size_field(const std::vector<std::array<double, 4>>& rows);

/// @throws bsp2::Error for what makes no sense.
void check_mesh_options(const SolverMeshOptions& options);
/// @throws bsp2::Error if the file's format cannot hold such a mesh.
void check_mesh_file(const std::filesystem::path& path, bool is_of_polyhedra, bool second_order,
                     int gmsh_version);

/// Which share of the tolerance what is round may have by place, so that its facets have these lengths to
/// each other: that of the squares. @param size_field x, y, z and a length above 0. @param size of which the
/// tolerance is, and nothing is longer; none or 0: the largest. @return null without any.
std::shared_ptr<const meshing::SizeField> tolerance_shares(
    const std::vector<std::array<double, 4>>& size_field, std::optional<double> size);

/// `bsp2::check_mesh`.
MeshCheck checked_mesh(const std::filesystem::path& path);

/// What the quality of its tetrahedra is.
void add_quality(const meshing::Quality& quality, MeshFigures& figures);

}  // namespace bsp2::api
