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

SolverMesh Result::solver_mesh(const SolverMeshOptions& options) const {
  return guarded([&] {
    api::check_mesh_options(options);
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
    api::check_mesh_file(path, mesh.polyhedra.has_value(), second_order, gmsh_version);
    io::make_folder(io::folder_of(io::solver_file(path)));
    if (!second_order) return io::write_solver_mesh(path, mesh, gmsh_version);
    io::SolverMesh with_middles = mesh;
    io::add_middles(with_middles);
    io::write_solver_mesh(path, with_middles, gmsh_version);
  });
}

}  // namespace bsp2
