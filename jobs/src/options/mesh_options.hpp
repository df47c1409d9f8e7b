#pragma once

#include <optional>
#include <string>
#include <vector>

#include "bsp2/bsp2.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// Options of the command as they are typed.
struct MeshText {
  std::string input, output, type, size_field, version = "4.1";
  std::vector<std::string> part_sizes, groups;
  std::optional<double> clean, size;
  double growth = SolverMeshOptions{}.growth;
  int order = 1;
  bool check = false;
};

/// Adds the options that only this command has.
void add_mesh_options(CLI::App& app, MeshText& text);

/// `--check`, which leaves no room for what says how a mesh is made. After all options but --report, --stats
/// and --quiet.
void add_check_option(CLI::App& app, MeshText& text);

/// What they mean. @throws bsp2::Error if they make no sense.
SolverMeshOutput mesh_output_of(const MeshText& text);

}  // namespace bsp2::jobs
