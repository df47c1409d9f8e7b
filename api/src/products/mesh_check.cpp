#include <algorithm>
#include <string>

#include "bsp2/api/products/solver_mesh.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/msh/msh_file.hpp"

namespace bsp2::api {
namespace {

class Checker {
 public:
  explicit Checker(const std::filesystem::path& path) : path_(path.string()) {
    if (path.extension() != ".msh")
      throw Error("'" + path_ + "' cannot be checked: meshes of gmsh can, whose files end in .msh");
    file_ = model::read_msh(path);
    checked_.file = path;
  }

  MeshCheck run() {
    take_volumes();
    take_surfaces();
    mesh_.points = file_.points;
    measure();
    look_at_faces();
    look_at_points();
    return std::move(checked_);
  }

 private:
  const std::string path_;
  model::MshFile file_;
  meshing::Tetrahedra mesh_;
  MeshCheck checked_;
  MeshFigures& summary_ = checked_.figures;

  /// @param kind of groups without a name.
  static std::string name_of(const model::MshFile::Key& key, const model::MshFile::Group& group,
                             const char* kind) {
    return group.name.empty() ? kind + std::to_string(key.second) : group.name;
  }

  void take_volumes() {
    for (const auto& [key, group] : file_.volumes) {
      if (group.elements.empty()) continue;
      for (const auto& corners : group.elements) {
        if (corners.size() != 4)
          throw Error("'" + path_ + "' cannot be checked: it has elements of " +
                      counted(corners.size(), "# corner[s]") + ", and only tetrahedra are known");
        mesh_.tetrahedra.push_back({corners[0], corners[1], corners[2], corners[3]});
        mesh_.part.push_back(static_cast<std::int32_t>(summary_.volumes.size()));
      }
      summary_.volumes.emplace_back(name_of(key, group, "volume "), 0);
    }
    if (mesh_.tetrahedra.empty()) throw Error("'" + path_ + "' has no tetrahedra");
  }

  void take_surfaces() {
    for (const auto& [key, group] : file_.surfaces) {
      for (const auto& corners : group.elements)
        if (corners.size() == 3) mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
      if (!group.elements.empty())
        summary_.groups.emplace_back(name_of(key, group, "surface "), group.elements.size());
    }
  }

  void measure() {
    const auto volumes = meshing::volumes_of(mesh_, summary_.volumes.size());
    for (std::size_t i = 0; i < summary_.volumes.size(); ++i) {
      summary_.volumes[i].second = volumes[i];
      summary_.volume += volumes[i];
    }
    summary_.cells = mesh_.tetrahedra.size();
    summary_.points = mesh_.points.size();
    const meshing::Quality quality = meshing::quality_of(mesh_);
    add_quality(quality, summary_);
    if (quality.turned > 0)
      checked_.faults.push_back(counted(quality.turned, "# tetrahedr[on is|a are] flat or turned over"));
  }

  void look_at_faces() {
    const meshing::FaceUse use = meshing::face_use(mesh_);
    summary_.faces = use.once + use.twice + use.more;
    summary_.outer_faces = use.once;
    summary_.overused_faces = use.more;
    if (use.more > 0)
      checked_.faults.push_back(counted(use.more, "# face[ belongs|s belong] to more than two tetrahedra"));
    if (use.folded > 0)
      checked_.faults.push_back(counted(use.folded, "# face[ has|s have] two tetrahedra on one side"));
    if (use.strange > 0)
      checked_.faults.push_back(
          counted(use.strange, "# triangle[ of a group is|s of groups are] no face of a tetrahedron"));
  }

  void look_at_points() {
    std::vector<bool> is_used(mesh_.points.size(), false);
    for (const auto& t : mesh_.tetrahedra)
      for (const std::uint32_t p : t) is_used[p] = true;
    for (const std::uint32_t p : file_.between) is_used[p] = true;
    if (const auto unused = std::count(is_used.begin(), is_used.end(), false); unused > 0)
      checked_.notes.push_back(counted(static_cast<std::uint64_t>(unused), "# point[ belongs|s belong]") +
                               " to no tetrahedron");
    std::sort(mesh_.points.begin(), mesh_.points.end());
    std::uint64_t equal = 0;
    for (std::size_t i = 1; i < mesh_.points.size(); ++i) equal += mesh_.points[i] == mesh_.points[i - 1];
    if (equal > 0)
      checked_.notes.push_back(counted(equal, "# point[ is|s are]") +
                               " where another one is: there the mesh may be in pieces");
    if (file_.curved > 0) checked_.notes.emplace_back("elements of second order are taken as straight");
  }
};

}  // namespace

MeshCheck checked_mesh(const std::filesystem::path& path) { return Checker(path).run(); }

}  // namespace bsp2::api
