#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/exact/exact.hpp"

namespace bsp2::geometry {

/// An oriented hyperplane in the frame of one primitive: exact integer coefficients, constant last; the
/// negative side is inside. At most 216 bits a coefficient (114 above D = 3).
template <int D>
struct Covector {
  std::array<LocalInteger, D + 1> exact;
  std::array<long double, D + 1> rounded;  ///< each coefficient with a relative error below 2^-63
  /// Numbers of points that it passes through exactly, as a mesh's facets do through their corners; 0: none.
  /// Covectors of one frame with a number in common have that point in common.
  std::array<std::uint32_t, 3> points{};
};

template <int D>
Covector<D> make_covector(const std::array<LocalInteger, D + 1>& exact);

/// A primitive in its own frame, exactly: the half-spaces of a convex polytope and its bounding box.
template <int D>
struct Polytope {
  std::vector<Covector<D>> covectors;
  std::array<double, D> lower{}, upper{};  ///< contain the polytope (rounded outward)
};

/// [0, 1]^D.
template <int D>
Polytope<D> unit_box();

/// A stack of regular polygons, as model::Lathe has it, scaled so that the largest radius and the span of z
/// are 1.
///
/// Corner directions are cosines and sines rounded to multiples of 2^-53, radii likewise; the corners of ring
/// i are *exactly* radius_i times the direction. So the four corners of each side lie exactly in one plane,
/// and all planes around a corner meet in one point: no sliver appears there, under any affine map.
/// @param radius, z one per ring: radii in [0, 1], z ascending from 0 to 1.
Polytope<3> lathe(std::uint32_t sides, std::span<const double> radius, std::span<const double> z);

/// The plane through the axis of a lathe and its corners number `corner` of `sides`, positive where angles
/// grow; and the plane across its axis at height z, positive above. In the frame of `lathe`.
Covector<3> axial_covector(std::uint32_t corner, std::uint32_t sides);
Covector<3> level_covector(double z);

/// The regular polygon of radius 1, with the corners of `lathe`.
Polytope<2> regular_polygon(std::uint32_t sides);

/// The convex polygon through points p 2^-53, |p| <= 2^53, counter-clockwise; D = 3: its prism over z in [0,
/// 1]. Repeated points are passed over.
template <int D>
Polytope<D> convex_polygon(std::span<const std::array<std::int64_t, 2>> points);

/// The plane through three points with coordinates p 2^-53, |p| <= 2^53, negative towards the inside of a
/// triangle that is counter-clockwise seen from outside. All zero where the points are collinear.
Covector<3> triangle_covector(const std::array<std::array<std::int64_t, 3>, 3>& points);

/// cos and sin of 360 * index / count degrees as multiples of 2^-53; exact at multiples of 30 and 45 degrees
/// where the values are rational, and symmetric in all octants.
std::array<std::int64_t, 2> corner_direction(std::uint32_t index, std::uint32_t count);

}  // namespace bsp2::geometry
