#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/simplices/orientation.hpp"

namespace bsp2::meshing {

inline Point operator-(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline double squared_distance(const Point& a, const Point& b) {
  const Point d = a - b;
  return dot(d, d);
}

/// Normals of the faces opposite of each corner, outward if the tetrahedron is right side out, as long as the
/// faces' areas are twice.
inline std::array<Point, 4> normals_of(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  return {cross(bc, bd), cross(ad, ac), cross(ab, ad), cross(ac, ab)};
}

/// A shape that rounding makes of flat ones.
inline constexpr double hardly_turned = -1e-7;

/// The smallest sine of the six dihedral angles: small for those near 0 and near 180 degrees; with the sign
/// of the volume. Flat by rounding counts as 0 or less: the sign is decided exactly where it is in doubt.
inline double shape_of(const Point& a, const Point& b, const Point& c, const Point& d) {
  const std::array<Point, 4> n = normals_of(a, b, c, d);
  const double six_volumes = -dot(n[3], d - a);
  std::array<double, 4> length;
  for (int i = 0; i < 4; ++i) length[i] = std::sqrt(dot(n[i], n[i]));
  // sin = 3/2 V l / (A A'), over the edge in which two faces meet.
  const std::array<const Point*, 4> p{&a, &b, &c, &d};
  double least = 1;
  for (int i = 0; i < 4; ++i)
    for (int k = i + 1; k < 4; ++k) {
      int e = 0;
      while (e == i || e == k) ++e;
      const int f = 6 - i - k - e;
      const double areas = length[i] * length[k];
      const double sine =
          areas > 0 ? std::fabs(six_volumes) * std::sqrt(squared_distance(*p[e], *p[f])) / areas : 0;
      least = std::min(least, sine);
    }
  const double edges = squared_distance(a, b) * squared_distance(a, c) * squared_distance(a, d);
  if (least > 1e-6 && six_volumes * six_volumes > 1e-26 * edges) return six_volumes > 0 ? least : -least;
  const int sign = orientation(a, b, c, d);
  return sign > 0 ? std::max(least, 1e-300) : sign == 0 ? 0 : -std::max(least, 1e-300);
}

}  // namespace bsp2::meshing
