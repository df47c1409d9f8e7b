#pragma once

#include <functional>
#include <ostream>

#include "options/command_line.hpp"

namespace bsp2::jobs {

using Run = std::function<supersteps::RunResult(const supersteps::RunOptions&, supersteps::Ranks&)>;

/// Before anything is computed. @throws bsp2::Error for a file that cannot be written.
void check_drawings(const RunCommand& command);

/// Draws what a run has found, on the master; for each section the model is run again without what is in
/// front of it. Collective. @throws bsp2::Error if it cannot be drawn.
void write_drawings(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
                    const Run& run, std::ostream& out);

}  // namespace bsp2::jobs
