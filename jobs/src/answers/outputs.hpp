#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "options/command_line.hpp"

namespace bsp2::jobs {

/// Whether two paths, however they are written, lead to one place, be there a file yet or not.
bool are_one_file(const std::filesystem::path& a, const std::filesystem::path& b);

/// Could the outputs be written? Asked before a long run. @throws bsp2::Error if not.
void check_outputs(const RunCommand& command);

/// The files that a run has written, for the user to find; of a mesh and of a series the one to open.
std::vector<std::filesystem::path> written_files(const RunCommand& command,
                                                 const supersteps::RunReport& report);

/// What was the first thing to fail, of all pictures and of all meshes of steps.
struct StepFailures {
  std::optional<supersteps::FailedOutput> frames, series;
};

/// Writes what there is after a step, as was asked for: a picture, the cells. Collective, within
/// Ranks::together.
/// @param failures what fails is told here, and takes nothing else along.
void write_step(const RunCommand& command, const supersteps::RunResult& now, unsigned step,
                supersteps::Ranks& ranks, StepFailures& failures);

/// Writes what shows the cells, if that was asked for: the mesh and the picture. With -o, what cannot be
/// drawn or meshed in this dimension is left out with a warning. Each file is made by itself: one that fails
/// is told in the report, and is not left from an earlier run in the folder of -o. Collective, within
/// Ranks::together.
/// @throws bsp2::Error if there is no folder for them.
void write_cells(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks);

/// Writes the rest: the boundary, then the report, which holds the costs up to here, at last a copy of the
/// snapshot. Otherwise as write_cells.
/// @param with_more adds to the report what else the command has made.
void write_results(
    const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
    const std::function<std::string(std::string)>& with_more = [](std::string report) { return report; });

}  // namespace bsp2::jobs
