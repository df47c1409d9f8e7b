#include "options/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <ostream>
#include <span>

#include "help/help.hpp"
#include "help/version.hpp"
#include "options/checks.hpp"
#include "options/drawing_options.hpp"
#include "options/mesh_options.hpp"
#include "options/output_options.hpp"
#include "options/paths.hpp"
#include "options/queue_options.hpp"
#include "options/render_options.hpp"
#include "options/view_options.hpp"
#include "options/work_options.hpp"

namespace bsp2::jobs {
namespace {

constexpr auto run_footer =
    "Examples:\n"
    "  bsp2 run model.csg                     evaluate and print a summary\n"
    "  bsp2 run model.csg -o out              and write mesh, surface and picture\n"
    "  mpirun -n 4 bsp2 run model.csg         the same on four processes\n"
    "\n"
    "  bsp2 run model.csg --picture tower.png --threads 4\n"
    "  bsp2 run model.csg --snapshot run.h5   also save the state of the run now and\n"
    "                                         then; after a stop: bsp2 resume run.h5\n"
    "Models are OpenSCAD's .csg files (openscad -o model.csg model.scad); .scad\n"
    "files are translated if the program openscad is installed.\n"
    "Exit code: 0 success, 2 a mistake in the options, the model or a path, 1 an\n"
    "error of bsp2 itself, 75 ended early by SIGINT, SIGTERM or SIGUSR1.";

/// Options as they are typed, before they mean something.
struct Raw {
  WorkText work;
  OutputText output;
  RenderText render;
  DrawingText drawing;
  MeshText solver_mesh;
  std::string exported, points, viewed, view_eye;
};

void add_tables_options(CLI::App& app, RunCommand& command) {
  add_input(app, "MODEL", command.model, model_words);
  command.tables = {1, 2, 4, 8, 16};
  app.add_option("--regions", command.tables, "numbers of nodes (default: 1,2,4,8,16)")
      ->delimiter(',')
      ->check(is_number(1U, 4096U, "1 .. 4096"))
      ->type_name("N,N,...");
  auto* const levels =
      app.add_option(
             "--levels", command.levels,
             "coarse resolutions: two levels (default: those above\nwhich 5 % and 25 % of the cells lie)")
          ->delimiter(',')
          ->check(is_number(1U, 65535U, "1 .. 65535"))
          ->type_name("A,B");
  auto* const brief =
      app.add_flag("--brief", command.brief,
                   "table 1 alone, to the end, without boundaries: much\nsooner for large models")
          ->excludes(levels);
  app.add_flag("--surface", command.of_surface,
               "what the surface takes, found without cells and put\ntogether by all nodes")
      ->excludes(levels)
      ->excludes(brief);
  app.add_option("--threads", command.options.threads, "threads of a node; 0: one a core")
      ->check(is_number(0U, 4096U, "0 .. 4096"))
      ->type_name("N");
}

void add_export_options(CLI::App& app, RunCommand& command, Raw& raw) {
  add_input(app, "SNAPSHOT", command.resume, snapshot_words);
  add_path(app, "-o,--output", raw.exported,
           ".pvtu: the cells, FUZZY where nothing is decided\nyet; else the surface of the IN cells, as the "
           "ending\nsays (see --list-formats)",
           "FILE")
      ->required();
  add_clean_option(app, command);
  add_list_formats_option(app, raw.output);
  app.add_flag("--tets", command.options.outputs.tets, "cut the cells into tetrahedra in a .pvtu");
}

void add_query_options(CLI::App& app, RunCommand& command, Raw& raw) {
  add_input(app, "SNAPSHOT", command.resume, snapshot_words);
  add_path(app, "--points", raw.points,
           "a text with the coordinates of a point on each line;\n-: standard input", "FILE")
      ->required();
  app.add_flag("--json", command.json, "answer as JSON, not as a table");
  add_threads_option(app, command, "Options");
  app.footer(
      "The distance is that to the nearest point with another label, negative in the\nsolid. What is FUZZY "
      "counts as both.");
}

/// The commands below `bsp2 jobs`, with options that others have, too.
QueueCommands add_queue(CLI::App& app, RunCommand& command, Raw& raw) {
  const QueueCommands queue = add_queue_commands(app, command);
  add_model_options(*queue.split, command, raw.work);
  add_tolerance_option(*queue.split, command);
  add_threads_option(*queue.run, command);
  add_threads_option(*queue.merge, command);
  add_budget_option(*queue.run, raw.work, "divide a job that takes longer (60s)");
  add_cells_option(*queue.run, command, "divide a job that gets more cells than about N");
  add_output_options(*queue.merge, command, raw.output);
  return queue;
}

/// Those that say later what was asked for.
struct Commands {
  CLI::App *exported, *render, *view, *tables, *draw;
  QueueCommands queue;
};

/// In the order of the help.
Commands add_commands(CLI::App& app, RunCommand& command, Raw& raw) {
  Commands commands{};
  CLI::App* run = app.add_subcommand("run", "Evaluate a model");
  add_input(*run, "MODEL", command.model, model_words);
  add_model_options(*run, command, raw.work);
  add_work_options(*run, command, raw.work);
  add_output_options(*run, command, raw.output);
  run->footer(run_footer);
  CLI::App* resume = app.add_subcommand("resume", "Go on with a run that was stopped");
  add_input(*resume, "SNAPSHOT", command.resume, std::string(snapshot_words) + "; kept up to date");
  add_work_options(*resume, command, raw.work);
  add_output_options(*resume, command, raw.output);
  resume->footer("Ends with the cells of an uninterrupted run, whatever the number of threads\nand stops.");
  CLI::App* info = app.add_subcommand("info", "Tell what a snapshot holds");
  add_input(*info, "SNAPSHOT", command.info, snapshot_words);
  commands.exported = app.add_subcommand("export", "Write the cells of a snapshot, or their surface");
  add_export_options(*commands.exported, command, raw);
  commands.render = add_render_command(app, command, raw.render, raw.work);
  commands.view = add_view_command(app, command, raw.viewed, raw.view_eye);
  add_model_options(*commands.view, command, raw.work);
  add_work_options(*commands.view, command, raw.work);
  describe_for_view(*commands.view);
  CLI::App* query = app.add_subcommand("query", "Tell where points are, and how far from the surface");
  add_query_options(*query, command, raw);
  add_mesh_command(app, command, raw.solver_mesh, raw.work);
  commands.tables = app.add_subcommand("tables", "Measure the paper's tables 1 to 6 for a model");
  add_tables_options(*commands.tables, command);
  commands.draw = add_draw_command(app, command, raw.drawing);
  add_solid_options(*commands.draw, command, raw.work);
  add_tolerance_option(*commands.draw, command);
  add_threads_option(*commands.draw, command);
  commands.queue = add_queue(app, command, raw);
  return commands;
}

void set_export(Outputs& outputs, const std::filesystem::path& path) {
  if (path.extension() == ".pvtu")
    outputs.cells = path;
  else if (file_format(path).surface)
    outputs.surfaces = {path};
  else
    throw Error("-o: '" + path.string() + "' must end in .pvtu (the cells), or in " + endings().surfaces +
                " (their surface)");
  if (outputs.tets && !outputs.cells) throw Error("--tets: only .pvtu files have cells");
}

void set_eye(RunCommand& command, const Raw& raw) {
  const std::string& eye = command.viewer ? raw.view_eye : raw.output.view.eye;
  const bool is_by_view = raw.work.order == "view" && !command.viewer;
  if (!is_by_view && !command.options.angle) return;
  if (eye.empty())
    throw Error(std::string(raw.work.order == "view" ? "--order view" : "--angle") +
                ": add --eye X,Y,Z, from where the model is looked at");
  command.options.eye = eye_of(eye);
}

/// What is only shown as it is: nothing is computed.
void set_shown(RunCommand& command, const Raw& raw) {
  if (raw.exported.empty() && raw.points.empty()) return;
  command.options.steps = 0;
  command.quiet = true;
  if (!raw.exported.empty()) set_export(command.options.outputs, raw.exported);
  if (raw.points.empty()) return;
  command.points = raw.points;
  command.options.collect = Collect::master;  // who is asked
}

/// Whether a surface may be found without cells: nothing that shows them is asked for, nor says how many. Of
/// a snapshot it may be there.
bool is_surface_alone(const RunCommand& command, const Raw& raw) {
  if (!raw.exported.empty()) return !command.options.outputs.surfaces.empty();
  const Options& options = command.options;
  const Outputs& outputs = options.outputs;
  const bool has_limits = options.level || options.budget || options.cells || options.steps ||
                          options.angle || options.tolerance || options.regions;
  return !outputs.surfaces.empty() && !outputs.cells && !outputs.picture && !outputs.of_steps() &&
         !command.points && !options.snapshot && !command.resume && raw.work.keep.empty() && !has_limits;
}

/// What was asked for, and what that means.
RunCommand finished(RunCommand command, const Raw& raw) {
  choose_work(raw.work, command.options);
  if (command.options.outputs.drawing) {
    choose_drawing(raw.drawing, command);
    return command;
  }
  set_eye(command, raw);
  if (command.viewer) {
    choose_view_command(command, raw.viewed, raw.work.order, raw.view_eye);
    return command;
  }
  set_shown(command, raw);
  choose_outputs(raw.output, command);
  if (!raw.render.input.empty()) choose_rendering(raw.render, command);
  if (!raw.solver_mesh.input.empty()) choose_mesh(raw.solver_mesh, command);
  command.options.surface_only = is_surface_alone(command, raw);
  return command;
}

/// "split, run, merge or status"
std::string spoken(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names)
    text += (&name == &names.front() ? "" : &name == &names.back() ? " or " : ", ") + name;
  return text;
}

/// What an option that is not there was meant to be.
std::string suggested_option(const CLI::App& app, const std::string& command, const std::string& word) {
  if (!word.starts_with("--")) return {};
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  const std::string given = word.substr(0, word.find('='));
  if (std::find(names.begin(), names.end(), given) != names.end())
    return "; it belongs after the command: '" + command + " " + given + "'";
  return suggestion(given, std::vector<std::string_view>(names.begin(), names.end()));
}

std::string suggested_command(const CLI::App& app, const std::string& word) {
  const std::vector<std::string> names = command_names(app);
  return suggestion(word, std::vector<std::string_view>(names.begin(), names.end()));
}

[[noreturn]] void fail(const CLI::ParseError& error, const CLI::App& app) {
  const CLI::App* innermost = &app;
  std::string name = "bsp2";
  for (auto parsed = app.get_subcommands(); !parsed.empty(); parsed = innermost->get_subcommands()) {
    innermost = parsed.front();
    name += " " + innermost->get_name();
  }
  const std::string hint = " (see '" + name + " --help')";
  const bool lacks_command = !innermost->get_subcommands({}).empty();
  using CLI::ExitCodes;
  if (const int code = error.get_exit_code();
      code == static_cast<int>(ExitCodes::ExtrasError) || code == static_cast<int>(ExitCodes::RequiredError))
    if (const auto unknown = app.remaining(true); !unknown.empty()) {
      const std::string& word = unknown.front();
      if (lacks_command && !word.starts_with('-'))
        throw Error("unknown command '" + name + " " + word + "'" + suggested_command(*innermost, word) +
                    hint);
      throw Error("unknown option or argument '" + word + "'" + suggested_option(*innermost, name, word) +
                  hint);
    }
  if (innermost == &app) throw Error("a command is required, for example 'bsp2 run MODEL'" + hint);
  if (lacks_command)
    throw Error("'" + name + "' needs a command: " + spoken(command_names(*innermost)) + hint);
  throw Error(error.what() + hint);
}

/// Before anything is read: CLI11 would take a mistyped command for an argument.
void check_command(const CLI::App& app, const std::vector<std::string>& arguments) {
  if (arguments.empty() || arguments.front().starts_with('-')) return;
  const std::string& word = arguments.front();
  const std::vector<std::string> names = command_names(app);
  if (std::find(names.begin(), names.end(), word) != names.end()) return;
  if (word.ends_with(".csg") || word.ends_with(".scad"))
    throw Error("unknown command '" + word + "' (did you mean 'bsp2 run " + word + "'? See 'bsp2 --help')");
  throw Error("unknown command '" + word + "'" + suggested_command(app, word) + " (see 'bsp2 --help')");
}

/// Commands about the command line itself. @return whether it was one of them, and has been printed.
struct AboutCommands {
  CLI::App *completion, *manual;
  std::string shell;
  bool print(const CLI::App& app, std::ostream& out) const {
    if (completion->parsed()) out << completion_script(shell);
    if (manual->parsed()) out << manual_page(app);
    return completion->parsed() || manual->parsed();
  }
};

void add_about_commands(CLI::App& app, AboutCommands& about) {
  about.completion = app.add_subcommand("completion", "Print what completes these words in a shell");
  about.completion->add_option("SHELL", about.shell, "bash, zsh or fish")
      ->required()
      ->check(is_one_of({"bash", "zsh", "fish"}));
  about.completion->footer("Example:\n  source <(bsp2 completion bash)");
  about.manual = app.add_subcommand("manual", "Print the manual page");
  about.manual->footer("Example:\n  bsp2 manual | man -l -");
}

}  // namespace

