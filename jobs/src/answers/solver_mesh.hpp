#pragma once

#include <array>
#include <cstdint>
#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "options/mesh_options.hpp"

namespace bsp2::jobs {

/// A mesh for solvers in figures.
struct MeshSummary {
  bool polyhedra = false;
  std::uint64_t points = 0, cells = 0, faces = 0;
  std::vector<std::pair<std::string, double>> volumes;        ///< content by name
  std::vector<std::pair<std::string, std::uint64_t>> groups;  ///< faces by name
  double volume = 0;
  double size = 0, clean = 0;
  // Of tetrahedra.
  std::uint64_t cells_at_first = 0, moved_points = 0;
  double largest_move = 0;
  double smallest_angle = 0, largest_angle = 0, mean_smallest_angle = 0;
  std::array<std::uint64_t, 18> histogram{};
  std::array<std::uint64_t, 3> below{};  ///< tetrahedra with an angle below 1, 5 and 10 degrees
  double seconds_of_cells = 0, seconds_of_shape = 0;
};

/// Makes the mesh of a finished run and writes it; what there is to tell goes into the report. On the master
/// alone, which has all cells.
/// @throws bsp2::Error if there is nothing to mesh, or the file cannot be written; std::runtime_error if no
/// valid mesh was found.
MeshSummary make_solver_mesh(const MeshCommand& command, supersteps::RunResult& result);

void print_mesh_summary(std::ostream& out, const MeshSummary& summary, bool with_histogram);

/// A report with the mesh in it.
std::string with_mesh(const std::string& report, const MeshSummary& summary);

}  // namespace bsp2::jobs
