#include <algorithm>
#include <bit>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "bsp2/geometry/dimensions.hpp"
#include "exchange.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {
namespace {

/// What travels: the tree, and to whom each region belongs.
struct Plan {
  std::int32_t root = ~0;
  std::vector<std::uint32_t> hyperplane;
  std::vector<std::int32_t> negative, positive, owner;
  std::vector<double> work;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & root & hyperplane & negative & positive & owner & work;
  }
};

template <int D>
Plan plan_of(const dataflow::Partition<D>& partition, int ranks, const std::vector<std::int32_t>& owner) {
  Plan plan;
  plan.root = partition.root;
  for (const auto& node : partition.nodes) {
    plan.hyperplane.push_back(node.hyperplane);
    plan.negative.push_back(node.negative);
    plan.positive.push_back(node.positive);
  }
  plan.work = partition.work;
  plan.owner = owner.empty() ? assign_regions(partition.work, ranks) : owner;
  const bool is_valid = std::all_of(plan.owner.begin(), plan.owner.end(), [&](std::int32_t rank) { return rank >= 0 && rank < ranks; });
  if (plan.owner.size() != partition.work.size() || !is_valid) throw std::invalid_argument("first_rank_of_region does not name a rank for each region");
  return plan;
}

template <int D>
dataflow::Partition<D> partition_of(const Plan& plan) {
  dataflow::Partition<D> partition;
  partition.root = plan.root;
  for (std::size_t i = 0; i < plan.hyperplane.size(); ++i) partition.nodes.push_back({plan.hyperplane[i], plan.negative[i], plan.positive[i]});
  partition.work = plan.work;
  return partition;
}

/// k for 2^k regions.
template <int D>
unsigned depth_of(const dataflow::Network<D>& network, const RunOptions& options) {
  if (options.regions) return static_cast<unsigned>(std::bit_width(std::bit_ceil(std::max(1U, *options.regions))) - 1);
  return dataflow::suggested_depth(network);
}

/// What the computation leaves undecided the partition does not cut either.
dataflow::PartitionLimits limits_of_cuts(const RunOptions& options) {
  dataflow::PartitionLimits limits;
  // Who asks for a number of regions is to get it, if it takes some seconds: 16,384 for 100,000 solids instead of 1,400.
  if (options.regions) limits.words *= 4;
  if (options.level) limits.level = *options.level;
  limits.tolerance = options.tolerance.value_or(0);
  if (options.angle) {
    limits.eye = options.eye;
    limits.angle = *options.angle * std::numbers::pi / 180;
  }
  return limits;
}

}  // namespace

std::vector<std::int32_t> assign_regions(const std::vector<double>& work, int ranks) {
  std::vector<std::size_t> order(work.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return work[a] > work[b]; });
  std::vector<std::int32_t> owner(work.size());
  std::vector<double> load(static_cast<std::size_t>(ranks));
  for (const std::size_t region : order) {
    const auto least = std::min_element(load.begin(), load.end());
    owner[region] = static_cast<std::int32_t>(least - load.begin());
    *least += work[region];
  }
  return owner;
}

template <int D>
Distribution<D> distribution(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options, unsigned threads) {
  dataflow::Partition<D> partition;
  Plan plan;
  if (ranks.is_master()) {
    partition = dataflow::partition(network, depth_of(network, options), limits_of_cuts(options), threads);
    plan = plan_of(partition, ranks.count(), options.first_rank_of_region);
  }
  broadcast(ranks, plan);
  const auto is_mine = [&](std::uint32_t region) { return plan.owner[region] == ranks.rank(); };
  if (ranks.is_master()) {
    std::erase_if(partition.regions, [&](const auto& region) { return !is_mine(region.number); });
  } else {
    partition = partition_of<D>(plan);
    std::vector<std::uint32_t> mine;
    for (std::uint32_t region = 0; region < plan.owner.size(); ++region)
      if (is_mine(region)) mine.push_back(region);
    partition.regions = dataflow::make_regions(network, partition, mine);
  }
  return {std::move(partition), std::move(plan.owner)};
}

#define BSP2_STAGE(D) template Distribution<D> distribution<D>(Ranks&, const dataflow::Network<D>&, const RunOptions&, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
