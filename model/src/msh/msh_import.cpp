// Meshes of gmsh as solids.
#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <unordered_map>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/msh/msh_file.hpp"
#include "import/imports.hpp"
#include "import/part_names.hpp"
#include "mesh/mesh_closing.hpp"

namespace bsp2::model {
namespace {

/// The sides of a solid element, by the number of its corners: counter-clockwise seen from outside.
const std::vector<std::vector<std::size_t>>& sides_of(int corners) {
  static const std::vector<std::vector<std::size_t>> tetrahedron{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}},
      pyramid{{0, 3, 2, 1}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}},
      prism{{0, 2, 1}, {3, 4, 5}, {0, 1, 4, 3}, {1, 2, 5, 4}, {2, 0, 3, 5}},
      hexahedron{{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}};
  return corners == 4 ? tetrahedron : corners == 5 ? pyramid : corners == 6 ? prism : hexahedron;
}

class MshSolids {
 public:
  MshSolids(const MshFile& file, const std::filesystem::path& path) : file_(file), path_(path) {}

  /// Solid elements are parts by their groups. Groups of a surface are, if each of them is closed; else they
  /// are sides of solids, and all is one mesh.
  ImportedParts finished() {
    ImportedParts result;
    PartNames names;
    const bool is_solid = !file_.volumes.empty();
    for (const auto& [key, group] : is_solid ? file_.volumes : file_.surfaces) {
      if (group.elements.empty()) continue;
      result.parts.push_back(
          {names.once(group.name), {}, is_solid ? skin_of(group.elements) : surface_of(group.elements)});
    }
    if (result.parts.empty()) {
      throw Error(path_.string() + ": there are no triangles and no solid elements in it");
    }
    if (is_solid)
      result.notes.emplace_back("it is a mesh of solid elements, whose outside is taken");
    else if (!are_closed(result.parts)) {
      if (std::any_of(result.parts.begin(), result.parts.end(),
                      [](const ImportedPart& part) { return !part.name.empty(); }))
        result.notes.emplace_back(
            "its groups are sides of a solid, and no solids; their names are passed over");
      ImportedMesh all = joined(result.parts);
      result.parts.clear();
      result.parts.push_back({{}, {}, std::move(all)});
    }
    if (file_.curved > 0)
      result.warnings.push_back(
          counted(file_.curved,
                  "# element[s] of higher order [counts|count] by the corners alone, with straight edges"));
    return result;
  }

 private:
  const MshFile& file_;
  const std::filesystem::path& path_;

  void add_face(const std::vector<std::uint32_t>& corners, ImportedMesh& mesh,
                std::unordered_map<std::uint32_t, std::uint32_t>& own) const {
    std::vector<std::uint32_t> face;
    for (const std::uint32_t corner : corners) {
      const auto [found, is_new] = own.try_emplace(corner, static_cast<std::uint32_t>(mesh.points.size()));
      if (is_new) mesh.add_point(file_.points[corner]);
      face.push_back(found->second);
    }
    mesh.add_face(face);
  }

  ImportedMesh surface_of(const std::vector<std::vector<std::uint32_t>>& faces) const {
    ImportedMesh mesh;
    std::unordered_map<std::uint32_t, std::uint32_t> own;
    for (const auto& face : faces) add_face(face, mesh, own);
    return mesh;
  }

  /// The sides of solid elements that are between no two of them.
  ImportedMesh skin_of(const std::vector<std::vector<std::uint32_t>>& elements) const {
    std::map<std::vector<std::uint32_t>, std::vector<std::uint32_t>> single;  // by sorted corners
    for (const auto& element : elements) {
      const bool is_inverted = element.size() == 4 && is_inside_out(element);
      for (const auto& side : sides_of(static_cast<int>(element.size()))) {
        std::vector<std::uint32_t> face;
        for (const std::size_t i : side) face.push_back(element[i]);
        if (is_inverted) std::reverse(face.begin(), face.end());
        std::vector<std::uint32_t> key = face;
        std::sort(key.begin(), key.end());
        if (const auto [found, is_new] = single.try_emplace(std::move(key), std::move(face)); !is_new)
          single.erase(found);
      }
    }
    ImportedMesh mesh;
    std::unordered_map<std::uint32_t, std::uint32_t> own;
    for (const auto& [key, face] : single) add_face(face, mesh, own);
    return mesh;
  }

  [[nodiscard]] bool is_inside_out(const std::vector<std::uint32_t>& corners) const {
    std::array<Point3, 3> e{};
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k)
        e[i][k] = file_.points[corners[i + 1]][k] - file_.points[corners[0]][k];
    return e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) -
               e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
               e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]) <
           0;
  }

  static bool are_closed(const std::vector<ImportedPart>& parts) {
    return std::all_of(parts.begin(), parts.end(),
                       [](const ImportedPart& part) { return open_edges(part.mesh.faces).empty(); });
  }
};

}  // namespace

ImportedParts import_msh(std::string_view bytes, const std::filesystem::path& path) {
  return MshSolids(read_msh(bytes, path), path).finished();
}

}  // namespace bsp2::model