std::optional<RunCommand> parse_command_line(const std::vector<std::string>& arguments, std::ostream& out) {
  RunCommand command;
  Raw raw;
  CLI::App app("Evaluates a solid model into an exact mesh of convex cells, in parallel.", "bsp2");
  app.set_version_flag("--version", version_text(), "Print the version, also of the libraries in use");
  app.formatter(make_help_formatter());
  app.get_formatter()->column_width(28);
  app.set_help_flag("-h,--help", "Print this help");
  app.set_help_all_flag("--help-all", "Print help with all options");
  app.require_subcommand(1);
  const Commands commands = add_commands(app, command, raw);
  AboutCommands about;
  add_about_commands(app, about);
  if (!arguments.empty() && arguments.front() == completion_word) {
    out << completion_lines(app, std::span(arguments).subspan(1));
    return std::nullopt;
  }
  check_command(app, arguments);
  try {
    const auto given = with_edges(arguments);
    app.parse(std::vector<std::string>(given.rbegin(), given.rend()));  // CLI11 takes them from the back
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() != 0) fail(error, app);
    if (raw.output.list_formats) {
      out << "Written (--boundary FILE):\n\n"
          << surface_format_table() << "\nRead (as the model, or by import()):\n\n"
          << import_format_table();
      return std::nullopt;
    }
    app.exit(error, out, out);  // help or version
    return std::nullopt;
  }
  if (about.print(app, out)) return std::nullopt;
  if (!commands.tables->parsed()) command.tables.clear();
  if (!commands.view->parsed()) command.viewer.reset();
  if (!commands.draw->parsed()) command.options.outputs.drawing.reset();
  choose_queue_command(commands.queue, command);
  command.options.dashes = "--";
  command.options.stop_gently =
      !commands.exported->parsed() && !commands.render->parsed() && !commands.draw->parsed();
  return finished(std::move(command), raw);
}

}  // namespace bsp2::jobs
