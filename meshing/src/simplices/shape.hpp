#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "bsp2/geometry/support/vectors.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/simplices/orientation.hpp"

namespace bsp2::meshing {

inline Point operator-(const Point& a, const Point& b) { return geometry::minus(a, b); }
using geometry::cross;
using geometry::dot;
inline double squared_distance(const Point& a, const Point& b) {
  const Point d = a - b;
  return dot(d, d);
}

/// Above 0 where it is right side out.
inline double volume_of(const Point& a, const Point& b, const Point& c, const Point& d) {
  return dot(cross(b - a, c - a), d - a) / 6;
}

/// Normals of the faces opposite of each corner, outward if the tetrahedron is right side out, as long as the
/// faces' areas are twice.
[[gnu::always_inline]] inline std::array<Point, 4> normals_of(const Point& a, const Point& b, const Point& c,
                                                              const Point& d) {
  const Point ab = b - a, ac = c - a, ad = d - a, bc = c - b, bd = d - b;
  return {cross(bc, bd), cross(ad, ac), cross(ab, ad), cross(ac, ab)};
}

/// The angle between two faces of a tetrahedron, in degrees.
struct DihedralAngle {
  std::array<std::uint8_t, 2> edge, beside;  ///< corners that both have, and the other two
  double degrees;
};

inline std::array<DihedralAngle, 6> dihedral_angles(const std::array<Point, 4>& normals) {
  std::array<DihedralAngle, 6> angles{{{{2, 3}, {0, 1}, 0},
                                       {{1, 3}, {0, 2}, 0},
                                       {{1, 2}, {0, 3}, 0},
                                       {{0, 3}, {1, 2}, 0},
                                       {{0, 2}, {1, 3}, 0},
                                       {{0, 1}, {2, 3}, 0}}};
  for (DihedralAngle& angle : angles) {
    const Point &a = normals[angle.beside[0]], &b = normals[angle.beside[1]];
    const Point sine = cross(a, b);
    angle.degrees = std::atan2(std::sqrt(dot(sine, sine)), -dot(a, b)) * 180 / std::numbers::pi;
  }
  return angles;
}

/// A shape that rounding makes of flat ones.
inline constexpr double hardly_turned = -1e-7;

/// The square of how much volume a tetrahedron has for its edges: 1 for a regular one, little for one that is
/// flat or long. @param six_volumes of it. @param lengths the sum of the squared lengths of its edges.
inline double squared_fullness(double six_volumes, double lengths) {
  return 432 * six_volumes * six_volumes / (lengths * lengths * lengths);
}

/// The smallest sine of the six dihedral angles, small for those near 0 and near 180 degrees, or the
/// fullness, if that is less: long ones have good angles; with the sign of the volume. Flat by rounding
/// counts as 0 or less: the sign is decided exactly where it is in doubt.
inline double shape_of(const Point& a, const Point& b, const Point& c, const Point& d) {
  const std::array<Point, 4> n = normals_of(a, b, c, d);
  const double six_volumes = -dot(n[3], d - a);
  const double ab = squared_distance(a, b), ac = squared_distance(a, c), ad = squared_distance(a, d),
               bc = squared_distance(b, c), bd = squared_distance(b, d), cd = squared_distance(c, d);
  std::array<double, 4> area;  // squares of twice the areas
  for (std::size_t i = 0; i < 4; ++i) area[i] = dot(n[i], n[i]);
  const double square = six_volumes * six_volumes;
  // sin = 3/2 V l / (A A'), over the edge in which two faces meet; here over one denominator.
  const double most = std::min({ab * area[0] * area[1], ac * area[0] * area[2], ad * area[0] * area[3],
                                bc * area[1] * area[2], bd * area[1] * area[3], cd * area[2] * area[3]}) *
                      square;
  const double denominator = area[0] * area[1] * area[2] * area[3];
  // Below the normal range, or an area is nothing.
  const bool is_degenerate = !(most > 1e-290) || !(denominator < 1e290);
  const double least =
      is_degenerate ? 0
                    : std::sqrt(std::min({1.0, most / denominator,
                                          squared_fullness(six_volumes, ab + ac + ad + bc + bd + cd)}));
  if (least > 1e-6 && square > 1e-26 * (ab * ac * ad)) return six_volumes > 0 ? least : -least;
  const int sign = orientation(a, b, c, d);
  return sign > 0 ? std::max(least, 1e-300) : sign == 0 ? 0 : -std::max(least, 1e-300);
}

}  // namespace bsp2::meshing
