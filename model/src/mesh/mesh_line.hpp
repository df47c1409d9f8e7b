#pragma once

#include <optional>
#include <vector>

#include "bsp2/geometry/support/box_tree.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "mesh/predicates.hpp"

/// Lines along an axis that meet the triangles of a mesh, exactly.
namespace bsp2::model {

/// Around each triangle.
std::vector<geometry::Box3> triangle_boxes(const TriangleMesh& mesh);

/// Whether the corners of triangle u lie in the plane of triangle t, exactly.
bool are_coplanar(const TriangleMesh& mesh, std::uint32_t t, std::uint32_t u);

/// The other two coordinates, so that counter-clockwise is seen from the far end of the axis.
Point2 along(int axis, const Point3& p);

/// The axis that a triangle is seen largest along.
int axis_across(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle);

/// A point of the triangle seen along the axis, near one of its corners, rounded; nothing if that is not
/// strictly inside.
std::optional<Point2> point_near(const TriangleMesh& mesh, std::uint32_t triangle, std::size_t corner,
                                 int axis);

/// Whether the line through `at` meets a triangle: 1 if this is wound counter-clockwise seen from the axis'
/// far end, -1 if clockwise, else 0. A line through an edge or a corner is taken to be the line a little
/// beside it, the same for all triangles, so that it meets exactly one of two that share an edge; one seen
/// edge-on is never met.
int meets(const TriangleMesh& mesh, std::uint32_t triangle, int axis, const Point2& at);

/// Where the line through `at` meets the plane of triangle u relative to that of triangle t: -1 below, 0 at
/// the same place, 1 above.
int compare_heights(const TriangleMesh& mesh, std::uint32_t u, std::uint32_t t, int axis, const Point2& at);

}  // namespace bsp2::model
