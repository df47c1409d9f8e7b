#pragma once

#include <iosfwd>
#include <string>
#include <vector>

#include "options/command_line.hpp"

namespace bsp2::jobs {

/// A mesh for solvers, for people: at most 80 columns but for names.
void print_mesh_summary(std::ostream& out, const MeshFigures& mesh, bool with_histogram);

/// `mesh --check`: prints and reports what a mesh in a file is like.
/// @return what else is good to know. @throws bsp2::Error that says what is wrong if the mesh is not valid.
std::vector<std::string> check_mesh_file(const RunCommand& command, std::ostream& out);

}  // namespace bsp2::jobs
