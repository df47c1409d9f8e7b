#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <string_view>

#include "bsp2/api/report/report_json.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "bsp2/supersteps/stages/collection.hpp"
#include "evaluation/result.hpp"
#include "expression/node.hpp"
#include "outputs/film.hpp"
#include "outputs/pictures.hpp"

namespace bsp2 {
std::string Result::Implementation::source() const {
  if (expression) return expression->to_text();
  if (!model.empty()) return load(model).to_text();
  const io::SnapshotHead head = io::read_snapshot(*snapshot, io::SnapshotPart::head).head;
  return located(head.source, folder_named_in(head.source, head.model));
}

std::string Result::Implementation::picture(const std::string& format, const View& view) {
  const auto options = api::picture_options(view, api::format_of("view." + format));
  check_cells("a picture");
  std::string bytes;
  ranks->ranks.together([&] { bytes = supersteps::render(ranks->ranks, result, options); });
  return bytes;
}

void Result::Implementation::animate(const std::filesystem::path& path, const Film& film, const View& view) {
  api::check(film);
  check_cells("an animation");
  if (!ranks->ranks.is_master() || !result.is_collected)
    throw Error("an animation is drawn by the master, if it has all cells: evaluate with Collect::master");
  const auto looks = api::picture_options(view, supersteps::PictureFormat::png);
  io::make_folder(io::folder_of(path));
  if (!api::draw_film(film, looks, result, result.report.threads, geometry::Interruption::is_wanted, path))
    throw geometry::Interrupted();
}

/// All cells in one file: a mesh whose only piece takes the name.
void write_one_vtu(const supersteps::RunResult& result, const std::filesystem::path& path, bool tets) {
  if (!result.is_collected)
    throw Error("cannot write '" + path.string() +
                "': the cells are on several ranks; .pvtu has a file of each of them");
  const io::TemporaryDirectory scratch(io::folder_of(path));
  io::VtuOptions options = supersteps::vtu_options(result);
  options.tets = tets;
  options.piece_cells = std::numeric_limits<std::size_t>::max();
  const std::filesystem::path mesh = scratch.path() / "mesh.pvtu", piece = scratch.path() / "mesh_0.vtu";
  io::write_vtu(mesh, result.report.dimension, result.mesh.batches, options);
  if (!std::filesystem::exists(piece))
    throw Error("cannot write '" + path.string() + "': there are no cells");
  std::filesystem::rename(piece, path);
}

/// What needs nothing of the others.
void Result::Implementation::write_on_master(const std::filesystem::path& path, const WriteOptions& options,
                                             std::vector<std::string>& warnings) {
  const std::string ending = path.extension().string();
  if (const io::SurfaceFormat* format = io::surface_format(path)) {
    if (result.report.dimension == 2 && format->is_plane)
      find_outlines();
    else
      find_surface(format->has_faces || (format->closes_parts && !result.part_names.empty()));
    auto& told = result.report.warnings;
    const auto before = static_cast<std::ptrdiff_t>(told.size());
    supersteps::write_boundary(result, path, options.clean, result.report.threads);
    warnings.insert(warnings.end(), told.begin() + before, told.end());
  } else if (ending == ".vtu") {
    check_cells("'" + path.string() + "'");
    write_one_vtu(result, path, options.tets);
  } else if (ending == ".json") {
    io::write_file(path, api::to_json(result.report));
  } else if (ending == ".csg") {
    io::write_file(path, source());
  } else if (ending == ".h5") {
    if (!snapshot)
      throw Error("cannot write '" + path.string() +
                  "': a snapshot is made while a model is evaluated; give Options::snapshot");
    io::copy_snapshot(*snapshot, path);
  } else {
    throw Error(
        "cannot write '" + path.string() +
        "': its ending names no format; .pvtu, .vtu (cells), .png, .svg, .pdf (picture), .json (report), "
        ".csg (model), .h5 (snapshot), and for the surface " +
        io::surface_endings() + " are known");
  }
}

std::vector<std::string> Result::Implementation::write(const std::filesystem::path& path,
                                                       const WriteOptions& options) {
  if (options.clean && !(*options.clean >= 0 && std::isfinite(*options.clean)))
    throw Error("cannot write '" + path.string() + "': clean is a length, 0 or more");
  std::vector<std::string> warnings;
  const bool is_mesh = path.extension() == ".pvtu";
  const auto picture = supersteps::picture_format(path);
  if (is_mesh || picture) check_cells("'" + path.string() + "'");
  ranks->ranks.together([&] {
    ranks->ranks.agree([&] {
      if (!ranks->ranks.is_master()) return;
      io::make_folder(io::folder_of(path));
      if (!is_mesh && !picture) write_on_master(path, options, warnings);
    });
    if (is_mesh) result.report.simplices = supersteps::write_mesh(ranks->ranks, result, path, options.tets);
    if (picture) {
      const std::string bytes =
          supersteps::render(ranks->ranks, result, api::picture_options(options.view, *picture));
      ranks->ranks.agree([&] {
        if (ranks->ranks.is_master()) io::write_file(path, bytes);
      });
    }
  });
  return warnings;
}

}  // namespace bsp2
