#include "bsp2/supersteps/run.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <thread>

#include "bsp2/geometry/error.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {
namespace {

using Clock = std::chrono::steady_clock;

/// Measures the time since the last lap: one lap a superstep.
class Stopwatch {
 public:
  double lap() {
    const auto now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  Clock::time_point last_ = Clock::now();
};

void record(RunReport& report, const std::string& name, double seconds, std::uint64_t cells = 0) {
  SuperstepRecord entry;
  entry.name = name;
  entry.seconds = {seconds};
  entry.bytes_sent = {0};
  entry.bytes_received = {0};
  entry.cells = {cells};
  entry.predicted_seconds = seconds;  // one rank communicates with nobody: w is all there is
  report.supersteps.push_back(entry);
}

void record_usage(RunReport& report) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); };
  report.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  report.peak_rss_bytes = static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
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

/// Passes progress on to the one who asked for it.
class ProgressConsumer : public dataflow::Consumer {
 public:
  explicit ProgressConsumer(const RunOptions& options) : options_(options) {}
  void consume(const std::shared_ptr<const dataflow::Refinement>&) override {}
  void progress(double done, std::uint64_t cells) override {
    if (options_.on_progress) options_.on_progress(done, cells);
  }

 private:
  const RunOptions& options_;
};

/// The loop of supersteps.
template <int D>
RunResult run_supersteps(const RunOptions& options, const model::Model& model, RunReport report, Stopwatch watch) {
  const dataflow::Network<D> network = compilation<D>(model, options);
  record(report, "compilation", watch.lap());

  dataflow::Partition<D> partition = distribution<D>(network, options);
  report.regions = static_cast<unsigned>(partition.regions.size());
  record(report, "distribution", watch.lap());

  Collection collection;
  ProgressConsumer progress(options);
  std::vector<dataflow::Consumer*> consumers{&progress};
  if (options.collect_cells) consumers.push_back(&collection);
  auto evaluation = computation<D>(network, std::move(partition.regions), options, report.threads, consumers);
  fill(report, network, evaluation.totals, options);
  record(report, "computation", watch.lap(), report.in_cells + report.fuzzy_cells + report.out_cells.value_or(0));

  RunResult result;
  result.mesh = collection.take(D);
  if (options.collect_cells) result.tree = join_trees<D>(network, partition, evaluation);
  record(report, "collection", watch.lap());

  if (options.boundary || options.contacts) {
    auto [contacts, boundary] = resolution<D>(network.table, result.mesh, options, report.threads);
    result.contacts = std::move(contacts);
    result.boundary = std::move(boundary);
    if (result.boundary) report.boundary = {result.boundary->triangles.size(), result.boundary->area(), result.boundary->is_closed()};
    record(report, "resolution", watch.lap(), report.in_cells);
  }
  result.report = std::move(report);
  return result;
}

}  // namespace

RunResult run(const RunOptions& options) {
  const auto start = Clock::now();
  Stopwatch watch;
  const model::Model model = model::read_csg(options.model);
  RunReport report;
  report.model = options.model.string();
  report.threads = options.threads != 0 ? options.threads : std::max(1u, std::thread::hardware_concurrency());
  report.dimension = model.expression.dimension();
  report.primitives = model.primitive_count;
  report.warnings = model.warnings;

  RunResult result;
  switch (report.dimension) {
    case 1: result = run_supersteps<1>(options, model, std::move(report), watch); break;
    case 2: result = run_supersteps<2>(options, model, std::move(report), watch); break;
    case 3: result = run_supersteps<3>(options, model, std::move(report), watch); break;
    case 4: result = run_supersteps<4>(options, model, std::move(report), watch); break;
    case 5: result = run_supersteps<5>(options, model, std::move(report), watch); break;
    case 6: result = run_supersteps<6>(options, model, std::move(report), watch); break;
    default: throw Error(report.model + ": solids of dimension 1 to 6 can be evaluated, not " + std::to_string(report.dimension));
  }
  result.report.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  record_usage(result.report);
  return result;
}

}  // namespace bsp2::supersteps
