#include "outputs/files.hpp"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <functional>
#include <string>
#include <system_error>

#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/animation.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "outputs/drawings.hpp"
#include "outputs/film.hpp"
#include "outputs/model_files.hpp"
#include "outputs/pictures.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

/// Whether two paths, however they are written, lead to one place, be there a file yet or not.
bool are_one_file(const fs::path& a, const fs::path& b) {
  std::error_code unknown;
  return fs::weakly_canonical(fs::absolute(a, unknown), unknown) ==
         fs::weakly_canonical(fs::absolute(b, unknown), unknown);
}

/// What is written beside the files of `files_of`, under names that follow from theirs.
std::vector<fs::path> companions_of(const Writing& writing) {
  std::vector<fs::path> files;
  if (writing.files.solver_mesh) {
    files = io::solver_files(writing.files.solver_mesh->file);
    files.erase(files.begin());  // which is the one of `files_of`
  }
  for (const fs::path& surface : writing.files.surfaces)
    if (surface.extension() == ".obj") files.push_back(fs::path(surface).replace_extension(".mtl"));
  return files;
}

/// Each output needs a name of its own.
void check_names(const Writing& writing) {
  std::vector<fs::path> files;
  const auto add = [&](const std::optional<fs::path>& file) {
    if (!file) return;
    for (const fs::path& other : files)
      if (are_one_file(*file, other) && !io::is_stream(*file))  // which may take several
        throw Error("two outputs would be written to one file, '" + file->string() +
                    "': give each its own name");
    files.push_back(*file);
  };
  for (const auto& file : files_of(writing)) add(file);
  for (const auto& file : companions_of(writing)) add(file);
  add(writing.run.snapshot);
  const auto& copy = writing.files.snapshot;
  if (copy && !(writing.run.snapshot && are_one_file(*copy, *writing.run.snapshot)))
    add(copy);  // else it is there already
}

void check_ending(const fs::path& file, bool is_known, const std::string& endings) {
  if (!is_known) throw Error("cannot write '" + file.string() + "': it must end in " + endings);
}

/// Those that a run reads its model from, or would if it goes on from a snapshot.
std::vector<fs::path> files_read_by(const supersteps::RunOptions& run) {
  std::error_code none;
  if (run.resume) {
    if (!io::is_snapshot(*run.resume)) return {};
    const io::SnapshotHead head = io::read_snapshot(*run.resume, io::SnapshotPart::head).head;
    return files_of_text(head.source, head.model);
  }
  if (run.text) return files_of_text(*run.text, run.model);
  if (fs::is_regular_file(run.model, none)) return files_of_model(run.model);  // a pipe can be read once
  return {};
}

/// No file that is read is written: the input, what the model imports, what options came from. A snapshot may
/// go on in its own file, and take the place of snapshots alone.
void check_inputs(const Writing& writing) {
  const auto is_there = [](const fs::path& file) {
    std::error_code none;
    return fs::is_regular_file(file, none);
  };
  std::vector<fs::path> files = files_of(writing), snapshots;
  for (const fs::path& file : companions_of(writing)) files.push_back(file);
  for (const auto& snapshot : {writing.run.snapshot, writing.files.snapshot})
    if (snapshot) snapshots.push_back(*snapshot);
  std::erase_if(files, std::not_fn(is_there));
  std::erase_if(snapshots, std::not_fn(is_there));
  if (files.empty() && snapshots.empty()) return;
  const auto refuse = [](const fs::path& file, const fs::path& input, const char* why) {
    std::error_code none;
    if (fs::equivalent(file, input, none)) throw Error("cannot write '" + file.string() + "': " + why);
  };
  std::vector<fs::path> inputs = writing.files.read;
  if (writing.run.resume) inputs.push_back(*writing.run.resume);
  if (!writing.run.model.empty()) inputs.push_back(writing.run.model);
  const std::vector<fs::path> of_model = files_read_by(writing.run);
  for (const fs::path& file : files) {
    for (const fs::path& input : inputs) refuse(file, input, "it is the input itself");
    for (const fs::path& input : of_model) refuse(file, input, "the model is made of it");
  }
  for (const fs::path& file : snapshots) {
    if (writing.run.resume && are_one_file(file, *writing.run.resume)) continue;
    for (const fs::path& input : inputs) refuse(file, input, "it is the input itself");
    std::error_code none;
    if (!fs::is_empty(file, none) && !io::is_snapshot(file))
      throw Error("cannot write the snapshot '" + file.string() +
                  "': there is a file that is no snapshot; remove it first");
  }
}

