#pragma once

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {

/// What is nearer to one point of a mesh than to the others, about: polyhedra that meet face to face, whose
/// faces stand nearly across the line between the two middles. Finite volumes like that.
struct Dual {
  static constexpr std::uint32_t no_triangle = std::numeric_limits<std::uint32_t>::max();
  /// A cell for each point of the mesh and each part there; more, where the part comes to the point from
  /// several sides, or where one cell would have a face that is turned or skew, as at edges that lead
  /// inwards: there each tetrahedron's corner at the point is a cell. Faces are in the order of their owners,
  /// and then of their neighbours. Those between cells of one part need not be plane; `plane` and `outward`
  /// tell of the others alone.
  Complex complex;
  std::vector<std::uint32_t>
      triangle_of_face;         ///< one of those that it lies on; none between cells of a part
  std::size_t wrong_faces = 0;  ///< that are turned or skew all the same
};

/// Cells about the points, with corners in the middles of tetrahedra. What bounds the parts stays where it
/// is: corners there are in the middles of triangles, and where these are not of one side and one group, in
/// the middles of edges and at the points.
/// @pre tetrahedra are right side out, and meet face to face. @param group of each triangle.
Dual dual_of(const Tetrahedra& mesh, std::span<const std::int32_t> group);

}  // namespace bsp2::meshing
