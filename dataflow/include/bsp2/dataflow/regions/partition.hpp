#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/network/network.hpp"

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

/// Where an evaluation leaves cells undecided, as its options say: no cut is made there. And how much is
/// looked at.
struct PartitionLimits {
  unsigned level = std::numeric_limits<std::uint16_t>::max();
  double tolerance = 0;
  std::shared_ptr<const meshing::SizeField> tolerance_shares;
  std::vector<double> eye;
  double angle = 0;
  /// The work on a region is estimated so many cuts below it, which are looked at for that alone; 0: by what
  /// is undecided in itself. The regions are the same.
  unsigned sampled_levels = 3;
  /// Of all localized programs, each piece by the regions that it is to have. Operands that go through the
  /// whole model stay in most pieces: then there are fewer regions.
  std::size_t words = std::size_t{1} << 25;
};

/// k for 2^k regions: grows with the half-spaces and facets of the model, and depends on nothing else.
template <int D>
unsigned suggested_depth(const Network<D>& network);

/// Parts the root cell into at most 2^depth regions in which about as much is undecided, by the hyperplanes
/// that its evaluation would choose: so the regions are tokens of the evaluation of the whole, and their cuts
/// add no cells. What turns out to be whole on both sides of a cut is still to be given back, see
/// coarsening.hpp. A region in which nothing is undecided is not cut further. The result depends on the
/// network, the depth and the limits alone.
/// @param threads look at what is cut.
template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits = {},
                       unsigned threads = 1);

/// Who of several makes a partition together with others: the `index`-th of `count`.
struct PartitionShare {
  unsigned index = 0, count = 1;
};

/// A node of a part of a partition, as it travels: in prefix order, a split before its negative and its
/// positive side.
struct PartitionNode {
  enum class Kind : std::uint32_t {
    split,
    region,
    elsewhere  ///< a subtree that is another one's
  };
  Kind kind = Kind::elsewhere;
  geometry::HyperplaneId hyperplane = 0;  ///< of a split
  double work = 0;                        ///< of a region
  friend bool operator==(const PartitionNode&, const PartitionNode&) = default;
};

/// What one of several has made of a partition.
template <int D>
struct PartitionPart {
  std::vector<PartitionNode> nodes;
  std::vector<Region<D>> regions;  ///< numbered within the part
};

/// One's part of what `partition` makes. Nothing is said to the others, and what they make is looked at no
/// more than the way to one's own part asks for.
template <int D>
PartitionPart<D> part_of_partition(const Network<D>& network, unsigned depth, PartitionShare share,
                                   const PartitionLimits& limits = {}, unsigned threads = 1);

template <int D>
struct JoinedPartition {
  Partition<D> partition;  ///< without regions
  std::vector<std::uint32_t>
      share_of_region;  ///< who has made each; its number within the part is how many of that one came before
};

/// The whole, of all parts in the order of their shares.
/// @throws std::invalid_argument if they do not fit together.
template <int D>
JoinedPartition<D> join_parts(std::span<const std::vector<PartitionNode>> parts);

/// Gives regions that have come from elsewhere their cells, by splitting along the nodes of the partition:
/// one walk to all of them.
/// @throws std::out_of_range if no way leads to a region, std::invalid_argument if one is given twice.
template <int D>
void make_cells(const Network<D>& network, const Partition<D>& partition, std::span<Region<D>> regions);

/// Adds regions that have come from elsewhere without their cells to those of the partition, in the order of
/// their numbers.
/// @throws as `make_cells`.
template <int D>
void add_regions(const Network<D>& network, Partition<D>& partition, std::vector<Region<D>> regions);

/// The cell of one region.
template <int D>
geometry::Cell<D> region_cell(const Network<D>& network, const Partition<D>& partition,
                              std::uint32_t number) {
  Region<D> region{.number = number};
  make_cells<D>(network, partition, std::span(&region, 1));
  return std::move(region.cell);
}

}  // namespace bsp2::dataflow
