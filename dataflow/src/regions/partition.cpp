#include "bsp2/dataflow/regions/partition.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <condition_variable>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "evaluate/large_stack.hpp"

namespace bsp2::dataflow {

using geometry::Cell;
using geometry::HyperplaneId;

namespace {

constexpr double growth = 0.7;  // of the work with an operand's half-spaces; measured

/// Estimates of work are whole numbers: all that look at a piece must draw the same conclusions, also where
/// their libraries round `pow` otherwise.
using Work = std::uint64_t;
constexpr double unit_of_work = 0x1p-8;

Work power_of(std::size_t undecided) {
  return static_cast<Work>(std::llround(std::pow(static_cast<double>(undecided), growth) / unit_of_work));
}

Work work_on(std::size_t undecided) {
  static const auto few = [] {
    std::array<Work, 256> work;
    for (std::size_t i = 0; i < work.size(); ++i) work[i] = power_of(i);
    return work;
  }();
  return undecided < few.size() ? few[undecided] : power_of(undecided);
}

/// A node of the evaluation's own tree. Those below the regions are only looked at.
template <int D>
struct Piece {
  Cell<D> cell;
  Words program;                      // localized
  std::optional<HyperplaneId> cut;    // none: all is decided, or left as it is
  std::array<bool, 2> half_is_out{};  // as the cut tells, before the halves are looked at
  Work weight = 0;                    // estimate of the work, by what is undecided of each operand
  std::uint16_t level = 0;
  bool is_parted = false;
  bool is_elsewhere = false;                     // left to others
  std::array<std::unique_ptr<Piece>, 2> halves;  // negative, positive; none: not made

  /// What the evaluation would go on with in a half: nothing where the cut has told that it is OUT. To ask
  /// about it again would not do: in a narrower cell a round solid has other tangents, and may not know any
  /// more what the one that it was cut along has told.
  [[nodiscard]] std::span<const Word> program_of_half(std::size_t side) const {
    if (half_is_out[side]) return {};
    return program;
  }
};

/// What one thread looks at pieces with.
template <int D>
class Looker {
 public:
  Looker(const Network<D>& network, const PartitionLimits& limits)
      : level_(limits.level), splitter_(network.table), localizer_(network, splitter_) {
    localizer_.set_tolerance(limits.tolerance);
    localizer_.set_tolerance_shares(limits.tolerance_shares.get());
    if (limits.angle > 0) localizer_.set_view(limits.eye, limits.angle);
  }

  /// What the expression is in a piece's cell.
  void look(Piece<D>& piece, Cell<D> cell, std::span<const Word> program) {
    typename Localizer<D>::Cut cut;
    if (localizer_.fire(program, cell, piece.program, cut).label == geometry::Label::fuzzy) {
      for (const auto& operand : localizer_.undecided_operands(piece.program))
        piece.weight += work_on(operand.weight);
      if (!cut.none && piece.level < level_) {
        piece.cut = cut.hyperplane;
        piece.half_is_out = {cut.negative_is_out, cut.positive_is_out};
      }
    } else {
      piece.program.clear();
    }
    piece.cell = std::move(cell);
  }

  /// Makes the halves of a piece. @return the words of their programs; 0 if there were halves before.
  std::size_t halve(Piece<D>& whole) {
    if (whole.halves[0]) return 0;
    std::array<Cell<D>, 2> cells;
    splitter_.classify(whole.cell, *whole.cut);
    splitter_.split(whole.cell, *whole.cut, &cells[0], &cells[1]);
    std::size_t words = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      whole.halves[side] = std::make_unique<Piece<D>>();
      whole.halves[side]->level = static_cast<std::uint16_t>(whole.level + 1);
      look(*whole.halves[side], std::move(cells[side]), whole.program_of_half(side));
      words += whole.halves[side]->program.size();
    }
    return words;
  }

 private:
  unsigned level_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
};

/// Parts a piece into regions, always the one in which most is undecided. Their work is estimated in the end,
/// where that is asked for.
template <int D>
class District {
 public:
  /// @param words of programs that may be looked at.
  District(Looker<D>& looker, std::size_t words, unsigned sampled_levels)
      : looker_(looker), words_left_(words), sampled_levels_(sampled_levels) {}

