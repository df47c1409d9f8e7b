#include <cmath>
#include <string>

#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/expression.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "bsp2/io/outputs/solver_mesh.hpp"

namespace bsp2::api {
namespace {

void check_length(const char* name, double length, bool may_be_none) {
  if (std::isfinite(length) && (length > 0 || (may_be_none && length == 0))) return;
  throw Error(std::string(name) + " is " + Value(length).text() + "; it takes a length " +
              (may_be_none ? "of 0 or more" : "above 0"));
}

}  // namespace

void check_size_field(const std::vector<std::array<double, 4>>& rows) {
  for (const auto& [x, y, z, size] : rows) {
    check_length("size of size_field", size, false);
    if (!std::isfinite(x + y + z)) throw Error("size_field has places that are no numbers");
  }
}

void check_mesh_options(const SolverMeshOptions& options) {
  if (options.size) check_length("size", *options.size, true);
  if (options.clean) check_length("clean", *options.clean, true);
  for (const auto& [name, size] : options.part_sizes) check_length(("size of " + name).c_str(), size, false);
  check_length("growth", options.growth, false);
  check_size_field(options.size_field);
  if (options.polyhedra && options.dual) throw Error("polyhedra and dual: a mesh is one or the other");
  if (options.polyhedra &&
      (options.size.value_or(0) > 0 || !options.part_sizes.empty() || !options.size_field.empty()))
    throw Error("size: polyhedra are the cells as they are; tetrahedra have a size");
}

void check_mesh_file(const std::filesystem::path& path, bool is_of_polyhedra, bool second_order,
                     int gmsh_version) {
  const auto format = io::solver_format(path);
  if (!format)
    throw Error("cannot write '" + path.string() + "': a mesh for solvers is " + io::solver_endings());
  if (is_of_polyhedra && !io::holds_polyhedra(*format))
    throw Error("cannot write '" + path.string() + "': only OpenFOAM cases and .vtu files hold polyhedra");
  if (second_order && (is_of_polyhedra || !io::holds_second_order(*format)))
    throw Error("cannot write '" + path.string() +
                "' with second_order: only tetrahedra in .msh, .inp, .xdmf and .vtu files may have points in "
                "the middle of edges");
  for (const std::filesystem::path& file : io::solver_files(path))
    if (io::is_snapshot(file))
      throw Error("cannot write '" + path.string() + "': its data would take the place of '" + file.string() +
                  "', which is a snapshot; give the mesh another name");
  if (gmsh_version != 41 && gmsh_version != 22) throw Error("gmsh_version is 41 or 22");
  if (gmsh_version != 41 && *format != io::SolverFormat::gmsh)
    throw Error("cannot write '" + path.string() + "' with gmsh_version: that is of .msh files");
}

}  // namespace bsp2::api
