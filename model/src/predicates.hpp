#pragma once

#include <array>

/// Exact answers about points whose coordinates are doubles, for the repair of meshes.
namespace bsp2::model {

using Point3 = std::array<double, 3>;

struct Point2 {
  double u, v;
};

/// Sign of the area of the triangle a b c: 1 = counter-clockwise, 0 = on a line. Exact.
int orientation(const Point2& a, const Point2& b, const Point2& c);

/// Whether the three points lie on one line (or coincide). Exact.
bool collinear(const Point3& a, const Point3& b, const Point3& c);

/// Whether v lies on the segment a b, the ends excluded. Exact.
bool inside_segment(const Point3& a, const Point3& b, const Point3& v);

}  // namespace bsp2::model
