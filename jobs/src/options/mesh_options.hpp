#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"
#include "options/command_line.hpp"
#include "options/work_options.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// Options of `bsp2 mesh` as they are typed.
struct MeshText {
  std::string input, output, report, type, size_field, version;
  std::vector<std::string> part_sizes, groups;
  std::optional<double> clean, size;
  double growth = SolverMeshOptions{}.growth;
  int order = 1;
  bool check = false;
};

/// Adds `bsp2 mesh`: a mesh of a model or of a snapshot, or the check of one.
CLI::App* add_mesh_command(CLI::App& app, RunCommand& command, MeshText& text, WorkText& work);

/// After parsing: what it is made of, and how. @throws bsp2::Error for what makes no sense.
void choose_mesh(const MeshText& text, RunCommand& command);

}  // namespace bsp2::jobs
