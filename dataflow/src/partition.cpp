#include "bsp2/dataflow/partition.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <queue>
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

namespace {

/// Cuts the space where its evaluation would cut it, always the region with the most work.
template <int D>
class Partitioner {
 public:
  Partitioner(const Network<D>& network, const PartitionLimits& limits) : network_(network), level_(limits.level), splitter_(network.table), localizer_(network, splitter_) {
    localizer_.set_tolerance(limits.tolerance);
    if (limits.angle > 0) localizer_.set_view(limits.eye, limits.angle);
  }

  Partition<D> run(std::size_t most_regions) {
    add(geometry::root_cell<D>(network_.table), network_.program, 0);
    std::priority_queue<std::pair<double, std::int64_t>> open;  // work, and the negative number: of equals the first
    const auto offer = [&](std::size_t piece) {
      if (pieces_[piece].cut) open.emplace(work_of(piece, sampled_levels), -static_cast<std::int64_t>(piece));
    };
    if (most_regions > 1) offer(0);
    for (std::size_t regions = 1; regions < most_regions && !open.empty(); ++regions) {
      const auto chosen = static_cast<std::size_t>(-open.top().second);
      if (pieces_[chosen].first_half == 0) break;  // enough was looked at
      open.pop();
      pieces_[chosen].is_parted = true;
      pieces_[chosen].cell = {};
      offer(pieces_[chosen].first_half);
      offer(pieces_[chosen].first_half + 1);
    }
    result_.root = number(0, network_.program);
    return std::move(result_);
  }

 private:
  static constexpr unsigned sampled_levels = 3;
  static constexpr double growth = 0.7;  // of the work with an operand's half-spaces; measured, as the levels
  /// Of all localized programs. Operands that go through the whole model stay in most pieces: then there are fewer regions.
  static constexpr std::size_t most_words = std::size_t{1} << 25;

  /// A node of the evaluation's own tree. Those below the regions are only looked at.
  struct Piece {
    Cell<D> cell;
    std::vector<Word> program;        // localized
    std::optional<HyperplaneId> cut;  // none: all is decided, or left as it is
    double weight = 0;                // estimate of the work, by what is undecided of each operand
    std::uint16_t level = 0;
    bool is_parted = false;
    std::size_t first_half = 0;  // 0: not made; the second one follows
  };

  const Network<D>& network_;
  unsigned level_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  std::deque<Piece> pieces_;
  std::size_t words_ = 0;  // of their programs
  Partition<D> result_;

  void add(Cell<D> cell, const std::vector<Word>& program, unsigned level) {
    Piece& piece = pieces_.emplace_back();
    piece.level = static_cast<std::uint16_t>(level);
    typename Localizer<D>::Cut cut;
    if (localizer_.fire(program, cell, piece.program, cut).label == geometry::Label::fuzzy) {
      for (const auto& operand : localizer_.undecided_operands(piece.program)) piece.weight += std::pow(static_cast<double>(operand.weight), growth);
      if (!cut.none && level < level_) piece.cut = cut.hyperplane;
      words_ += piece.program.size();
    }
    piece.cell = std::move(cell);
  }

  void halve(std::size_t at) {
    splitter_.classify(pieces_[at].cell, *pieces_[at].cut);
    Cell<D> negative, positive;
    splitter_.split(pieces_[at].cell, *pieces_[at].cut, &negative, &positive);
    pieces_[at].first_half = pieces_.size();
    add(std::move(negative), pieces_[at].program, pieces_[at].level + 1U);
    add(std::move(positive), pieces_[at].program, pieces_[at].level + 1U);
  }

  /// Estimate of the work on a piece: what is undecided some levels below it. Most pieces there will be looked at anyway.
  double work_of(std::size_t at, unsigned levels) {
    if (levels == 0 || !pieces_[at].cut) return pieces_[at].weight;
    if (pieces_[at].first_half == 0) {
      if (words_ > most_words) return pieces_[at].weight;
      halve(at);
    }
    const std::size_t half = pieces_[at].first_half;
    return work_of(half, levels - 1) + work_of(half + 1, levels - 1);
  }

  /// The regions from the negative side to the positive one. Each has the expression that was localized in the cell before the
  /// last cut, as a token has it: firing that is what its evaluation begins with. @return the child that the piece is.
  std::int32_t number(std::size_t at, const std::vector<Word>& program) {
    if (!pieces_[at].is_parted) {
      Piece& piece = pieces_[at];
      result_.work.push_back(at == 0 ? 0 : work_of(at, sampled_levels));
      result_.regions.push_back({static_cast<std::uint32_t>(result_.regions.size()), piece.level, std::move(piece.cell), program, {}});
      return ~static_cast<std::int32_t>(result_.regions.size() - 1);
    }
    const std::size_t node = result_.nodes.size();
    result_.nodes.push_back({*pieces_[at].cut, 0, 0});
    const std::int32_t negative = number(pieces_[at].first_half, pieces_[at].program), positive = number(pieces_[at].first_half + 1, pieces_[at].program);
    result_.nodes[node].negative = negative;
    result_.nodes[node].positive = positive;
    return static_cast<std::int32_t>(node);
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
Partition<D> partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits) {
  Partition<D> result;
  call_on_large_stack([&] { result = Partitioner<D>(network, limits).run(std::size_t{1} << depth); });
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
    if (at < 0) {
      result_.push_back({static_cast<std::uint32_t>(~at), static_cast<std::uint16_t>(level), std::move(cell), program, {}});
      return;
    }
    std::vector<Word> local;
    typename Localizer<D>::Cut unused;
    localizer_.fire(program, cell, local, unused);
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
  template Partition<D> partition<D>(const Network<D>&, unsigned, const PartitionLimits&);                                             \
  template std::vector<Region<D>> make_regions<D>(const Network<D>&, const Partition<D>&, std::span<const std::uint32_t>);             \
  template Cell<D> region_cell<D>(const Network<D>&, const Partition<D>&, std::uint32_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