  void part(Piece<D>& piece, std::size_t most_regions) {
    offer(piece);
    for (std::size_t regions = 1; regions < most_regions && !open_.empty(); ++regions) {
      Piece<D>& chosen = *open_.begin()->piece;
      if (!look_below(chosen)) break;  // enough was looked at
      open_.erase(open_.begin());
      chosen.is_parted = true;
      chosen.cell = {};
      for (auto& half : chosen.halves) offer(*half);
    }
    for (const Open& region : open_) sample(*region.piece, sampled_levels_);
  }

 private:
  /// A region that may be parted: the one with the most undecided first, of equals the one that was offered
  /// first.
  struct Open {
    Work work;
    std::size_t offer;
    Piece<D>* piece;
    bool operator<(const Open& other) const {
      return work != other.work ? work > other.work : offer < other.offer;
    }
  };
  Looker<D>& looker_;
  std::size_t words_left_;
  unsigned sampled_levels_;
  std::set<Open> open_;
  std::size_t offers_ = 0;

  void offer(Piece<D>& piece) {
    if (piece.cut) open_.insert({piece.weight, offers_++, &piece});
  }

  /// Sees to the halves of a piece that is to be cut, unless enough was looked at. @return whether there are
  /// some.
  bool look_below(Piece<D>& piece) {
    if (piece.halves[0]) return true;
    if (words_left_ == 0) return false;
    words_left_ -= std::min(words_left_, looker_.halve(piece));
    return true;
  }

  /// Estimate of the work on a piece, as `work_of`, for which it is looked at.
  Work sample(Piece<D>& piece, unsigned levels) {
    if (levels == 0 || !piece.cut || !look_below(piece)) return piece.weight;
    const Work negative = sample(*piece.halves[0], levels - 1),
               positive = sample(*piece.halves[1], levels - 1);
    return negative + positive;
  }
};

/// Estimate of the work on a piece: what is undecided some levels below it, as far as it was looked at.
template <int D>
Work work_of(const Piece<D>& piece, unsigned levels) {
  if (levels == 0 || !piece.cut || !piece.halves[0]) return piece.weight;
  return work_of(*piece.halves[0], levels - 1) + work_of(*piece.halves[1], levels - 1);
}

/// Cuts the space where its evaluation would cut it: from the root on each piece gives its halves shares of
/// its regions by their weights, until few are left, a district. Whoever looks at a piece needs nothing but
/// the way to it, so threads and shares take different ones.
template <int D>
class Partitioner {
 public:
  Partitioner(const Network<D>& network, const PartitionLimits& limits, unsigned threads,
              PartitionShare share)
      : network_(network), limits_(limits), threads_(std::max(1U, threads)), share_(share) {}

  /// On a large stack.
  PartitionPart<D> run(std::size_t most_regions) {
    regions_of_a_district_ =
        std::max<std::size_t>(least_regions_of_a_district, most_regions / most_districts);
    Looker<D> looker(network_, limits_);
    looker.look(root_, geometry::root_cell<D>(network_.table), network_.program);
    const std::size_t words = root_.program.size();
    if (most_regions > 1)
      add({&root_, most_regions, limits_.words - std::min(limits_.words, words), 0, share_.count});
    root_.is_elsewhere = most_regions == 1 && share_.index != 0;
    const std::size_t threads = std::min<std::size_t>(
        {threads_, most_regions,
         1 + words * static_cast<std::size_t>(std::bit_width(most_regions)) / words_of_a_thread});
    if (threads > 1)
      call_on_large_stacks(threads, [&](std::size_t) {
        Looker<D> own(network_, limits_);
        work(own);
      });
    else
      work(looker);
    write(root_, network_.program);
    return std::move(result_);
  }

 private:
  // Measured: with smaller districts regions differ more in their work, with fewer there is less to share.
  static constexpr std::size_t least_regions_of_a_district = 16, most_districts = 64;
  static constexpr std::size_t words_of_a_thread =
      16384;  // at least: starting one takes as long as looking at some hundred

  /// To part a piece.
  struct Task {
    Piece<D>* piece;
    std::size_t regions;                // at most
    std::size_t words;                  // of programs that may be looked at
    unsigned first_share, share_count;  // who does it
  };

