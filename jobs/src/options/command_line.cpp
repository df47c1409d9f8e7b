#include "options/command_line.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <ostream>
#include <span>

#include "options/checks.hpp"
#include "options/drawing_options.hpp"
#include "options/film_options.hpp"
#include "options/help.hpp"
#include "options/mesh_options.hpp"
#include "options/picture_options.hpp"
#include "options/queue_options.hpp"
#include "options/version.hpp"
#include "options/view_options.hpp"

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
  std::string order, budget, folder, picture, frames, report, table, collect, snapshot, parts, exported,
      rendered, drawn_input, points, series, viewed, view_eye;
  PictureText view;
  FilmText film;
  DrawingText drawing;
  MeshText solver_mesh;
  std::vector<std::string> keep, boundaries;
  bool mesh = false, list_formats = false;
};

CLI::Validator finite_share() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= 0 && value <= 0.01) return {};
            return "must be between 0 and 0.01, not " + text;
          },
          "0 .. 0.01"};
}

CLI::Validator positive_number() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value)) return {};
            return "must be a length above 0, not " + text;
          },
          "> 0"};
}

CLI::Validator acute_angle() {
  return {[](const std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value > 0 && value < 90) return {};
            return "must be an angle above 0 and below 90 degrees, not " + text;
          },
          "0 .. 90"};
}

/// An option that names a file or a folder.
CLI::Option* add_path(CLI::App& app, const std::string& option, std::string& path,
                      const std::string& description, const std::string& type) {
  return app.add_option(option, path, description)->check(is_named())->type_name(type);
}

/// What a command works on: it has to be there.
template <class Path>
void add_input(CLI::App& app, const char* name, Path& path, const char* description) {
  app.add_option(name, path, description)->required()->check(is_named())->type_name("");
}

CLI::Validator some_cells() { return is_number(std::uint64_t{1}, std::uint64_t{1} << 62, "1 or more"); }

constexpr auto work_group = "What is computed";

/// What the text of a model is taken for.
void add_solid_options(CLI::App& app, RunCommand& command, Raw& raw, const char* group) {
  auto& options = command.options;
  app.add_flag("--curved", options.curved,
               "take spheres, cylinders, circles as truly round:\nFUZZY cells hold their surfaces (see "
               "--tolerance)")
      ->group(group);
  app.add_option(
         "--parts", raw.parts,
         "what the parts of the model are: named (its part\nnodes; default), or colour (each colour is one)")
      ->check(is_one_of({"named", "colour", "color"}))
      ->type_name("KIND")
      ->group(group);
  app.add_option("--coincidence", options.coincidence,
                 "planes closer than this share of the bounding box\nare one; 0: only equal planes")
      ->check(finite_share())
      ->type_name("T")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--strict", options.strict, "end with an error where there is a warning")->group(group);
}

/// What fixes the cells from the start.
void add_model_options(CLI::App& app, RunCommand& command, Raw& raw) {
  auto& options = command.options;
  const auto group = work_group;
  app.add_option("--regions", options.regions,
                 "divide space into N regions, rounded up to a power\nof two (default: chosen by the size of "
                 "the model)")
      ->check(is_number(1U, 1U << 20, "1 .. 1048576"))
      ->type_name("N")
      ->group(group);
  app.add_option(
         "--keep", raw.keep,
         "keep only cells of this kind: in, fuzzy or out;\nrepeat for several (default: in and fuzzy)")
      ->check(is_one_of({"in", "fuzzy", "out"}))
      ->delimiter(',')
      ->allow_extra_args(false)
      ->type_name("KIND")
      ->group(group);
  add_solid_options(app, command, raw, group);
}

void add_threads_option(CLI::App& app, RunCommand& command, const char* group) {
  app.add_option("--threads", command.options.threads, "threads of this process; 0: one a core")
      ->check(is_number(0U, 4096U, "0 .. 4096"))
      ->type_name("N")
      ->group(group);
}

void add_tolerance_option(CLI::App& app, RunCommand& command, const char* group) {
  app.add_option("--tolerance", command.options.tolerance,
                 "refine what is round down to cells so thin\n"
                 "(default: a thousandth of the model, a sixteenth in\n"
                 "four dimensions, more above)")
      ->check(positive_number())
      ->type_name("H")
      ->group(group);
}

