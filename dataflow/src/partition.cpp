#include "bsp2/dataflow/partition.hpp"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>

#include "bsp2/dataflow/localizer.hpp"
#include "large_stack.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::HyperplaneId;
using geometry::Position;

namespace {

template <int D>
class Partitioner {
 public:
  Partitioner(const Network<D>& network, unsigned depth) : network_(network), depth_(depth), splitter_(network.table), localizer_(network, splitter_) {}

  Partition<D> run() {
    result_.root = cut(geometry::root_cell<D>(network_.table), network_.program, 0);
    return std::move(result_);
  }

 private:
  const Network<D>& network_;
  unsigned depth_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  Partition<D> result_;

  std::int32_t cut(Cell<D> cell, const std::vector<Word>& program, unsigned level) {
    std::vector<Word> local;
    typename Localizer<D>::Cut unused;
    const bool fuzzy = localizer_.fire(program, cell, local, unused).label == geometry::Label::fuzzy;
    std::optional<HyperplaneId> hyperplane;
    const auto operands = fuzzy ? localizer_.undecided_operands(local) : std::vector<typename Localizer<D>::UndecidedOperand>();
    if (fuzzy && level < depth_) hyperplane = balanced_cut(cell, operands);
    if (!hyperplane) {
      double work = 0;
      for (const auto& operand : operands) work += static_cast<double>(operand.weight);
      result_.work.push_back(work);
      result_.regions.push_back({static_cast<std::uint32_t>(result_.regions.size()), static_cast<std::uint16_t>(level), std::move(cell), fuzzy ? std::move(local) : program, {}});
      return ~static_cast<std::int32_t>(result_.regions.size() - 1);
    }
    splitter_.classify(cell, *hyperplane);
    Cell<D> negative, positive;
    splitter_.split(cell, *hyperplane, &negative, &positive);
    const auto node = static_cast<std::int32_t>(result_.nodes.size());
    result_.nodes.push_back({*hyperplane, 0, 0});
    const std::int32_t low = cut(std::move(negative), local, level + 1);
    const std::int32_t high = cut(std::move(positive), local, level + 1);
    result_.nodes[node].negative = low;
    result_.nodes[node].positive = high;
    return node;
  }

  /// After `fire`: across the longest axis, with half of the estimated work on each side.
  std::optional<HyperplaneId> balanced_cut(const Cell<D>& cell, const std::vector<typename Localizer<D>::UndecidedOperand>& operands) {
    const CellExtent<D> extent(cell);
    std::array<int, D> axes;
    for (int i = 0; i < D; ++i) axes[i] = i;
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return extent.upper[a] - extent.lower[a] > extent.upper[b] - extent.lower[b]; });
    for (const int axis : axes) {
      std::vector<std::pair<double, double>> centres;  // and weights
      double total = 0;
      for (const auto& operand : operands) {
        const Producer<D>& producer = network_.producers[operand.producer];
        const double low = std::max(producer.lower[axis], extent.lower[axis]), high = std::min(producer.upper[axis], extent.upper[axis]);
        // Spread over its extent: a long operand is work on both sides of a cut.
        for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) centres.emplace_back(low + share * (high - low), static_cast<double>(operand.weight));
        total += 5 * static_cast<double>(operand.weight);
      }
      std::sort(centres.begin(), centres.end());
      double below = 0;
      for (const auto& [centre, weight] : centres) {
        below += weight;
        if (below * 2 < total) continue;
        const auto& table = network_.table;
        const HyperplaneId id = table.axis_hyperplane(axis, table.axis_position(axis, centre));
        if (splitter_.position(cell, id, table.rounded(id)) == Position::crossing) return id;
        break;
      }
    }
    return std::nullopt;
  }
};

}  // namespace

template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth) {
  Partition<D> result;
  call_on_large_stack([&] { result = Partitioner<D>(network, depth).run(); });
  return result;
}

namespace {

/// Walks down to the regions that are asked for, localizing the program on the way.
template <int D>
class RegionMaker {
 public:
  RegionMaker(const Network<D>& network, const Partition<D>& partition, std::span<const std::uint32_t> numbers)
      : network_(network), partition_(partition), numbers_(numbers), splitter_(network.table), localizer_(network, splitter_) {
    count(partition.root);
  }

  std::vector<Region<D>> run() {
    descend(partition_.root, geometry::root_cell<D>(network_.table), network_.program, 0);
    if (result_.size() != numbers_.size()) throw std::out_of_range("the partition does not have all regions that are asked for");
    return std::move(result_);
  }

