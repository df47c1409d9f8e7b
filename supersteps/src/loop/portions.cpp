#include "bsp2/supersteps/loop/portions.hpp"

#include <algorithm>
#include <map>
#include <numeric>
#include <set>

#include "bsp2/dataflow/regions/archive.hpp"
#include "bsp2/dataflow/regions/coarsening.hpp"
#include "bsp2/dataflow/regions/portion.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "loop/progress.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace fs = std::filesystem;
namespace {

using dataflow::Frontier;
using dataflow::Region;

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw Error(std::string("'").append(path.string()).append("' ").append(why));
}

RunOptions options_of(const io::SnapshotHead& head) {
  RunOptions options;
  options.model = head.model;
  options.coincidence = head.coincidence;
  options.curved = head.curved;
  options.parts_by_colour = head.parts_by_colour;
  options.level = head.level;
  if (head.tolerance > 0) options.tolerance = head.tolerance;
  if (head.angle > 0) {
    options.angle = head.angle;
    options.eye = head.eye;
  }
  options.keep_in = head.keep_in;
  options.keep_fuzzy = head.keep_fuzzy;
  options.keep_out = head.keep_out;
  return options;
}

/// The model of a plan.
Source source_of(const io::SnapshotHead& head) {
  Source source;
  source.text = head.source;
  source.model = model::parse_csg(source.text, source_name(options_of(head)), {.curved = head.curved});
  return source;
}

template <int D>
dataflow::Network<D> network_of(const io::SnapshotHead& head, const Source& source, const fs::path& plan) {
  dataflow::Network<D> network = translation<D>(source, options_of(head));
  if (head.hyperplanes != hyperplane_digest(network))
    refuse(plan,
           "was written by a program that compiles its model differently; use that one, or split the model "
           "anew");
  return network;
}

std::uint64_t sum(const std::vector<std::uint64_t>& numbers) {
  return std::accumulate(numbers.begin(), numbers.end(), std::uint64_t{0});
}

PortionState state_of(const io::Snapshot& snapshot) {
  PortionState state;
  state.is_finished = snapshot.head.complete;
  state.cells = snapshot.head.in_cells;
  if (snapshot.head.keep_in && !snapshot.head.keep_out)  // regions that are one cell each, held for the merge
    state.cells += static_cast<std::uint64_t>(
        std::count(snapshot.frontier_tokens.begin(), snapshot.frontier_tokens.end(), 0U));
  state.undecided = sum(snapshot.frontier_tokens);
  state.open = sum(snapshot.frontier_open);
  for (const SuperstepRecord& record : records_of(snapshot.head))
    state.seconds += record.seconds.empty() ? 0 : record.seconds[0];
  return state;
}

/// Regions of a snapshot that are left, without their cells. @param wanted by their places in the frontier.
template <int D>
std::vector<Region<D>> regions_at(const io::Snapshot& snapshot, const std::vector<std::size_t>& wanted) {
  std::vector<Region<D>> regions;
  for (const std::size_t i : wanted)
    dataflow::from_bytes(std::span<const char>(snapshot.frontier_archive[i]), regions.emplace_back());
  return regions;
}

/// The regions of a divided portion with something to do, dealt out to two halves by their number of open
/// tokens. Those in which all has ended stay with the parent.
std::array<std::vector<std::size_t>, 2> dealt_regions(const io::Snapshot& parent) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < parent.frontier_region.size(); ++i)
    if (parent.frontier_open[i] > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return parent.frontier_open[a] > parent.frontier_open[b];
  });
  std::array<std::vector<std::size_t>, 2> halves;
  std::array<std::uint64_t, 2> load{};
  for (const std::size_t i : order) {
    const std::size_t half = load[1] < load[0] ? 1 : 0;
    halves[half].push_back(i);
    load[half] += parent.frontier_open[i];
  }
  return halves;
}

