#include "surface/skin_of_cells.hpp"

#include <algorithm>
#include <memory>
#include <utility>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::FacetIndex;
using geometry::Skin;
using Table = geometry::HyperplaneTable<3>;

namespace {

using Batches = std::vector<std::shared_ptr<const geometry::CellBatch>>;

class Collector final : public Consumer {
 public:
  void consume(const std::shared_ptr<const Refinement>& refinement) override {
    batches.emplace_back(refinement, &refinement->cells);
  }
  Batches batches;
};

/// Cuts boxes out of space. Thread rule: one thread at a time.
class BoxMaker {
 public:
  explicit BoxMaker(const Table& table) : splitter_(table), root_(geometry::root_cell(table)) {}
  Cell<3> make(const HotBox& box) {
    Cell<3> cell = root_.copy();
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      cut(cell, axis, box.low[k], true);
      cut(cell, axis, box.high[k], false);
    }
    return cell;
  }

 private:
  geometry::Splitter<3> splitter_;
  Cell<3> root_;

  void cut(Cell<3>& cell, int axis, std::uint32_t position, bool keep_upper) {
    const auto side = Table::axis_hyperplane(axis, position);
    if (splitter_.classify(cell, side) != geometry::Position::crossing) return;
    Cell<3> half;
    splitter_.split(cell, side, keep_upper ? nullptr : &half, keep_upper ? &half : nullptr);
    cell = std::move(half);
  }
};

std::vector<Region<3>> regions_of(const Network<3>& network, const std::vector<std::vector<HotBox>>& boxes) {
  BoxMaker maker(network.table);
  std::vector<Region<3>> regions;
  for (const auto& some : boxes)
    for (const HotBox& box : some)
      regions.push_back({static_cast<std::uint32_t>(regions.size()), 0, maker.make(box), box.program, {}});
  return regions;
}

/// The skin on all planes but the boxes' own sides, where no operand ends.
void match(const Table& table, const Batches& batches, unsigned threads, Skin& skin) {
  constexpr std::size_t grain = 256;
  const auto first_cut = Table::axis_hyperplane(0, 0);
  geometry::FacetGrouping grouping;
  grouping.group = [&](std::uint32_t, geometry::HyperplaneId id) {
    return id >= first_cut ? geometry::FacetGrouping::left_out : 0;
  };
  const FacetIndex index(table, batches, std::move(grouping));
  std::vector<Skin> skins((index.size() + grain - 1) / grain);
  geometry::for_each_range(index.size(), grain, threads, [&](std::size_t first, std::size_t end) {
    geometry::FacetMatcher matcher(table);
    geometry::FacetSet set;
    for (std::size_t i = first; i < end; ++i) {
      set.clear(index.hyperplane(i));
      index.append(i, set);
      matcher.match(set, nullptr, &skins[first / grain]);
    }
  });
  for (Skin& some : skins) skin.append(std::exchange(some, {}));
}

}  // namespace

void add_skin_of_cells(const Network<3>& network, const std::vector<std::vector<HotBox>>& boxes,
                       unsigned threads, const std::atomic<bool>& stop, Skin& skin) {
  std::vector<Region<3>> regions = regions_of(network, boxes);
  if (regions.empty()) return;
  EvaluateOptions options;
  options.threads = threads;
  options.keep_fuzzy = false;
  options.interrupted = [&] { return stop.load(); };
  Collector collector;
  Consumer* const consumers[] = {&collector};
  evaluate<3>(network, std::move(regions), options, consumers);
  if (!stop) match(network.table, collector.batches, threads, skin);
}

}  // namespace bsp2::dataflow