 private:
  const Network<D>& network_;
  const Partition<D>& partition_;
  std::span<const std::uint32_t> numbers_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  std::vector<std::size_t> wanted_ = std::vector<std::size_t>(partition_.nodes.size());  // regions below each node
  std::vector<Region<D>> result_;

  [[nodiscard]] std::size_t wanted(std::int32_t child) const {
    if (child >= 0) return wanted_[static_cast<std::size_t>(child)];
    return std::binary_search(numbers_.begin(), numbers_.end(), static_cast<std::uint32_t>(~child)) ? 1 : 0;
  }
  std::size_t count(std::int32_t child) {
    if (child < 0) return wanted(child);
    const auto& node = partition_.nodes[static_cast<std::size_t>(child)];
    return wanted_[static_cast<std::size_t>(child)] = count(node.negative) + count(node.positive);
  }

  void descend(std::int32_t at, Cell<D> cell, const std::vector<Word>& program, unsigned level) {
    if (wanted(at) == 0) return;
    std::vector<Word> local;
    typename Localizer<D>::Cut unused;
    const bool fuzzy = localizer_.fire(program, cell, local, unused).label == geometry::Label::fuzzy;
    if (at < 0) {
      result_.push_back({static_cast<std::uint32_t>(~at), static_cast<std::uint16_t>(level), std::move(cell), fuzzy ? std::move(local) : program, {}});
      return;
    }
    const auto& node = partition_.nodes[static_cast<std::size_t>(at)];
    splitter_.classify(cell, node.hyperplane);
    Cell<D> negative, positive;
    splitter_.split(cell, node.hyperplane, wanted(node.negative) != 0 ? &negative : nullptr, wanted(node.positive) != 0 ? &positive : nullptr);
    descend(node.negative, std::move(negative), local, level + 1);
    descend(node.positive, std::move(positive), local, level + 1);
  }
};

}  // namespace

template <int D>
std::vector<Region<D>> make_regions(const Network<D>& network, const Partition<D>& partition, std::span<const std::uint32_t> numbers) {
  std::vector<Region<D>> regions;
  call_on_large_stack([&] { regions = RegionMaker<D>(network, partition, numbers).run(); });
  return regions;
}

template <int D>
Cell<D> region_cell(const Network<D>& network, const Partition<D>& partition, std::uint32_t number) {
  // The way up from the leaf, then down again.
  std::vector<std::int32_t> parent(partition.nodes.size(), -1);
  std::int32_t at = -1;
  bool found = partition.root == ~static_cast<std::int32_t>(number);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i)
    for (const std::int32_t child : {partition.nodes[i].negative, partition.nodes[i].positive})
      if (child >= 0)
        parent[static_cast<std::size_t>(child)] = static_cast<std::int32_t>(i);
      else if (~child == static_cast<std::int32_t>(number)) {
        at = static_cast<std::int32_t>(i);
        found = true;
      }
  if (!found) throw std::out_of_range("the partition has no region " + std::to_string(number));
  std::vector<std::int32_t> path;
  for (; at >= 0; at = parent[static_cast<std::size_t>(at)]) path.push_back(at);
  path.insert(path.begin(), ~static_cast<std::int32_t>(number));
  geometry::Splitter<D> splitter(network.table);
  Cell<D> cell = geometry::root_cell<D>(network.table);
  for (std::size_t i = path.size(); i-- > 1;) {
    const auto& node = partition.nodes[static_cast<std::size_t>(path[i])];
    const bool negative = node.negative == path[i - 1];
    splitter.classify(cell, node.hyperplane);
    Cell<D> half;
    splitter.split(cell, node.hyperplane, negative ? &half : nullptr, negative ? nullptr : &half);
    cell = std::move(half);
  }
  return cell;
}

#define BSP2_INSTANTIATE(D)                                                                                                            \
  template Partition<D> partition<D>(const Network<D>&, unsigned);                                                                     \
  template std::vector<Region<D>> make_regions<D>(const Network<D>&, const Partition<D>&, std::span<const std::uint32_t>);             \
  template Cell<D> region_cell<D>(const Network<D>&, const Partition<D>&, std::uint32_t);
BSP2_INSTANTIATE(1)
BSP2_INSTANTIATE(2)
BSP2_INSTANTIATE(3)
BSP2_INSTANTIATE(4)
BSP2_INSTANTIATE(5)
BSP2_INSTANTIATE(6)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