/// What a portion has to do, without cells.
template <int D>
std::vector<Region<D>> regions_of(const Portion& portion, const io::Snapshot& parent) {
  if (!parent.head.is_portion) {
    std::vector<std::size_t> wanted;
    for (const std::uint32_t number : portion.regions) {
      const auto& all = parent.frontier_region;  // in a plan all, in order
      const auto at = number < all.size() && all[number] == number
                          ? all.begin() + static_cast<std::ptrdiff_t>(number)
                          : std::find(all.begin(), all.end(), number);
      if (at == all.end()) refuse(portion.parent, "has no region " + std::to_string(number));
      wanted.push_back(static_cast<std::size_t>(at - all.begin()));
    }
    return regions_at<D>(parent, wanted);
  }
  const auto halves = dealt_regions(parent);
  const auto half = static_cast<std::size_t>(portion.half);
  const bool is_one_region = halves[1].empty();
  std::vector<Region<D>> regions = regions_at<D>(parent, halves[is_one_region ? 0 : half]);
  for (Region<D>& region : regions) {
    region.frontier = dataflow::separate_emitted(region.frontier)
                          .pending;  // its cells, and the tree over them, stay with the parent
    if (!is_one_region) continue;
    if (auto parts = dataflow::divide(region.frontier))
      region.frontier = std::move((*parts)[half]);
    else if (half == 1)
      return {};
  }
  return regions;
}

template <int D>
void set_totals(io::SnapshotHead& head, const dataflow::Totals<D>& totals) {
  head.in_cells = totals.in_cells;
  head.out_cells = totals.out_cells;
  head.in_volume = totals.in.value().volume();
  head.digest = totals.digest.hex();
  head.totals = dataflow::to_bytes(totals);
}

/// How many tokens there are to go on with.
template <int D>
std::uint64_t open_of(const std::vector<Region<D>>& regions) {
  std::uint64_t open = 0;
  for (const auto& region : regions) open += dataflow::remains_of(region.frontier).open;
  return open;
}

/// From the plan to the result of a portion.
template <int D>
io::Snapshot evaluated(const dataflow::Network<D>& network, const io::SnapshotHead& plan,
                       const Portion& portion, const io::Snapshot& parent, const RunOptions& given) {
  RunOptions options = options_of(plan);
  options.order = given.order;
  options.budget_seconds = given.budget_seconds;
  options.cells = given.cells;
  options.interrupted = given.interrupted;
  Progress<D> progress(network);
  progress.partition = partition_of<D>(plan);
  progress.partition.regions = regions_of<D>(portion, parent);
  dataflow::make_cells<D>(network, progress.partition, progress.partition.regions);

  Ranks alone;
  const unsigned threads = threads_of(given, alone);
  alone.begin("computation", 0, Phase::computation);
  bool stopped = true;
  while (stopped) {
    auto evaluation = progress.take_in(
        progress.region_numbers(), true, {}, nullptr, [&](const Recorded& before, const auto& consumers) {
          return computation<D>(alone, network, std::move(progress.partition.regions), options, threads,
                                before, options.cells, nullptr, consumers)
              .evaluation;
        });
    progress.partition.regions = std::move(evaluation.unfinished);
    const std::uint64_t open = open_of(progress.partition.regions);
    stopped = evaluation.stopped && open > 0;
    if ((options.interrupted && options.interrupted()) || open > 1) break;
  }
  alone.count_cells(progress.totals.in_cells);

  io::Snapshot result;
  result.head = plan;
  result.head.source.clear();  // the plan has it, and the partition
  result.head.partition_hyperplane.clear();
  result.head.partition_children.clear();
  forget_records(result.head);  // they are of the plan
  result.head.is_portion = true;
  result.head.steps = 1;
  result.head.complete = !stopped;
  set_totals(result.head, progress.totals);
  append_records(result.head, alone.records());
  add_share(result, progress);
  return result;
}

/// Puts results together: of each region, cells and trees one after the other and frontiers over each other.
template <int D>
class Joiner {
 public:
  Joiner(const fs::path& plan_path, const io::Snapshot& plan, const std::vector<JoinedPortion>& portions)
      : plan_path_(plan_path),
        plan_(plan),
        portions_(portions),
        network_(network_of<D>(plan.head, source_of(plan.head), plan_path)),
        progress_(network_) {
    head_ = plan.head;
    head_.complete = true;
    progress_.partition = partition_of<D>(plan.head);
    times_.name = "computation";
  }

  io::Snapshot run() {
    for (const JoinedPortion& portion : portions_) {
      if (portion.result)
        take(*portion.result);
      else
        leave(portion);
    }
    return finish();
  }

 private:
  const fs::path& plan_path_;
  const io::Snapshot& plan_;
  const std::vector<JoinedPortion>& portions_;
  dataflow::Network<D> network_;
  io::SnapshotHead head_;
  Progress<D> progress_;
  std::vector<std::uint32_t> finished_;
  std::map<std::uint32_t, Region<D>> left_;
  SuperstepRecord times_;  // a value a portion

