#include "bsp2/dataflow/partition.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <iterator>
#include <optional>
#include <set>
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

/// Cuts the space where its evaluation would cut it, always the region with the most work. That is one after the other; what each cut
/// asks for, the pieces below its halves, several threads look at beforehand. No result depends on which of them did, or whether.
template <int D>
class Partitioner {
 public:
  Partitioner(const Network<D>& network, const PartitionLimits& limits, unsigned threads) : network_(network), level_(limits.level), most_words_(limits.words) {
    for (unsigned i = 0; i < std::max(1U, threads); ++i) tools_.emplace_back(network, limits);
  }

  Partition<D> run(std::size_t most_regions) {
    look(tools_.front(), pieces_.emplace_back(), geometry::root_cell<D>(network_.table), network_.program);
    words_ = pieces_.front().program.size();
    std::set<Open> open;
    std::size_t offers = 0;
    const auto offer = [&](std::size_t piece) {
      if (pieces_[piece].cut) open.insert({work_of(piece, sampled_levels), offers++, piece});
    };
    if (most_regions > 1) {
      look_below({0}, sampled_levels);
      offer(0);
    }
    for (std::size_t regions = 1; regions < most_regions && !open.empty(); ++regions) {
      const std::size_t chosen = open.begin()->piece;
      if (!pieces_[chosen].is_counted) break;  // enough was looked at
      if (!pieces_[chosen].is_foreseen) look_ahead(open, most_regions - regions);
      open.erase(open.begin());
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
  static constexpr std::size_t foreseen_cuts = 8;         // at a time for each thread, so that there is something to share
  static constexpr std::size_t words_of_a_thread = 4096;  // at least: starting one takes as long as looking at some hundred

  /// A node of the evaluation's own tree. Those below the regions are only looked at.
  struct Piece {
    Cell<D> cell;
    std::vector<Word> program;        // localized
    std::optional<HyperplaneId> cut;  // none: all is decided, or left as it is
    double weight = 0;                // estimate of the work, by what is undecided of each operand
    std::uint16_t level = 0;
    bool is_parted = false;
    bool is_counted = false;     // its halves' words are
    bool is_foreseen = false;    // what parting it asks for has been made
    std::size_t first_half = 0;  // 0: not made; the second one follows
  };

  /// A region that may be parted: the one with the most work first, of equals the one that was offered first.
  struct Open {
    double work;
    std::size_t offer;
    std::size_t piece;
    bool operator<(const Open& other) const { return work != other.work ? work > other.work : offer < other.offer; }
  };

  /// What one thread looks at pieces with.
  struct Tools {
    geometry::Splitter<D> splitter;
    Localizer<D> localizer;
    Tools(const Network<D>& network, const PartitionLimits& limits) : splitter(network.table), localizer(network, splitter) {
      localizer.set_tolerance(limits.tolerance);
      if (limits.angle > 0) localizer.set_view(limits.eye, limits.angle);
    }
  };

  const Network<D>& network_;
  unsigned level_;
  std::size_t most_words_;
  std::deque<Tools> tools_;
  std::deque<Piece> pieces_;
  std::size_t words_ = 0;  // of the programs of those that were asked for
  Partition<D> result_;

  /// What the expression is in a piece's cell.
  void look(Tools& tools, Piece& piece, Cell<D> cell, const std::vector<Word>& program) const {
    typename Localizer<D>::Cut cut;
    if (tools.localizer.fire(program, cell, piece.program, cut).label == geometry::Label::fuzzy) {
      for (const auto& operand : tools.localizer.undecided_operands(piece.program)) piece.weight += std::pow(static_cast<double>(operand.weight), growth);
      if (!cut.none && piece.level < level_) piece.cut = cut.hyperplane;
    } else {
      piece.program.clear();
    }
    piece.cell = std::move(cell);
  }

  /// @param side 0 for the negative half of a piece, 1 for the positive one.
  void make_half(Tools& tools, std::size_t of, std::size_t side) {
    const Piece& whole = pieces_[of];
    Cell<D> half;
    tools.splitter.classify(whole.cell, *whole.cut);
    tools.splitter.split(whole.cell, *whole.cut, side == 0 ? &half : nullptr, side == 1 ? &half : nullptr);
    look(tools, pieces_[whole.first_half + side], std::move(half), whole.program);
  }

  void halve(const std::vector<std::size_t>& wholes) {
    for (const std::size_t at : wholes) {
      pieces_[at].first_half = pieces_.size();
      for (int side = 0; side < 2; ++side) pieces_.emplace_back().level = static_cast<std::uint16_t>(pieces_[at].level + 1);
    }
    const std::size_t count = 2 * wholes.size();
    std::size_t words = 0;
    for (const std::size_t at : wholes) words += 2 * pieces_[at].program.size();
    std::atomic<std::size_t> next{0};
    const auto make_some = [&](std::size_t thread) {
      for (std::size_t i = next++; i < count; i = next++) make_half(tools_[thread], wholes[i / 2], i % 2);
    };
    if (const std::size_t threads = std::min({tools_.size(), count, words / words_of_a_thread}); threads > 1)
      call_on_large_stacks(threads, make_some);
    else
      make_some(0);
  }

  /// Makes what the estimate of the work on pieces asks for. One thread makes it when it is asked for.
  void look_below(std::vector<std::size_t> pieces, unsigned levels) {
    if (tools_.size() == 1 || words_ > most_words_) return;
    for (; levels > 0 && !pieces.empty(); --levels) {
      std::erase_if(pieces, [&](std::size_t at) { return !pieces_[at].cut; });
      std::vector<std::size_t> wholes, halves;
      std::copy_if(pieces.begin(), pieces.end(), std::back_inserter(wholes), [&](std::size_t at) { return pieces_[at].first_half == 0; });
      halve(wholes);
      for (const std::size_t at : pieces) halves.insert(halves.end(), {pieces_[at].first_half, pieces_[at].first_half + 1});
      pieces = std::move(halves);
    }
  }

  /// Makes what the next cuts will ask for, if the regions with the most work now are parted. Most of them will be.
  void look_ahead(const std::set<Open>& open, std::size_t cuts_left) {
    std::vector<std::size_t> pieces;
    for (auto region = open.begin(); region != open.end() && pieces.size() < std::min(foreseen_cuts * tools_.size(), cuts_left); ++region) {
      pieces_[region->piece].is_foreseen = true;
      pieces.push_back(region->piece);
    }
    look_below(std::move(pieces), sampled_levels + 1);
  }

  /// Estimate of the work on a piece: what is undecided some levels below it. Most pieces there will be looked at anyway.
  double work_of(std::size_t at, unsigned levels) {
    if (levels == 0 || !pieces_[at].cut) return pieces_[at].weight;
    if (!pieces_[at].is_counted) {
      if (words_ > most_words_) return pieces_[at].weight;
      if (pieces_[at].first_half == 0) halve({at});
      for (std::size_t side = 0; side < 2; ++side) words_ += pieces_[pieces_[at].first_half + side].program.size();
      pieces_[at].is_counted = true;
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
    planes += producer.round >= 0 || producer.torus >= 0 || producer.spline >= 0 || producer.preimage >= 0 ? planes_of_a_round
              : producer.mesh < 0 ? static_cast<double>(producer.plane_count)
                                  : static_cast<double>(network.meshes[static_cast<std::size_t>(producer.mesh)].facets.size());
  return planes < planes_of_a_region ? 0 : std::min(most, static_cast<unsigned>(std::log2(planes / planes_of_a_region)));
}

template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits, unsigned threads) {
  Partition<D> result;
  call_on_large_stack([&] { result = Partitioner<D>(network, limits, threads).run(std::size_t{1} << depth); });
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
  template Partition<D> partition<D>(const Network<D>&, unsigned, const PartitionLimits&, unsigned);                                   \
  template std::vector<Region<D>> make_regions<D>(const Network<D>&, const Partition<D>&, std::span<const std::uint32_t>);             \
  template Cell<D> region_cell<D>(const Network<D>&, const Partition<D>&, std::uint32_t);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
