#include <algorithm>
#include <map>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/io/files/file.hpp"
#include "meshes/formats.hpp"
#include "meshes/mesh_text.hpp"

// Source: the CalculiX manual, *NODE, *ELEMENT, *NSET, *SURFACE. Its faces of a tetrahedron are S1: 1 2 3,
// S2: 1 4 2, S3: 2 4 3, S4: 3 4 1.

namespace bsp2::io {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

struct ElementFace {
  Triangle points;
  std::size_t element;
  int face;
};

/// All faces of elements, by their points; of two elements with the same face the one whose volume comes
/// first.
std::vector<ElementFace> faces_of(const SolverMesh& mesh) {
  constexpr std::array<std::array<int, 3>, 4> corners{{{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  std::vector<ElementFace> faces;
  for (std::size_t i = 0; i < mesh.tetrahedra.tetrahedra.size(); ++i) {
    geometry::Interruption::check();
    for (int f = 0; f < 4; ++f) {
      Triangle points;
      for (std::size_t k = 0; k < 3; ++k) points[k] = mesh.tetrahedra.tetrahedra[i][corners[f][k]];
      std::sort(points.begin(), points.end());
      faces.push_back({points, i, f + 1});
    }
  }
  std::sort(faces.begin(), faces.end(), [&](const ElementFace& a, const ElementFace& b) {
    return std::pair(a.points, mesh.volume[a.element]) < std::pair(b.points, mesh.volume[b.element]);
  });
  return faces;
}

template <typename Numbers>
void write_lines(MeshText& text, const Numbers& numbers) {
  std::size_t in_line = 0;
  for (const auto number : numbers) text << number << (++in_line % 12 == 0 ? ",\n" : ", ");
  if (in_line % 12 != 0) text << '\n';
}

}  // namespace

void write_abaqus(const std::filesystem::path& path, const SolverMesh& mesh) {
  const bool is_second = !mesh.middles.empty();
  const auto& tetrahedra = mesh.tetrahedra.tetrahedra;
  MeshText text;
  text << "*NODE, NSET=all\n";
  std::size_t number = 0;
  for (const auto& [x, y, z] : mesh.points()) text << ++number << ", " << x << ", " << y << ", " << z << '\n';
  const std::vector<std::string> volumes = plain_names(mesh.volumes),
                                 groups = plain_names(mesh.groups, {"all"});
  for (std::size_t volume = 0; volume < mesh.volumes.size(); ++volume) {
    text << "*ELEMENT, TYPE=" << (is_second ? "C3D10" : "C3D4") << ", ELSET=" << volumes[volume] << '\n';
    for (std::size_t i = 0; i < tetrahedra.size(); ++i) {
      if (mesh.volume[i] != static_cast<std::int32_t>(volume)) continue;
      text << i + 1;
      for (const std::uint32_t p : tetrahedra[i]) text << ", " << p + 1;
      if (is_second)
        for (const std::uint32_t p : mesh.middles[i]) text << ", " << p + 1;
      text << '\n';
    }
  }
  const auto faces = faces_of(mesh);
  for (std::size_t g = 0; g < mesh.groups.size(); ++g) {
    const std::string& name = groups[g];
    std::vector<std::uint32_t> nodes;
    text << "*SURFACE, NAME=" << name << ", TYPE=ELEMENT\n";
    for (std::size_t i = 0; i < mesh.group_of_triangle.size(); ++i) {
      if (mesh.group_of_triangle[i] != static_cast<std::int32_t>(g)) continue;
      Triangle points = mesh.tetrahedra.triangles[i];
      for (const std::uint32_t p : points) nodes.push_back(p + 1);
      if (is_second)
        for (const std::uint32_t p : mesh.triangle_middles[i]) nodes.push_back(p + 1);
      std::sort(points.begin(), points.end());
      const auto face =
          std::lower_bound(faces.begin(), faces.end(), points,
                           [](const ElementFace& a, const Triangle& b) { return a.points < b; });
      text << face->element + 1 << ", S" << face->face << '\n';
    }
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    text << "*NSET, NSET=" << name << '\n';
    write_lines(text, nodes);
  }
  write_file(path, text.text());
}

}  // namespace bsp2::io
