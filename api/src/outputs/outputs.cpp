#include "outputs/outputs.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <functional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/api/report/report_json.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/pvd.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "bsp2/supersteps/stages/collection.hpp"
#include "outputs/drawings.hpp"
#include "outputs/files.hpp"
#include "outputs/film.hpp"
#include "outputs/pictures.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

/// Outputs::folder shows one run: what it does not write is not left there by another one.
void remove_old(const fs::path& path) {
  std::error_code nothing_there;
  fs::remove(path, nothing_there);
}

/// Removes the old output in a file's place in the folder, if the file is called as Outputs::folder calls it.
void remove_old_of(const std::optional<fs::path>& folder, const fs::path& path) {
  if (!folder) return;
  if (path == *folder / Outputs::cells_name) return io::remove_vtu(path);
  for (const char* name : {Outputs::surface_name, Outputs::picture_name, Outputs::report_name})
    if (path == *folder / name) remove_old(path);
}

/// In Outputs::folder, what this dimension does not allow is left out; asked for by another name than those
/// of there, it is a mistake.
bool is_possible(bool possible, const char* what, const std::optional<fs::path>& folder,
                 const char* usual_name, const fs::path& path, supersteps::RunReport& report) {
  if (possible || !folder || path != *folder / usual_name) return true;
  if (path == *folder / Outputs::cells_name)
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
void tell_lost_colours(const Writing& writing, supersteps::RunResult& result) {
  const auto is_coloured = [](const auto& thing) { return thing.has_value(); };
  const auto& of_model = result.colour_of_primitive;
  const auto& parts = result.report.named_parts;
  if (!(result.boundary || result.outlines) || std::none_of(of_model.begin(), of_model.end(), is_coloured) ||
      std::any_of(parts.begin(), parts.end(), [](const auto& part) { return part.colour.has_value(); }))
    return;
  const auto file =
      std::find_if(writing.files.surfaces.begin(), writing.files.surfaces.end(), [](const auto& path) {
        return io::surface_format(path) != nullptr && io::surface_format(path)->holds_colours;
      });
  if (file == writing.files.surfaces.end()) return;
  result.report.notes.push_back(fmt::format(
      "the model has colours, which are not in {}: a surface has the colours of parts; if the "
      "model is {}, each colour is one",
      file->string(), writing.dashes.empty() ? "evaluated with parts_by_colour" : "run with --parts colour"));
}

/// On the master. Nothing if the run could not find it, which it has told.
void write_boundary(const Writing& writing, const fs::path& path, supersteps::RunResult& result) {
  const auto& folder = writing.files.folder;
  if (result.boundary || result.outlines)
    return supersteps::write_boundary(result, path, writing.files.clean, result.report.threads);
  const int d = result.report.dimension;
  if ((d == 3 || (d == 2 && writing.run.outlines)) && !result.report.failed.empty()) {
    // What could not be glued has no name of its own; an earlier file there is not this run's.
    for (auto& failed : result.report.failed)
      if (failed.file.empty()) failed.file = path;
    return remove_old_of(folder, path);
  }
  if (is_possible(false, "boundary", folder, Outputs::surface_name, path, result.report))
    throw Error("cannot write '" + path.string() + "': boundaries are found for solids of dimension 3, not " +
                std::to_string(d) +
                (d == 2 ? "; the outlines of plane models are written as " + io::plane_endings() : ""));
}

/// A closed surface looks like all of the solid.
void tell_incomplete(const Writing& writing, supersteps::RunReport& report, supersteps::Ranks& ranks) {
  const int d = report.dimension;
  if (report.complete || writing.files.surfaces.empty() || !(d == 3 || (d == 2 && writing.run.outlines)))
    return;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    const std::string text = fmt::format(
        "the run is not complete: '{}' is the {} of what is inside for sure so far, of {} of {:.6g}",
        writing.files.surfaces.front().filename().string(), d == 3 ? "surface" : "outline",
        d == 3 ? "a volume" : "an area", report.in_volume);
    if (writing.run.strict) throw Error(text + "; " + writing.dashes + "strict turns warnings into errors");
    report.warnings.push_back(text);
  });
}

/// Who wants nothing but files gets none of what is ended.
void end_if_over(const Writing& writing) {
  if (writing.cells_go && geometry::Interruption::is_over()) throw geometry::Interrupted();
}

