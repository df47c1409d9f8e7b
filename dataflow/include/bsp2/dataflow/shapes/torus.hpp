#pragma once

#include <algorithm>

#include "bsp2/dataflow/shapes/round_solid.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/geometry/families/torus_family.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

class TorusProducer;

/// A placed torus (model::Torus). In its own frame the radius of its circle is 1. D = 3. A round solid.
struct Torus {
  using Primitive = model::Torus;
  using Process = TorusProducer;
  static constexpr bool exists_in(int dimension) { return dimension == 3; }
  static constexpr bool is_convex = false;
  static RoundFrame<3> frame(const model::Torus& torus);
  static Torus place(const model::Torus& torus, geometry::HyperplaneTable<3>& table, std::uint32_t map,
                     std::uint32_t limit);

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
  [[nodiscard]] static std::vector<geometry::OrientedHyperplane> axis_tangents() { return {}; }
};

}  // namespace bsp2::dataflow