  const Network<D>& network_;
  const PartitionLimits& limits_;
  std::size_t threads_, regions_of_a_district_ = 1;
  PartitionShare share_;
  Piece<D> root_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<Task> tasks_;
  std::size_t open_ = 0;  // tasks that wait or are worked on
  bool failed_ = false;
  PartitionPart<D> result_;

  void work(Looker<D>& looker) {
    try {
      while (auto task = next())
        for (; task; task = go_on(looker, *task)) {
        }
    } catch (...) {
      const std::lock_guard lock(mutex_);
      failed_ = true;
      changed_.notify_all();
      throw;
    }
  }

  std::optional<Task> next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return failed_ || open_ == 0 || !tasks_.empty(); });
    if (failed_ || tasks_.empty()) return std::nullopt;
    const Task task = tasks_.back();
    tasks_.pop_back();
    return task;
  }

  std::nullopt_t end() {
    const std::lock_guard lock(mutex_);
    if (--open_ == 0) changed_.notify_all();
    return std::nullopt;
  }

  void add(const Task& task) {
    const std::lock_guard lock(mutex_);
    tasks_.push_back(task);
    ++open_;
    changed_.notify_one();
  }

  /// @return what is left of the task for this thread.
  std::optional<Task> go_on(Looker<D>& looker, const Task& task) {
    Piece<D>& piece = *task.piece;
    if (piece.cut && task.regions > regions_of_a_district_ && task.words > 0) return part(looker, task);
    if (task.first_share == share_.index)
      District<D>(looker, task.words, limits_.sampled_levels).part(piece, task.regions);
    else
      leave_to_others(piece);
    return end();
  }

  /// Cuts a piece in two.
  std::optional<Task> part(Looker<D>& looker, const Task& task) {
    Piece<D>& piece = *task.piece;
    const std::size_t words = task.words - std::min(task.words, looker.halve(piece));
    piece.is_parted = true;
    piece.cell = {};
    const std::array<Task, 2> halves = halves_of(task, words);
    for (const Task& half : halves)
      if (!is_mine(half)) leave_to_others(*half.piece);
    if (is_mine(halves[0]) && is_mine(halves[1])) add(halves[1]);
    return is_mine(halves[0]) ? halves[0] : halves[1];
  }

  /// @param words that are left to look at.
  static std::array<Task, 2> halves_of(const Task& task, std::size_t words) {
    const auto& halves = task.piece->halves;
    const Work all = std::max<Work>(1, halves[0]->weight + halves[1]->weight);
    const auto part_of_first = [&](std::size_t whole)
        -> std::size_t {  // no half goes without, but where nothing is cut one is enough
      if (!halves[0]->cut) return 1;
      if (!halves[1]->cut) return whole - 1;
      return std::clamp<std::size_t>((whole * halves[0]->weight + all / 2) / all, 1, whole - 1);
    };
    Task first = task, second = task;
    first.piece = halves[0].get();
    second.piece = halves[1].get();
    first.regions = part_of_first(task.regions);
    second.regions = task.regions - first.regions;
    first.words = words / task.regions * first.regions;
    second.words = words / task.regions * second.regions;
    if (task.share_count > 1) {
      first.share_count = static_cast<unsigned>(part_of_first(task.share_count));
      second.share_count = task.share_count - first.share_count;
      second.first_share = task.first_share + first.share_count;
    }
    return {first, second};
  }

  [[nodiscard]] bool is_mine(const Task& task) const {
    return share_.index >= task.first_share && share_.index - task.first_share < task.share_count;
  }

  static void leave_to_others(Piece<D>& piece) {
    piece = {};
    piece.is_elsewhere = true;
  }

  /// The regions from the negative side to the positive one. Each has the expression that was localized in
  /// the cell before the last cut, as a token has it: firing that is what its evaluation begins with.
  void write(Piece<D>& piece, std::span<const Word> program) {
    using Kind = PartitionNode::Kind;
    if (piece.is_elsewhere) {
      result_.nodes.push_back({Kind::elsewhere, 0, 0});
    } else if (piece.is_parted) {
      result_.nodes.push_back({Kind::split, *piece.cut, 0});
      for (std::size_t side = 0; side < 2; ++side) write(*piece.halves[side], piece.program_of_half(side));
    } else {
      const Work work = &piece == &root_ ? 0 : work_of(piece, limits_.sampled_levels);
      result_.nodes.push_back({Kind::region, 0, static_cast<double>(work) * unit_of_work});
      result_.regions.push_back({static_cast<std::uint32_t>(result_.regions.size()),
                                 piece.level,
                                 std::move(piece.cell),
                                 {program.begin(), program.end()},
                                 {}});
    }
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
    planes += is_curved(producer.kind) ? planes_of_a_round
              : producer.kind == ProducerKind::mesh
                  ? static_cast<double>(network.meshes[producer.index].facets.size())
                  : static_cast<double>(producer.plane_count);
  return planes < planes_of_a_region
             ? 0
             : std::min(most, static_cast<unsigned>(std::log2(planes / planes_of_a_region)));
}

