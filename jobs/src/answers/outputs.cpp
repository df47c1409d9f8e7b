#include "answers/outputs.hpp"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <functional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "answers/drawings.hpp"
#include "answers/film.hpp"
#include "answers/summary.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/animation.hpp"
#include "bsp2/io/outputs/pvd.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "bsp2/supersteps/stages/collection.hpp"
#include "options/picture_options.hpp"
#include "tables/superstep_table.hpp"

namespace bsp2::jobs {
namespace fs = std::filesystem;
namespace {

std::vector<fs::path> files_of(const RunCommand& command) {
  std::vector<fs::path> files;
  if (command.mesh) files.push_back(*command.mesh);
  files.insert(files.end(), command.boundaries.begin(), command.boundaries.end());
  for (const auto& file : {command.picture, command.report, command.table, command.series})
    if (file) files.push_back(*file);
  if (command.drawing)
    files.insert(files.end(), command.drawing->files.begin(), command.drawing->files.end());
  if (command.solver_mesh && io::solver_format(command.solver_mesh->output) != io::SolverFormat::openfoam)
    files.push_back(command.solver_mesh->output);
  return files;
}

/// Each output needs a name of its own.
void check_names(const RunCommand& command) {
  std::vector<fs::path> files;
  const auto add = [&](const std::optional<fs::path>& file) {
    if (!file) return;
    for (const fs::path& other : files)
      if (are_one_file(*file, other) &&
          (!fs::exists(*file) || fs::is_regular_file(*file)))  // a device may take several
        throw Error("two outputs would be written to one file, '" + file->string() +
                    "': give each its own name");
    files.push_back(*file);
  };
  for (const auto& file : files_of(command)) add(file);
  add(command.options.snapshot);
  const auto& copy = command.snapshot_copy;
  if (copy && !(command.options.snapshot && are_one_file(*copy, *command.options.snapshot)))
    add(copy);  // else it is there already
}

/// A folder of -o shows one run: what it does not write is not left there by another one.
void remove_old(const fs::path& path) {
  std::error_code nothing_there;
  fs::remove(path, nothing_there);
}

/// The same of a file that could not be written, if it is called as -o calls it.
void remove_old_of(const std::optional<fs::path>& folder, const fs::path& path) {
  if (!folder) return;
  if (path == *folder / mesh_name) return io::remove_vtu(path);
  for (const char* name : {boundary_name, picture_name, report_name})
    if (path == *folder / name) remove_old(path);
}

/// With -o, what this dimension does not allow is left out; asked for by another name than -o gives it, it is
/// a mistake.
bool is_possible(bool possible, const char* what, const std::optional<fs::path>& folder,
                 const char* usual_name, const fs::path& path, supersteps::RunReport& report) {
  if (possible || !folder || path != *folder / usual_name) return true;
  if (path == *folder / mesh_name)
    io::remove_vtu(path);
  else
    remove_old(path);
  if (report.dimension == 2) return false;  // a plane model has no boundary: told, but no warning
  report.warnings.push_back(
      std::string("no ") + what + " is written: the model's dimension is " +
      std::to_string(report.dimension) +
      (report.dimension > 3 ? "; section() or project() in the model give what can be shown" : ""));
  return false;
}

/// A surface knows the colours of parts. Where the model has others, who gets a file that could hold them is
/// told, once.
void tell_lost_colours(const RunCommand& command, supersteps::RunResult& result) {
  const auto is_coloured = [](const auto& thing) { return thing.has_value(); };
  const auto& of_model = result.colour_of_primitive;
  const auto& parts = result.report.named_parts;
  if (!(result.boundary || result.outlines) || std::none_of(of_model.begin(), of_model.end(), is_coloured) ||
      std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part.colour.has_value(); }))
    return;
  const auto file = std::find_if(command.boundaries.begin(), command.boundaries.end(), [](const auto& path) {
    return io::surface_format(path) != nullptr && io::surface_format(path)->holds_colours;
  });
  if (file == command.boundaries.end()) return;
  result.report.notes.push_back(
      fmt::format("the model has colours, which are not in {}: a surface has the colours of parts; if the "
                  "model is run with --parts colour, each colour is one",
                  file->string()));
}

/// On the master. Nothing if the run could not find it, which it has told.
void write_boundary(const RunCommand& command, const fs::path& path, supersteps::RunResult& result) {
  const auto& folder = command.folder;
  if (result.boundary || result.outlines)
    return supersteps::write_boundary(result, path, command.clean, result.report.threads);
  const int d = result.report.dimension;
  if ((d == 3 || (d == 2 && command.options.outlines)) && !result.report.failed.empty()) {
    // What could not be glued has no name of its own; an earlier file there is not this run's.
    for (auto& failed : result.report.failed)
      if (failed.file.empty()) failed.file = path;
    return remove_old_of(folder, path);
  }
  if (is_possible(false, "boundary", folder, boundary_name, path, result.report))
    throw Error("cannot write '" + path.string() + "': boundaries are found for solids of dimension 3, not " +
                std::to_string(d) +
                (d == 2 ? "; the outlines of plane models are written as " + io::plane_endings() : ""));
}

