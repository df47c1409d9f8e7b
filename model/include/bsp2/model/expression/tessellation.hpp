#pragma once

#include <cstdint>

/// How round things become polyhedra, exactly as OpenSCAD does it.
namespace bsp2::model {

/// OpenSCAD's special variables and their defaults.
struct Resolution {
  double fn = 0;   ///< `$fn`: number of sides, 0 = from the other two
  double fa = 12;  ///< `$fa`: smallest angle of a side in degrees
  double fs = 2;   ///< `$fs`: smallest length of a side
  friend bool operator==(const Resolution&, const Resolution&) = default;
};

/// Limits on one primitive, far above what a model needs; more is taken for a slip of the pen.
inline constexpr std::uint32_t max_sides = 200'000;
inline constexpr std::uint64_t max_sphere_facets = 10'000'000;

/// The number of sides of a circle of this radius, >= 3. A double, since `$fn` may be anything: it may exceed
/// max_sides.
double side_count(double radius, const Resolution& resolution);

/// The number of rings of a sphere with `sides` corners a ring.
constexpr std::uint32_t ring_count(std::uint32_t sides) { return (sides + 1) / 2; }

/// Sine and cosine of an angle in degrees, exact at the multiples of 30 and symmetric about the multiples
/// of 90.
double sine(double degrees);
double cosine(double degrees);

}  // namespace bsp2::model
