#pragma once

#include <ostream>

#include "bsp2/api/products/drawings.hpp"
#include "options/command_line.hpp"

namespace bsp2::jobs {

using api::Run;

/// Before anything is computed. @throws bsp2::Error for a file that cannot be written.
void check_drawings(const RunCommand& command);

/// Draws what a run has found and writes it, on the master. Collective. @throws bsp2::Error if it cannot be
/// drawn.
void write_drawings(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
                    const Run& run, std::ostream& out);

}  // namespace bsp2::jobs
