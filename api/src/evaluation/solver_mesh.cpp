#include "bsp2/api/products/solver_mesh.hpp"

#include <cmath>
#include <stdexcept>

#include "bsp2/api/evaluation/run_options.hpp"
#include "bsp2/io/files/file.hpp"
#include "evaluation/result.hpp"

namespace bsp2 {

class SolverMesh::Implementation {
 public:
  api::MadeSolverMesh made;
};

namespace {

void check_length(const char* name, double length, bool may_be_none) {
  if (std::isfinite(length) && (length > 0 || (may_be_none && length == 0))) return;
  throw Error(std::string(name) + " is " + Value(length).text() + "; it takes a length " +
              (may_be_none ? "of 0 or more" : "above 0"));
}

void check(const SolverMeshOptions& options) {
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

}  // namespace

SolverMesh Result::solver_mesh(const SolverMeshOptions& options) const {
  return guarded([&] {
    check(options);
    const auto& result = implementation_->result;
    if (result.report.dimension != 3)
      throw Error("solids of dimension 3 are meshed, not " + std::to_string(result.report.dimension));
    implementation_->asked();  // or it says why not
    if (!result.keeps_in) throw Error("the IN cells are meshed: evaluate with keep_in");
    auto made = std::make_shared<SolverMesh::Implementation>();
    made->made = api::make_solver_mesh(options, result);
    return SolverMesh(std::move(made));
  });
}

std::span<const double> SolverMesh::points() const { return flat(implementation_->made.mesh.points()); }
std::span<const std::uint32_t> SolverMesh::tetrahedra() const {
  return flat(implementation_->made.mesh.tetrahedra.tetrahedra);
}
std::span<const std::int32_t> SolverMesh::volumes() const { return implementation_->made.mesh.volume; }
std::span<const std::uint32_t> SolverMesh::triangles() const {
  return flat(implementation_->made.mesh.tetrahedra.triangles);
}
std::span<const std::int32_t> SolverMesh::groups() const {
  return implementation_->made.mesh.group_of_triangle;
}
const std::vector<std::string>& SolverMesh::volume_names() const {
  return implementation_->made.mesh.volumes;
}
const std::vector<std::string>& SolverMesh::group_names() const { return implementation_->made.mesh.groups; }
double SolverMesh::volume() const { return implementation_->made.summary.volume; }
double SolverMesh::smallest_angle() const { return implementation_->made.summary.smallest_angle; }
double SolverMesh::largest_angle() const { return implementation_->made.summary.largest_angle; }
const std::vector<std::string>& SolverMesh::warnings() const { return implementation_->made.warnings; }
const std::vector<std::string>& SolverMesh::notes() const { return implementation_->made.notes; }

void SolverMesh::write(const std::filesystem::path& path, bool second_order, int gmsh_version) const {
  guarded([&] {
    const io::SolverMesh& mesh = implementation_->made.mesh;
    const auto format = io::solver_format(path);
    if (!format)
      throw Error("cannot write '" + path.string() + "': a mesh for solvers is " + io::solver_endings());
    if (mesh.polyhedra && !io::holds_polyhedra(*format))
      throw Error("cannot write '" + path.string() + "': only OpenFOAM cases and .vtu files hold polyhedra");
    if (second_order && (mesh.polyhedra || !io::holds_second_order(*format)))
      throw Error(
          "cannot write '" + path.string() +
          "' with second_order: only tetrahedra in .msh, .inp, .xdmf and .vtu files may have points in "
          "the middle of edges");
    if (gmsh_version != 41 && gmsh_version != 22) throw Error("gmsh_version is 41 or 22");
    std::filesystem::path target = path;
    if (target.extension() == ".foam") target.replace_extension();
    io::make_folder(io::folder_of(target));
    if (!second_order) return io::write_solver_mesh(target, mesh, gmsh_version);
    io::SolverMesh with_middles = mesh;
    io::add_middles(with_middles);
    io::write_solver_mesh(target, with_middles, gmsh_version);
  });
}

}  // namespace bsp2
