#include "mesh/mesh_touching.hpp"

#include <algorithm>
#include <bit>
#include <tuple>
#include <unordered_map>

#include "bsp2/geometry/support/disjoint_sets.hpp"

namespace bsp2::model {
namespace {

struct PointHash {
  std::size_t operator()(const Point3& point) const {
    std::uint64_t hash = 0;
    for (const double x : point)
      hash = (hash ^ std::bit_cast<std::uint64_t>(x + 0.0)) * 0x9E3779B97F4A7C15u + (hash >> 29);  // no -0
    return static_cast<std::size_t>(hash ^ (hash >> 32));
  }
};

/// An edge of which there is more in one direction, and the mesh that it is of.
struct OpenSide {
  OpenEdge edge;
  std::uint32_t mesh;
  bool operator<(const OpenSide& other) const {
    return std::tie(edge.a, edge.b, mesh) < std::tie(other.edge.a, other.edge.b, other.mesh);
  }
};

std::vector<OpenSide> open_sides(const std::vector<MeshView>& meshes) {
  std::unordered_map<Point3, std::uint32_t, PointHash> number;
  std::vector<OpenSide> sides;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    FaceCycles faces = meshes[m].faces;
    for (std::uint32_t& corner : faces.corners)
      corner = number.try_emplace(meshes[m].points[corner], static_cast<std::uint32_t>(number.size()))
                   .first->second;
    for (const OpenEdge& edge : open_edges(faces)) sides.push_back({edge, m});
  }
  std::sort(sides.begin(), sides.end());
  return sides;
}

}  // namespace

std::vector<std::vector<std::size_t>> closed_together(const std::vector<MeshView>& meshes) {
  const std::vector<OpenSide> sides = open_sides(meshes);
  geometry::DisjointSets sets(meshes.size());
  std::vector<bool> is_open(meshes.size());  // even with all that have the same edge
  for (std::size_t begin = 0, end = 0; begin < sides.size(); begin = end) {
    int excess = 0;
    while (end < sides.size() && sides[end].edge.a == sides[begin].edge.a &&
           sides[end].edge.b == sides[begin].edge.b) {
      sets.unite(sides[begin].mesh, sides[end].mesh);
      excess += sides[end++].edge.excess;
    }
    if (excess != 0) is_open[sides[begin].mesh] = true;
  }
  for (std::uint32_t m = 0; m < meshes.size(); ++m)
    if (is_open[m]) is_open[sets.find(m)] = true;
  std::vector<std::vector<std::size_t>> groups;
  std::unordered_map<std::uint32_t, std::size_t> group_of;
  for (std::uint32_t m = 0; m < meshes.size(); ++m) {
    const bool is_alone = is_open[sets.find(m)];
    const auto [found, is_new] = group_of.try_emplace(sets.find(m), groups.size());
    if (is_new || is_alone)
      groups.push_back({m});
    else
      groups[found->second].push_back(m);
  }
  return groups;
}

}  // namespace bsp2::model