template <int D>
PartitionPart<D> part_of_partition(const Network<D>& network, unsigned depth, PartitionShare share,
                                   const PartitionLimits& limits, unsigned threads) {
  PartitionPart<D> result;
  call_on_large_stack(
      [&] { result = Partitioner<D>(network, limits, threads, share).run(std::size_t{1} << depth); });
  return result;
}

namespace {

/// Walks through all parts at once.
template <int D>
class PartJoiner {
 public:
  explicit PartJoiner(std::span<const std::vector<PartitionNode>> parts)
      : parts_(parts), next_(parts.size()) {}

  JoinedPartition<D> run() {
    std::vector<std::uint32_t> shares(parts_.size());
    std::iota(shares.begin(), shares.end(), 0U);
    result_.partition.root = join(std::move(shares));
    for (std::size_t i = 0; i < parts_.size(); ++i)
      if (next_[i] != parts_[i].size())
        throw std::invalid_argument("a part of a partition has more than one root");
    return std::move(result_);
  }

 private:
  std::span<const std::vector<PartitionNode>> parts_;
  std::vector<std::size_t> next_;  // node of each part
  JoinedPartition<D> result_;

  /// @param shares whose parts have this node, or the mark that others have it. @return the child.
  std::int32_t join(std::vector<std::uint32_t> shares) {
    using Kind = PartitionNode::Kind;
    std::erase_if(shares, [&](std::uint32_t share) {
      if (next_[share] == parts_[share].size())
        throw std::invalid_argument("a part of a partition is not complete");
      return parts_[share][next_[share]++].kind == Kind::elsewhere;
    });
    if (shares.empty()) throw std::invalid_argument("nobody has a part of the partition");
    const PartitionNode& node = parts_[shares.front()][next_[shares.front()] - 1];
    for (const std::uint32_t share : shares)
      if (parts_[share][next_[share] - 1] != node || (shares.size() > 1 && node.kind == Kind::region))
        throw std::invalid_argument("two have different parts of one partition, or the same");
    Partition<D>& partition = result_.partition;
    if (node.kind == Kind::region) {
      partition.work.push_back(node.work);
      result_.share_of_region.push_back(shares.front());
      return ~static_cast<std::int32_t>(partition.work.size() - 1);
    }
    const std::size_t at = partition.nodes.size();
    partition.nodes.push_back({node.hyperplane, 0, 0});
    const std::int32_t negative = join(shares), positive = join(std::move(shares));
    partition.nodes[at].negative = negative;
    partition.nodes[at].positive = positive;
    return static_cast<std::int32_t>(at);
  }
};

}  // namespace

template <int D>
JoinedPartition<D> join_parts(std::span<const std::vector<PartitionNode>> parts) {
  JoinedPartition<D> result;
  call_on_large_stack([&] { result = PartJoiner<D>(parts).run(); });
  return result;
}

template <int D>
Partition<D> partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits,
                       unsigned threads) {
  PartitionPart<D> whole = part_of_partition<D>(network, depth, {}, limits, threads);
  Partition<D> result = join_parts<D>(std::span(&whole.nodes, 1)).partition;
  result.regions = std::move(whole.regions);
  return result;
}

