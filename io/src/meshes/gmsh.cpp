#include <algorithm>

#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"

// Source: the gmsh reference manual, "MSH file format" (4.1) and "Legacy formats" (2.2).

namespace bsp2::io {
namespace {

constexpr int triangle = 2, tetrahedron = 4, second_order_triangle = 9, second_order_tetrahedron = 11;

/// Volumes and groups have one number each, volumes first.
class GmshText {
 public:
  explicit GmshText(const SolverMesh& mesh) : mesh_(mesh), second_(!mesh.middles.empty()) {}

  std::string version_41() {
    text_ << "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n";
    write_names();
    write_entities();
    const auto& points = mesh_.points();
    text_ << "$Nodes\n1 " << points.size() << " 1 " << points.size() << "\n3 1 0 " << points.size() << '\n';
    for (std::size_t i = 1; i <= points.size(); ++i) text_ << i << '\n';
    for (const auto& [x, y, z] : points) text_ << x << ' ' << y << ' ' << z << '\n';
    text_ << "$EndNodes\n";
    const auto groups = sorted(mesh_.group_of_triangle, mesh_.groups.size());
    const auto volumes = sorted(mesh_.volume, mesh_.volumes.size());
    std::size_t blocks = 0, number = 0;
    for (const auto& all : {groups, volumes})
      for (const auto& some : all) blocks += some.empty() ? 0 : 1;
    const std::size_t elements = mesh_.group_of_triangle.size() + mesh_.volume.size();
    text_ << "$Elements\n" << blocks << ' ' << elements << " 1 " << elements << '\n';
    for (std::size_t g = 0; g < groups.size(); ++g) {
      if (groups[g].empty()) continue;
      text_ << "2 " << g + 1 << ' ' << triangle_type() << ' ' << groups[g].size() << '\n';
      for (const std::size_t i : groups[g]) {
        text_ << ++number;
        write_triangle(i);
      }
    }
    for (std::size_t v = 0; v < volumes.size(); ++v) {
      if (volumes[v].empty()) continue;
      text_ << "3 " << v + 1 << ' ' << tetrahedron_type() << ' ' << volumes[v].size() << '\n';
      for (const std::size_t i : volumes[v]) {
        text_ << ++number;
        write_tetrahedron(i);
      }
    }
    text_ << "$EndElements\n";
    return text_.text();
  }

  std::string version_22() {
    text_ << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    write_names();
    text_ << "$Nodes\n" << mesh_.points().size() << '\n';
    std::size_t number = 0;
    for (const auto& [x, y, z] : mesh_.points())
      text_ << ++number << ' ' << x << ' ' << y << ' ' << z << '\n';
    text_ << "$EndNodes\n$Elements\n" << mesh_.group_of_triangle.size() + mesh_.volume.size() << '\n';
    number = 0;
    for (std::size_t i = 0; i < mesh_.group_of_triangle.size(); ++i) {
      const auto group = static_cast<std::size_t>(mesh_.group_of_triangle[i]);
      text_ << ++number << ' ' << triangle_type() << " 2 " << number_of_group(group) << ' ' << group + 1;
      write_triangle(i);
    }
    for (std::size_t i = 0; i < mesh_.volume.size(); ++i) {
      text_ << ++number << ' ' << tetrahedron_type() << " 2 " << mesh_.volume[i] + 1 << ' '
            << mesh_.volume[i] + 1;
      write_tetrahedron(i);
    }
    text_ << "$EndElements\n";
    return text_.text();
  }

 private:
  const SolverMesh& mesh_;
  bool second_;
  MeshText text_;

  [[nodiscard]] std::size_t number_of_group(std::size_t group) const {
    return mesh_.volumes.size() + group + 1;
  }
  [[nodiscard]] int triangle_type() const { return second_ ? second_order_triangle : triangle; }
  [[nodiscard]] int tetrahedron_type() const { return second_ ? second_order_tetrahedron : tetrahedron; }

  static std::vector<std::vector<std::size_t>> sorted(const std::vector<std::int32_t>& group,
                                                      std::size_t groups) {
    std::vector<std::vector<std::size_t>> all(groups);
    for (std::size_t i = 0; i < group.size(); ++i) all[static_cast<std::size_t>(group[i])].push_back(i);
    return all;
  }

  /// A name stands in one line.
  static std::string quoted(std::string name) {
    std::replace(name.begin(), name.end(), '"', '\'');
    std::replace_if(
        name.begin(), name.end(), [](unsigned char c) { return c < ' '; }, ' ');
    return '"' + name + '"';
  }

  void write_names() {
    text_ << "$PhysicalNames\n" << mesh_.volumes.size() + mesh_.groups.size() << '\n';
    for (std::size_t g = 0; g < mesh_.groups.size(); ++g)
      text_ << "2 " << number_of_group(g) << ' ' << quoted(mesh_.groups[g]) << '\n';
    for (std::size_t v = 0; v < mesh_.volumes.size(); ++v)
      text_ << "3 " << v + 1 << ' ' << quoted(mesh_.volumes[v]) << '\n';
    text_ << "$EndPhysicalNames\n";
  }

  void write_entities() {
    std::array<double, 6> box{};
    if (!mesh_.points().empty())
      for (std::size_t k = 0; k < 3; ++k) {
        box[k] = box[k + 3] = mesh_.points().front()[k];
        for (const auto& p : mesh_.points()) {
          box[k] = std::min(box[k], p[k]);
          box[k + 3] = std::max(box[k + 3], p[k]);
        }
      }
    const auto write_box = [&] {
      for (const double x : box) text_ << ' ' << x;
    };
    text_ << "$Entities\n0 0 " << mesh_.groups.size() << ' ' << mesh_.volumes.size() << '\n';
    for (std::size_t g = 0; g < mesh_.groups.size(); ++g) {
      text_ << g + 1;
      write_box();
      text_ << " 1 " << number_of_group(g) << " 0\n";
    }
    for (std::size_t v = 0; v < mesh_.volumes.size(); ++v) {
      text_ << v + 1;
      write_box();
      text_ << " 1 " << v + 1 << " 0\n";
    }
    text_ << "$EndEntities\n";
  }

  void write_triangle(std::size_t i) {
    for (const std::uint32_t p : mesh_.tetrahedra.triangles[i]) text_ << ' ' << p + 1;
    if (second_)
      for (const std::uint32_t p : mesh_.triangle_middles[i]) text_ << ' ' << p + 1;
    text_ << '\n';
  }
  void write_tetrahedron(std::size_t i) {
    for (const std::uint32_t p : mesh_.tetrahedra.tetrahedra[i]) text_ << ' ' << p + 1;
    if (second_)
      for (const std::size_t k : {0, 1, 2, 3, 5, 4}) text_ << ' ' << mesh_.middles[i][k] + 1;
    text_ << '\n';
  }
};

}  // namespace

void write_gmsh(const std::filesystem::path& path, const SolverMesh& mesh, int version) {
  GmshText text(mesh);
  write_file(path, version == 22 ? text.version_22() : text.version_41());
}

}  // namespace bsp2::io