/// What may differ from one session of a run to the next.
void add_work_options(CLI::App& app, RunCommand& command, Raw& raw) {
  auto& options = command.options;
  const auto group = work_group;
  add_threads_option(app, command, group);
  app.add_option("--level", options.level, "stop after N cuts in a row; the rest stays FUZZY")
      ->check(is_number(0U, 65535U, "0 .. 65535"))
      ->type_name("N")
      ->group(group);
  add_tolerance_option(app, command, group);
  app.add_option(
         "--budget", raw.budget,
         "stop after a time: 2s, 500ms, 1min, or seconds;\nwith --snapshot: the time between two (30s)")
      ->type_name("TIME")
      ->group(group);
  app.add_option("--cells", options.cells, "stop at about N cells")
      ->check(some_cells())
      ->type_name("N")
      ->group(group);
  app.add_option("--steps", options.steps, "end after N steps as long as --budget says")
      ->check(is_number(1U, 1U << 30, "1 or more"))
      ->type_name("N")
      ->group(group);
  app.add_option("--angle", options.angle,
                 "stop where FUZZY cells are seen thinner than this\n"
                 "from --eye; 0.1 is three pixels of a picture of\n"
                 "1000 that is 30 degrees wide")
      ->check(acute_angle())
      ->type_name("DEGREES")
      ->group(group);
  app.add_option(
         "--order", raw.order,
         "which cell is refined next: depth, priority (the\nlargest) or view (what looks largest from --eye)")
      ->check(is_one_of({"depth", "priority", "view"}))
      ->type_name("ORDER")
      ->group(group);
}

/// Asks for the table of formats, and for nothing else.
CLI::Option* add_list_formats_option(CLI::App& app, Raw& raw) {
  const auto ask = [&raw](std::int64_t) {
    raw.list_formats = true;
    throw CLI::Success();  // the rest of the command line does not matter, nor what it lacks
  };
  return app.add_flag_function("--list-formats", ask, "print the formats of surfaces");
}

CLI::Option* add_clean_option(CLI::App& app, RunCommand& command) {
  return app
      .add_option("--clean", command.options.outputs.clean,
                  "surfaces without shorter edges, thinner triangles;\n0: as they are (default: what the "
                  "format\ntells "
                  "apart)")
      ->check(is_number(0.0, 1e300, "0 or more"))
      ->type_name("LENGTH");
}

void add_output_options(CLI::App& app, RunCommand& command, Raw& raw) {
  const auto group = "What is written";
  add_path(app, "-o,--output", raw.folder,
           "write everything into this folder:\nreport.json, solid.pvtu with its pieces, "
           "boundary.stl,\nview.png and snapshot.h5",
           "DIR")
      ->group(group);
  app.add_flag("--vtu", raw.mesh, "write the cells as solid.pvtu (without -o: here)")->group(group);
  app.add_flag("--tets", command.options.outputs.tets, "cut the cells into tetrahedra in solid.pvtu")
      ->group(group);
  add_path(app, "--snapshot", raw.snapshot, "write the state of the run, after each step", "FILE.h5")
      ->group(group);
  app.add_option("--boundary", raw.boundaries,
                 "write the surface, closed triangles, as the file's\nending says (see --list-formats), of "
                 "plane models "
                 "the\noutline; repeat for several")
      ->check(is_named())
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->group(group);
  add_clean_option(app, command)->group(group);
  add_list_formats_option(app, raw)->group(group);
  add_path(app, "--picture", raw.picture, "draw the solid: .png, .svg or .pdf", "FILE")->group(group);
  add_path(app, "--frames", raw.frames,
           "draw what there is after each step (--budget; 1s):\nPREFIX0000.png and so on", "PREFIX")
      ->group(group);
  add_path(
      app, "--series", raw.series,
      "write the cells after each step (--budget; 1s), and\nFILE.pvd, which shows them over time in ParaView",
      "FILE.pvd")
      ->group(group);
  add_path(app, "--report", raw.report, "write the report", "FILE.json")->group(group);
  add_path(app, "--table", raw.table, "write what each superstep cost each rank", "FILE.csv")->group(group);
  app.add_option("--collect", raw.collect,
                 "where the cells of all ranks go: to the master, up a\n"
                 "tree of masters, or each rank to its own files\n"
                 "(default: master up to 200,000 cells, else file)")
      ->check(is_one_of({"master", "tree", "file"}))
      ->type_name("WHERE")
      ->group(group);
  add_picture_options(app, raw.view);
  app.add_flag("--stats", command.stats, "print figures about the kernel's work")->group(group);
  app.add_option("--timeout", command.options.timeout,
                 "end a run on several ranks if one of them gives no\n"
                 "sign of life for so long; 0: never (default: what\n"
                 "BSP2_TIMEOUT says, else 300)")
      ->check(is_number(0.0, 1e9, "0 or more"))
      ->type_name("SECONDS")
      ->group(group);
  app.add_flag("--quiet", command.quiet, "print no summary and no progress")->group(group);
}

