#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {

/// The outside and interfaces of a mesh, to be asked for what is near to them.
class Surface {
 public:
  explicit Surface(const Tetrahedra& mesh);
  /// Whether some of it is no farther from a place than that.
  [[nodiscard]] bool is_near(const Point& place, double reach) const;
  /// Whether that is so of each corner and middle of the triangles of another mesh.
  [[nodiscard]] bool is_near_all_of(const Tetrahedra& other, double reach) const;

 private:
  std::vector<std::array<Point, 3>> triangles_;
  std::optional<geometry::BoxTree> tree_;  // none of no triangles
};

}  // namespace bsp2::meshing
