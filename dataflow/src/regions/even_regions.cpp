#include "regions/even_regions.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::HyperplaneId;
using geometry::Position;

namespace {

template <int D>
class EvenCutter {
 public:
  explicit EvenCutter(const Network<D>& network)
      : network_(network), splitter_(network.table), localizer_(network, splitter_) {}

  std::vector<Region<D>> run(unsigned cuts) {
    cut(geometry::root_cell<D>(network_.table), network_.program, 0, cuts);
    return std::move(regions_);
  }

 private:
  using Operands = std::vector<typename Localizer<D>::UndecidedOperand>;
  const Network<D>& network_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  std::vector<Region<D>> regions_;

  void cut(Cell<D> cell, std::span<const Word> program, unsigned level, unsigned cuts) {
    Words local;
    typename Localizer<D>::Cut unused;
    const bool fuzzy = localizer_.fire(program, cell, local, unused).label == geometry::Label::fuzzy;
    std::optional<HyperplaneId> hyperplane;
    if (fuzzy && level < cuts) hyperplane = middle(cell, localizer_.undecided_operands(local));
    if (!hyperplane) {
      regions_.push_back({static_cast<std::uint32_t>(regions_.size()),
                          static_cast<std::uint16_t>(level),
                          std::move(cell),
                          fuzzy ? std::vector<Word>(local.begin(), local.end())
                                : std::vector<Word>(program.begin(), program.end()),
                          {}});
      return;
    }
    splitter_.classify(cell, *hyperplane);
    Cell<D> negative, positive;
    splitter_.split(cell, *hyperplane, &negative, &positive);
    cut(std::move(negative), local, level + 1, cuts);
    cut(std::move(positive), local, level + 1, cuts);
  }

  std::optional<HyperplaneId> middle(const Cell<D>& cell, const Operands& operands) {
    const CellExtent<D> extent(cell);
    for (const int axis : extent.axes_by_length()) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (const auto& operand : operands) {
        low = std::min(low, std::max(network_.producers[operand.producer].lower[axis], extent.lower[axis]));
        high = std::max(high, std::min(network_.producers[operand.producer].upper[axis], extent.upper[axis]));
      }
      const HyperplaneId id = network_.axial_cut(axis, low + (high - low) / 2);
      if (splitter_.position(cell, id, network_.table.rounded(id)) == Position::crossing) return id;
    }
    return std::nullopt;
  }
};

}  // namespace

template <int D>
std::vector<Region<D>> even_regions(const Network<D>& network, unsigned cuts) {
  return EvenCutter<D>(network).run(cuts);
}

#define BSP2_INSTANTIATE(D) template std::vector<Region<D>> even_regions<D>(const Network<D>&, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