void add_tables_options(CLI::App& app, RunCommand& command) {
  add_input(app, "MODEL", command.model, "the model: a .csg or .scad file");
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
  app.add_flag("--brief", command.brief,
               "table 1 alone, to the end, without boundaries: much\nsooner for large models")
      ->excludes(levels);
  app.add_option("--threads", command.options.threads, "threads of a node; 0: one a core")
      ->check(is_number(0U, 4096U, "0 .. 4096"))
      ->type_name("N");
}

/// A mesh for solvers, of a model or of a snapshot.
void add_mesh_command(CLI::App& app, RunCommand& command, Raw& raw) {
  auto& options = command.options;
  add_input(app, "MODEL|SNAPSHOT", raw.solver_mesh.input,
            "a .csg or .scad file, or what --snapshot wrote (.h5);\nwith --check a mesh (.msh)");
  add_mesh_options(app, raw.solver_mesh);
  const auto group = work_group;
  app.add_flag("--curved", options.curved, "take spheres, cylinders, circles as truly round")->group(group);
  add_tolerance_option(app, command, group);
  app.add_option("--level", options.level, "stop after N cuts in a row; the rest is left out")
      ->check(is_number(0U, 65535U, "0 .. 65535"))
      ->type_name("N")
      ->group(group);
  app.add_option("--parts", raw.parts, "what the parts are: named (default), or colour")
      ->check(is_one_of({"named", "colour", "color"}))
      ->type_name("KIND")
      ->group(group);
  app.add_option("--coincidence", options.coincidence,
                 "planes closer than this share of the bounding box\nare one; 0: only equal planes")
      ->check(finite_share())
      ->type_name("T")
      ->capture_default_str()
      ->group(group);
  app.add_flag("--strict", options.strict, "end with an error where there is a warning")->group(group);
  add_threads_option(app, command, group);
  add_check_option(app, raw.solver_mesh);
  add_path(app, "--report", raw.report, "write the report", "FILE.json");
  app.add_flag("--stats", command.stats, "print how many dihedral angles are how large");
  app.add_flag("--quiet", command.quiet, "print no summary and no progress");
  app.footer(
      "Examples:\n"
      "  bsp2 mesh model.csg -o model.msh --size 2\n"
      "  bsp2 mesh model.csg -o model.inp --element-order 2 --group fixed=x==min\n"
      "  bsp2 mesh model.csg -o case              an OpenFOAM case\n"
      "  bsp2 mesh --check model.msh              what a mesh is like; is it valid?\n"
      "On several ranks the cells are computed by all and meshed by the first one.");
}

void set_kept(Options& options, const std::vector<std::string>& keep) {
  if (keep.empty()) return;
  const auto named = [&](const char* label) {
    return std::find(keep.begin(), keep.end(), label) != keep.end();
  };
  options.keep_in = named("in");
  options.keep_fuzzy = named("fuzzy");
  options.keep_out = named("out");
}

/// Of a snapshot: nothing is computed.
bool is_only_shown(const RunCommand& command, const Raw& raw) {
  return !raw.exported.empty() || (!raw.rendered.empty() && command.resume) || !raw.points.empty();
}

/// What a picture or an animation is of: a snapshot, whatever it is called, or a model.
void set_drawn_input(RunCommand& command, const std::filesystem::path& input) {
  std::error_code none;
  if (input.extension() == ".h5" || (std::filesystem::exists(input, none) && is_snapshot(input))) {
    refuse_solid_options(command.options);
    command.resume = input;
  } else {
    command.model = input;
  }
}

