#pragma once

#include <string>

#include "options/command_line.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// Adds `view` with the options that only it has; they write into `command.viewer`, which exists from here
/// on.
/// @param input what it is to show. @param eye as it is typed.
CLI::App* add_view_command(CLI::App& app, RunCommand& command, std::string& input, std::string& eye);

/// Once it has the options of `run`, too: tells what some of them do here.
void describe_for_view(CLI::App& view);

/// After parsing: what is shown, and what is computed for it. @param order as it is typed; empty: none.
void choose_view_command(RunCommand& command, const std::string& input, const std::string& order,
                         const std::string& eye);

}  // namespace bsp2::jobs
