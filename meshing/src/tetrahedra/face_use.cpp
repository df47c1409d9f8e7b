#include <algorithm>

#include "bsp2/meshing/simplices/orientation.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

/// A face as one tetrahedron uses it.
struct Use {
  Triangle points;  ///< in order
  int side;         ///< the sign of that order, seen from outside of the tetrahedron; 0: it is flat

  Use(Triangle cycle, int sign) : points(cycle), side(sign) {
    for (const auto& [i, k] : {std::pair(0, 1), std::pair(1, 2), std::pair(0, 1)})
      if (points[static_cast<std::size_t>(i)] > points[static_cast<std::size_t>(k)]) {
        std::swap(points[static_cast<std::size_t>(i)], points[static_cast<std::size_t>(k)]);
        side = -side;
      }
  }
};

std::vector<Use> uses_of(const Tetrahedra& mesh) {
  std::vector<Use> uses;
  uses.reserve(4 * mesh.tetrahedra.size());
  for (const auto& [a, b, c, d] : mesh.tetrahedra) {
    const auto& p = mesh.points;
    const int sign = orientation(p[a], p[b], p[c], p[d]);
    for (const Triangle& cycle : {Triangle{b, c, d}, Triangle{a, d, c}, Triangle{a, b, d}, Triangle{a, c, b}})
      uses.emplace_back(cycle, sign);
  }
  std::sort(uses.begin(), uses.end(), [](const Use& a, const Use& b) { return a.points < b.points; });
  return uses;
}

}  // namespace

FaceUse face_use(const Tetrahedra& mesh) {
  FaceUse result;
  std::vector<Triangle> faces;  // each once, in order
  const std::vector<Use> uses = uses_of(mesh);
  for (auto use = uses.begin(); use != uses.end();) {
    const auto end =
        std::find_if(use, uses.end(), [&](const Use& other) { return other.points != use->points; });
    const auto times = end - use;
    ++(times == 1 ? result.once : times == 2 ? result.twice : result.more);
    if (times == 2 && use[0].side * use[1].side > 0) ++result.folded;
    faces.push_back(use->points);
    use = end;
  }
  for (const Triangle& triangle : mesh.triangles)
    if (!std::binary_search(faces.begin(), faces.end(), Use(triangle, 1).points)) ++result.strange;
  return result;
}

}  // namespace bsp2::meshing
