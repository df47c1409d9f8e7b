#pragma once

#include <string>
#include <vector>

#include "options/command_line.hpp"

namespace CLI {
class App;
}

/// What is computed, and of what: options that several commands have.
namespace bsp2::jobs {

/// Those that are typed as words.
struct WorkText {
  std::string order, budget, parts;
  std::vector<std::string> keep;
};

constexpr auto work_group = "What is computed";

/// What the text of a model is taken for.
void add_solid_options(CLI::App& app, RunCommand& command, WorkText& text);
/// That, and what else fixes the cells from the start.
void add_model_options(CLI::App& app, RunCommand& command, WorkText& text);
/// What may differ from one session of a run to the next.
void add_work_options(CLI::App& app, RunCommand& command, WorkText& text);

void add_threads_option(CLI::App& app, RunCommand& command, const char* group = work_group);
void add_tolerance_option(CLI::App& app, RunCommand& command);
/// @param rest what becomes of the rest where the cuts end.
void add_level_option(CLI::App& app, RunCommand& command, const std::string& rest);
void add_budget_option(CLI::App& app, WorkText& text, const char* description);
void add_cells_option(CLI::App& app, RunCommand& command, const char* description);

/// After parsing: what the words mean. @throws bsp2::Error for a time that is none.
void choose_work(const WorkText& text, Options& options);

/// "2s", "500ms", "1.5min", "1h" or a plain number of seconds. @throws bsp2::Error for anything else.
double parse_seconds(const std::string& text);

}  // namespace bsp2::jobs
