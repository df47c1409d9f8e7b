#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/dataflow/evaluate.hpp"
#include "bsp2/dataflow/network.hpp"

namespace bsp2::dataflow {

/// A binary space partition of the root cell into regions of about equal estimated work.
///
/// A child >= 0 of a node is a node, a child < 0 is the region ~child.
template <int D>
struct Partition {
  struct Node {
    geometry::HyperplaneId hyperplane;
    std::int32_t negative, positive;
  };
  std::int32_t root = ~0;
  std::vector<Node> nodes;
  std::vector<Region<D>> regions;
};

/// Cuts the root cell `depth` times in two by axis-parallel hyperplanes, each at the weighted median of the undecided
/// operands, their weight being their number of half-spaces or facets. A region in which nothing is undecided is not cut
/// further: there are at most 2^depth regions.
/// The result depends on the network and the depth alone.
template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth);

/// The cell of a region, for one that has come from elsewhere without it. Uses the nodes of the partition alone.
/// @throws std::out_of_range if the partition has no such region.
template <int D>
geometry::Cell<D> region_cell(const Network<D>& network, const Partition<D>& partition, std::uint32_t number);

}  // namespace bsp2::dataflow
