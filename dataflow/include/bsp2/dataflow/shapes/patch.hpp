#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace bsp2::dataflow {

/// A piece of a spline or subdivision surface of k parameters in E^D, with the control points that determine
/// it. It lies in their convex hull, and so do the pieces that it is halved into.
///
///   tensor         a Bezier patch over [0, 1]^k: prod (degree + 1) points, those of the last parameter next
///   to each other;
///                  where it is rational, each is w x, w
///   catmull_clark  a quadrangle of a Catmull-Clark surface whose first corner has `valence` edges, not 4,
///   and the corners of
///                  the quadrangles around it: v, e_0, f_0, ... e_(N-1), f_(N-1), then 7 outer ones
///                  (patch.cpp)
///   loop           a triangle of a Loop surface whose first corner has `valence` edges, and the corners of
///   the triangles
///                  around it: v, e_0 ... e_(N-1), then 5 outer ones
/// Source: G. Farin, Curves and Surfaces for CAGD; J. Stam, Exact Evaluation of Catmull-Clark Subdivision
/// Surfaces at Arbitrary Parameter Values (SIGGRAPH 1998), figure 4; C. Loop, Smooth Subdivision Surfaces
/// Based on Triangles (1987).
template <int D>
struct Patch {
  enum class Kind : std::uint8_t { tensor, catmull_clark, loop };
  using Point = std::array<double, D>;

  Kind kind = Kind::tensor;
  bool rational = false;
  std::uint8_t parameters = 2;            ///< k
  std::uint16_t valence = 4;              ///< not of a tensor patch
  std::array<std::uint8_t, D> degrees{};  ///< of a tensor patch, by parameter
  std::vector<double> coordinates;        ///< size() points, stride() numbers each

  [[nodiscard]] std::size_t stride() const { return rational ? D + 1 : D; }
  [[nodiscard]] std::size_t size() const { return coordinates.size() / stride(); }
  /// A control point, where it is in space.
  [[nodiscard]] Point point(std::size_t index) const;
  /// The 2^k patches that it consists of. A tensor or Catmull-Clark patch with bit j set in its number lies
  /// in the upper half of parameter j. Rounded, as coordinates are.
  [[nodiscard]] std::vector<Patch> halves() const;
  /// Points of the surface where patches meet: 2^k, numbered like the halves, or the 3 of a triangle, around
  /// it.
  [[nodiscard]] std::vector<Point> corners() const;
  /// k directions along it, not of unit length, from the control points; some may vanish.
  [[nodiscard]] std::vector<Point> tangents() const;
  /// A bound of the rounding error of a coordinate that one halving adds, of coordinates up to 1 and weights
  /// of `ratio` between the largest and the smallest.
  [[nodiscard]] double halving_error(double ratio) const;
};

/// The bicubic Bezier patch of a uniform B-spline with these 4 x 4 points.
template <int D>
Patch<D> bezier_of_bspline(const std::array<std::array<std::array<double, D>, 4>, 4>& points);

}  // namespace bsp2::dataflow
