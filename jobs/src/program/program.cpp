#include "program/program.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <sstream>
#include <utility>

#include "answers/drawings.hpp"
#include "answers/outputs.hpp"
#include "answers/point_query.hpp"
#include "answers/progress_bar.hpp"
#include "answers/snapshot_info.hpp"
#include "answers/solver_mesh.hpp"
#include "answers/summary.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "options/command_line.hpp"
#include "program/queueing.hpp"
#include "program/signals.hpp"
#include "program/viewing.hpp"

namespace bsp2::jobs {
namespace {

constexpr int internal_error = 1, user_error = 2;

/// Everything that is said to the user goes through this: one line each on stderr.
spdlog::logger make_log() {
  spdlog::logger log("bsp2", std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log.set_pattern("bsp2: %v");
  return log;
}

/// What an interrupted run leaves in place although it is not its own. @param of_all also the snapshot that
/// it would have written.
std::vector<std::string> earlier_files(const RunCommand& command, bool of_all) {
  const auto is_there = [](const auto& file) { return file && std::filesystem::exists(*file); };
  std::vector<std::string> lines;
  const auto& snapshot = command.options.snapshot;
  const auto& resumed = command.options.resume;
  if (of_all && is_there(snapshot) && !(resumed && are_one_file(*snapshot, *resumed)))
    lines.push_back("'" + snapshot->string() +
                    "' is the snapshot of an earlier run: to resume it is not to go on with this one");
  if (command.folder && (is_there(command.mesh) || is_there(command.picture) || is_there(command.report) ||
                         is_there(command.snapshot_copy) ||
                         std::any_of(command.boundaries.begin(), command.boundaries.end(),
                                     [](const auto& file) { return std::filesystem::exists(file); })))
    lines.push_back("the other files in '" + command.folder->string() + "' are of an earlier run");
  return lines;
}

void tell_interruption(const RunCommand& command, spdlog::logger& log) {
  if (command.film)
    log.warn("interrupted; '{}' is not written", command.picture->string());
  else if (command.solver_mesh)
    log.warn("interrupted; '{}' is not written", command.solver_mesh->output.string());
  else if (const auto& snapshot = command.options.snapshot)
    log.warn("interrupted; '{}' holds what there is: go on with 'bsp2 resume {}{}'", snapshot->string(),
             snapshot->string(), command.folder ? " -o " + command.folder->string() : "");
  else
    log.warn("interrupted; nothing is written (with --snapshot FILE.h5 the run could be resumed)");
  for (const std::string& line : earlier_files(command, false)) log.warn("{}", line);
}

/// What a signal handler says, which can make no text of its own.
std::string farewell_of(const RunCommand& command) {
  std::string text = "bsp2: interrupted before there was anything to save\n";
  for (const std::string& line : earlier_files(command, true)) text += "bsp2: " + line + "\n";
  return text;
}

/// A plane model has no boundary to write. With -o that is no mistake and gets no warning, but who looks for
/// the file is told.
void tell_left_out(const RunCommand& command, const supersteps::RunReport& report, spdlog::logger& log) {
  if (report.dimension == 2 && command.folder &&
      command.boundaries == std::vector{*command.folder / boundary_name})
    log.info(
        "no {} is written: the model is plane, and boundaries are found for solids of dimension 3; "
        "--boundary "
        "writes its outline as {}",
        boundary_name, io::plane_endings());
}

void tell_written(std::ostream& out, const RunCommand& command, const supersteps::RunReport& report) {
  const char* name = "\n  written   ";
  for (const std::filesystem::path& file : written_files(command, report))
    out << std::exchange(name, "            ") << file.string() << '\n';
}

/// @return the exit code where some outputs failed: a mistake of ours weighs more than the user's.
int code_of(const supersteps::RunReport& report) {
  int code = 0;
  for (const auto& failed : report.failed)
    code = code == internal_error || !failed.is_users ? internal_error : user_error;
  return code;
}

/// One message for each output that could not be made. @return the exit code.
int tell_failed(const supersteps::RunReport& report, spdlog::logger& log) {
  for (const auto& failed : report.failed) log.error("{}", failed.text);
  return code_of(report);
}

/// A bar names each superstep that begins, as long as this is there; who listened before still does.
class FollowedSupersteps {
 public:
  FollowedSupersteps(supersteps::Ranks& ranks, ProgressBar& bar)
      : ranks_(ranks), before_(ranks.on_superstep) {
    ranks.on_superstep = [&bar, before = before_](const std::string& name, unsigned step) {
      bar.begin(name);
      if (before) before(name, step);
    };
  }
  ~FollowedSupersteps() { ranks_.on_superstep = before_; }
  FollowedSupersteps(const FollowedSupersteps&) = delete;
  FollowedSupersteps& operator=(const FollowedSupersteps&) = delete;

 private:
  supersteps::Ranks& ranks_;
  std::function<void(const std::string&, unsigned)> before_;
};

/// What the master says, on all ranks. Collective.
bool told_by_master(bool said, supersteps::Ranks& ranks) {
  if (ranks.is_master())
    for (int rank = 1; rank < ranks.count(); ++rank) ranks.send(rank, said ? "yes" : "no");
  ranks.sync();
  return ranks.is_master() ? said : ranks.received().front().bytes == "yes";
}

/// The mesh for solvers, on the master, which has all cells; a signal ends it. Collective.
std::optional<MeshSummary> mesh_cells(const RunCommand& command, supersteps::RunResult& result,
                                      supersteps::Ranks& ranks) {
  std::optional<MeshSummary> summary;
  bool is_over = false;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    const geometry::Interruption by_signal(command.options.interrupted);
    try {
      command.on_writing(command.solver_mesh->output);
      summary = make_solver_mesh(*command.solver_mesh, result);
    } catch (const geometry::Interrupted&) {
      is_over = true;
    }
  });
  result.report.interrupted = told_by_master(is_over, ranks);
  return summary;
}

/// On all ranks, and only the master speaks.
/// @return the exit code.
int run_command(RunCommand command, std::ostream& out, supersteps::Ranks& ranks, const Run& run,
                spdlog::logger& log) {
  if (command.timeout) ranks.set_timeout(*command.timeout);
  if (command.info) {
    if (ranks.is_master()) print_snapshot(out, *command.info);
    return 0;
  }
  if (command.checked_mesh) {
    if (!ranks.is_master()) return 0;
    for (const std::string& note : check_mesh_file(command, out)) log.info("note: {}", note);
    return 0;
  }
  if (command.options.resume) io::check_snapshot_is_readable(*command.options.resume);
  if (command.points && ranks.is_master()) {
    const io::SnapshotHead head = io::read_snapshot(*command.options.resume, io::SnapshotPart::head).head;
    if (!head.keep_in || !head.keep_fuzzy)
      throw Error("the snapshot '" + command.options.resume->string() +
                  "' does not keep all IN and FUZZY cells, so it cannot tell where points are; run the model "
                  "without --keep, or with --keep in,fuzzy");
    command.options.points = read_points(*command.points, head.dimension);
  }
  check_outputs(command);
  std::optional<JoinedSnapshot> joined;
  if (command.queue) command.options.resume = joined.emplace(command, ranks).path();
  const SignalWatch watch(ranks.is_master() ? farewell_of(command) : "", ranks.count() == 1);
  command.options.interrupted = SignalWatch::interrupted;
  const bool speaks = ranks.is_master() && (!command.quiet || command.film);  // which takes a while
  ProgressBar bar(speaks ? stderr : nullptr);
  const FollowedSupersteps followed(ranks, bar);
  command.options.on_progress = [&bar](double done, std::uint64_t cells) { bar.show(done, cells); };
  command.view.on_progress = [&bar](double done) { bar.show(done, 0); };
  command.on_writing = [&bar](const std::filesystem::path& file) {
    bar.begin("writing " + file.filename().string());
  };
  StepFailures step_failures;
  if (command.shows_steps())
    command.options.on_frame = [&](const supersteps::RunResult& now, unsigned step) {
      write_step(command, now, step, ranks, step_failures);
    };
  bool cells_are_written = false;
  if (!command.solver_mesh)  // which needs the cells to the end
    command.options.on_cells = [&](supersteps::RunResult& now) {
      write_cells(command, now, ranks);
      cells_are_written = true;
    };
  supersteps::RunResult result = run(command.options, ranks);
  for (const auto& failed : {step_failures.frames, step_failures.series})
    if (failed) result.report.failed.push_back(*failed);
  const auto end_early = [&] {
    bar.clear();
    const int code = tell_failed(result.report, log);
    const auto is_snapshot = [&](const supersteps::FailedOutput& failed) {
      return failed.file == command.options.snapshot;
    };
    if (std::any_of(result.report.failed.begin(), result.report.failed.end(), is_snapshot)) return code;
    tell_interruption(command, log);
    return interrupted_code;
  };
  if (result.report.interrupted) return end_early();
  if (command.points && ranks.is_master()) {
    bar.clear();
    print_answers(out, command.options.points, result.answers, result.report.dimension, command.json,
                  result.part_names);
  }
  if (command.drawing) write_drawings(command, result, ranks, run, out);
  if (!cells_are_written) write_cells(command, result, ranks);
  std::optional<MeshSummary> mesh;
  if (command.solver_mesh) mesh = mesh_cells(command, result, ranks);
  if (result.report.interrupted) return end_early();
  write_results(command, result, ranks,
                [&](const std::string& report) { return mesh ? with_mesh(report, *mesh) : report; });
  bar.clear();
  if (!ranks.is_master()) return code_of(result.report);
  for (const std::string& warning : result.report.warnings) log.warn("warning: {}", warning);
  for (const std::string& note : result.report.notes)
    if (!command.quiet || command.options.steps == 0U) log.info("note: {}", note);
  if (speaks) tell_left_out(command, result.report, log);
  if (speaks && !command.drawing)
    print_summary(out, result.report, (command.stats && !command.solver_mesh) || needs_table(result.report));
  if (speaks && mesh) print_mesh_summary(out, *mesh, command.stats);
  if (command.stats && !command.solver_mesh) print_stats(out, result.report);
  if (speaks) tell_written(out, command, result.report);
  return tell_failed(result.report, log);
}

/// Nobody reads on (a closed pipe) is fine; a full disk is not.
void finish(std::ostream& out) {
  out.flush();
  if (out) return;
  out.clear();
  errno = 0;
  out << '\n' << std::flush;  // what went wrong may be long ago: another attempt tells why
  if (!out && errno != EPIPE && errno != 0)
    throw Error("cannot write to standard output: " + std::generic_category().message(errno));
}

/// @return the exit code of what `body` does; only one of the ranks tells why it failed.
int exit_code(const std::function<int()>& body, bool speaks, spdlog::logger& log) {
  if (!speaks) log.set_level(spdlog::level::off);
  try {
    return body();
  } catch (const Error& error) {
    log.error("{}", error.what());
    return error.is_users_mistake() ? user_error : internal_error;
  } catch (const supersteps::Failure& failure) {
    log.error("{}", failure.what());
    return internal_error;
  } catch (const std::bad_alloc&) {
    log.error("out of memory");
    return internal_error;
  } catch (const std::exception& error) {
    log.error("internal error: {}", error.what());
    return internal_error;
  }
}

}  // namespace

