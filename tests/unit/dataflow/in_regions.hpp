#pragma once

// An evaluation in many regions, as the engine makes it.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/dataflow/regions/coarsening.hpp"
#include "bsp2/dataflow/regions/portion.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

/// Where an evaluation with these options leaves cells undecided.
inline PartitionLimits limits_of(const EvaluateOptions& options) {
  PartitionLimits limits;
  if (options.level) limits.level = *options.level;
  limits.tolerance = options.tolerance.value_or(0);
  if (options.angle) {
    limits.eye = options.eye;
    limits.angle = *options.angle;
  }
  return limits;
}

/// Regions are evaluated in random lots; what is whole is given back after each.
template <int D>
class InRegions {
 public:
  InRegions(const Network<D>& network, unsigned depth, const EvaluateOptions& options, Random& random)
      : network_(network),
        random_(random),
        options_(options),
        parts_(partition(network, depth, limits_of(options))),
        totals_(network.table.radius(), network.table.width()) {
    totals_.reset_bounds();
    waiting_ = std::move(parts_.regions);
    regions_ = waiting_.size();
  }

  [[nodiscard]] std::size_t regions() const { return regions_; }
  [[nodiscard]] std::size_t interruptions() const { return interruptions_; }

  /// Evaluates all. @param cells if not 0, a lot may end after so many cells at most, and goes on with other
  /// threads, in another order, as another process finds it: through bytes, without the cells.
  void run(std::uint64_t cells) {
    options_.suspend = options_.hold_uniform_regions = options_.same_limits = true;
    while (!waiting_.empty()) {
      std::shuffle(waiting_.begin(), waiting_.end(), random_);
      const std::size_t most = std::max<std::size_t>(5, waiting_.size() / 2);
      std::vector<Region<D>> lot;
      for (int i = pick(random_, 1, static_cast<int>(most)); i > 0 && !waiting_.empty(); --i) {
        lot.push_back(std::move(waiting_.back()));
        waiting_.pop_back();
      }
      EvaluateOptions options = options_;
      if (cells > 0) {
        options.threads = static_cast<unsigned>(pick(random_, 1, 2));
        options.order = chance(random_, 0.5) ? Order::depth : Order::priority;
        if (chance(random_, 0.5))
          options.cells = static_cast<std::uint64_t>(pick(random_, 1, static_cast<int>(cells)));
        travel(lot);
      }
      auto found = evaluate(network_, std::move(lot), options, {});
      totals_ += found.totals;
      for (auto& region : found.unfinished) {
        const bool goes_on = found.stopped && remains_of(region.frontier).open > 0;
        interruptions_ += goes_on ? 1 : 0;
        (goes_on ? waiting_ : left_).push_back(std::move(region));
      }
      give_back_wholes();
    }
  }

  /// To be run again, further: what has ended as thin, deep or small enough is looked at again.
  void go_on_to(const EvaluateOptions& options) {
    options_ = options;
    std::vector<Region<D>> held;
    for (auto& region : left_) {
      if (uniform_region_of(region)) {
        held.push_back(std::move(region));
        continue;
      }
      for (Frontier::Node& node : region.frontier.nodes) node.ended = 0;
      waiting_.push_back(std::move(region));
    }
    left_ = std::move(held);
  }

  /// With what is left, as it is.
  Totals<D> totals() {
    Totals<D> all = totals_;
    all += picture<D>(network_, left_, options_, {}).totals;
    return all;
  }

  /// Regions that are whole, and wait for what is beyond a cut.
  [[nodiscard]] std::vector<std::uint32_t> held() const {
    std::vector<std::uint32_t> numbers;
    for (const auto& region : left_)
      if (uniform_region_of(region)) numbers.push_back(region.number);
    return numbers;
  }

 private:
  const Network<D>& network_;
  Random& random_;
  EvaluateOptions options_;
  Partition<D> parts_;
  Totals<D> totals_;
  std::vector<Region<D>> waiting_, left_;
  std::size_t regions_ = 0, interruptions_ = 0;

  void travel(std::vector<Region<D>>& lot) {
    for (Region<D>& region : lot) {
      Region<D> back;
      from_bytes(to_bytes(region), back);
      back.cell = region_cell(network_, parts_, back.number);
      region = std::move(back);
    }
  }

  void give_back_wholes() {
    std::vector<UniformRegion> uniform;
    std::vector<std::uint32_t> unfinished;
    for (const auto& region : waiting_) unfinished.push_back(region.number);
    for (const auto& region : left_)
      if (const auto whole = uniform_region_of(region))
        uniform.push_back(*whole);
      else
        unfinished.push_back(region.number);
    std::map<std::uint32_t, UniformRegion> remaining;
    for (const UniformRegion& whole : coarsen<D>(network_, parts_, uniform, unfinished))
      remaining.emplace(whole.region, whole);
    std::vector<Region<D>> certain, others;
    for (auto& region : left_) {
      const bool was_whole = uniform_region_of(region).has_value();
      const auto is = remaining.find(region.number);
      if (was_whole && is == remaining.end()) continue;
      if (was_whole)
        region = {region.number,
                  is->second.level,
                  region_cell(network_, parts_, region.number),
                  {},
                  {{{Frontier::Kind::held, is->second.label, 0, is->second.owner}}, {}}};
      (was_whole && is->second.is_certain ? certain : others).push_back(std::move(region));
    }
    totals_ += picture<D>(network_, certain, options_, {}).totals;
    left_ = std::move(others);
  }
};

/// Totals of an evaluation in many regions.
template <int D>
Totals<D> evaluated_in_regions(const Network<D>& network, unsigned depth, const EvaluateOptions& options,
                               Random& random) {
  InRegions<D> regions(network, depth, options, random);
  regions.run(0);
  for (const std::uint32_t number : regions.held())
    EXPECT_TRUE(options.level || network.is_round()) << "region " << number << " waits for nobody";
  return regions.totals();
}

}  // namespace bsp2::dataflow
