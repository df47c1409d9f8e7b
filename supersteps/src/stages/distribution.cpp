#include <algorithm>
#include <bit>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace {

/// k for 2^k regions.
template <int D>
unsigned depth_of(const dataflow::Network<D>& network, const RunOptions& options) {
  if (options.regions)
    return static_cast<unsigned>(std::bit_width(std::bit_ceil(std::max(1U, *options.regions))) - 1);
  const unsigned depth = dataflow::suggested_depth(network);
  if (!options.most_regions) return depth;
  return std::min(depth, static_cast<unsigned>(std::bit_width(std::max(1U, *options.most_regions)) - 1));
}

/// What the computation leaves undecided the partition does not cut either. To look below regions pays where
/// many ranks share them, or may take up a snapshot: up to sixteen were as evenly loaded without (measured
/// with 128 regions).
dataflow::PartitionLimits limits_of_cuts(const RunOptions& options, unsigned ranks) {
  constexpr unsigned few_ranks = 16;
  dataflow::PartitionLimits limits;
  if (ranks <= few_ranks && !options.snapshot) limits.sampled_levels = 0;
  // Who asks for a number of regions is to get about that, if it takes some seconds: 16,384 for 100,000
  // solids instead of 1,400.
  if (options.regions) limits.words *= 4;
  if (options.level) limits.level = *options.level;
  limits.tolerance = options.tolerance.value_or(0);
  limits.tolerance_shares = options.tolerance_shares;
  if (options.angle) {
    limits.eye = options.eye;
    limits.angle = *options.angle * std::numbers::pi / 180;
  }
  return limits;
}

/// The rank of each region: as the caller says, or by the estimated work. What is made of cells that touch,
/// a surface or polyhedra, costs the less the fewer touch those of other ranks.
std::vector<std::int32_t> owners(const std::vector<double>& work, int ranks, const RunOptions& options) {
  const std::vector<std::int32_t>& asked = options.first_rank_of_region;
  if (asked.empty())
    return options.boundary || options.complex ? assign_neighbours(work, ranks) : assign_regions(work, ranks);
  const bool is_valid =
      std::all_of(asked.begin(), asked.end(), [&](std::int32_t rank) { return rank >= 0 && rank < ranks; });
  if (asked.size() != work.size() || !is_valid)
    throw std::invalid_argument("first_rank_of_region does not name a rank for each region");
  return asked;
}

/// Sends the regions that this rank has made to their owners; the partition gets those that it owns. Cells do
/// not travel: to split again costs less.
template <int D>
void hand_out(Ranks& ranks, const dataflow::Network<D>& network, dataflow::Partition<D>& partition,
              std::vector<dataflow::Region<D>> made, const std::vector<std::int32_t>& owner) {
  const auto is_mine = [&](const dataflow::Region<D>& region) {
    return owner[region.number] == ranks.rank();
  };
  for (dataflow::Region<D>& region : made) {
    if (is_mine(region)) continue;
    ranks.send(owner[region.number], dataflow::to_bytes(region));
    region.program = {};
  }
  std::erase_if(made, [&](const auto& region) { return !is_mine(region); });
  ranks.sync();
  std::vector<dataflow::Region<D>> received;
  for (const auto& message : ranks.received()) dataflow::from_bytes(message.bytes, received.emplace_back());
  partition.regions = std::move(made);
  dataflow::add_regions(network, partition, std::move(received));
}

}  // namespace

std::vector<std::int32_t> assign_regions(const std::vector<double>& work, int ranks) {
  std::vector<std::size_t> order(work.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return work[a] > work[b]; });
  std::vector<std::int32_t> owner(work.size());
  std::vector<double> load(static_cast<std::size_t>(ranks));
  for (const std::size_t region : order) {
    const auto least = std::min_element(load.begin(), load.end());
    owner[region] = static_cast<std::int32_t>(least - load.begin());
    *least += work[region];
  }
  return owner;
}

std::vector<std::int32_t> assign_neighbours(const std::vector<double>& work, int ranks) {
  const double all = std::accumulate(work.begin(), work.end(), 0.0);
  if (!(all > 0)) return assign_regions(work, ranks);
  std::vector<std::int32_t> owner;
  double before = 0;
  for (const double own : work) {
    owner.push_back(std::min(ranks - 1, static_cast<std::int32_t>(ranks * ((before + own / 2) / all))));
    before += own;
  }
  return owner;
}

template <int D>
dataflow::PartitionPart<D> part_of_distribution(const dataflow::Network<D>& network,
                                                const RunOptions& options, dataflow::PartitionShare share,
                                                unsigned threads, unsigned for_ranks) {
  return dataflow::part_of_partition(network, depth_of(network, options), share,
                                     limits_of_cuts(options, std::max(share.count, for_ranks)), threads);
}

template <int D>
Distribution<D> distribution(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options,
                             unsigned threads, unsigned for_ranks) {
  const dataflow::PartitionShare share{static_cast<unsigned>(ranks.rank()),
                                       static_cast<unsigned>(ranks.count())};
  auto mine = part_of_distribution(network, options, share, threads, for_ranks);
  auto [partition, maker_of_region] = dataflow::join_parts<D>(all_gather(ranks, mine.nodes));
  std::vector<std::int32_t> owner;
  if (ranks.is_master()) owner = owners(partition.work, ranks.count(), options);
  broadcast(ranks, owner);
  for (std::uint32_t number = 0, made = 0; number < owner.size(); ++number)
    if (maker_of_region[number] == share.index) mine.regions[made++].number = number;
  hand_out(ranks, network, partition, std::move(mine.regions), owner);
  return {std::move(partition), std::move(owner)};
}

#define BSP2_STAGE(D)                                                                                        \
  template dataflow::PartitionPart<D> part_of_distribution<D>(                                               \
      const dataflow::Network<D>&, const RunOptions&, dataflow::PartitionShare, unsigned, unsigned);         \
  template Distribution<D> distribution<D>(Ranks&, const dataflow::Network<D>&, const RunOptions&, unsigned, \
                                           unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
