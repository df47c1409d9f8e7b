#include "bsp2/formats.hpp"

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/products/drawings.hpp"
#include "bsp2/api/products/group_rule.hpp"
#include "bsp2/io/outputs/animation.hpp"
#include "bsp2/io/outputs/sheet.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "bsp2/model/msh/size_field.hpp"
#include "bsp2/supersteps/render/rendering.hpp"

namespace bsp2 {

FileFormat file_format(const std::filesystem::path& path) {
  return guarded([&] {
    FileFormat format;
    if (const io::SurfaceFormat* of_surface = io::surface_format(path)) {
      format.surface = true;
      format.outline = of_surface->is_plane;
      format.triangles = !of_surface->is_plane && !of_surface->has_faces;
    }
    format.picture = supersteps::picture_format(path).has_value();
    format.animation = io::is_animation(path);
    format.drawing = io::sheet_format(path).has_value();
    if (const auto of_mesh = io::solver_format(path)) {
      format.solver_mesh = true;
      format.openfoam = *of_mesh == io::SolverFormat::openfoam;
      format.gmsh = *of_mesh == io::SolverFormat::gmsh;
      format.polyhedra = io::holds_polyhedra(*of_mesh);
      format.second_order = io::holds_second_order(*of_mesh);
    }
    return format;
  });
}

bool is_snapshot(const std::filesystem::path& file) { return file.extension() == ".h5" || io::is_hdf5(file); }

Endings endings() {
  return guarded([] { return Endings{io::surface_endings(), io::plane_endings(), io::solver_endings()}; });
}
std::string surface_format_table() {
  return guarded([] { return io::surface_format_table(); });
}
std::string import_format_table() {
  return guarded([] { return model::import_format_table(); });
}

void check(const DrawingOptions& drawing, std::string_view dashes) {
  guarded([&] { api::drawing_options(drawing, dashes); });
}
void check_group(const std::string& group) {
  guarded([&] { api::parse_group(group); });
}
void check_animation(const std::filesystem::path& path) {
  guarded([&] { io::Animation::check(path); });
}
std::vector<std::array<double, 4>> read_size_field(const std::filesystem::path& path) {
  return guarded([&] { return model::read_size_field(path); });
}

}  // namespace bsp2