/// What the program has told in words of its own already.
void check_formats(const Writing& writing) {
  const Outputs& files = writing.files;
  if (files.cells) check_ending(*files.cells, files.cells->extension() == ".pvtu", ".pvtu");
  if (files.series) check_ending(*files.series, files.series->extension() == ".pvd", ".pvd");
  for (const fs::path& file : files.surfaces)
    check_ending(file, io::surface_format(file) != nullptr, io::surface_endings());
  if (files.film && !files.picture) throw Error("an animation needs the name of a file: outputs.picture");
  if (files.picture && !files.film) picture_options(files.view, format_of(*files.picture));
  if (files.film || files.frames) picture_options(files.view, supersteps::PictureFormat::png);
  if (files.film) check(*files.film);
  if (files.drawing)
    for (const fs::path& file : files.drawing->files)
      check_ending(file, io::sheet_format(file).has_value(), ".svg, .pdf or .dxf");
  if (files.solver_mesh) {
    const fs::path& file = files.solver_mesh->file;
    const SolverMeshOptions& mesh = files.solver_mesh->mesh;
    check_mesh_options(mesh);
    check_mesh_file(file, mesh.polyhedra || mesh.dual, files.solver_mesh->second_order,
                    files.solver_mesh->gmsh_version);
    if (!writing.run.keep_in) throw Error("the IN cells are meshed: evaluate with keep_in");
  }
  if (files.clean && !(*files.clean >= 0 && std::isfinite(*files.clean)))
    throw Error("clean is a length, 0 or more");
  if (!files.surfaces.empty() && !writing.run.keep_in)
    throw Error("the IN cells have the surface: evaluate with keep_in");
}

}  // namespace

std::vector<fs::path> files_of(const Writing& writing) {
  std::vector<fs::path> files;
  if (writing.files.cells) files.push_back(*writing.files.cells);
  files.insert(files.end(), writing.files.surfaces.begin(), writing.files.surfaces.end());
  for (const auto& file :
       {writing.files.picture, writing.files.report, writing.files.table, writing.files.series})
    if (file) files.push_back(*file);
  if (writing.files.drawing)
    files.insert(files.end(), writing.files.drawing->files.begin(), writing.files.drawing->files.end());
  if (writing.files.solver_mesh) files.push_back(io::solver_file(writing.files.solver_mesh->file));
  return files;
}

void check_files(const Writing& writing) {
  check_formats(writing);
  check_names(writing);
  check_inputs(writing);
  if (writing.files.folder) io::check_folder(*writing.files.folder);
  for (const auto& snapshot : {writing.run.snapshot, writing.files.snapshot})
    if (snapshot) io::check_snapshot_path(*snapshot);
  if (writing.files.cells || writing.files.series) io::check_vtu();
  for (const fs::path& file : writing.files.surfaces) io::check_surface_file(file);
  if (writing.files.film) io::Animation::check(*writing.files.picture);
  if (writing.files.picture || writing.files.frames) supersteps::check_pictures();
  if (writing.files.drawing) check_drawing(*writing.files.drawing, writing.dashes);
  if (writing.files.frames) io::check_folder(io::folder_of(frame_path(*writing.files.frames, 0)));
  for (const fs::path& file : files_of(writing)) {
    if (io::is_stream(file)) continue;
    io::check_folder(io::folder_of(file));
    std::error_code error;
    if (!file.has_filename() || fs::is_directory(file, error))
      throw Error("cannot write '" + file.string() + "': it is a directory");
    if (error && error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory)
      throw Error("cannot write '" + file.string() + "': " + error.message());
    if (fs::exists(file, error) && ::access(file.c_str(), W_OK) != 0)
      throw Error("cannot write '" + file.string() + "': " + std::generic_category().message(errno));
  }
}

std::vector<fs::path> written_files(const Writing& writing, const supersteps::RunReport& report) {
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
  for (const auto& file : files_of(writing)) add(file);
  for (const auto& snapshot : {writing.run.snapshot, writing.files.snapshot}) add(snapshot);
  return files;
}

}  // namespace bsp2::api
