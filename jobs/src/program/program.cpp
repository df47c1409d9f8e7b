#include "program/program.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <sstream>
#include <utility>

#include "answers/mesh_summary.hpp"
#include "answers/point_query.hpp"
#include "answers/progress_bar.hpp"
#include "answers/snapshot_info.hpp"
#include "answers/summary.hpp"
#include "bsp2/geometry/support/counted.hpp"
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
  std::error_code ignored;
  const auto is_there = [](const auto& file) { return file && std::filesystem::exists(*file); };
  std::vector<std::string> lines;
  const Outputs& outputs = command.options.outputs;
  const auto& snapshot = command.options.snapshot;
  const auto& resumed = command.resume;
  if (of_all && is_there(snapshot) && !(resumed && std::filesystem::equivalent(*snapshot, *resumed, ignored)))
    lines.push_back("'" + snapshot->string() +
                    "' is the snapshot of an earlier run: to resume it is not to go on with this one");
  if (outputs.folder && (is_there(outputs.cells) || is_there(outputs.picture) || is_there(outputs.report) ||
                         is_there(outputs.snapshot) ||
                         std::any_of(outputs.surfaces.begin(), outputs.surfaces.end(),
                                     [](const auto& file) { return std::filesystem::exists(file); })))
    lines.push_back("the other files in '" + outputs.folder->string() + "' are of an earlier run");
  return lines;
}

/// What a command makes that ends without it when it is interrupted: a snapshot has all else.
std::optional<std::filesystem::path> file_given_up(const RunCommand& command) {
  const Outputs& outputs = command.options.outputs;
  if (outputs.film) return outputs.picture;
  if (outputs.solver_mesh) return outputs.solver_mesh->file;
  if (command.options.stop_gently) return std::nullopt;
  if (outputs.drawing) return outputs.drawing->files.front();
  if (outputs.picture) return outputs.picture;
  return outputs.surfaces.empty() ? outputs.cells : outputs.surfaces.front();
}

/// Whether there are others than those of the folder, which its name brings along.
bool has_more_files(const Outputs& outputs) {
  const auto is_more = [&](const std::optional<std::filesystem::path>& file) {
    return file && !(outputs.folder && file->parent_path() == *outputs.folder);
  };
  return is_more(outputs.cells) || is_more(outputs.picture) || is_more(outputs.report) ||
         is_more(outputs.table) || is_more(outputs.series) || outputs.frames ||
         std::ranges::any_of(outputs.surfaces, is_more);
}