int program(const std::vector<std::string>& arguments, std::ostream& out, supersteps::Ranks& ranks,
            const Run& run) {
  spdlog::logger log = make_log();
  const auto body = [&] {
    std::ostringstream ignored;
    std::ostream& speech = ranks.is_master() ? out : ignored;
    const auto command = parse_command_line(arguments, speech);
    if (command && !command->tables.empty() && ranks.count() > 1)
      throw Error("'bsp2 tables' measures node after node in one process: start it without mpirun");
    int code = 0;
    if (command && !command->tables.empty())
      tables_command(*command, out);
    else if (command && command->queue && command->queue->action != QueueCommand::Action::merge)
      code = queue_command(*command, speech);
    else if (command && command->viewer)
      code = view_command(*command, speech, ranks, run, log);
    else if (command)
      ranks.together([&] { code = run_command(*command, out, ranks, run, log); });
    finish(speech);
    return code;
  };
  return exit_code(body, ranks.is_master(), log);
}

int program(const std::vector<std::string>& arguments, std::ostream& out) {
  int code = 0;
  spdlog::logger log = make_log();
  const auto body = [&] {
    // Workers of a queue are alone, whoever started them: those of one launcher do not wait for each other.
    const bool is_alone = arguments.size() > 1 && arguments[0] == "jobs" && arguments[1] != "merge";
    supersteps::Ranks ranks = is_alone ? supersteps::Ranks() : supersteps::Ranks::launched();
    const auto run = [](const supersteps::RunOptions& options, supersteps::Ranks& all) {
      return supersteps::run(options, all);
    };
    code = program(arguments, out, ranks, run);
    return code;
  };
  return std::max(exit_code(body, true, log), code);
}

}  // namespace bsp2::jobs
