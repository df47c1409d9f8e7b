#pragma once

#include <array>
#include <optional>
#include <string>

#include "bsp2/model/expression.hpp"
#include "predicates.hpp"

namespace bsp2::model {

/// An edge that goes from one side of a triangle to the other, through it.
struct MeshCrossing {
  std::array<Point3, 2> edge;
  std::array<Point3, 3> triangle;
};

/// A place where a closed mesh crosses itself; nothing if there is none for sure. Faces that touch do not cross.
///
/// An edge crosses where its ends lie clearly (beyond rounding) on both sides of a triangle that it hits, or of both
/// triangles at an edge that it hits. Time: n log n for n triangles of a mesh that is no heap of them.
std::optional<MeshCrossing> self_crossing(const TriangleMesh& mesh);

/// "the edge from (x, y, z) to ... goes through the triangle ..."
std::string text_of(const MeshCrossing& crossing);

}  // namespace bsp2::model
