#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/api/products/drawings.hpp"
#include "bsp2/figures.hpp"
#include "bsp2/outputs.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::api {

/// What is written, and of what run.
struct Writing {
  const Outputs& files;
  const supersteps::RunOptions& run;
  bool stops_gently = false;  ///< long work asks `run.interrupted` itself: nothing around it does
  bool cells_go = false;      ///< given up once they are written
  std::string dashes;         ///< before names of options in messages
  std::function<void(const std::filesystem::path&)> on_writing;  ///< before a file is written; may be empty
  std::function<void(double done)> on_picture;                   ///< the share that is drawn; may be empty
};

/// What there is to tell of files beside the report; on the master.
struct Written {
  std::vector<std::filesystem::path>
      files;  ///< to be found by the user; of several that are one, that to open
  std::optional<MeshFigures> solver_mesh;
  std::optional<Figures::Drawing> drawing;
};

/// What the master says, on all ranks. Collective.
bool told_by_master(bool said, supersteps::Ranks& ranks);

/// What the run has to find for its files. @param only nothing else is wanted.
void ask_for(const Outputs& files, bool only, supersteps::RunOptions& run);

/// Evaluates, and writes what is asked for: what shows steps after each, what shows cells as soon as they are
/// there, then all else; the report holds the costs up to there. Each file is made by itself: one that fails
/// is told in the report, and is not left from an earlier run in Outputs::folder. Collective, within
/// Ranks::together.
/// @param evaluate the engine. @throws bsp2::Error for files that could not be written, before anything is
/// computed; for a drawing that makes no sense.
supersteps::RunResult write_run(const Writing& writing, supersteps::Ranks& ranks, const Run& evaluate,
                                Written& written);

/// The name of the picture of a step: PREFIX0007.png, or DIR/0007.png for a prefix that ends with a slash or
/// is a folder.
std::filesystem::path frame_path(const std::filesystem::path& prefix, unsigned step);

}  // namespace bsp2::api