/// Makes one file; if that fails the others are made all the same, and the report tells. Collective; `work`
/// is made of collective calls and Ranks::agree.
void make(const RunCommand& command, const fs::path& path, supersteps::RunReport& report,
          const supersteps::Ranks& ranks, const std::function<void()>& work) {
  if (command.on_writing) command.on_writing(path);
  auto failed = supersteps::attempt(ranks, work);
  if (!failed) return;
  if (failed->text.find(path.string()) == std::string::npos)
    failed->text = "cannot write '" + path.string() + "': " + failed->text;
  failed->file = path;
  report.failed.push_back(std::move(*failed));
  if (ranks.is_master()) remove_old_of(command.folder, path);
}

/// The same of a file that the master makes alone.
void make_alone(const RunCommand& command, const fs::path& path, supersteps::RunReport& report,
                supersteps::Ranks& ranks, const std::function<void()>& work) {
  make(command, path, report, ranks, [&] {
    ranks.agree([&] {
      if (ranks.is_master()) work();
    });
  });
}

/// From where a picture is seen, where that is not what one expects.
void tell_eye(geometry::Label at_eye, supersteps::RunReport& report) {
  if (at_eye == geometry::Label::in)
    report.notes.emplace_back(
        "the eye is inside the solid: the picture shows the inner sides of its boundary, as if the solid "
        "were clear");
  if (at_eye == geometry::Label::fuzzy)
    report.notes.emplace_back(
        "the eye is in a cell that is not decided (FUZZY): the picture shows what is seen from there of all "
        "others");
}

void draw_picture(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  bool possible = false;
  ranks.agree([&] {
    const int d = result.report.dimension;
    possible = is_possible(d == 2 || d == 3, "picture", command.folder, picture_name, *command.picture,
                           result.report);
    if (possible) ranks.begin("rendering");
  });
  if (!possible) return;
  if (command.film)
    return ranks.agree([&] {
      if (ranks.is_master() && !draw_film(*command.film, command.view, result, result.report.threads,
                                          command.options.interrupted, *command.picture))
        result.report.interrupted = true;
    });
  auto at_eye = geometry::Label::out;
  const std::string picture = supersteps::render(ranks, result, command.view, &at_eye);
  tell_eye(at_eye, result.report);
  ranks.agree([&] {
    if (ranks.is_master()) io::write_file(*command.picture, picture);
  });
}

void write_solid(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  bool possible = false;
  ranks.agree([&] {
    possible = is_possible(result.report.dimension <= 3, "mesh", command.folder, mesh_name, *command.mesh,
                           result.report);
  });
  if (!possible) return;
  const auto simplices = supersteps::write_mesh(ranks, result, *command.mesh, command.tets);
  if (!command.tets || result.report.dimension < 2) return;
  result.report.simplices = simplices;
  const char* faces = result.report.dimension == 3 ? "face to face" : "edge to edge";
  result.report.notes.push_back(
      fmt::format("{} fill each cell by itself: they do not meet {} where cells touch",
                  simplex_name(result.report), faces));
}

/// NAME_0003.pvtu of NAME.pvd.
fs::path mesh_of_step(fs::path series, unsigned step) {
  return series.replace_filename(series.stem().string() + fmt::format("_{:04}.pvtu", step));
}

void write_frame(const RunCommand& command, const supersteps::RunResult& now, unsigned step,
                 supersteps::Ranks& ranks) {
  const fs::path path = frame_path(*command.frames, step);
  supersteps::PictureOptions view = command.view;
  view.format = supersteps::PictureFormat::png;
  view.bounds = now.bounds;  // the same camera for all frames
  const std::string picture = supersteps::render(ranks, now, view);
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    io::make_folder(io::folder_of(path));
    io::write_file(path, picture);
  });
}

/// The mesh of this step, and the series up to here: also of the sessions that came before.
void write_series(const RunCommand& command, const supersteps::RunResult& now, unsigned step,
                  supersteps::Ranks& ranks) {
  ranks.agree([&] {
    if (now.report.dimension > 3)
      throw Error("--series: cells of dimension 1 to 3 can be written, not " +
                  std::to_string(now.report.dimension));
    if (ranks.is_master()) io::make_folder(io::folder_of(*command.series));
  });  // now the folder is there
  supersteps::write_mesh(ranks, now, mesh_of_step(*command.series, step), command.tets, step);
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    std::vector<std::pair<double, fs::path>> meshes;
    for (unsigned i = 0; i <= step; ++i)
      if (const fs::path path = mesh_of_step(*command.series, i); fs::exists(path))
        meshes.emplace_back(i, path);
    io::write_pvd(*command.series, meshes);
  });
}

}  // namespace

