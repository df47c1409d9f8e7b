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
    if (fuzzy && level < depth_) hyperplane = balanced_cut(cell, localizer_.undecided_operands(local));
    if (!hyperplane) {
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

#define BSP2_INSTANTIATE(D) template Cell<D> region_cell<D>(const Network<D>&, const Partition<D>&, std::uint32_t);
BSP2_INSTANTIATE(1)
BSP2_INSTANTIATE(2)
BSP2_INSTANTIATE(3)
BSP2_INSTANTIATE(4)
BSP2_INSTANTIATE(5)
BSP2_INSTANTIATE(6)
#undef BSP2_INSTANTIATE

template Partition<1> partition<1>(const Network<1>&, unsigned);
template Partition<2> partition<2>(const Network<2>&, unsigned);
template Partition<3> partition<3>(const Network<3>&, unsigned);
template Partition<4> partition<4>(const Network<4>&, unsigned);
template Partition<5> partition<5>(const Network<5>&, unsigned);
template Partition<6> partition<6>(const Network<6>&, unsigned);

}  // namespace bsp2::dataflow
