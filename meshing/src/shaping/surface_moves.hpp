#pragma once

#include <array>
#include <optional>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "editing/editor.hpp"
#include "shaping/displacement.hpp"

namespace bsp2::meshing {

/// How far a surface was moved, by place, however its points change afterwards.
///
/// Where corners of a triangle were moved, it has moved with them: in between by a mean of what they were,
/// each weighted by how near it is; on a side that is not plane any more, and may be divided otherwise
/// afterwards, as far as any of its corners. Shape: the triangles that have moved, and a tree over their
/// boxes.
class SurfaceMoves {
 public:
  SurfaceMoves() = default;
  /// @param moved of each point. @param reach how far a place may be from where it is on the surface.
  SurfaceMoves(const Editor& editor, const std::vector<Displacement>& moved, double reach);

  /// Of the surface there.
  [[nodiscard]] Displacement at(const Point& place) const;

 private:
  struct Triangle {
    std::array<Point, 3> corner;
    std::array<Displacement, 3> moved;
  };
  double reach_ = 0;
  std::vector<Triangle> triangles_;
  std::optional<geometry::BoxTree> tree_;
};

}  // namespace bsp2::meshing
