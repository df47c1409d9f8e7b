#include "bsp2/supersteps/run.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <chrono>

#include "bsp2/geometry/error.hpp"
#include "exchange.hpp"
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

/// Adds up the CPU time of all ranks, and finds the largest of them.
void record_usage(Ranks& ranks, RunReport& report) {
  for (const Usage& usage : gather(ranks, usage_of_this_process())) {
    report.cpu_seconds += usage.cpu_seconds;
    report.peak_rss_bytes = std::max(report.peak_rss_bytes, usage.peak_rss_bytes);
  }
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
  if (totals.in_cells > 0) {
    report.lower.assign(totals.lower.begin(), totals.lower.end());
    report.upper.assign(totals.upper.begin(), totals.upper.end());
  }
  report.digest = totals.digest.hex();
  report.splits = totals.counts.splits;
  report.predicates = totals.counts.predicates;
  report.exact_fallbacks = totals.counts.exact_predicates;
}

/// The loop of supersteps.
template <int D>
RunResult run_supersteps(Ranks& ranks, const RunOptions& options, const Source& source, RunReport report) {
  const dataflow::Network<D> network = translation<D>(source, options);
  for (const std::string& warning : network.warnings) report.warnings.push_back(report.model + ": " + warning);

  ranks.begin("distribution");
  dataflow::Partition<D> partition = distribution<D>(ranks, network, options);
  report.regions = static_cast<unsigned>(partition.work.size());

  ranks.begin("computation");
  Collection collection;
  std::vector<dataflow::Consumer*> consumers;
  if (options.collect_cells) consumers.push_back(&collection);
  auto evaluation = computation<D>(ranks, network, std::move(partition.regions), options, report.threads, consumers);
  ranks.count_cells(evaluation.totals.in_cells + evaluation.totals.fuzzy_cells + evaluation.totals.out_cells);

  ranks.begin("collection");
  fill(report, network, sum_totals(ranks, network, evaluation.totals), options);
  RunResult result;
  result.mesh = collection.take(D);
  if (options.collect_cells) result.tree = join_trees<D>(network, partition, evaluation);
  result.report = std::move(report);
  return result;
}

}  // namespace

RunResult run(const RunOptions& options, Ranks& ranks) {
  const auto start = Clock::now();
  ranks.begin("compilation");
  Source source = compilation(ranks, options);
  ranks.begin("broadcast");
  broadcasting(ranks, source, options);
  RunReport report;
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
  result.report.supersteps = ranks.records();
  record_usage(ranks, result.report);
  result.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  return result;
}

RunResult run(const RunOptions& options) {
  Ranks alone;
  return run(options, alone);
}

}  // namespace bsp2::supersteps
