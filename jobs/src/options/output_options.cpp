#include "options/output_options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "options/paths.hpp"

namespace bsp2::jobs {
namespace {

void set_surfaces(Options& options, const OutputText& text) {
  for (const std::string& file : text.boundaries) {
    if (!file_format(file).surface)
      throw Error("--boundary: '" + file + "' must end in " + endings().surfaces);
    if (!options.keep_in) throw Error("--boundary is the surface of the IN cells: add --keep in");
    options.outputs.surfaces.emplace_back(file);
  }
}

void set_pictures(RunCommand& command, const OutputText& text) {
  Outputs& outputs = command.options.outputs;
  // An eye of other than three dimensions is not that of a picture.
  PictureText view = text.view;
  if (!command.options.eye.empty() && command.options.eye.size() != 3) view.eye.clear();
  outputs.view = view_of(view);
  if (!text.picture.empty()) outputs.picture = text.picture;
  if (view.explode.find(':') != std::string::npos)
    throw Error("--explode: a range is for animations, which 'bsp2 render' makes; here it is one number");
  if (outputs.picture) check_picture(*outputs.picture, "--picture");
  if (!text.frames.empty()) outputs.frames = text.frames;
  if (is_given(text.view) && !outputs.picture && !outputs.frames && text.folder.empty() &&
      command.options.eye.empty())
    throw Error(
        std::string("nothing is drawn: the options of pictures need --picture, --frames or -o DIR") +
        (text.view.eye.empty() ? "" : "; what is refined from an --eye needs --angle or --order view") +
        " (see 'bsp2 run --help')");
}

/// Steps of their own, for what is shown of each.
void set_steps(RunCommand& command, const OutputText& text) {
  Outputs& outputs = command.options.outputs;
  if (!text.series.empty()) {
    outputs.series = text.series;
    if (outputs.series->extension() != ".pvd")
      throw Error("--series: '" + text.series + "' must end in .pvd");
  }
  if (outputs.of_steps() && !command.options.budget) command.options.budget = 1;
}

/// What -o names; names that are given otherwise stay.
void set_folder(Options& options, const OutputText& text) {
  if (file_format(text.folder).surface)
    throw Error("-o: '" + text.folder + "' would be a folder; the surface is written with --boundary FILE");
  Outputs& outputs = options.outputs;
  const std::filesystem::path folder = text.folder;
  outputs.folder = folder;
  outputs.cells = folder / Outputs::cells_name;
  if (options.snapshot && text.snapshot.empty())
    outputs.snapshot = folder / Outputs::snapshot_name;  // it keeps up what it resumes
  if (!options.snapshot) {
    options.snapshot = folder / Outputs::snapshot_name;
    if (options.budget && !options.steps && !outputs.of_steps()) options.steps = 1;  // as without -o
  }
  if (outputs.surfaces.empty() && options.keep_in) outputs.surfaces = {folder / Outputs::surface_name};
  if (!outputs.picture) outputs.picture = folder / Outputs::picture_name;
  if (!outputs.report) outputs.report = folder / Outputs::report_name;
}

void check_clean(const Outputs& outputs) {
  const bool is_any = std::any_of(outputs.surfaces.begin(), outputs.surfaces.end(),
                                  [](const auto& file) { return file_format(file).triangles; });
  if (outputs.clean && !is_any)
    throw Error("--clean: there are no triangles to clean; name a file for them (see --list-formats)");
}

}  // namespace

CLI::Option* add_list_formats_option(CLI::App& app, OutputText& text) {
  const auto ask = [&text](std::int64_t) {
    text.list_formats = true;
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

void add_output_options(CLI::App& app, RunCommand& command, OutputText& text) {
  const auto group = "What is written";
  add_path(app, "-o,--output", text.folder,
           "write everything into this folder:\nreport.json, solid.pvtu with its pieces, "
           "boundary.stl,\nview.png and snapshot.h5",
           "DIR")
      ->group(group);
  app.add_flag("--vtu", text.cells, "write the cells as solid.pvtu (without -o: here)")->group(group);
  app.add_flag("--tets", command.options.outputs.tets, "cut the cells into tetrahedra in solid.pvtu")
      ->group(group);
  add_path(app, "--snapshot", text.snapshot, "write the state of the run, after each step", "FILE.h5")
      ->group(group);
  app.add_option("--boundary", text.boundaries,
                 "write the surface, closed triangles, as the file's\nending says (see --list-formats), of "
                 "plane models "
                 "the\noutline; repeat for several")
      ->check(is_named())
      ->allow_extra_args(false)
      ->type_name("FILE")
      ->group(group);
  add_clean_option(app, command)->group(group);
  add_list_formats_option(app, text)->group(group);
  add_path(app, "--picture", text.picture, "draw the solid: .png, .svg or .pdf", "FILE")->group(group);
  add_path(app, "--frames", text.frames,
           "draw what there is after each step (--budget; 1s):\nPREFIX0000.png and so on", "PREFIX")
      ->group(group);
  add_path(
      app, "--series", text.series,
      "write the cells after each step (--budget; 1s), and\nFILE.pvd, which shows them over time in ParaView",
      "FILE.pvd")
      ->group(group);
  add_path(app, "--report", text.report, "write the report", "FILE.json")->group(group);
  add_path(app, "--table", text.table, "write what each superstep cost each rank", "FILE.csv")->group(group);
  app.add_option("--collect", text.collect,
                 "where the cells of all ranks go: to the master, up a\n"
                 "tree of masters, or each rank to its own files\n"
                 "(default: master up to 200,000 cells, else file)")
      ->check(is_one_of({"master", "tree", "file"}))
      ->type_name("WHERE")
      ->group(group);
  add_picture_options(app, text.view);
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

void choose_outputs(const OutputText& text, RunCommand& command) {
  Options& options = command.options;
  Outputs& outputs = options.outputs;
  set_surfaces(options, text);
  set_pictures(command, text);
  set_steps(command, text);
  if (!text.report.empty()) outputs.report = text.report;
  if (!text.snapshot.empty())
    options.snapshot = text.snapshot;
  else if (command.resume && options.steps != 0U)
    options.snapshot = command.resume;
  if (!text.table.empty()) outputs.table = text.table;
  if (text.collect == "master") options.collect = Collect::master;
  if (text.collect == "tree") options.collect = Collect::tree;
  if (text.collect == "file") options.collect = Collect::file;
  if (text.cells) outputs.cells = Outputs::cells_name;
  if (!text.folder.empty()) set_folder(options, text);
  check_clean(outputs);
  if (outputs.tets && !outputs.cells && !outputs.series)
    throw Error("--tets needs -o DIR, --vtu or --series (see 'bsp2 run --help')");
}

}  // namespace bsp2::jobs
