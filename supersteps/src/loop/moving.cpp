#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "bsp2/geometry/support/dimensions.hpp"
#include "loop/progress.hpp"
#include "ranks/exchange.hpp"

namespace bsp2::supersteps {
namespace {

/// What a rank has left to do, region by region.
struct Left {
  std::vector<std::uint32_t> region;
  std::vector<double> work;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& region& work;
  }
};

/// The share of a region that is undecided, each split counted as half and half. @param levels below the
/// region that remain.
double undecided_share(const dataflow::Frontier& frontier, int levels) {
  if (frontier.empty()) return levels > 0 ? 1 : 0;
  double share = 0;
  std::vector<int> depths{0};  // of the nodes to come, the next one last
  for (const auto& node : frontier.nodes) {
    const int depth = depths.back();
    depths.pop_back();
    if (node.kind == dataflow::Frontier::Kind::split) depths.insert(depths.end(), 2, depth + 1);
    if (node.kind == dataflow::Frontier::Kind::token && node.ended == 0 && depth < levels)
      share += std::ldexp(1.0, -depth);
  }
  return share;
}

template <int D>
Left left_of(const Progress<D>& progress, std::optional<unsigned> level) {
  Left left;
  for (const auto& region : progress.partition.regions) {
    // A snapshot has no estimates; even a region that was estimated to be no work is some.
    const double whole = region.number < progress.partition.work.size()
                             ? std::max(1.0, progress.partition.work[region.number])
                             : 1.0;
    left.region.push_back(region.number);
    const int levels = level ? static_cast<int>(*level) - region.level : std::numeric_limits<int>::max();
    left.work.push_back(whole * undecided_share(region.frontier, levels));
  }
  return left;
}

constexpr char a_region = 'f';  // `send` of a mesh uses other letters

}  // namespace

std::vector<std::int32_t> reassign_regions(const std::vector<double>& work,
                                           const std::vector<std::int32_t>& owner, int ranks) {
  constexpr double worth_moving = 0.05;  // of a rank's load
  std::vector<std::size_t> order(work.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return work[a] > work[b]; });
  const double slack = worth_moving * std::accumulate(work.begin(), work.end(), 0.0) / ranks;
  std::vector<double> load(static_cast<std::size_t>(ranks));
  std::vector<std::int32_t> result(work.size());
  for (const std::size_t i : order) {
    const auto least = std::min_element(load.begin(), load.end());
    const auto stays = load.begin() + owner[i];
    const auto to = work[i] == 0 || *stays <= *least + slack ? stays : least;
    result[i] = static_cast<std::int32_t>(to - load.begin());
    *to += work[i];
  }
  return result;
}

template <int D>
bool move_regions(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
                  std::vector<std::int32_t>& rank_of_region, std::optional<unsigned> level) {
  if (ranks.count() == 1) return false;
  std::vector<std::uint32_t> regions;
  std::vector<std::int32_t> owner;
  std::vector<double> work;
  const auto all = all_gather(ranks, left_of(progress, level));
  for (std::size_t rank = 0; rank < all.size(); ++rank) {
    regions.insert(regions.end(), all[rank].region.begin(), all[rank].region.end());
    work.insert(work.end(), all[rank].work.begin(), all[rank].work.end());
    owner.resize(regions.size(), static_cast<std::int32_t>(rank));
  }
  const auto now = reassign_regions(work, owner, ranks.count());
  for (std::size_t i = 0; i < regions.size(); ++i) rank_of_region.at(regions[i]) = now[i];
  if (now == owner) return false;

  std::erase_if(progress.partition.regions, [&](const dataflow::Region<D>& region) {
    const int to = rank_of_region[region.number];
    if (to == ranks.rank()) return false;
    if (const auto mesh = progress.meshes.extract(region.number)) send(ranks, to, std::move(mesh.mapped()));
    ranks.send(to, std::string(1, a_region) + dataflow::to_bytes(region));
    return true;
  });
  ranks.sync();
  RegionMesh mesh;
  std::vector<dataflow::Region<D>> moved;
  for (const auto& message : ranks.received()) {
    if (message.bytes.front() == a_region) {
      dataflow::from_bytes(std::span<const char>(message.bytes).subspan(1), moved.emplace_back());
    } else if (receive(message.bytes, mesh)) {
      const std::uint32_t number = mesh.region;
      progress.meshes[number] = std::exchange(mesh, {});
    }
  }
  dataflow::add_regions(network, progress.partition, std::move(moved));
  return true;
}

#define BSP2_STAGE(D)                                                              \
  template bool move_regions<D>(Ranks&, const dataflow::Network<D>&, Progress<D>&, \
                                std::vector<std::int32_t>&, std::optional<unsigned>);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
