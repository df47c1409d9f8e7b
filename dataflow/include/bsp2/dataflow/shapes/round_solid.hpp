#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "bsp2/dataflow/process/box.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

/// A truly round primitive as the network has it, placed. One struct a kind says all that others ask of it,
/// and they ask at compile time:
/// - `Primitive`: what it is in the model;
/// - `exists_in(D)`: whether there are any of this dimension;
/// - `is_convex`: whether it is its own hull;
/// - `Process`: the producer that answers for it: RoundProducer, which asks for more, or one of its own;
/// - `frame(primitive)`: its normalized frame, and its bounds and flat faces there;
/// - `place(primitive, table, map, limit)`: placed by a map, with at most `limit` hyperplanes of the table;
/// - `axis_tangents()`: tangents that may bound it along an axis;
/// - `profile(primitive, corners)`: radius and height of circles where constructs take corners;
///   they are as near to each other as so many corners of a circle are. Of what is model::TellsOfItself.
///
/// The list of all kinds is round_solids.hpp.
namespace bsp2::dataflow {

/// A primitive in a frame in which lengths are of the order of 1.
template <int D>
struct RoundFrame {
  std::array<double, D> factors;  ///< from the frame to the primitive's own
  Box<D> bounds;                  ///< in the frame, but of what is a ball times a box
  std::optional<int> ball_axes;   ///< of what is a unit ball of so many axes times [0, 1] in the others
  std::vector<geometry::Covector<D>> half_spaces;  ///< its flat faces
};

template <int D, typename Solid>
class RoundProducer;

/// @throws bsp2::Error if a round solid needs more hyperplanes than are left for it.
void check_hyperplanes(std::uint64_t needed, std::uint32_t limit);

/// @throws bsp2::Error as `check_hyperplanes`.
template <int D, typename Family>
geometry::HyperplaneId add_family(geometry::HyperplaneTable<D>& table, std::uint32_t map,
                                  const Family& family, std::uint32_t limit) {
  check_hyperplanes(family.count(), limit);
  return table.add_family(map, family);
}

}  // namespace bsp2::dataflow
