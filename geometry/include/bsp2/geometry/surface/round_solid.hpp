#pragma once

#include <array>
#include <cstdint>
#include <variant>

namespace bsp2::geometry {

/// A ball, a piece of a cone or a torus that stands free in a solid, as its formula has it. D = 3.
///
/// Lengths are in model units, rounded to doubles. In its own frame, of `x` and `z`, the ball and the torus
/// lie around the origin, and a cone goes from there along z.
struct RoundSolid {
  struct Ball {
    double radius;
  };
  struct Cone {
    double bottom, top;  ///< radii, >= 0; a cylinder where they are equal
    double height;
  };
  struct Torus {
    double major, minor;  ///< of its circle, and around that: major > minor
  };
  std::variant<Ball, Cone, Torus> shape;
  std::array<double, 3> origin, x, z;  ///< directions are of unit length, and across each other
  std::int32_t part;                   ///< that it belongs to, as in Brep
  std::array<double, 3> lower, upper;  ///< a box that contains it, and nothing else of the solid
};

}  // namespace bsp2::geometry
