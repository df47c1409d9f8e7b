#pragma once

#include "options/command_line.hpp"

namespace CLI {
class App;
}

namespace bsp2::jobs {

/// The commands below `bsp2 jobs`.
struct QueueCommands {
  CLI::App *jobs, *split, *run, *merge, *status;
};

/// Adds them with the options that only they have; they write into command.queue, which exists from here on.
QueueCommands add_queue_commands(CLI::App& app, RunCommand& command);

/// After parsing: leaves command.queue empty if none of them was asked for, and makes options of what was.
void choose_queue_command(const QueueCommands& commands, RunCommand& command);

}  // namespace bsp2::jobs
