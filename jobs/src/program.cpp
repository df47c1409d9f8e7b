#include "bsp2/jobs/program.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <sstream>

#include "bsp2/geometry/error.hpp"
#include "bsp2/jobs/command_line.hpp"
#include "bsp2/jobs/outputs.hpp"
#include "bsp2/jobs/progress_bar.hpp"
#include "bsp2/jobs/summary.hpp"

namespace bsp2::jobs {
namespace {

constexpr int ours = 1, users = 2;

using Run = std::function<supersteps::RunResult(const supersteps::RunOptions&, supersteps::Ranks&)>;

/// Everything that is said to the user goes through this: one line each on stderr.
spdlog::logger make_log() {
  spdlog::logger log("bsp2", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log.set_pattern("bsp2: %v");
  return log;
}

/// On all ranks, and only the master speaks.
void run_command(RunCommand command, std::ostream& out, supersteps::Ranks& ranks, const Run& run, spdlog::logger& log) {
  check_outputs(command);
  const bool speaks = ranks.is_master() && !command.quiet;
  ProgressBar bar(stderr);
  if (speaks) command.options.on_progress = [&bar](double done, std::uint64_t cells) { bar.show(done, cells); };
  supersteps::RunResult result = run(command.options, ranks);
  bar.clear();
  write_outputs(command, result, ranks);
  if (!ranks.is_master()) return;
  for (const std::string& warning : result.report.warnings) log.warn("warning: {}", warning);
  if (speaks) print_summary(out, result.report);
  if (command.stats) print_stats(out, result.report);
}

/// Nobody reads on (a closed pipe) is fine; a full disk is not.
void finish(std::ostream& out) {
  errno = 0;
  out.flush();
  if (!out && errno != EPIPE && errno != 0) {
    throw Error("cannot write to standard output: " + std::generic_category().message(errno));
  }
}

/// @return the exit code of what `body` does; only one of the ranks tells why it failed.
int exit_code(const std::function<void()>& body, bool speaks, spdlog::logger& log) {
  if (!speaks) log.set_level(spdlog::level::off);
  try {
    body();
    return 0;
  } catch (const Error& error) {
    log.error("{}", error.what());
    return users;
  } catch (const supersteps::Failure& failure) {
    log.error("{}", failure.what());
    return ours;
  } catch (const std::bad_alloc&) {
    log.error("out of memory");
    return ours;
  } catch (const std::exception& error) {
    log.error("internal error: {}", error.what());
    return ours;
  }
}

}  // namespace

int program(const std::vector<std::string>& arguments, std::ostream& out, supersteps::Ranks& ranks, const Run& run) {
  spdlog::logger log = make_log();
  const auto body = [&] {
    std::ostringstream ignored;
    std::ostream& speech = ranks.is_master() ? out : ignored;
    const auto command = parse_command_line(arguments, speech);
    if (command) ranks.together([&] { run_command(*command, out, ranks, run, log); });
    finish(speech);
  };
  return exit_code(body, ranks.is_master(), log);
}

int program(const std::vector<std::string>& arguments, std::ostream& out) {
  int code = 0;
  spdlog::logger log = make_log();
  const auto body = [&] {
    supersteps::Ranks ranks = supersteps::Ranks::launched();
    const auto run = [](const supersteps::RunOptions& options, supersteps::Ranks& all) { return supersteps::run(options, all); };
    code = program(arguments, out, ranks, run);
  };
  return std::max(exit_code(body, true, log), code);
}

}  // namespace bsp2::jobs
