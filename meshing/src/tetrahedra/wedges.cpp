#include "tetrahedra/wedges.hpp"

#include <algorithm>

#include "bsp2/geometry/support/interruption.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {

using geometry::Interruption;

Wedges::Wedges(const Tetrahedra& mesh, const std::vector<Edge>& edges) : mesh_(mesh) {
  for (const Edge& edge : edges) slices_.try_emplace(edge);
  if (slices_.empty()) return;
  find_slices();
  find_borders();
  for (auto& [edge, slices] : slices_) join(edge, slices);
}

double Wedges::angle(const Edge& edge, std::uint32_t tetrahedron) const {
  const auto& slices = slices_.at(edge);
  return std::ranges::find(slices, tetrahedron, &Slice::tetrahedron)->of_wedge;
}

void Wedges::find_slices() {
  std::vector<bool> is_asked(mesh_.points.size(), false);
  for (const auto& [edge, slices] : slices_) is_asked[edge[0]] = is_asked[edge[1]] = true;
  for (std::uint32_t t = 0; t < mesh_.tetrahedra.size(); ++t) {
    Interruption::check();
    const auto& p = mesh_.tetrahedra[t];
    if (std::ranges::count_if(p, [&](std::uint32_t q) { return is_asked[q]; }) < 2) continue;
    const auto normals =
        normals_of(mesh_.points[p[0]], mesh_.points[p[1]], mesh_.points[p[2]], mesh_.points[p[3]]);
    for (const DihedralAngle& at : dihedral_angles(normals)) {
      const auto found = slices_.find(edge_between(p[at.edge[0]], p[at.edge[1]]));
      if (found != slices_.end())
        found->second.push_back({t, {p[at.beside[0]], p[at.beside[1]]}, at.degrees});
    }
  }
}

void Wedges::find_borders() {
  for (const auto& triangle : mesh_.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge edge = edge_between(triangle[k], triangle[(k + 1) % 3]);
      if (slices_.contains(edge)) borders_[edge].push_back(triangle[(k + 2) % 3]);
    }
}

/// From slice to slice, beyond faces that are not on a side.
void Wedges::join(const Edge& edge, std::vector<Slice>& slices) const {
  std::map<std::uint32_t, std::vector<std::size_t>> at_face;  // slices by the third point of their faces
  for (std::size_t i = 0; i < slices.size(); ++i)
    for (const std::uint32_t p : slices[i].beside) at_face[p].push_back(i);
  if (const auto borders = borders_.find(edge); borders != borders_.end())
    for (const std::uint32_t p : borders->second) at_face.erase(p);
  std::vector<bool> is_seen(slices.size(), false);
  std::vector<std::size_t> wedge;
  const auto add = [&](std::size_t i) {
    if (!is_seen[i]) wedge.push_back(i);
    is_seen[i] = true;
  };
  for (std::size_t first = 0; first < slices.size(); ++first) {
    if (is_seen[first]) continue;
    wedge.clear();
    add(first);
    const std::int32_t part = mesh_.part[slices[first].tetrahedron];
    double angle = 0;
    for (std::size_t i = 0; i < wedge.size(); ++i) {
      const Slice& slice = slices[wedge[i]];
      angle += slice.angle;
      for (const std::uint32_t p : slice.beside)
        if (const auto beyond = at_face.find(p); beyond != at_face.end())
          for (const std::size_t k : beyond->second)
            if (mesh_.part[slices[k].tetrahedron] == part) add(k);
    }
    for (const std::size_t i : wedge) slices[i].of_wedge = angle;
  }
}

}  // namespace bsp2::meshing
