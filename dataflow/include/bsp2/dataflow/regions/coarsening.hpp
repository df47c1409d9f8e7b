#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/process/process.hpp"
#include "bsp2/dataflow/regions/partition.hpp"

namespace bsp2::dataflow {

/// A region that is one cell as a whole, not emitted yet: EvaluateOptions::hold_uniform_regions.
struct UniformRegion {
  std::uint32_t region = 0;
  geometry::Label label = geometry::Label::in;
  std::int32_t owner = no_owner;  ///< as an Outcome has it
  std::uint16_t level = 0;
  bool is_certain =
      false;  ///< it will not be given back with its sibling: nothing keeps it from being emitted
};

/// The whole that a region is; nothing if it is divided, or not decided.
template <int D>
std::optional<UniformRegion> uniform_region_of(const Region<D>& region);

/// Gives back, across the cuts between regions, what an evaluation of all as one region would have given
/// back: where both sides of a cut turned out alike, they become one region, and so on up the tree.
///
/// Depends on the regions alone: in whatever order they become known, in one call or in many, the end is the
/// same.
/// @param partition where regions become one, its nodes change: the region that remains has the number of the
/// first one, and the others are no longer reached from the root.
/// @param uniform all there are, on whatever rank, in any order.
/// @param unfinished the other regions of which something is left. What is in neither list is divided for
/// good.
/// @return those that remain, in the order of their numbers.
/// Source: the design of joins, within a region; see docs/dataflow.md, "Giving back".
template <int D>
std::vector<UniformRegion> coarsen(const Network<D>& network, Partition<D>& partition,
                                   std::span<const UniformRegion> uniform,
                                   std::span<const std::uint32_t> unfinished);

}  // namespace bsp2::dataflow
