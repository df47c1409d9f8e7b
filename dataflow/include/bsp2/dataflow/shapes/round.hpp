#pragma once

#include "bsp2/dataflow/shapes/round_solid.hpp"
#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// A placed round solid (model::Round). In its own frame the largest radius is 1 and the box is [0, 1] along
/// each axis that is not round. RoundSolid, and what RoundProducer asks.
template <int D>
struct Round {
  using Primitive = model::Round;
  using Process = RoundProducer<D, Round>;
  using Family = geometry::RoundFamily<D>;
  using Wedge = typename Family::Wedge;
  static constexpr bool exists_in(int) { return true; }
  static constexpr bool is_convex = true;
  static RoundFrame<D> frame(const model::Round& round);
  static Round place(const model::Round& round, geometry::HyperplaneTable<D>& table, std::uint32_t map,
                     std::uint32_t limit);

  Family family;
  geometry::HyperplaneId first;  ///< id of the family's hyperplane number 0
  typename geometry::AffineMap<D>::Inverse to_frame;

  [[nodiscard]] std::uint32_t levels() const { return family.levels(); }
  [[nodiscard]] int places() const { return family.axes() - 1; }
  [[nodiscard]] geometry::OrientedHyperplane tangent(const Wedge& wedge) const {
    return plane(family.tangent(wedge));
  }
  [[nodiscard]] geometry::OrientedHyperplane chord(const Wedge& wedge) const {
    return plane(family.chord(wedge));
  }
  [[nodiscard]] geometry::OrientedHyperplane halving(const Wedge& wedge, int place) const {
    return plane(family.halving(wedge, place));
  }
  [[nodiscard]] geometry::OrientedHyperplane bound(const Wedge& wedge, int place, int side) const {
    return plane(family.bound(wedge, place, side));
  }
  /// The pyramid of directions in which a point of the frame is.
  [[nodiscard]] Wedge first_wedge(const std::array<double, D>& y) const;
  [[nodiscard]] geometry::Label ask_vertices(const Wedge* wedge, const geometry::Cell<D>& cell,
                                             const std::array<double, D>& centre) const;
  [[nodiscard]] geometry::OrientedHyperplane outer(std::uint32_t face) const {
    return tangent({.face = face});
  }
  [[nodiscard]] std::uint32_t outer_count() const { return static_cast<std::uint32_t>(2 * family.axes()); }
  /// None of a cone: its tangents are inclined.
  [[nodiscard]] std::vector<geometry::OrientedHyperplane> axis_tangents() const;

 private:
  /// The hyperplane of this number, inside negative where it has an inside.
  [[nodiscard]] geometry::OrientedHyperplane plane(std::uint32_t number) const {
    return geometry::oriented(first + number);
  }
  [[nodiscard]] geometry::OrientedHyperplane plane(const typename Family::Radial& radial) const {
    return geometry::oriented(first + radial.number, radial.flipped);
  }
  [[nodiscard]] double radius_at(const std::array<double, D>& y) const;
};

}  // namespace bsp2::dataflow
