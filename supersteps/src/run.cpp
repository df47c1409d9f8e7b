#include "bsp2/supersteps/run.hpp"

#include <sys/resource.h>

#include <algorithm>

#include "bsp2/geometry/error.hpp"
#include "exchange.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {
namespace {

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
  for (const std::string& warning : network.warnings) report.warnings.push_back(options.model.string() + ": " + warning);

  ranks.begin("distribution");
  auto [partition, rank_of_region] = distribution<D>(ranks, network, options);
  report.regions = static_cast<unsigned>(rank_of_region.size());

  ranks.begin("computation");
  Keeper keeper;
  std::vector<dataflow::Consumer*> consumers;
  if (options.collect_cells) consumers.push_back(&keeper);
  std::vector<std::uint32_t> mine;
  for (const auto& region : partition.regions) mine.push_back(region.number);
  auto evaluation = computation<D>(ranks, network, std::move(partition.regions), options, report.threads, consumers);
  ranks.count_cells(evaluation.totals.in_cells + evaluation.totals.fuzzy_cells + evaluation.totals.out_cells);

  ranks.begin("collection");
  fill(report, network, sum_totals(ranks, network, evaluation.totals), options);
  RunResult result;
  if (options.collect_cells) {
    Part part = keeper.take<D>(std::move(mine), std::move(evaluation));
    result.is_collected = collection(ranks, part, options.collect);
    ranks.count_cells(part.cells);
    std::vector<std::int32_t> leaves(rank_of_region.size()), roots(rank_of_region.size(), geometry::BspTree::empty_leaf);
    for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i] = ~static_cast<std::int32_t>(i + 1);
    for (std::size_t i = 0; i < part.regions.size(); ++i) roots[part.regions[i]] = part.roots[i];
    result.tree = join_trees<D>(network, partition, std::move(part.tree), roots);
    result.partition = join_trees<D>(network, partition, geometry::BspTree{.dimension = D}, leaves);
    result.mesh = {D, std::move(part.batches)};
  }
  result.rank_of_region = std::move(rank_of_region);

  if ((options.boundary || options.contacts) && result.is_collected) {
    ranks.begin("resolution");
    if (ranks.is_master()) {
      auto [contacts, boundary] = resolution<D>(network.table, result.mesh, options);
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
  report.supersteps = ranks.records();
  report.cpu_seconds = 0;
  report.peak_rss_bytes = 0;
  for (const Usage& usage : gather(ranks, usage_of_this_process())) {
    report.cpu_seconds += usage.cpu_seconds;
    report.peak_rss_bytes = std::max(report.peak_rss_bytes, usage.peak_rss_bytes);
  }
  report.seconds = ranks.seconds();
}

RunResult run(const RunOptions& options, Ranks& ranks) {
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
  record_costs(ranks, result.report);
  return result;
}

RunResult run(const RunOptions& options) {
  Ranks alone;
  return run(options, alone);
}

}  // namespace bsp2::supersteps
