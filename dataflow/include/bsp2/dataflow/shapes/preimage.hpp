#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <utility>
#include <variant>
#include <vector>

#include "bsp2/dataflow/shapes/patch_tree.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/families/computed_family.hpp"
#include "bsp2/geometry/families/round_family.hpp"
#include "bsp2/geometry/families/torus_family.hpp"
#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

/// The solids that model::Preimage takes its points to, each in a frame of its own, with the hyperplanes that
/// enclose it there.
namespace preimage {

constexpr std::size_t most_axes = geometry::built_dimensions;
/// A point of such a frame, or a covector, its constant last.
using Vector = std::array<double, most_axes>;
using Covector = std::array<long double, most_axes + 1>;

/// |(y_1 .. y_K)| <= the radius of the family, which has K axes: a ball, or a cylinder or cone without its
/// ends.
struct RoundSolid {
  geometry::RoundFamily<geometry::built_dimensions> family;
  [[nodiscard]] std::size_t axes() const;
};
struct TorusSolid {
  geometry::RoundFamily<3> fan;  ///< of two axes
  geometry::TorusFamily family;  ///< its planes are numbered after those of the fan
  [[nodiscard]] static std::size_t axes() { return 3; }
  [[nodiscard]] std::uint32_t levels() const { return std::min(fan.levels(), family.levels()); }
};
template <int F>
struct PatchSolid {
  std::shared_ptr<const PatchTree<F>> tree;  // shared: its producer has it, and the family
  [[nodiscard]] static std::size_t axes() { return F; }
};
using Solid = std::variant<RoundSolid, TorusSolid, PatchSolid<2>, PatchSolid<3>>;

/// Hyperplane of this number in the frame. Those that enclose the solid stand back from it by `margin`, more
/// than what rounding makes of a point on them: what is cut off by one is seen to be outside, what is before
/// a chord inside.
constexpr long double margin = 0x1p-38L;
Covector covector(const Solid& solid, std::uint32_t number);
std::uint32_t count(const Solid& solid);

}  // namespace preimage

/// Hyperplanes of a solid of another space, as far as they are in this one. They are rounded, and so serve as
/// cuts alone: no decision depends on where they are exactly.
template <int D>
class PreimagePlanes final : public geometry::ComputedFamily<D> {
 public:
  using Row = std::array<long double, D + 1>;
  /// @param rows of the map from the family's frame to that of the solid, constants last.
  PreimagePlanes(preimage::Solid solid, std::vector<Row> rows)
      : solid_(std::move(solid)), rows_(std::move(rows)) {}
  [[nodiscard]] const preimage::Solid& solid() const { return solid_; }
  [[nodiscard]] std::uint32_t count() const override { return preimage::count(solid_); }
  [[nodiscard]] std::array<std::int64_t, D + 1> covector(std::uint32_t number) const override;

 private:
  preimage::Solid solid_;
  std::vector<Row> rows_;
};

/// A placed model::Preimage.
template <int D>
struct Preimage {
  std::shared_ptr<const PreimagePlanes<D>> planes;  // shared: the hyperplane table has them too
  geometry::HyperplaneId first;                     ///< id of hyperplane number 0
  typename geometry::AffineMap<D>::Inverse to_primitive;
  std::vector<std::array<double, D + 1>>
      rows;                        ///< from the primitive's space to the frame of the solid, constants last
  std::array<double, D> weight{};  ///< how far a step along an axis of the model goes in the frame, at most

  [[nodiscard]] geometry::OrientedHyperplane plane(std::uint32_t number) const {
    return geometry::oriented(first + number);
  }
};

}  // namespace bsp2::dataflow
