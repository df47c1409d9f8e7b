#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace bsp2::geometry {

/// A closed path of lines and arcs of circles.
struct OutlinePath {
  std::vector<std::array<double, 2>> corners;  ///< rounded; model units
  /// Of the piece from each corner to the next: the tangent of a quarter of the angle by which it turns to
  /// the left; 0: it is straight. Within [-1, 1], half a circle. Empty: all are straight.
  std::vector<double> bulges;
};

/// What circle an arc between two corners is of.
struct OutlineArc {
  std::array<double, 2> centre;
  double radius;
  /// @param bulge as in OutlinePath. @pre not 0.
  OutlineArc(const std::array<double, 2>& from, const std::array<double, 2>& to, double bulge) {
    const double x = to[0] - from[0], y = to[1] - from[1], beside = (1 - bulge * bulge) / (4 * bulge);
    centre = {(from[0] + to[0]) / 2 - beside * y, (from[1] + to[1]) / 2 + beside * x};
    radius = std::hypot(x, y) * (1 + bulge * bulge) / (4 * std::fabs(bulge));
  }
};

/// The boundary of one part of a plane solid: closed paths with the part on their left, outer ones
/// counter-clockwise, holes clockwise. They may touch themselves and each other in points, never cross.
struct PartOutline {
  std::int32_t part = 0;
  std::vector<OutlinePath> paths;
  std::uint32_t arcs = 0;      ///< pieces of circles among them, whole ones included
  std::uint32_t polygons = 0;  ///< pieces in which polygons stand for something curved
};

}  // namespace bsp2::geometry