/// Makes one file; if that fails the others are made all the same, and the report tells. Collective; `work`
/// is made of collective calls and Ranks::agree.
void make(const Writing& writing, const fs::path& path, supersteps::RunReport& report,
          const supersteps::Ranks& ranks, const std::function<void()>& work) {
  if (writing.cells_go) geometry::Interruption::check();
  if (writing.on_writing) writing.on_writing(path);
  auto failed = supersteps::attempt(ranks, work);
  if (!failed) return;
  end_if_over(writing);
  if (failed->text.find(path.string()) == std::string::npos)
    failed->text = "cannot write '" + path.string() + "': " + failed->text;
  failed->file = path;
  report.failed.push_back(std::move(*failed));
  if (ranks.is_master()) remove_old_of(writing.files.folder, path);
}

/// Makes a file by the master alone, which tells all ranks how that ended.
void make_alone(const Writing& writing, const fs::path& path, supersteps::RunReport& report,
                supersteps::Ranks& ranks, const std::function<void()>& work) {
  make(writing, path, report, ranks, [&] {
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

void draw_picture(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  bool possible = false;
  ranks.agree([&] {
    const int d = result.report.dimension;
    possible = is_possible(d == 2 || d == 3, "picture", writing.files.folder, Outputs::picture_name,
                           *writing.files.picture, result.report);
    if (possible) ranks.begin("rendering");
  });
  if (!possible) return;
  const fs::path& file = *writing.files.picture;
  auto view = picture_options(writing.files.view,
                              writing.files.film ? supersteps::PictureFormat::png : format_of(file));
  view.on_progress = writing.on_picture;
  if (writing.files.film) {
    bool is_over = false;
    ranks.agree([&] {
      is_over = ranks.is_master() && !draw_film(*writing.files.film, view, result, result.report.threads,
                                                writing.run.interrupted, file);
    });
    result.report.interrupted = told_by_master(is_over, ranks);
    return;
  }
  auto at_eye = geometry::Label::out;
  const std::string picture = supersteps::render(ranks, result, view, &at_eye);
  tell_eye(at_eye, result.report);
  ranks.agree([&] {
    if (ranks.is_master()) io::write_file(file, picture);
  });
}

void write_solid(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  bool possible = false;
  ranks.agree([&] {
    possible = is_possible(result.report.dimension <= 3, "mesh", writing.files.folder, Outputs::cells_name,
                           *writing.files.cells, result.report);
  });
  if (!possible) return;
  const auto simplices = supersteps::write_mesh(ranks, result, *writing.files.cells, writing.files.tets);
  if (!writing.files.tets || result.report.dimension < 2) return;
  result.report.simplices = simplices;
  const char* faces = result.report.dimension == 3 ? "face to face" : "edge to edge";
  result.report.notes.push_back(
      fmt::format("{} fill each cell by itself: they do not meet {} where cells touch",
                  result.report.dimension == 3 ? "tetrahedra" : "triangles", faces));
}

/// NAME_0003.pvtu of NAME.pvd.
fs::path mesh_of_step(fs::path series, unsigned step) {
  return series.replace_filename(series.stem().string() + fmt::format("_{:04}.pvtu", step));
}

void write_frame(const Writing& writing, const supersteps::RunResult& now, unsigned step,
                 supersteps::Ranks& ranks) {
  const fs::path path = frame_path(*writing.files.frames, step);
  auto view = picture_options(writing.files.view, supersteps::PictureFormat::png);
  view.on_progress = writing.on_picture;
  view.bounds = now.bounds;  // the same camera for all frames
  const std::string picture = supersteps::render(ranks, now, view);
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    io::make_folder(io::folder_of(path));
    io::write_file(path, picture);
  });
}

/// The mesh of this step, and the series up to here: also of the sessions that came before.
void write_series(const Writing& writing, const supersteps::RunResult& now, unsigned step,
                  supersteps::Ranks& ranks) {
  ranks.agree([&] {
    if (now.report.dimension > 3)
      throw Error(writing.dashes + "series: cells of dimension 1 to 3 can be written, not " +
                  std::to_string(now.report.dimension));
    if (ranks.is_master()) io::make_folder(io::folder_of(*writing.files.series));
  });  // now the folder is there
  supersteps::write_mesh(ranks, now, mesh_of_step(*writing.files.series, step), writing.files.tets, step);
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    std::vector<std::pair<double, fs::path>> meshes;
    for (unsigned i = 0; i <= step; ++i)
      if (const fs::path path = mesh_of_step(*writing.files.series, i); fs::exists(path))
        meshes.emplace_back(i, path);
    io::write_pvd(*writing.files.series, meshes);
  });
}

