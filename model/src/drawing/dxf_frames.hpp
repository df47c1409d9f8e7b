#pragma once

#include <array>

#include "drawing/dxf_file.hpp"

/// The coordinates that entities of a DXF file stand in.
namespace bsp2::model::dxf {

using Vector = std::array<double, 3>;

/// An affine map of space: three rows of a linear part, and where 0 goes.
class Map {
 public:
  /// Leaves everything where it is.
  Map() = default;
  static Map of(const Vector& x, const Vector& y, const Vector& z);  ///< where the unit vectors go
  /// Turns about the z axis by an angle with this cosine and sine, and then moves 0 to a point.
  static Map turned(double c, double s, const Vector& to);
  /// Moves a point to 0, and then multiplies by these factors.
  static Map scaled(const Vector& factors, const Vector& about);

  [[nodiscard]] Vector operator()(double x, double y, double z) const;
  /// First `m`, then this one.
  [[nodiscard]] Map after(const Map& m) const;
  /// How much longer a length in the plane of x and y becomes, at most, seen along the z axis.
  [[nodiscard]] double stretch() const;

 private:
  std::array<Vector, 3> rows_{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  Vector to_{};
};

/// The direction that the plane of an entity looks in (codes 210, 220, 230), of length 1; along the z axis if
/// it has none.
Vector normal_of(const Entity& e);

/// From the plane of an entity, with axes that the file leaves to Autodesk's "arbitrary axis algorithm", to
/// the drawing. A normal of 0, 0, -1 mirrors x.
Map plane_of(const Entity& e);

/// The cross product.
Vector across(const Vector& a, const Vector& b);

}  // namespace bsp2::model::dxf
