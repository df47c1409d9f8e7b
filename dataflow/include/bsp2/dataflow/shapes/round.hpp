#pragma once

#include <algorithm>

#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/geometry/families/torus_family.hpp"

namespace bsp2::dataflow {

/// A placed round solid (model::Round). In its own frame the largest radius is 1 and the box is [0, 1] along
/// each axis that is not round.
template <int D>
struct Round {
  geometry::RoundFamily<D> family;
  geometry::HyperplaneId first;  ///< id of the family's hyperplane number 0
  typename geometry::AffineMap<D>::Inverse to_frame;

  /// The hyperplane of this number, inside negative where it has an inside.
  [[nodiscard]] geometry::OrientedHyperplane plane(std::uint32_t number) const {
    return geometry::oriented(first + number);
  }
  [[nodiscard]] geometry::OrientedHyperplane plane(
      const typename geometry::RoundFamily<D>::Radial& radial) const {
    return geometry::oriented(first + radial.number, radial.flipped);
  }
};

/// A placed torus (model::Torus). In its own frame the radius of its circle is 1. D = 3.
struct Torus {
  geometry::RoundFamily<3> fan;  ///< of two axes: its radial planes part the wedges
  geometry::HyperplaneId first_of_fan;
  geometry::TorusFamily family;
  geometry::HyperplaneId first;
  geometry::AffineMap<3>::Inverse to_frame;

  [[nodiscard]] std::uint32_t levels() const { return std::min(fan.levels(), family.levels()); }
  [[nodiscard]] geometry::OrientedHyperplane plane(std::uint32_t number) const {
    return geometry::oriented(first + number);
  }
  [[nodiscard]] geometry::OrientedHyperplane radial(const geometry::RoundFamily<3>::Radial& radial) const {
    return geometry::oriented(first_of_fan + radial.number, radial.flipped);
  }
};

}  // namespace bsp2::dataflow