bool are_one_file(const fs::path& a, const fs::path& b) {
  std::error_code unknown;
  return fs::weakly_canonical(fs::absolute(a, unknown), unknown) ==
         fs::weakly_canonical(fs::absolute(b, unknown), unknown);
}

void check_outputs(const RunCommand& command) {
  check_names(command);
  if (command.folder) io::check_folder(*command.folder);
  for (const auto& snapshot : {command.options.snapshot, command.snapshot_copy})
    if (snapshot) io::check_snapshot_path(*snapshot);
  if (command.mesh || command.series) io::check_vtu();
  for (const fs::path& file : command.boundaries) io::check_surface_file(file);
  if (command.film) io::Animation::check(*command.picture);
  if (command.picture || command.frames) supersteps::check_pictures();
  if (command.drawing) check_drawings(command);
  if (command.frames) io::check_folder(io::folder_of(frame_path(*command.frames, 0)));
  for (const fs::path& file : files_of(command)) {
    io::check_folder(io::folder_of(file));
    std::error_code error;
    if (!file.has_filename() || fs::is_directory(file, error))
      throw Error("cannot write '" + file.string() + "': it is a directory");
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
      throw Error("cannot write '" + file.string() + "': " + error.message());
    if (fs::exists(file, error) && ::access(file.c_str(), W_OK) != 0)
      throw Error("cannot write '" + file.string() + "': " + std::generic_category().message(errno));
    if (fs::equivalent(file, command.options.resume.value_or(command.options.model), error))
      throw Error("cannot write '" + file.string() + "': it is the input itself");
  }
}

std::vector<fs::path> written_files(const RunCommand& command, const supersteps::RunReport& report) {
  std::vector<fs::path> files;
  const auto add = [&](const std::optional<fs::path>& file) {
    std::error_code ignored;
    if (!file || !fs::is_regular_file(*file, ignored)) return;
    const bool is_named = std::any_of(files.begin(), files.end(),
                                      [&](const fs::path& other) { return are_one_file(*file, other); });
    const bool has_failed =
        std::any_of(report.failed.begin(), report.failed.end(),
                    [&](const supersteps::FailedOutput& failed) { return failed.file == *file; });
    if (!is_named && !has_failed) files.push_back(*file);
  };
  for (const auto& file : files_of(command)) add(file);
  for (const auto& snapshot : {command.options.snapshot, command.snapshot_copy}) add(snapshot);
  return files;
}

void write_step(const RunCommand& command, const supersteps::RunResult& now, unsigned step,
                supersteps::Ranks& ranks, StepFailures& failures) {
  const auto make = [&](std::optional<supersteps::FailedOutput>& first, const auto& work) {
    auto failed = supersteps::attempt(ranks, work);
    if (failed && !first) first = std::move(failed);
  };
  if (command.frames) make(failures.frames, [&] { write_frame(command, now, step, ranks); });
  if (command.series) make(failures.series, [&] { write_series(command, now, step, ranks); });
}

void write_cells(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    if (command.folder) io::make_folder(*command.folder);
    if (command.folder && command.boundaries.empty()) remove_old(*command.folder / boundary_name);
    for (const fs::path& file : files_of(command)) io::make_folder(io::folder_of(file));
  });  // now the folders are there
  if (command.mesh)
    make(command, *command.mesh, result.report, ranks, [&] { write_solid(command, result, ranks); });
  if (command.picture)
    make(command, *command.picture, result.report, ranks, [&] { draw_picture(command, result, ranks); });
}

void write_results(const RunCommand& command, supersteps::RunResult& result, supersteps::Ranks& ranks,
                   const std::function<std::string(std::string)>& with_more) {
  const auto make = [&](const fs::path& path, const auto& work) {
    make_alone(command, path, result.report, ranks, work);
  };
  const int d = result.report.dimension;
  if (!command.boundaries.empty() && (d == 3 || (d == 2 && command.options.outlines))) ranks.begin("writing");
  for (const fs::path& file : command.boundaries) make(file, [&] { write_boundary(command, file, result); });
  if (ranks.is_master()) tell_lost_colours(command, result);
  supersteps::record_costs(ranks, result.report);
  if (command.report)
    make(*command.report, [&] { io::write_file(*command.report, with_more(api::to_json(result.report))); });
  if (command.table)
    make(*command.table, [&] { io::write_file(*command.table, to_csv(result.report.supersteps)); });
  // The largest, and there already under its own name.
  const auto is_snapshot = [&](const supersteps::FailedOutput& failed) {
    return failed.file == command.options.snapshot;
  };
  const bool is_saved = std::none_of(result.report.failed.begin(), result.report.failed.end(), is_snapshot);
  if (command.snapshot_copy && is_saved)
    make(*command.snapshot_copy,
         [&] { io::copy_snapshot(*command.options.snapshot, *command.snapshot_copy); });
}

}  // namespace bsp2::jobs
