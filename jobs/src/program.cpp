#include "bsp2/jobs/program.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <exception>

#include "bsp2/geometry/error.hpp"
#include "bsp2/jobs/command_line.hpp"
#include "bsp2/jobs/outputs.hpp"
#include "bsp2/jobs/progress_bar.hpp"
#include "bsp2/jobs/summary.hpp"

namespace bsp2::jobs {
namespace {

constexpr int ours = 1, users = 2;

/// Everything that is said to the user goes through this: one line each on stderr.
spdlog::logger make_log() {
  spdlog::logger log("bsp2", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log.set_pattern("bsp2: %v");
  return log;
}

void run_command(RunCommand command, std::ostream& out,
                 const std::function<supersteps::RunResult(const supersteps::RunOptions&)>& run,
                 spdlog::logger& log) {
  check_outputs(command);
  ProgressBar bar(stderr);
  if (!command.quiet)
    command.options.on_progress = [&bar](double done, std::uint64_t cells) { bar.show(done, cells); };
  supersteps::RunResult result = run(command.options);
  bar.clear();
  write_outputs(command, result);
  for (const std::string& warning : result.report.warnings) log.warn("warning: {}", warning);
  if (!command.quiet) print_summary(out, result.report);
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

}  // namespace

int program(const std::vector<std::string>& arguments, std::ostream& out,
            const std::function<supersteps::RunResult(const supersteps::RunOptions&)>& run) {
  spdlog::logger log = make_log();
  try {
    if (const auto command = parse_command_line(arguments, out)) run_command(*command, out, run, log);
    finish(out);
    return 0;
  } catch (const Error& error) {
    log.error("{}", error.what());
    return users;
  } catch (const std::bad_alloc&) {
    log.error("out of memory");
    return ours;
  } catch (const std::exception& error) {
    log.error("internal error: {}", error.what());
    return ours;
  }
}

}  // namespace bsp2::jobs
