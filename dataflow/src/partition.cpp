#include "bsp2/dataflow/partition.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/localizer.hpp"
#include "bsp2/geometry/dimensions.hpp"
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
  using Operands = std::vector<typename Localizer<D>::UndecidedOperand>;
  static constexpr unsigned sampled_levels = 2;

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
    const Operands operands = fuzzy ? localizer_.undecided_operands(local) : Operands();
    if (fuzzy && level < depth_) hyperplane = balanced_cut(cell, operands);
    if (!hyperplane) {
      result_.work.push_back(fuzzy && level > 0 ? work_of(cell, local, operands, sampled_levels) : 0);
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

  /// Estimate of the work on a cell: it is cut further, for a sample, and the work on what cannot be folded away grows
  /// with its half-spaces, but slower than they do, since cuts between operands part them.
  double work_of(const Cell<D>& cell, const std::vector<Word>& program, const Operands& operands, unsigned levels) {
    double weight = 0;
    for (const auto& operand : operands) weight += static_cast<double>(operand.weight);
    if (levels == 0) return std::sqrt(weight);
    const auto hyperplane = balanced_cut(cell, operands);
    if (!hyperplane) return std::sqrt(weight);
    splitter_.classify(cell, *hyperplane);
    std::array<Cell<D>, 2> halves;
    splitter_.split(cell, *hyperplane, &halves[0], &halves[1]);
    double work = 0;
    for (const Cell<D>& half : halves) {
      std::vector<Word> local;
      typename Localizer<D>::Cut unused;
      if (localizer_.fire(program, half, local, unused).label == geometry::Label::fuzzy)
        work += work_of(half, local, localizer_.undecided_operands(local), levels - 1);
    }
    return work;
  }

  /// After `fire`: across the longest axis, with about half of the estimated work on each side.
  std::optional<HyperplaneId> balanced_cut(const Cell<D>& cell, const Operands& operands) {
    const CellExtent<D> extent(cell);
    std::array<int, D> axes;
    for (int i = 0; i < D; ++i) axes[i] = i;
    std::stable_sort(axes.begin(), axes.end(), [&](int a, int b) { return extent.upper[a] - extent.lower[a] > extent.upper[b] - extent.lower[b]; });
    for (const int axis : axes) {
      const auto [low, middle, high] = quantiles(extent, operands, axis);
      if (const auto own = own_plane(cell, operands, axis, low, middle, high)) return own;
      const HyperplaneId id = network_.axial_cut(axis, middle);
      if (crosses(cell, id)) return id;
    }
    return std::nullopt;
  }

  [[nodiscard]] bool crosses(const Cell<D>& cell, HyperplaneId id) {
    return splitter_.position(cell, id, network_.table.rounded(id)) == Position::crossing;
  }

  /// Where along an axis 44, 50 and 56 % of the operands' weight lie below.
  std::array<double, 3> quantiles(const CellExtent<D>& extent, const Operands& operands, int axis) {
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
    constexpr std::array<double, 3> shares{0.44, 0.5, 0.56};
    std::array<double, 3> result{};
    std::size_t next = 0;
    double below = 0;
    for (const auto& [centre, weight] : centres) {
      below += weight;
      while (next < shares.size() && below >= shares[next] * total) result[next++] = centre;
    }
    return result;
  }

  /// A hyperplane of an operand's own, the nearest to the middle between low and high: such a cut adds no cells.
  std::optional<HyperplaneId> own_plane(const Cell<D>& cell, const Operands& operands, int axis, double low, double middle, double high) {
    std::vector<std::pair<double, HyperplaneId>> candidates;  // distance from the middle
    for (const auto& operand : operands) {
      const Producer<D>& producer = network_.producers[operand.producer];
      for (const int side : {0, 1}) {
        const double bound = side == 0 ? producer.lower[axis] : producer.upper[axis];
        const std::uint32_t own = producer.bounding_plane[axis][static_cast<std::size_t>(side)];
        if (own != 0 && bound >= low && bound <= high) candidates.emplace_back(std::fabs(bound - middle), (own - 1) >> 1);
      }
    }
    if (candidates.empty()) return std::nullopt;
    const HyperplaneId nearest = std::min_element(candidates.begin(), candidates.end())->second;
    return crosses(cell, nearest) ? std::optional(nearest) : std::nullopt;
  }
};

}  // namespace

template <int D>
unsigned suggested_depth(const Network<D>& network) {
  // Measured: fewer regions are balanced worse over 16 ranks, more of them cost time.
  constexpr double planes_of_a_region = 512;
  constexpr unsigned most = 12;
  constexpr double planes_of_a_round = 128;
  double planes = 0;
  for (const auto& producer : network.producers)
    planes += producer.round >= 0 || producer.torus >= 0 || producer.spline >= 0 || producer.preimage >= 0 ? planes_of_a_round :
              producer.mesh < 0 ? static_cast<double>(producer.plane_count) : static_cast<double>(network.meshes[static_cast<std::size_t>(producer.mesh)].facets.size());
  return planes < planes_of_a_region ? 0 : std::min(most, static_cast<unsigned>(std::log2(planes / planes_of_a_region)));
}

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
  template unsigned suggested_depth<D>(const Network<D>&);                                                                             \
  template Partition<D> partition<D>(const Network<D>&, unsigned);                                                                     \
  template std::vector<Region<D>> make_regions<D>(const Network<D>&, const Partition<D>&, std::span<const std::uint32_t>);             \
  template Cell<D> region_cell<D>(const Network<D>&, const Partition<D>&, std::uint32_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