  void take(const fs::path& result) {
    const io::Snapshot part = io::read_snapshot(result);
    if (!part.head.is_portion || part.head.hyperplanes != plan_.head.hyperplanes || part.head.dimension != D)
      refuse(result, "is no result of this plan");
    dataflow::Totals<D> totals(network_.table.radius(), network_.table.width());
    dataflow::from_bytes(std::span<const char>(part.head.totals), totals);
    progress_.totals += totals;
    std::map<std::uint32_t, Recorded> begin;  // of this portion's nodes and cells, by regions
    const std::set<std::uint32_t> unfinished(part.frontier_region.begin(), part.frontier_region.end());
    for (const auto& [number, mesh] : meshes_of<D>(part)) {
      begin[number] = append(progress_.meshes[number], mesh);
      if (!unfinished.contains(number)) finished_.push_back(number);
    }
    std::vector<std::size_t> all(part.frontier_region.size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    std::vector<Region<D>> regions = regions_at<D>(part, all);
    for (std::size_t k = 0; k < regions.size(); ++k) {
      Frontier& frontier = regions[k].frontier;
      const bool has_heirs = !part.head.complete && part.frontier_open[k] > 0;  // what is undecided is theirs
      if (has_heirs) frontier = dataflow::separate_emitted(frontier).emitted;
      for (Frontier::Node& node : frontier.nodes)
        if (node.kind == Frontier::Kind::emitted)
          node.value = shifted(node.value, begin[regions[k].number].nodes, begin[regions[k].number].cells);
      lay(std::move(regions[k]));
    }
    count_time(part);
  }

  void leave(const JoinedPortion& missing) {
    head_.complete = false;
    const io::Snapshot parent = missing.parent
                                    ? io::read_snapshot(missing.portion.parent, io::SnapshotPart::frontier)
                                    : io::Snapshot();
    for (Region<D>& region : regions_of<D>(missing.portion, missing.parent ? parent : plan_))
      lay(std::move(region));
  }

  void lay(Region<D> region) {
    const auto& nodes = region.frontier.nodes;
    if (nodes.size() == 1 && nodes[0].kind == Frontier::Kind::elsewhere) return;
    const auto [place, is_new] = left_.try_emplace(region.number, std::move(region));
    if (!is_new) place->second.frontier = dataflow::overlay(place->second.frontier, region.frontier);
  }

  void count_time(const io::Snapshot& part) {
    for (const SuperstepRecord& record : records_of(part.head)) {
      if (record.seconds.empty()) continue;
      times_.seconds.push_back(record.seconds[0]);
      times_.work_seconds.push_back(record.work_seconds[0]);
      times_.bytes_sent.push_back(0);
      times_.bytes_received.push_back(0);
      times_.cells.push_back(record.cells[0]);
      times_.predicted_seconds = std::max(times_.predicted_seconds, record.work_seconds[0]);
    }
  }

  io::Snapshot finish() {
    std::vector<Region<D>> whole_regions;  // as the plan has them: their cells are made again, all at once
    std::vector<unsigned> seen(plan_.head.partition_hyperplane.size() + 1);
    for (const std::uint32_t region : finished_) ++seen.at(region);
    for (auto& [number, region] : left_) {
      ++seen.at(number);
      if (dataflow::remains_of(region.frontier).elsewhere > 0)
        refuse(plan_path_,
               "and its results do not fit (part of region " + std::to_string(number) + " is missing)");
      auto& regions = dataflow::uniform_region_of(region) ? whole_regions : progress_.partition.regions;
      regions.push_back(std::move(region));
    }
    if (std::any_of(seen.begin(), seen.end(), [](unsigned count) { return count != 1; }))
      refuse(plan_path_, "and its results do not fit (a region is missing, or there twice)");
    dataflow::add_regions(network_, progress_.partition, std::move(whole_regions));
    Ranks alone;
    alone.begin("computation", 0, Phase::computation);
    coarsen(alone, network_, progress_, options_of(plan_.head), alone.cores_of_a_rank(), nullptr);
    set_partition(head_, progress_.partition);
    head_.steps = 1;
    set_totals(head_, progress_.totals);
    if (!times_.seconds.empty()) append_records(head_, {times_});
    io::Snapshot whole;
    whole.head = std::move(head_);
    add_share(whole, progress_);
    return whole;
  }
};

}  // namespace