namespace {

/// For each node of a partition, and each of its regions, the node above it; -1 where there is none.
struct Parents {
  std::vector<std::int32_t> of_node, of_region;
};

template <int D>
Parents parents_in(const Partition<D>& partition) {
  constexpr std::int32_t not_there = -2;
  Parents parents{std::vector<std::int32_t>(partition.nodes.size(), not_there),
                  std::vector<std::int32_t>(partition.nodes.size() + 1, not_there)};
  const auto set = [&](std::int32_t child, std::int32_t parent) {
    (child < 0 ? parents.of_region.at(static_cast<std::size_t>(~child))
               : parents.of_node.at(static_cast<std::size_t>(child))) = parent;
  };
  set(partition.root, -1);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i)
    for (const std::int32_t child : {partition.nodes[i].negative, partition.nodes[i].positive})
      set(child, static_cast<std::int32_t>(i));
  return parents;
}

}  // namespace

template <int D>
void make_cells(const Network<D>& network, const Partition<D>& partition, std::span<Region<D>> regions) {
  const Parents parents = parents_in(partition);
  std::vector<bool> leads_there(partition.nodes.size());
  std::vector<Region<D>*> wanted(partition.nodes.size() + 1);
  for (Region<D>& region : regions) {
    if (region.number >= wanted.size())
      throw std::out_of_range("the partition has no region " + std::to_string(region.number));
    if (std::exchange(wanted[region.number], &region) != nullptr)
      throw std::invalid_argument("there are two regions of one number");
    for (std::int32_t at = parents.of_region[region.number];
         at >= 0 && !leads_there[static_cast<std::size_t>(at)];
         at = parents.of_node[static_cast<std::size_t>(at)])
      leads_there[static_cast<std::size_t>(at)] = true;
  }
  // What has been visited is wanted no more: the walk ends, whatever the nodes of a damaged partition name.
  const auto is_wanted = [&](std::int32_t child) {
    return child < 0 ? wanted[static_cast<std::size_t>(~child)] != nullptr
                     : leads_there[static_cast<std::size_t>(child)];
  };
  geometry::Splitter<D> splitter(network.table);
  std::vector<std::pair<std::int32_t, Cell<D>>> open;
  open.emplace_back(partition.root, regions.empty() ? Cell<D>() : geometry::root_cell<D>(network.table));
  while (!open.empty()) {
    auto [at, cell] = std::move(open.back());
    open.pop_back();
    if (!is_wanted(at)) continue;
    if (at < 0) {
      std::exchange(wanted[static_cast<std::size_t>(~at)], nullptr)->cell = std::move(cell);
      continue;
    }
    leads_there[static_cast<std::size_t>(at)] = false;
    const auto& node = partition.nodes[static_cast<std::size_t>(at)];
    std::array<Cell<D>, 2> halves;
    splitter.classify(cell, node.hyperplane);
    splitter.split(cell, node.hyperplane, is_wanted(node.negative) ? &halves[0] : nullptr,
                   is_wanted(node.positive) ? &halves[1] : nullptr);
    open.emplace_back(node.negative, std::move(halves[0]));
    open.emplace_back(node.positive, std::move(halves[1]));
  }
  for (const Region<D>* region : wanted)
    if (region != nullptr)
      throw std::out_of_range("the partition has no way to region " + std::to_string(region->number));
}

template <int D>
void add_regions(const Network<D>& network, Partition<D>& partition, std::vector<Region<D>> regions) {
  make_cells<D>(network, partition, regions);
  std::move(regions.begin(), regions.end(), std::back_inserter(partition.regions));
  std::sort(partition.regions.begin(), partition.regions.end(),
            [](const Region<D>& a, const Region<D>& b) { return a.number < b.number; });
}

#define BSP2_INSTANTIATE(D)                                                                          \
  template unsigned suggested_depth<D>(const Network<D>&);                                           \
  template PartitionPart<D> part_of_partition<D>(const Network<D>&, unsigned, PartitionShare,        \
                                                 const PartitionLimits&, unsigned);                  \
  template JoinedPartition<D> join_parts<D>(std::span<const std::vector<PartitionNode>>);            \
  template Partition<D> partition<D>(const Network<D>&, unsigned, const PartitionLimits&, unsigned); \
  template void make_cells<D>(const Network<D>&, const Partition<D>&, std::span<Region<D>>);         \
  template void add_regions<D>(const Network<D>&, Partition<D>&, std::vector<Region<D>>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
