#pragma once

#include <ostream>

#include "options/command_line.hpp"

namespace spdlog {
class logger;
}

namespace bsp2::jobs {

/// Shows runs in browsers: one after another, as the files of the model are saved, until the last page is
/// closed or a signal comes. Collective.
/// @return the exit code of the last run.
/// @throws bsp2::Error if nothing can be served.
int view_command(const RunCommand& command, std::ostream& out, const Ranks& ranks, spdlog::logger& log);

}  // namespace bsp2::jobs
