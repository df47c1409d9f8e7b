#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/supersteps/state/run_result.hpp"
#include "options/mesh_options.hpp"

namespace bsp2::jobs {

using api::MeshSummary;

/// Makes the mesh of a finished run and writes it; what there is to tell goes into the report. On the master
/// alone, which has all cells.
/// @throws bsp2::Error if there is nothing to mesh, or the file cannot be written; std::runtime_error if no
/// valid mesh was found.
MeshSummary make_solver_mesh(const MeshCommand& command, supersteps::RunResult& result);

void print_mesh_summary(std::ostream& out, const MeshSummary& summary, bool with_histogram);

/// A report with the mesh in it.
std::string with_mesh(const std::string& report, const MeshSummary& summary);

/// `mesh --check`: prints and reports what a mesh in a file is like.
/// @return what else is good to know. @throws bsp2::Error that says what is wrong if the mesh is not valid.
std::vector<std::string> check_mesh_file(const RunCommand& command, std::ostream& out);

}  // namespace bsp2::jobs
