#include "bsp2/supersteps/run.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "bsp2/geometry/error.hpp"
#include "exchange.hpp"
#include "progress.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {
namespace {

using Clock = std::chrono::steady_clock;

struct Usage {
  double cpu_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & cpu_seconds & peak_rss_bytes;
  }
};

Usage usage_of_this_process() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  return {seconds(usage.ru_utime) + seconds(usage.ru_stime), static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
}

template <int D>
void fill(RunReport& report, const dataflow::Network<D>& network, const dataflow::Totals<D>& totals, const RunOptions& options) {
  const auto in = totals.in.value();
  report.hyperplanes = network.table.size();
  report.in_cells = totals.in_cells;
  report.fuzzy_cells = totals.fuzzy_cells;
  if (options.keep_out) report.out_cells = totals.out_cells;
  report.in_volume = in.volume();
  report.fuzzy_volume = totals.fuzzy.value().volume();
  report.level = totals.level;
  for (int i = 1; i <= D && in.volume() > 0; ++i) report.centroid.push_back(in.integral[geometry::Moments<D>::index(0, i)] / in.volume());
  for (int i = 0; i <= D; ++i) {
    auto& row = report.inertia.emplace_back();
    for (int j = 0; j <= D; ++j) row.push_back(in.integral[geometry::Moments<D>::index(i, j)]);
  }
  const auto fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
  for (int i = 0; i <= D && totals.fuzzy_cells > 0; ++i) {
    auto &least = report.inertia_least.emplace_back(), &most = report.inertia_most.emplace_back();
    for (int j = 0; j <= D; ++j) {
      const int at = geometry::Moments<D>::index(i, j);
      least.push_back(in.integral[at] + below.integral[at]);
      most.push_back(in.integral[at] + fuzzy.integral[at] - below.integral[at]);
    }
  }
  if (totals.in_cells > 0) {
    report.lower.assign(totals.lower.begin(), totals.lower.end());
    report.upper.assign(totals.upper.begin(), totals.upper.end());
  }
  report.digest = totals.digest.hex();
  report.splits = totals.counts.splits;
  report.predicates = totals.counts.predicates;
  report.exact_fallbacks = totals.counts.exact_predicates;
}

/// Why the loop goes on or ends, the same on all ranks.
struct StepEnd {
  bool stopped = false, interrupted = false;  // on some rank
  std::uint64_t cells = 0;                    // finished, on all ranks
  bool last = false;
};

template <int D>
std::uint64_t finished_cells(const Progress<D>& progress) {
  return progress.totals.in_cells + progress.totals.fuzzy_cells + progress.totals.out_cells;
}

/// What all ranks say after a computation superstep. Collective.
template <int D>
StepEnd end_of_step(Ranks& ranks, const RunOptions& options, const Progress<D>& progress, bool stopped, unsigned steps_done) {
  const bool interrupted = options.interrupted && options.interrupted();
  StepEnd end;
  for (const auto& answer : all_gather(ranks, std::vector<std::uint64_t>{stopped, interrupted, finished_cells(progress)})) {
    end.stopped = end.stopped || answer[0] != 0;
    end.interrupted = end.interrupted || answer[1] != 0;
    end.cells += answer[2];
  }
  const unsigned only = options.budget_seconds && !options.snapshot ? 1 : ~0U;
  end.last = !end.stopped || end.interrupted || steps_done >= options.steps.value_or(only) || (options.cells && end.cells >= *options.cells);
  end.interrupted = end.interrupted && end.stopped;
  return end;
}

/// The options of one computation superstep. Without a budget, a step that ends with a snapshot is long against the time
/// that the last one took to write.
RunOptions options_of_step(const RunOptions& options, std::uint64_t cells, double snapshot_seconds) {
  constexpr double shortest = 30, share = 20;
  RunOptions step = options;
  if (options.snapshot && !options.budget_seconds) step.budget_seconds = std::max(shortest, share * snapshot_seconds);
  if (options.cells) step.cells = *options.cells > cells ? *options.cells - cells : 0;
  return step;
}

/// One computation superstep: what it decides becomes progress, what is left stays in it.
template <int D>
bool advance(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress, const RunOptions& options, unsigned threads) {
  Keeper keeper;
  std::vector<dataflow::Consumer*> consumers;
  if (options.collect_cells) consumers.push_back(&keeper);
  const std::vector<std::uint32_t> numbers = progress.region_numbers();
  auto evaluation = computation<D>(ranks, network, std::move(progress.partition.regions), options, threads, progress.recorded(), consumers);
  ranks.count_cells(evaluation.totals.in_cells + evaluation.totals.fuzzy_cells + evaluation.totals.out_cells);
  progress.partition.regions = std::move(evaluation.unfinished);
  ++progress.steps;
  const bool stopped = evaluation.stopped;
  progress.add(numbers, std::move(evaluation), keeper);
  return stopped;
}

/// What is left becomes FUZZY cells: the end of a run.
template <int D>
void draw_rest(const dataflow::Network<D>& network, Progress<D>& progress, const RunOptions& options, unsigned threads) {
  if (progress.partition.regions.empty()) return;
  Keeper keeper;
  std::vector<dataflow::Consumer*> consumers;
  if (options.collect_cells) consumers.push_back(&keeper);
  progress.add(progress.region_numbers(), picturing<D>(network, progress.partition.regions, options, threads, progress.recorded(), consumers), keeper);
}

