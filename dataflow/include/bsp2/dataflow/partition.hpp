#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
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

/// Where an evaluation leaves cells undecided, as its options say: no cut is made there. And how much is looked at.
struct PartitionLimits {
  unsigned level = std::numeric_limits<std::uint16_t>::max();
  double tolerance = 0;
  std::vector<double> eye;
  double angle = 0;
  /// Of all localized programs. Operands that go through the whole model stay in most pieces: then there are fewer regions.
  std::size_t words = std::size_t{1} << 25;
};

/// k for 2^k regions: grows with the half-spaces and facets of the model, and depends on nothing else.
template <int D>
unsigned suggested_depth(const Network<D>& network);

/// Parts the root cell into at most 2^depth regions, always the one with the most estimated work, by the hyperplane that its
/// evaluation would choose for it: so the regions are tokens of the evaluation of the whole, and their cuts add no cells. What
/// turns out to be whole on both sides of a cut is still to be given back, see giving_back.hpp. A region in which nothing is
/// undecided is not cut further.
/// The result depends on the network, the depth and the limits alone.
/// @param threads look at what the cuts will ask for.
template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits = {}, unsigned threads = 1);

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