/// What was the first thing to fail, of all pictures and of all meshes of steps.
struct StepFailures {
  std::optional<supersteps::FailedOutput> frames, series;
};

/// What there is after a step: a picture, the cells. What fails takes nothing else along. Collective.
void write_step(const Writing& writing, const supersteps::RunResult& now, unsigned step,
                supersteps::Ranks& ranks, StepFailures& failures) {
  const auto make = [&](std::optional<supersteps::FailedOutput>& first, const auto& work) {
    auto failed = supersteps::attempt(ranks, work);
    if (failed && !first) first = std::move(failed);
  };
  if (writing.files.frames) make(failures.frames, [&] { write_frame(writing, now, step, ranks); });
  if (writing.files.series) make(failures.series, [&] { write_series(writing, now, step, ranks); });
}

/// What shows the cells: the mesh and the picture. Collective. @throws bsp2::Error if there is no folder for
/// them.
void write_cells(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks) {
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    if (writing.files.folder) io::make_folder(*writing.files.folder);
    if (writing.files.folder && writing.files.surfaces.empty())
      remove_old(*writing.files.folder / Outputs::surface_name);
    const auto& mesh = writing.files.solver_mesh;  // whose folder is made when there is one
    for (const fs::path& file : files_of(writing))
      if (!mesh || file != io::solver_file(mesh->file)) io::make_folder(io::folder_of(file));
  });  // now the folders are there
  if (writing.files.cells)
    make(writing, *writing.files.cells, result.report, ranks, [&] { write_solid(writing, result, ranks); });
  if (writing.files.picture)
    make(writing, *writing.files.picture, result.report, ranks,
         [&] { draw_picture(writing, result, ranks); });
}

/// The rest: the boundary, then the report, at last a copy of the snapshot. Collective.
void write_results(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks,
                   const Written& written) {
  const auto make = [&](const fs::path& path, const auto& work) {
    make_alone(writing, path, result.report, ranks, work);
  };
  const int d = result.report.dimension;
  if (!writing.files.surfaces.empty() && (d == 3 || (d == 2 && writing.run.outlines))) ranks.begin("writing");
  for (const fs::path& file : writing.files.surfaces)
    make(file, [&] { write_boundary(writing, file, result); });
  if (ranks.is_master()) tell_lost_colours(writing, result);
  supersteps::record_costs(ranks, result.report);
  if (writing.files.report)
    make(*writing.files.report, [&] {
      io::write_file(*writing.files.report,
                     to_json(result.report, written.solver_mesh ? &*written.solver_mesh : nullptr));
    });
  if (writing.files.table)
    make(*writing.files.table,
         [&] { io::write_file(*writing.files.table, to_csv(result.report.supersteps)); });
  // The largest, and there already under its own name.
  const auto is_snapshot = [&](const supersteps::FailedOutput& failed) {
    return failed.file == writing.run.snapshot;
  };
  const bool is_saved = std::none_of(result.report.failed.begin(), result.report.failed.end(), is_snapshot);
  if (writing.files.snapshot && is_saved)
    make(*writing.files.snapshot, [&] { io::copy_snapshot(*writing.run.snapshot, *writing.files.snapshot); });
}

/// The mesh of a finished run, and its file; what there is to tell goes into the report. Of the master.
MeshFigures write_solver_mesh(const Writing& writing, supersteps::RunResult& result) {
  const SolverMeshOutput& output = *writing.files.solver_mesh;
  if (writing.on_writing) writing.on_writing(io::solver_file(output.file));
  MadeSolverMesh made = make_solver_mesh(output.mesh, result, writing.dashes);
  if (writing.run.strict && !made.warnings.empty())
    throw Error(made.warnings.front() + "; " + writing.dashes + "strict turns warnings into errors");
  auto& report = result.report;
  report.warnings.insert(report.warnings.end(), made.warnings.begin(), made.warnings.end());
  report.notes.insert(report.notes.end(), made.notes.begin(), made.notes.end());
  if (!output.mesh.groups.empty() && !io::holds_groups(io::solver_format(output.file).value()))
    report.notes.push_back(
        "groups of faces are not in '" + output.file.filename().string() +
        "': .vtu files hold volumes alone; .msh, .inp, .xdmf and OpenFOAM cases have groups");
  if (output.second_order) io::add_middles(made.mesh);
  made.summary.points = made.mesh.points().size();
  io::make_folder(io::folder_of(io::solver_file(output.file)));
  io::write_solver_mesh(output.file, made.mesh, output.gmsh_version);
  return made.summary;
}

