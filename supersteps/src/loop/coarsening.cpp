#include "bsp2/dataflow/regions/coarsening.hpp"

#include <algorithm>
#include <map>

#include "bsp2/geometry/support/dimensions.hpp"
#include "loop/progress.hpp"
#include "ranks/exchange.hpp"

namespace bsp2::supersteps {
namespace {

/// Of which regions a rank has something left, and what is held of those that are one cell.
struct LeftOver {
  std::vector<std::uint32_t> unfinished;
  std::vector<std::uint32_t> region;  // of uniform
  std::vector<std::uint8_t> label;
  std::vector<std::int32_t> owner;
  std::vector<std::uint16_t> level;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& unfinished& region& label& owner& level;
  }
};

template <int D>
LeftOver left_over(const Progress<D>& progress) {
  LeftOver left;
  for (const auto& region : progress.partition.regions) {
    const auto whole = dataflow::uniform_region_of(region);
    if (!whole) {
      left.unfinished.push_back(region.number);
      continue;
    }
    left.region.push_back(whole->region);
    left.label.push_back(static_cast<std::uint8_t>(whole->label));
    left.owner.push_back(whole->owner);
    left.level.push_back(whole->level);
  }
  return left;
}

/// A region as what it became: its cell is that of the node of the partition which it has taken.
template <int D>
void become(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition,
            const dataflow::UniformRegion& whole, dataflow::Region<D>& region) {
  region.frontier.nodes[0].value = whole.owner;
  if (region.level == whole.level && !region.cell.vertices().empty()) return;
  region.level = whole.level;
  region.cell = dataflow::region_cell(network, partition, region.number);
}

}  // namespace

template <int D>
void coarsen(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
             const RunOptions& options, unsigned threads, CellStream* stream) {
  std::vector<dataflow::UniformRegion> uniform;
  std::vector<std::uint32_t> unfinished;
  for (const LeftOver& left : all_gather(ranks, left_over(progress))) {
    unfinished.insert(unfinished.end(), left.unfinished.begin(), left.unfinished.end());
    for (std::size_t i = 0; i < left.region.size(); ++i)
      uniform.push_back(
          {left.region[i], static_cast<geometry::Label>(left.label[i]), left.owner[i], left.level[i]});
  }
  if (uniform.empty()) return;
  std::map<std::uint32_t, dataflow::UniformRegion> remaining;
  for (const auto& whole : dataflow::coarsen<D>(network, progress.partition, uniform, unfinished))
    remaining.emplace(whole.region, whole);

  std::vector<dataflow::Region<D>> stay, done;
  for (auto& region : progress.partition.regions) {
    const auto was = dataflow::uniform_region_of(region);
    const auto is = was ? remaining.find(region.number) : remaining.end();
    if (was && is == remaining.end()) continue;  // part of another region now
    if (was) become(network, progress.partition, is->second, region);
    (was && is->second.is_certain ? done : stay).push_back(std::move(region));
  }
  progress.partition.regions = std::move(stay);
  if (done.empty()) return;

  std::vector<dataflow::Consumer*> others;
  if (stream != nullptr) others.push_back(stream);
  std::vector<std::uint32_t> numbers;
  for (const auto& region : done) numbers.push_back(region.number);
  progress.take_in(numbers, options.collect_cells, others, stream,
                   [&](const Recorded& before, const auto& consumers) {
                     auto emitted = provisional_cells<D>(network, done, options, threads, before, consumers);
                     ranks.count_cells(emitted.totals.in_cells + emitted.totals.out_cells);
                     return emitted;
                   });
}

#define BSP2_STAGE(D)                                                                                      \
  template void coarsen<D>(Ranks&, const dataflow::Network<D>&, Progress<D>&, const RunOptions&, unsigned, \
                           CellStream*);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