void set_pictures(RunCommand& command, const Raw& raw) {
  Outputs& outputs = command.options.outputs;
  // An eye of other than three dimensions is not that of a picture.
  PictureText view = raw.view;
  if (!command.options.eye.empty() && command.options.eye.size() != 3) view.eye.clear();
  outputs.view = view_of(view);
  if (!raw.picture.empty()) outputs.picture = raw.picture;
  if (!raw.rendered.empty()) outputs.picture = raw.rendered;
  if (!raw.rendered.empty()) outputs.film = film_of(raw.film, raw.view.explode, raw.rendered);
  if (!outputs.film && raw.view.explode.find(':') != std::string::npos)
    throw Error("--explode: a range is for animations, which 'bsp2 render' makes; here it is one number");
  if (outputs.picture && !outputs.film)
    check_picture(*outputs.picture, raw.rendered.empty() ? "--picture" : "-o");
  if (!raw.frames.empty()) outputs.frames = raw.frames;
  if (is_given(raw.view) && !outputs.picture && !outputs.frames && raw.folder.empty() &&
      command.options.eye.empty())
    throw Error(
        std::string("nothing is drawn: the options of pictures need --picture, --frames or -o DIR") +
        (raw.view.eye.empty() ? "" : "; what is refined from an --eye needs --angle or --order view") +
        " (see 'bsp2 run --help')");
  if (is_only_shown(command, raw) && outputs.view.shade == "rank")
    throw Error(
        "--shade rank: a snapshot does not tell who computed its cells; draw them when they are computed, "
        "with 'bsp2 render MODEL' or 'bsp2 run --picture'");
}