/// Round solids are refined without end, so something has to say where: a thousandth of the model unless
/// the user does. A budget alone does not: depth first, it would be spent in one place.
template <int D>
void limit_refinement(const dataflow::Network<D>& network, RunOptions& options, RunReport& report) {
  if (!network.is_round()) return;
  if (!options.tolerance && !options.level) options.tolerance = std::ldexp(1.0, std::ilogb(network.table.width() / 1000));
  report.tolerance = options.tolerance;
}

/// The loop of supersteps.
template <int D>
RunResult run_supersteps(Ranks& ranks, RunOptions options, const Source& source, RunReport report) {
  const dataflow::Network<D> network = translation<D>(source, options);
  limit_refinement(network, options, report);
  for (const std::string& warning : network.warnings) report.warnings.push_back(report.model + ": " + warning);

  ranks.begin("distribution");
  auto [progress, rank_of_region] = options.resume ? load_progress<D>(ranks, network, options) : begin_progress<D>(network, distribution<D>(ranks, network, options));
  report.regions = static_cast<unsigned>(progress.partition.nodes.size() + 1);

  double snapshot_seconds = 0;
  StepEnd end{.stopped = true, .cells = finished_cells(progress), .last = options.steps == 0U};
  for (unsigned step = 0; !end.last; ++step) {
    ranks.begin("computation", progress.steps);
    const bool stopped = advance(ranks, network, progress, options_of_step(options, end.cells, snapshot_seconds), report.threads);
    end = end_of_step(ranks, options, progress, stopped, step + 1);
    if (options.snapshot) {
      auto records = report.earlier;
      for (auto& record : ranks.records()) records.push_back(std::move(record));
      ranks.begin("snapshot", progress.steps - 1);
      const auto start = Clock::now();
      save_progress(ranks, network, progress, options, source, !end.stopped, records);
      snapshot_seconds = std::chrono::duration<double>(Clock::now() - start).count();
    }
  }

  ranks.begin("collection");
  draw_rest(network, progress, options, report.threads);
  fill(report, network, sum_totals(ranks, network, progress.totals), options);
  report.complete = !end.stopped;
  report.interrupted = end.interrupted;
  RunResult result;
  if (options.collect_cells) {
    Part part = progress.take();
    result.is_collected = collection(ranks, part, options.collect);
    ranks.count_cells(part.cells);
    std::vector<std::int32_t> leaves(rank_of_region.size()), roots(rank_of_region.size(), geometry::BspTree::empty_leaf);
    for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i] = ~static_cast<std::int32_t>(i + 1);
    for (std::size_t i = 0; i < part.regions.size(); ++i) roots[part.regions[i]] = part.roots[i];
    result.tree = join_trees<D>(network, progress.partition, std::move(part.tree), roots);
    result.partition = join_trees<D>(network, progress.partition, geometry::BspTree{.dimension = D}, leaves);
    result.mesh = {D, std::move(part.batches)};
  }
  result.rank_of_region = std::move(rank_of_region);

  if ((options.boundary || options.contacts) && result.is_collected) {
    ranks.begin("resolution");
    if (ranks.is_master()) {
      auto [contacts, boundary] = resolution<D>(network.table, result.mesh, options, report.threads);
      result.contacts = std::move(contacts);
      result.boundary = std::move(boundary);
      if (result.boundary) report.boundary = {result.boundary->triangles.size(), result.boundary->area(), result.boundary->is_closed()};
    }
  }
  result.report = std::move(report);
  return result;
}

}  // namespace

void record_costs(Ranks& ranks, RunReport& report) {
  report.supersteps = report.earlier;
  for (auto& record : ranks.records()) report.supersteps.push_back(std::move(record));
  report.cpu_seconds = 0;
  report.peak_rss_bytes = 0;
  for (const Usage& usage : gather(ranks, usage_of_this_process())) {
    report.cpu_seconds += usage.cpu_seconds;
    report.peak_rss_bytes = std::max(report.peak_rss_bytes, usage.peak_rss_bytes);
  }
  report.seconds = ranks.seconds();
}

RunResult run(const RunOptions& given, Ranks& ranks) {
  RunReport report;
  RunOptions options = given.resume ? resumed_options(given, report.earlier) : given;
  options.collect_cells = options.collect_cells || options.snapshot;
  ranks.begin("compilation");
  Source source = compilation(ranks, options);
  ranks.begin("broadcast");
  broadcasting(ranks, source, options);
  report.model = options.model.string();
  report.ranks = static_cast<unsigned>(ranks.count());
  report.threads = options.threads != 0 ? options.threads : ranks.cores_of_a_rank();
  report.dimension = source.model.expression.dimension();
  report.primitives = source.model.primitive_count;
  report.warnings = source.model.warnings;

  ranks.begin("compilation");
  RunResult result;
  switch (report.dimension) {
    case 1: result = run_supersteps<1>(ranks, options, source, std::move(report)); break;
    case 2: result = run_supersteps<2>(ranks, options, source, std::move(report)); break;
    case 3: result = run_supersteps<3>(ranks, options, source, std::move(report)); break;
    case 4: result = run_supersteps<4>(ranks, options, source, std::move(report)); break;
    case 5: result = run_supersteps<5>(ranks, options, source, std::move(report)); break;
    case 6: result = run_supersteps<6>(ranks, options, source, std::move(report)); break;
    default: throw Error(report.model + ": solids of dimension 1 to 6 can be evaluated, not " + std::to_string(report.dimension));
  }
  record_costs(ranks, result.report);
  return result;
}

RunResult run(const RunOptions& options) {
  Ranks alone;
  return run(options, alone);
}

}  // namespace bsp2::supersteps
