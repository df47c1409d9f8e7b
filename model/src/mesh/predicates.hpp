#pragma once

#include <array>
#include <optional>

#include "bsp2/geometry/support/vectors.hpp"

/// Exact answers about points whose coordinates are doubles, for the repair of meshes.
namespace bsp2::model {

using Point3 = std::array<double, 3>;

using geometry::cross;
using geometry::dot;
using geometry::minus;

struct Point2 {
  double u, v;
};

/// Sign of the area of the triangle a b c: 1 = counter-clockwise, 0 = on a line. Exact.
int orientation(const Point2& a, const Point2& b, const Point2& c);

/// Sign of the volume of the tetrahedron a b c d: 1 if a b c is counter-clockwise seen from d. Exact.
int orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d);

/// Sign of the volume of the tetrahedron a b c d where doubles tell it for sure.
std::optional<int> quick_orientation(const Point3& a, const Point3& b, const Point3& c, const Point3& d);

/// Whether the three points lie on one line (or coincide). Exact.
bool collinear(const Point3& a, const Point3& b, const Point3& c);

/// Whether v lies on the segment a b, the ends excluded. Exact.
bool inside_segment(const Point3& a, const Point3& b, const Point3& v);

}  // namespace bsp2::model
