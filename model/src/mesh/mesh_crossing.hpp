#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/model/expression/expression.hpp"
#include "mesh/predicates.hpp"

namespace bsp2::model {

/// What goes through a triangle, or lies on it.
struct MeshCrossing {
  std::array<Point3, 3> triangle;
  std::vector<Point3> other;  ///< the ends of an edge that goes from one side to the other, or a triangle
  bool in_plane = false;      ///< two triangles: in the same plane, wound alike, not through each other
};

/// A place where a closed mesh crosses itself; nothing if there is none for sure. Faces that touch do not
/// cross.
///
/// An edge crosses where its ends lie clearly (beyond rounding) on both sides of a triangle that it hits, or
/// of both triangles at an edge that it hits. Triangles cross, too, that clearly share more than a point
/// inside both while their edges only pass through edges and corners exactly. Triangles that lie in one plane
/// exactly cross where the mesh winds around one side of the plane by two or more times more than around the
/// other; those of solids that touch face to face are wound in opposite ways there. Time: n log n for n
/// triangles of a mesh that is no heap of them. @param threads that look; the result is the same for any
/// number.
std::optional<MeshCrossing> self_crossing(const TriangleMesh& mesh, unsigned threads = 1);

/// "the edge from (x, y, z) to ... goes through the triangle ...", "the triangle ... and the triangle ...
/// cover each other ..." or "... go through each other"
std::string text_of(const MeshCrossing& crossing);

}  // namespace bsp2::model