/// Steps of their own, for what is shown of each.
void set_steps(RunCommand& command, const Raw& raw) {
  Outputs& outputs = command.options.outputs;
  if (!raw.series.empty()) {
    outputs.series = raw.series;
    if (outputs.series->extension() != ".pvd") throw Error("--series: '" + raw.series + "' must end in .pvd");
  }
  if (outputs.of_steps() && !command.options.budget) command.options.budget = 1;
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

bool asks_for_colours(const Raw& raw) { return raw.parts == "colour" || raw.parts == "color"; }

void set_eye(RunCommand& command, const Raw& raw) {
  const std::string& eye = command.viewer ? raw.view_eye : raw.view.eye;
  const bool is_by_view = raw.order == "view" && !command.viewer;
  if (!is_by_view && !command.options.angle) return;
  if (eye.empty())
    throw Error(std::string(raw.order == "view" ? "--order view" : "--angle") +
                ": add --eye X,Y,Z, from where the model is looked at");
  command.options.eye = eye_of(eye);
}

void set_surfaces(Options& options, const Raw& raw) {
  for (const std::string& file : raw.boundaries) {
    if (!file_format(file).surface)
      throw Error("--boundary: '" + file + "' must end in " + endings().surfaces);
    if (!options.keep_in) throw Error("--boundary is the surface of the IN cells: add --keep in");
    options.outputs.surfaces.emplace_back(file);
  }
}

/// What -o names; names that are given otherwise stay.
void set_folder(Options& options, const Raw& raw) {
  if (file_format(raw.folder).surface)
    throw Error("-o: '" + raw.folder + "' would be a folder; the surface is written with --boundary FILE");
  Outputs& outputs = options.outputs;
  const std::filesystem::path folder = raw.folder;
  outputs.folder = folder;
  outputs.cells = folder / Outputs::cells_name;
  if (options.snapshot && raw.snapshot.empty())
    outputs.snapshot = folder / Outputs::snapshot_name;  // it keeps up what it resumes
  if (!options.snapshot) {
    options.snapshot = folder / Outputs::snapshot_name;
    if (options.budget && !options.steps && !outputs.of_steps()) options.steps = 1;  // as without -o
  }
  if (outputs.surfaces.empty() && options.keep_in) outputs.surfaces = {folder / Outputs::surface_name};
  if (!outputs.picture) outputs.picture = folder / Outputs::picture_name;
  if (!outputs.report) outputs.report = folder / Outputs::report_name;
}

void set_solver_mesh(RunCommand& command, const Raw& raw) {
  command.options.outputs.solver_mesh = mesh_output_of(raw.solver_mesh);
  const std::filesystem::path input = raw.solver_mesh.input;
  if (input.extension() == ".h5") {
    command.resume = input;
    command.options.steps = 0;
  } else {
    command.model = input;
    const SolverMeshOptions& mesh = command.options.outputs.solver_mesh->mesh;
    command.options.size_field = mesh.size_field;
    if (mesh.size.value_or(0) > 0) command.options.size = mesh.size;
  }
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
         !command.points && !options.snapshot && !command.resume && raw.keep.empty() && !has_limits;
}

RunCommand finished(RunCommand command, const Raw& raw) {
  Options& options = command.options;
  Outputs& outputs = options.outputs;
  set_kept(options, raw.keep);
  options.parts_by_colour = asks_for_colours(raw);
  if (raw.order == "priority" || raw.order == "view") options.order = Order::priority;
  if (!raw.drawn_input.empty()) set_drawn_input(command, raw.drawn_input);
  set_eye(command, raw);
  if (!raw.budget.empty()) options.budget = parse_seconds(raw.budget);
  if (command.viewer) {
    finish_view_command(command, raw.order, raw.view_eye);
    return command;
  }
  set_surfaces(options, raw);
  set_pictures(command, raw);
  set_steps(command, raw);
  if (!raw.report.empty()) outputs.report = raw.report;
  if (!raw.snapshot.empty())
    options.snapshot = raw.snapshot;
  else if (command.resume && !is_only_shown(command, raw))
    options.snapshot = command.resume;
  if (!raw.table.empty()) outputs.table = raw.table;
  if (raw.collect == "master") options.collect = Collect::master;
  if (raw.collect == "tree") options.collect = Collect::tree;
  if (raw.collect == "file") options.collect = Collect::file;
  if (raw.mesh) outputs.cells = Outputs::cells_name;
  if (!raw.exported.empty()) set_export(outputs, raw.exported);
  if (!raw.points.empty()) command.points = raw.points;
  if (is_only_shown(command, raw)) {
    options.steps = 0;  // nothing is computed, only shown as it is
    command.quiet = true;
  }
  if (!raw.folder.empty()) set_folder(options, raw);
  if (raw.solver_mesh.check) {
    command.checked_mesh = raw.solver_mesh.input;
    return command;
  }
  if (!raw.solver_mesh.input.empty()) set_solver_mesh(command, raw);
  if (outputs.tets && !outputs.cells && !outputs.series)
    throw Error("--tets needs -o DIR, --vtu or --series (see 'bsp2 run --help')");
  options.surface_only = is_surface_alone(command, raw);
  if (command.points) options.collect = Collect::master;  // who is asked
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

void refuse_solid_options(const Options& options) {
  if (options.curved || options.parts_by_colour || options.tolerance ||
      options.coincidence != Options().coincidence)
    throw Error("--curved, --parts, --coincidence and --tolerance are those of the snapshot: leave them out");
}

double parse_seconds(const std::string& text) {
  static const std::map<std::string, double> units{{"", 1}, {"s", 1}, {"ms", 1e-3}, {"min", 60}, {"h", 3600}};
  const auto split = text.find_first_not_of("0123456789.");
  const std::string number = text.substr(0, split),
                    unit = split == std::string::npos ? "" : text.substr(split);
  double value = 0;
  if (units.count(unit) == 0 || number.empty() || !CLI::detail::lexical_cast(number, value) || !(value > 0)) {
    throw Error("--budget: '" + text + "' is no time; write for example 2s, 500ms or 1min");
  }
  return value * units.at(unit);
}

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
  CLI::App* run = app.add_subcommand("run", "Evaluate a model");
  add_input(*run, "MODEL", command.model, "the model: a .csg or .scad file");
  add_model_options(*run, command, raw);
  add_work_options(*run, command, raw);
  add_output_options(*run, command, raw);
  CLI::App* resume = app.add_subcommand("resume", "Go on with a run that was stopped");
  add_input(*resume, "SNAPSHOT", command.resume, "what --snapshot wrote; kept up to date");
  add_work_options(*resume, command, raw);
  add_output_options(*resume, command, raw);
  resume->footer("Ends with the cells of an uninterrupted run, whatever the number of threads\nand stops.");
  CLI::App* info = app.add_subcommand("info", "Tell what a snapshot holds");
  add_input(*info, "SNAPSHOT", command.info, "what --snapshot wrote");
  CLI::App* exported = app.add_subcommand("export", "Write the cells of a snapshot, or their surface");
  add_input(*exported, "SNAPSHOT", command.resume, "what --snapshot wrote");
  add_path(*exported, "-o,--output", raw.exported,
           ".pvtu: the cells, FUZZY where nothing is decided\nyet; else the surface of the IN cells, as the "
           "ending\nsays (see --list-formats)",
           "FILE")
      ->required();
  add_clean_option(*exported, command);
  add_list_formats_option(*exported, raw);
  exported->add_flag("--tets", command.options.outputs.tets, "cut the cells into tetrahedra in a .pvtu");
  CLI::App* rendered = app.add_subcommand("render", "Make a picture or an animation");
  add_input(*rendered, "MODEL|SNAPSHOT", raw.drawn_input,
            "a .csg or .scad file, or what --snapshot wrote (.h5)");
  add_path(*rendered, "-o,--output", raw.rendered, "the picture: .png, .svg or .pdf; or an animation", "FILE")
      ->required();
  add_picture_options(*rendered, raw.view);
  add_film_options(*rendered, raw.film);
  add_solid_options(*rendered, command, raw, work_group);
  add_tolerance_option(*rendered, command, work_group);
  add_threads_option(*rendered, command, work_group);
  rendered->add_flag("--quiet", command.quiet, "print no summary and no progress");
  rendered->footer(
      "Examples:\n"
      "  bsp2 render run.h5 -o far.png --eye 60,-90,40 --size 2000x1500\n"
      "  bsp2 render model.csg -o turn.apng --turntable 120\n"
      "  bsp2 render run.h5 -o inside.mp4 --sweep-section y:-10:10 --count 200");
  CLI::App* view = add_view_command(app, command, raw.viewed, raw.view_eye);
  add_model_options(*view, command, raw);
  add_work_options(*view, command, raw);
  describe_for_view(*view);
  CLI::App* queried = app.add_subcommand("query", "Tell where points are, and how far from the surface");
  add_input(*queried, "SNAPSHOT", command.resume, "what --snapshot wrote");
  add_path(*queried, "--points", raw.points,
           "a text with the coordinates of a point on each line;\n-: standard input", "FILE")
      ->required();
  queried->add_flag("--json", command.json, "answer as JSON, not as a table");
  add_threads_option(*queried, command, "Options");
  queried->footer(
      "The distance is that to the nearest point with another label, negative in the\nsolid. What is FUZZY "
      "counts as both.");
  CLI::App* meshed = app.add_subcommand("mesh", "Make a conforming mesh for solvers, with named parts");
  add_mesh_command(*meshed, command, raw);
  CLI::App* tables = app.add_subcommand("tables", "Measure the paper's tables 1 to 6 for a model");
  add_tables_options(*tables, command);
  CLI::App* draw = add_draw_command(app, command, raw.drawing);
  add_solid_options(*draw, command, raw, work_group);
  add_tolerance_option(*draw, command, work_group);
  add_threads_option(*draw, command, work_group);
  const QueueCommands queue = add_queue_commands(app, command);
  add_model_options(*queue.split, command, raw);
  add_tolerance_option(*queue.split, command, work_group);
  add_threads_option(*queue.run, command, work_group);
  add_threads_option(*queue.merge, command, work_group);
  queue.run->add_option("--budget", raw.budget, "divide a job that takes longer (60s)")
      ->type_name("TIME")
      ->group(work_group);
  queue.run->add_option("--cells", command.options.cells, "divide a job that gets more cells than about N")
      ->check(some_cells())
      ->type_name("N")
      ->group(work_group);
  add_output_options(*queue.merge, command, raw);
  AboutCommands about;
  add_about_commands(app, about);
  run->footer(run_footer);
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
    if (raw.list_formats) {
      out << "Written (--boundary FILE):\n\n"
          << surface_format_table() << "\nRead (as the model, or by import()):\n\n"
          << import_format_table();
      return std::nullopt;
    }
    app.exit(error, out, out);  // help or version
    return std::nullopt;
  }
  if (about.print(app, out)) return std::nullopt;
  if (!tables->parsed()) command.tables.clear();
  choose_queue_command(queue, command);
  choose_view_command(*view, command, raw.viewed);
  command.options.dashes = "--";
  command.options.stop_gently = !exported->parsed() && !rendered->parsed() && !draw->parsed();
  if (!draw->parsed()) {
    command.options.outputs.drawing.reset();
    return finished(std::move(command), raw);
  }
  command.options.parts_by_colour = asks_for_colours(raw);
  choose_drawing(raw.drawing, command);
  return command;
}

}  // namespace bsp2::jobs
