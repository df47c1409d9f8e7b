#pragma once

#include <memory>
#include <utility>

#include "bsp2/dataflow/shapes/round_solid.hpp"
#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/families/computed_family.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// The hyperplanes that enclose a paraboloid level by level, each under a number, computed when asked for.
///
/// The paraboloid, in its frame: |x|^2 <= z, z <= 1, where x has all coordinates but the last one, z. The
/// cube
/// [-1, 1]^(D-1) around x is divided into a grid of 2^level boxes along each axis, the wedges. For the points
/// of a box with the middle c and the half side s,
///   2 c.x - |c|^2 <= |x|^2 <= 2 c.x - |c|^2 + (D - 1) s^2
/// the first everywhere (the *tangent* over c), the second in the box, with equality in its corners (the
/// *chord*). So both are parallel, and their coefficients are integers: nothing is rounded. *Bounds* are
/// x_i = t / 2^levels.
template <int D>
class ParaboloidFamily final : public geometry::ComputedFamily<D> {
 public:
  using Wedge = typename geometry::RoundFamily<D>::Wedge;  ///< of which there is one face
  /// @param limit there are at most so many hyperplanes, if the coarsest do with them.
  explicit ParaboloidFamily(std::uint64_t limit);

  [[nodiscard]] std::uint32_t levels() const { return levels_; }
  [[nodiscard]] std::uint32_t tangent(const Wedge& wedge) const;
  [[nodiscard]] std::uint32_t chord(const Wedge& wedge) const { return tangent(wedge) + 1; }
  /// Where the middle of the wedge is along an axis, or a bound of it (side -1 or 1); positive above.
  [[nodiscard]] std::uint32_t across(const Wedge& wedge, int axis, int side) const;

  [[nodiscard]] std::uint32_t count() const override { return first_of_level_[levels_ + 1]; }
  [[nodiscard]] std::array<std::int64_t, D + 1> covector(std::uint32_t number) const override;

 private:
  static constexpr int axes = D - 1;
  static constexpr std::uint32_t most_levels = 20;
  std::uint32_t levels_ = 0;
  std::array<std::uint32_t, most_levels + 2> first_of_level_{};  // the bounds come first

  [[nodiscard]] static std::uint64_t bounds_with(std::uint32_t levels) {
    return static_cast<std::uint64_t>(axes) * ((2ULL << levels) + 1);
  }
  [[nodiscard]] static std::uint64_t wedges_at(std::uint32_t level) {
    return 1ULL << (level * static_cast<std::uint32_t>(axes));
  }
};

/// A placed paraboloid (model::Paraboloid). A round solid, and what RoundProducer asks.
template <int D>
struct Paraboloid {
  using Primitive = model::Paraboloid;
  using Process = RoundProducer<D, Paraboloid>;
  using Family = ParaboloidFamily<D>;
  using Wedge = typename Family::Wedge;
  static constexpr bool exists_in(int dimension) { return dimension >= 2; }
  static constexpr bool is_convex = true;
  static RoundFrame<D> frame(const model::Paraboloid& paraboloid);
  static Paraboloid place(const model::Paraboloid& paraboloid, geometry::HyperplaneTable<D>& table,
                          std::uint32_t map, std::uint32_t limit);
  static std::vector<std::pair<double, double>> profile(const model::Paraboloid& paraboloid,
                                                        std::uint32_t corners);

  std::shared_ptr<const Family> family;  // shared: with the hyperplane table
  geometry::HyperplaneId first;          ///< id of the family's hyperplane number 0
  typename geometry::AffineMap<D>::Inverse to_frame;

  [[nodiscard]] std::uint32_t levels() const { return family->levels(); }
  [[nodiscard]] static int places() { return D - 1; }
  [[nodiscard]] geometry::OrientedHyperplane tangent(const Wedge& wedge) const {
    return geometry::oriented(first + family->tangent(wedge));
  }
  [[nodiscard]] geometry::OrientedHyperplane chord(const Wedge& wedge) const {
    return geometry::oriented(first + family->chord(wedge));
  }
  [[nodiscard]] geometry::OrientedHyperplane halving(const Wedge& wedge, int place) const {
    return geometry::oriented(first + family->across(wedge, place, 0));
  }
  [[nodiscard]] geometry::OrientedHyperplane bound(const Wedge& wedge, int place, int side) const {
    return geometry::oriented(first + family->across(wedge, place, side));
  }
  [[nodiscard]] static Wedge first_wedge(const std::array<double, D>&) { return {}; }
  [[nodiscard]] geometry::Label ask_vertices(const Wedge* wedge, const geometry::Cell<D>& cell,
                                             const std::array<double, D>& centre) const;
  /// z = 0, and the sides of the cube around x.
  [[nodiscard]] geometry::OrientedHyperplane outer(std::uint32_t i) const;
  [[nodiscard]] static std::uint32_t outer_count() { return 2 * D - 1; }
  [[nodiscard]] std::vector<geometry::OrientedHyperplane> axis_tangents() const;
};

}  // namespace bsp2::dataflow