std::vector<RegionWork> make_plan(const RunOptions& given, const fs::path& plan) {
  Ranks alone;
  RunOptions options = given;
  options.snapshot = plan;
  alone.begin("compilation", 0, Phase::preparation);
  const unsigned threads = threads_of(options, alone);
  const Source source = parsed(compilation(alone, options), options);
  std::vector<double> work = geometry::in_dimension(source.model.expression.dimension(), [&](auto dimension) {
    constexpr int D = dimension();
    const dataflow::Network<D> network = translation<D>(source, options, threads);
    if (options.strict)
      for (const auto& warnings : {source.warnings, overlaps_in(source, options, threads).warnings,
                                   source.model.warnings, network.warnings})
        refuse_warnings(warnings);
    limit_refinement(network, options);
    alone.begin("distribution", 0, Phase::preparation);
    Distribution<D> regions = distribution<D>(alone, network, options, threads);
    std::vector<double> estimates = regions.partition.work;
    const auto started = begin_progress<D>(network, std::move(regions));
    save_progress(alone, network, started.first, options, source, false, alone.records());
    return estimates;
  });
  std::vector<RegionWork> regions;
  for (std::uint32_t region = 0; region < work.size(); ++region) regions.push_back({region, work[region]});
  std::stable_sort(regions.begin(), regions.end(),
                   [](const RegionWork& a, const RegionWork& b) { return a.work > b.work; });
  return regions;
}

PortionState read_portion(const fs::path& result) {
  const io::Snapshot snapshot = io::read_snapshot(result, io::SnapshotPart::head);
  if (!snapshot.head.is_portion) refuse(result, "is no result of a job");
  return state_of(snapshot);
}

class PortionEvaluator::Implementation {
 public:
  virtual ~Implementation() = default;
  virtual io::Snapshot evaluate(const Portion& portion, const RunOptions& options) = 0;
};

namespace {

template <int D>
class EvaluatorOf : public PortionEvaluator::Implementation {
 public:
  EvaluatorOf(const fs::path& path, io::Snapshot plan)
      : path_(path),
        plan_(std::move(plan)),
        source_(source_of(plan_.head)),
        network_(network_of<D>(plan_.head, source_, path)) {}

  io::Snapshot evaluate(const Portion& portion, const RunOptions& options) override {
    if (portion.parent == path_) return evaluated<D>(network_, plan_.head, portion, plan_, options);
    return evaluated<D>(network_, plan_.head, portion,
                        io::read_snapshot(portion.parent, io::SnapshotPart::frontier), options);
  }

 private:
  fs::path path_;
  io::Snapshot plan_;
  Source source_;
  dataflow::Network<D> network_;
};

}  // namespace

PortionEvaluator::PortionEvaluator(const fs::path& plan) {
  io::Snapshot snapshot = io::read_snapshot(plan, io::SnapshotPart::frontier);
  if (snapshot.head.is_portion) refuse(plan, "is no plan");
  implementation_ =
      geometry::in_dimension(snapshot.head.dimension, [&](auto dimension) -> std::unique_ptr<Implementation> {
        return std::make_unique<EvaluatorOf<dimension()>>(plan, std::move(snapshot));
      });
}

PortionEvaluator::~PortionEvaluator() = default;

PortionState PortionEvaluator::evaluate(const Portion& portion, const RunOptions& options,
                                        const fs::path& result) {
  const io::Snapshot snapshot = implementation_->evaluate(portion, options);
  io::write_snapshot(result, snapshot);
  return state_of(snapshot);
}

void join_portions(const fs::path& plan, const std::vector<JoinedPortion>& portions,
                   const fs::path& snapshot) {
  const io::Snapshot start = io::read_snapshot(plan, io::SnapshotPart::frontier);
  io::Snapshot whole;
  try {
    whole = geometry::in_dimension(start.head.dimension, [&](auto dimension) {
      return Joiner<dimension()>(plan, start, portions).run();
    });
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // archives and numbers that checksums cannot guard against
    refuse(plan, std::string("and its results do not fit (") + error.what() + ")");
  }
  io::write_snapshot(snapshot, whole);
}

}  // namespace bsp2::supersteps
