#pragma once

#include <cstdint>
#include <span>
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
  std::vector<double> work;  ///< estimate for each region, in no unit: only ratios mean something
  std::vector<Region<D>> regions;
};

/// k for 2^k regions: grows with the half-spaces and facets of the model, and depends on nothing else.
template <int D>
unsigned suggested_depth(const Network<D>& network);

/// Cuts the root cell `depth` times in two by axis-parallel hyperplanes, each near the weighted median of the undecided
/// operands, their weight being their number of half-spaces or facets; by a hyperplane of an operand's own if there is one.
/// A region in which nothing is undecided is not cut further: there are at most 2^depth regions.
/// The result depends on the network and the depth alone.
template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth);

/// Regions of a partition that was made elsewhere, from its nodes alone, in the order of their numbers. Costs no more than a
/// walk down the tree to them.
/// @param numbers which ones, in ascending order.
/// @throws std::out_of_range if the partition does not have all of them.
template <int D>
std::vector<Region<D>> make_regions(const Network<D>& network, const Partition<D>& partition, std::span<const std::uint32_t> numbers);

/// The cell of a region, for one that has come from elsewhere without it. Uses the nodes of the partition alone.
/// @throws std::out_of_range if the partition has no such region.
template <int D>
geometry::Cell<D> region_cell(const Network<D>& network, const Partition<D>& partition, std::uint32_t number);

}  // namespace bsp2::dataflow