void tell_interruption(const RunCommand& command, spdlog::logger& log) {
  const Outputs& outputs = command.options.outputs;
  if (const auto file = file_given_up(command))
    log.warn("interrupted; '{}' is not written", file->string());
  else if (const auto& snapshot = command.options.snapshot)
    log.warn("interrupted; '{}' holds what there is: go on with 'bsp2 resume {}{}'{}", snapshot->string(),
             snapshot->string(), outputs.folder ? " -o " + outputs.folder->string() : "",
             has_more_files(outputs) ? ", and with the options of the other files" : "");
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
void tell_left_out(const Outputs& outputs, const Figures& figures, spdlog::logger& log) {
  if (figures.dimension == 2 && outputs.folder &&
      outputs.surfaces == std::vector{*outputs.folder / Outputs::surface_name})
    log.info(
        "no {} is written: the model is plane, and boundaries are found for solids of dimension 3; "
        "--boundary "
        "writes its outline as {}",
        Outputs::surface_name, endings().outlines);
}

void tell_written(std::ostream& out, const Figures& figures) {
  const char* name = "\n  written   ";
  for (const std::filesystem::path& file : figures.written)
    out << std::exchange(name, "            ") << file.string() << '\n';
}

void tell_drawing(std::ostream& out, const Figures::Drawing& drawing) {
  out << fmt::format(
      "{} on {}, scale {}\n", counted(drawing.lines, "# line[s]"), drawing.sheet,
      drawing.scale >= 1 ? fmt::format("{:g}:1", drawing.scale) : fmt::format("1:{:g}", 1 / drawing.scale));
}

/// @return the exit code where some outputs failed: a mistake of ours weighs more than the user's.
int code_of(const Figures& figures) {
  int code = 0;
  for (const auto& failed : figures.failed)
    code = code == internal_error || !failed.is_users_mistake ? internal_error : user_error;
  return code;
}

/// One message for each output that could not be made. @return the exit code.
int tell_failed(const Figures& figures, spdlog::logger& log) {
  for (const auto& failed : figures.failed) log.error("{}", failed.text);
  return code_of(figures);
}

/// @return the exit code.
int tell_early_end(const RunCommand& command, const Figures& figures, spdlog::logger& log) {
  const int code = tell_failed(figures, log);
  const auto is_snapshot = [&](const Figures::Failed& failed) {
    return failed.file == command.options.snapshot;
  };
  if (std::any_of(figures.failed.begin(), figures.failed.end(), is_snapshot)) return code;
  tell_interruption(command, log);
  return interrupted_code;
}

/// Before anything is computed; on the master, elsewhere there are none. Collective.
std::vector<double> points_of(const RunCommand& command, const Ranks& ranks) {
  std::vector<double> points;
  ranks.together([&] {
    if (!command.points || !ranks.is_master()) return;
    const SnapshotInfo info = snapshot_info(*command.resume);
    if (!info.keep_in || !info.keep_fuzzy)
      throw Error("the snapshot '" + command.resume->string() +
                  "' does not keep all IN and FUZZY cells, so it cannot tell where points are; run the model "
                  "without --keep, or with --keep in,fuzzy");
    points = read_points(*command.points, info.dimension);
  });
  return points;
}

void answer(const RunCommand& command, const Result& result, const std::vector<double>& points,
            std::ostream& out) {
  std::vector<std::string> names;
  for (const Part& part : result.parts()) names.push_back(part.name);
  print_answers(out, points, result.locate(points), result.dimension(), command.json, names);
}

/// Evaluates as the command says, under a bar. Collective.
Result evaluated(const RunCommand& command, const Ranks& ranks, ProgressBar& bar) {
  Options options = command.options;
  options.outputs_only = !command.points;
  if (options.budget && options.snapshot && !options.steps)
    options.steps = std::numeric_limits<unsigned>::max();  // until all is decided, with a snapshot each time
  // Before a snapshot has been read there is nothing to lose: nobody asks, and a signal ends all at once.
  bool has_read = options.stop_gently || ranks.count() > 1;
  options.stop = [&has_read] { return has_read && SignalWatch::interrupted(); };
  options.progress = [&bar, &has_read, begun = 0U](const Progress& now) mutable {
    has_read = has_read || now.phase != Phase::preparation;
    if (std::exchange(begun, now.begun) != now.begun)
      bar.begin(now.superstep);
    else
      bar.show(now.done, now.phase == Phase::computation ? now.cells : 0);
  };
  return command.resume ? resume(*command.resume, options, ranks) : evaluate(command.model, options, ranks);
}

/// What a run has found, on the master. @return the exit code.
int tell(const RunCommand& command, const Figures& figures, bool speaks, std::ostream& out,
         spdlog::logger& log) {
  const Outputs& outputs = command.options.outputs;
  if (figures.drawing && !command.quiet) tell_drawing(out, *figures.drawing);
  for (const std::string& warning : figures.warnings) log.warn("warning: {}", warning);
  for (const std::string& note : figures.notes)
    if (!command.quiet || command.options.steps == 0U) log.info("note: {}", note);
  if (speaks) tell_left_out(outputs, figures, log);
  if (speaks && !outputs.drawing)
    print_summary(out, figures, (command.stats && !outputs.solver_mesh) || needs_table(figures));
  if (speaks && figures.solver_mesh) print_mesh_summary(out, *figures.solver_mesh, command.stats);
  if (command.stats && !outputs.solver_mesh) print_stats(out, figures);
  if (speaks) tell_written(out, figures);
  return tell_failed(figures, log);
}

/// On all ranks, and only the master speaks.
/// @return the exit code.
int run_command(RunCommand command, std::ostream& out, const Ranks& ranks, spdlog::logger& log) {
  if (command.info) {
    if (ranks.is_master()) print_snapshot(out, *command.info);
    return 0;
  }
  if (command.checked_mesh) {
    if (!ranks.is_master()) return 0;
    for (const std::string& note : check_mesh_file(command, out)) log.info("note: {}", note);
    return 0;
  }
  const std::vector<double> points = points_of(command, ranks);
  std::optional<JoinedSnapshot> joined;
  if (command.queue) command.resume = joined.emplace(command, ranks).path();
  const SignalWatch watch(ranks.is_master() ? farewell_of(command) : "",
                          ranks.count() == 1 && command.options.stop_gently);
  const bool speaks = ranks.is_master() && !command.quiet;
  ProgressBar bar(speaks ? stderr : nullptr);
  const Result result = evaluated(command, ranks, bar);
  bar.clear();
  const Figures figures = result.figures();
  if (figures.is_interrupted) return tell_early_end(command, figures, log);
  if (!ranks.is_master()) return code_of(figures);
  if (command.points) answer(command, result, points, out);
  return tell(command, figures, speaks, out, log);
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
  } catch (const std::filesystem::filesystem_error& error) {
    log.error("'{}': {}", error.path1().string().substr(0, 200), error.code().message());
    return user_error;
  } catch (const std::bad_alloc&) {
    log.error("out of memory");
    return internal_error;
  } catch (const std::exception& error) {
    log.error("internal error: {}", error.what());
    return internal_error;
  }
}

}  // namespace

int program(const std::vector<std::string>& arguments, std::ostream& out, const Ranks& ranks) {
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
      code = view_command(*command, speech, ranks, log);
    else if (command)
      code = run_command(*command, out, ranks, log);
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
    code = program(arguments, out, is_alone ? Ranks() : Ranks::launched());
    return code;
  };
  return std::max(exit_code(body, true, log), code);
}

}  // namespace bsp2::jobs