/// Makes it on the master, which has all cells; whoever stops the run ends it. Collective.
void mesh_cells(const Writing& writing, supersteps::RunResult& result, supersteps::Ranks& ranks,
                Written& written) {
  bool is_over = false;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    std::optional<geometry::Interruption> by_user;
    if (writing.run.interrupted && (writing.stops_gently || ranks.count() > 1))
      by_user.emplace(writing.run.interrupted);
    try {
      written.solver_mesh = write_solver_mesh(writing, result);
    } catch (const geometry::Interrupted&) {
      is_over = true;
    }
  });
  result.report.interrupted = told_by_master(is_over, ranks);
}

}  // namespace

bool told_by_master(bool said, supersteps::Ranks& ranks) {
  if (ranks.is_master())
    for (int rank = 1; rank < ranks.count(); ++rank) ranks.send(rank, said ? "yes" : "no");
  ranks.sync();
  return ranks.is_master() ? said : ranks.received().front().bytes == "yes";
}

void ask_for(const Outputs& files, bool only, supersteps::RunOptions& run) {
  const auto any = [&](const auto& is_such) {
    return std::any_of(files.surfaces.begin(), files.surfaces.end(), [&](const fs::path& file) {
      const io::SurfaceFormat* format = io::surface_format(file);
      return format != nullptr && is_such(*format);
    });
  };
  const bool has_surfaces = !files.surfaces.empty();
  run.boundary = run.boundary || has_surfaces || files.drawing;
  run.faces = run.faces || files.drawing || any([](const auto& format) { return format.has_faces; });
  run.closes_parts = run.closes_parts || any([](const auto& format) { return format.closes_parts; });
  run.outlines = run.outlines || any([](const auto& format) { return format.is_plane; });
  run.traces_boundary = run.traces_boundary || has_surfaces;
  if (files.film || files.solver_mesh) run.collect = supersteps::Collect::master;  // which makes them
  if (!only) return;
  run.collect_cells = run.boundary || files.cells || files.picture || files.of_steps() || files.solver_mesh;
  run.can_be_asked = files.solver_mesh.has_value();
  // Nobody else needs all cells in one place.
  run.complex = files.solver_mesh && !files.cells && !files.picture && !files.of_steps() && !files.film &&
                !files.drawing;
  if (run.complex) run.collect = supersteps::Collect::file;
}

supersteps::RunResult write_run(const Writing& writing, supersteps::Ranks& ranks, const Run& evaluate,
                                Written& written) {
  check_files(writing);
  supersteps::RunOptions run = writing.run;
  StepFailures step_failures;
  if (writing.files.of_steps())
    run.on_frame = [&](const supersteps::RunResult& now, unsigned step) {
      write_step(writing, now, step, ranks, step_failures);
    };
  bool cells_are_written = false;
  if (writing.cells_go && !writing.files.solver_mesh)  // which needs the cells to the end
    run.on_cells = [&](supersteps::RunResult& now) {
      tell_incomplete(writing, now.report, ranks);
      write_cells(writing, now, ranks);
      cells_are_written = true;
    };
  supersteps::RunResult result = evaluate(run, ranks);
  for (const auto& failed : {step_failures.frames, step_failures.series})
    if (failed) result.report.failed.push_back(*failed);
  if (result.report.interrupted) return result;
  end_if_over(writing);
  if (!cells_are_written) tell_incomplete(writing, result.report, ranks);
  if (writing.files.drawing) write_drawing(writing, result, ranks, evaluate, written);
  if (!cells_are_written) write_cells(writing, result, ranks);
  if (writing.files.solver_mesh && !result.report.interrupted) mesh_cells(writing, result, ranks, written);
  if (result.report.interrupted) return result;
  write_results(writing, result, ranks, written);
  if (ranks.is_master()) written.files = written_files(writing, result.report);
  return result;
}

fs::path frame_path(const fs::path& prefix, unsigned step) {
  const std::string name = fmt::format("{:04}.png", step);
  std::error_code ignored;
  if (!prefix.has_filename() || fs::is_directory(prefix, ignored)) return prefix / name;
  return prefix.string() + name;
}

}  // namespace bsp2::api
