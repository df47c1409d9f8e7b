#include "program/viewing.hpp"

#include <spawn.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>

#include <optional>
#include <thread>
#include <utility>

#include "answers/progress_bar.hpp"
#include "answers/summary.hpp"
#include "program/signals.hpp"

extern char** environ;

namespace bsp2::jobs {
namespace {

void open_in_browser(const std::string& link, spdlog::logger& log) {
  std::string program = "xdg-open", argument = link;
  char* const arguments[] = {program.data(), argument.data(), nullptr};
  pid_t child = 0;
  if (::posix_spawnp(&child, "xdg-open", nullptr, nullptr, arguments, environ) != 0) {
    log.warn("--open: there is no xdg-open here; open the link by hand");
    return;
  }
  std::thread([child] { ::waitpid(child, nullptr, 0); }).detach();
}

/// What a run has found. @return its exit code.
int tell(const Figures& figures, bool speaks, std::ostream& out, spdlog::logger& log) {
  for (const std::string& warning : figures.warnings) log.warn("warning: {}", warning);
  if (speaks)
    for (const std::string& note : figures.notes) log.info("note: {}", note);
  for (const auto& failed : figures.failed) log.error("{}", failed.text);
  if (speaks) print_summary(out, figures, false);
  if (speaks) out << std::endl;
  return figures.failed.empty() ? 0 : 1;
}

}  // namespace

int view_command(const RunCommand& command, std::ostream& out, const Ranks& ranks, spdlog::logger& log) {
  const bool speaks = ranks.is_master() && !command.quiet;
  const SignalWatch watched("", false);
  SignalWatch::interrupted();  // from here on signals are remembered
  std::optional<ProgressBar> bar;
  int code = 0;
  ViewerOptions viewer = *command.viewer;
  viewer.serves = [&](const std::string& link) {
    out << link << std::endl;
    if (command.viewer->open) open_in_browser(link, log);
  };
  viewer.evaluated = [&](const Figures& figures) {
    bar.reset();
    code = figures.is_interrupted ? interrupted_code
           : ranks.is_master()    ? tell(figures, speaks, out, log)
                                  : 0;
  };
  viewer.failed = [&](const Error& error) {
    bar.reset();
    log.error("{}", error.what());
    code = 2;
  };
  Options options = command.options;
  options.stop = SignalWatch::interrupted;
  options.progress = [&, begun = 0U](const Progress& now) mutable {
    if (!bar) {  // of another run
      bar.emplace(speaks ? stderr : nullptr);
      begun = 0;
    }
    if (std::exchange(begun, now.begun) != now.begun)
      bar->begin(now.superstep);
    else
      bar->show(now.done, now.phase == Phase::computation ? now.cells : 0);
  };
  view(command.resume.value_or(command.model), viewer, options, ranks);
  return code;
}

}  // namespace bsp2::jobs
