#include "bsp2/supersteps/loop/run.hpp"

#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "loop/asking.hpp"
#include "loop/kept_boundary.hpp"
#include "loop/late_warnings.hpp"
#include "loop/looks.hpp"
#include "loop/measuring.hpp"
#include "loop/progress.hpp"
#include "loop/querying.hpp"
#include "loop/tracing.hpp"
#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {
namespace {

using Clock = std::chrono::steady_clock;

struct Usage {
  double cpu_seconds = 0;
  std::uint64_t peak_rss_bytes = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& cpu_seconds& peak_rss_bytes;
  }
};

Usage usage_of_this_process() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {seconds(usage.ru_utime) + seconds(usage.ru_stime),
          static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
}

template <int D>
void fill(RunReport& report, const dataflow::Network<D>& network, const dataflow::Totals<D>& totals,
          const RunOptions& options) {
  report.hyperplanes = network.table.size();
  report.in_cells = totals.in_cells;
  report.fuzzy_cells = totals.fuzzy_cells;
  if (options.keep_out) report.out_cells = totals.out_cells;
  static_cast<Measures&>(report) = measures_of(totals);
  for (std::size_t part = 0; part < network.parts.size(); ++part) {
    const auto& [name, colour] = network.parts[part];
    const double volume = part < totals.parts.size() ? totals.parts[part].value().volume() : 0;
    report.named_parts.push_back({static_cast<std::int32_t>(part), name, rounded(colour), volume});
  }
  report.level = totals.level;
  if (totals.in_cells > 0) {
    report.lower.assign(totals.lower.begin(), totals.lower.end());
    report.upper.assign(totals.upper.begin(), totals.upper.end());
    for (auto* corner : {&report.lower, &report.upper})
      for (double& x : *corner) x += 0.0;  // which of 0 and -0 came first is nothing to tell of
  }
  report.digest = totals.digest.hex();
  report.splits = totals.counts.splits;
  report.predicates = totals.counts.predicates;
  report.exact_fallbacks = totals.counts.exact_predicates;
}

/// Why the loop goes on or ends, the same on all ranks.
struct StepEnd {
  bool stopped = false, interrupted = false;  // on some rank
  std::uint64_t cells = 0;                    // on all ranks, undecided ones counted; where there is a limit
  bool last = false;
};

template <int D>
std::uint64_t finished_cells(const Progress<D>& progress) {
  return progress.totals.in_cells + progress.totals.fuzzy_cells + progress.totals.out_cells;
}

/// The cells of this rank if the run ended now.
template <int D>
std::uint64_t cells_now(const Progress<D>& progress, bool keep_out) {
  std::uint64_t cells = finished_cells(progress);
  for (const auto& region : progress.partition.regions) cells += region.cells_left(keep_out);
  return cells;
}

/// Whether there are about as many cells as were asked for: cells that turn out alike, and are given back as
/// one while the workers stop, do no harm.
bool are_enough(std::uint64_t cells, const RunOptions& options) {
  return options.cells && cells >= *options.cells - *options.cells / 64;
}

/// What all ranks say after a computation superstep. Collective.
template <int D>
StepEnd end_of_step(Ranks& ranks, const RunOptions& options, const Progress<D>& progress, bool stopped,
                    unsigned steps_done) {
  const bool interrupted = options.interrupted && options.interrupted();
  StepEnd end;
  const std::uint64_t cells = options.cells ? cells_now(progress, options.keep_out) : 0;
  for (const auto& answer : all_gather(ranks, std::vector<std::uint64_t>{stopped, interrupted, cells})) {
    end.stopped = end.stopped || answer[0] != 0;
    end.interrupted = end.interrupted || answer[1] != 0;
    end.cells += answer[2];
  }
  const unsigned only = options.budget_seconds && !options.snapshot && !options.on_frame ? 1 : ~0U;
  end.last = !end.stopped || end.interrupted || steps_done >= options.steps.value_or(only) ||
             are_enough(end.cells, options);
  end.interrupted = end.interrupted && end.stopped;
  return end;
}

/// The options of one computation superstep. Without a budget, a step that ends with a snapshot is long
/// against the time that the last one took to write.
RunOptions options_of_step(const RunOptions& options, double snapshot_seconds) {
  constexpr double shortest = 30, share = 20;
  RunOptions step = options;
  if (options.snapshot && !options.budget_seconds)
    step.budget_seconds = std::max(shortest, share * snapshot_seconds);
  return step;
}

/// Those of the options that whoever watches decides, for one superstep. Collective.
void steer(Ranks& ranks, const RunOptions& options, unsigned step, int dimension, RunOptions& of_step) {
  if (!options.steer) return;
  std::vector<double> said;  // order, whether there is a budget, the budget, and the eye
  if (ranks.is_master()) {
    const Steering steering = options.steer(step);
    said = {steering.order == Order::priority ? 1.0 : 0.0, steering.budget_seconds ? 1.0 : 0.0,
            steering.budget_seconds.value_or(0)};
    said.insert(said.end(), steering.eye.begin(), steering.eye.end());
  }
  broadcast(ranks, said);
  of_step.order = said.at(0) != 0 ? Order::priority : Order::depth;
  of_step.budget_seconds.reset();
  if (said.at(1) != 0) of_step.budget_seconds = said.at(2);
  if (options.angle) return;
  of_step.eye.assign(said.begin() + 3, said.end());
  if (of_step.eye.size() != static_cast<std::size_t>(dimension)) of_step.eye.clear();
}

/// A consumer of the computation: tells whoever watches of its cells.
class Teller : public dataflow::Consumer {
 public:
  explicit Teller(const RunOptions& options) : tell_(options.on_new_cells) {}
  void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override {
    if (tell_) tell_(std::shared_ptr<const geometry::CellBatch>(refinement, &refinement->cells));
  }
  [[nodiscard]] bool takes_cells() const override { return tell_ != nullptr; }

 private:
  const std::function<void(const std::shared_ptr<const geometry::CellBatch>&)>& tell_;
};

/// One round of a computation superstep: what it decides becomes progress, what is left stays in it.
template <int D>
Computed<D> compute(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
                    const RunOptions& options, unsigned threads, std::optional<std::uint64_t> quota,
                    CellStream* stream) {
  Teller teller(options);
  std::vector<dataflow::Consumer*> others;
  if (options.on_new_cells) others.push_back(&teller);
  const bool collects = options.collect_cells && (stream == nullptr || stream->holds_here());
  bool shall_move = false;
  const auto evaluate = [&](const Recorded& before, const std::vector<dataflow::Consumer*>& consumers) {
    auto computed = computation<D>(ranks, network, std::move(progress.partition.regions), options, threads,
                                   before, quota, stream, consumers);
    ranks.count_cells(computed.evaluation.totals.in_cells + computed.evaluation.totals.fuzzy_cells +
                      computed.evaluation.totals.out_cells);
    malloc_trim(0);  // what the workers held: the next supersteps need other sizes
    shall_move = computed.shall_move;
    return std::move(computed.evaluation);
  };
  auto evaluation = progress.take_in(progress.region_numbers(), collects, others, stream, evaluate);
  progress.partition.regions = std::move(evaluation.unfinished);
  return {std::move(evaluation), shall_move};
}

/// What ranks have done in the rounds of a step so far.
struct Rounds {
  double seconds = 0;        ///< of the slowest
  std::uint64_t cells = 0;   ///< undecided ones counted; where there is a limit
  unsigned unfinished = 0;   ///< ranks that have something left
  bool interrupted = false;  ///< on some rank

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& seconds& cells& unfinished& interrupted;
  }
};

/// All together. Collective. What a rank measured itself must not lead it another way than the others.
Rounds ask_all(Ranks& ranks, const Rounds& mine) {
  Rounds all;
  for (const Rounds& said : all_gather(ranks, mine)) {
    all.seconds = std::max(all.seconds, said.seconds);
    all.cells += said.cells;
    all.unfinished += said.unfinished;
    all.interrupted = all.interrupted || said.interrupted;
  }
  return all;
}

/// One computation superstep. It has several rounds if a rank has nothing left to do before the others, or
/// cells enough before all together have: then regions move. @param cells that all ranks have, undecided ones
/// counted, where there is a limit.
template <int D>
bool advance(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
             std::vector<std::int32_t>& rank_of_region, const RunOptions& options, std::uint64_t cells,
             unsigned threads, CellStream* stream) {
  const auto start = Clock::now();
  ++progress.steps;
  RunOptions round = options;
  for (auto active = static_cast<unsigned>(ranks.count());;) {
    std::optional<std::uint64_t> quota;
    if (options.cells) round.cells = *options.cells > cells ? *options.cells - cells : 0;
    if (round.cells) quota = std::max<std::uint64_t>(1, (*round.cells + active - 1) / active);
    const auto computed = compute(ranks, network, progress, round, threads, quota, stream);
    const bool stopped = computed.evaluation.stopped;
    if (ranks.count() == 1 || (!computed.shall_move && !options.cells)) return stopped;
    const bool unfinished = stopped && !progress.partition.regions.empty();
    const Rounds all = ask_all(ranks, {std::chrono::duration<double>(Clock::now() - start).count(),
                                       options.cells ? cells_now(progress, options.keep_out) : 0,
                                       unfinished ? 1U : 0U, options.interrupted && options.interrupted()});
    if (all.unfinished == 0 || all.interrupted ||
        (options.budget_seconds && all.seconds >= *options.budget_seconds) || are_enough(all.cells, options))
      return stopped;
    active = all.unfinished;
    if (options.budget_seconds) round.budget_seconds = *options.budget_seconds - all.seconds;
    cells = all.cells;
    if (!move_regions(ranks, network, progress, rank_of_region, options.level))
      round.move_after_seconds.reset();
  }
}

/// What is left becomes FUZZY cells: the end of a run.
template <int D>
void draw_rest(const dataflow::Network<D>& network, Progress<D>& progress, const RunOptions& options,
               unsigned threads, CellStream* stream) {
  if (progress.partition.regions.empty()) return;
  std::vector<dataflow::Consumer*> others;
  if (stream != nullptr) others.push_back(stream);
  progress.take_in(progress.region_numbers(), options.collect_cells, others, stream,
                   [&](const Recorded& before, const auto& consumers) {
                     return provisional_cells<D>(network, progress.partition.regions, options, threads,
                                                 before, consumers);
                   });
}

/// Cells go to the master while they are computed, if they are wanted there.
std::unique_ptr<CellStream> stream_of(Ranks& ranks, const RunOptions& options, RegionMeshes& meshes) {
  if (ranks.count() == 1 || !options.collect_cells || options.collect == Collect::file) return nullptr;
  const bool keeps = options.collect == Collect::automatic || options.snapshot || options.on_frame ||
                     options.boundary || options.contacts;
  auto stream = std::make_unique<CellStream>(ranks, options.collect, keeps);
  stream->begin(meshes);
  return stream;
}

/// Brings the cells to where they are wanted, and joins the trees above them. Collective.
template <int D>
RunResult collected(Ranks& ranks, const dataflow::Network<D>& network,
                    const dataflow::Partition<D>& partition, RegionMeshes meshes, Collect collect,
                    std::size_t regions, CellStream* stream = nullptr) {
  RunResult result;
  result.is_collected = collection(ranks, meshes, collect, stream);
  MergedMesh part = join(std::move(meshes), D, regions);
  malloc_trim(0);  // the regions' own trees
  ranks.count_cells(part.cells);
  std::vector<std::int32_t> leaves(regions);
  for (std::size_t i = 0; i < leaves.size(); ++i) leaves[i] = ~static_cast<std::int32_t>(i + 1);
  result.tree = join_trees<D>(network, partition, std::move(part.tree), part.roots);
  result.partition = join_trees<D>(network, partition, geometry::BspTree{.dimension = D}, leaves);
  result.mesh = {D, std::move(part.batches)};
  return result;
}

/// Whether all is decided, on all ranks. Collective.
template <int D>
bool is_nothing_left(Ranks& ranks, const Progress<D>& progress) {
  const auto left = all_gather(ranks, static_cast<std::uint64_t>(progress.partition.regions.size()));
  return std::all_of(left.begin(), left.end(), [](std::uint64_t regions) { return regions == 0; });
}

/// Writes the progress. @return how that failed, alike on all ranks: the run is worth going on with.
/// Collective.
template <int D>
std::optional<FailedOutput> try_to_save(Ranks& ranks, const dataflow::Network<D>& network,
                                        const Progress<D>& progress, const RunOptions& options,
                                        const Source& source, bool complete,
                                        const std::vector<SuperstepRecord>& earlier) {
  auto records = earlier;
  for (auto& record : ranks.records()) records.push_back(std::move(record));
  auto failed = attempt(ranks, [&] {
    ranks.agree([&] { ranks.begin("snapshot", progress.steps - 1); });
    try {
      save_progress(ranks, network, progress, options, source, complete, records);
    } catch (const io::RefusedSnapshot& refusal) {
      throw AgreedFailure(refusal.what(), true);
    }
  });
  if (failed) failed->file = *options.snapshot;
  return failed;
}

/// The snapshot that a run writes.
struct Saving {
  std::optional<FailedOutput> failure;  // of the last time
  bool is_saved = false;                // by this run, as it is now
  double seconds = 0;                   // that the last time took

  /// Collective.
  template <int D>
  void save(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress,
            const RunOptions& options, const Source& source, bool complete,
            const std::vector<SuperstepRecord>& earlier) {
    const auto start = Clock::now();
    failure = try_to_save(ranks, network, progress, options, source, complete, earlier);
    seconds = std::chrono::duration<double>(Clock::now() - start).count();
    is_saved = !failure;
  }
};

/// Glues the cells, if that is asked for and the boundary is not known already; what cannot be glued is told
/// in the report. Collective.
template <int D>
void resolve(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress, CellShare share,
             std::optional<TracedBoundary> traced, const RunOptions& options, RunResult& result) {
  if (traced) {
    result.boundary = std::move(traced->boundary);
    result.faces = std::move(traced->faces);
    return describe_boundary(result);
  }
  if (!options.collect_cells || (!options.boundary && !options.contacts)) return;
  const auto failed = attempt(ranks, [&] {
    ranks.agree([&] { ranks.begin("resolution"); });
    auto [contacts, boundary, faces, outlines] =
        resolution<D>(ranks, network, progress.partition, std::move(share), options, result.report.threads);
    result.contacts = std::move(contacts);
    result.boundary = std::move(boundary);
    result.faces = std::move(faces);
    result.outlines = std::move(outlines);
  });
  if (failed) result.report.failed.push_back({"the boundary: " + failed->text, failed->is_users});
  describe_boundary(result);
}

/// Of the cells, which are given up. Collective.
void make_complex(Ranks& ranks, const dataflow::Network<3>& network, const RunOptions& options,
                  RunResult& result) {
  ranks.agree([&] { ranks.begin("meshing"); });
  result.tree = geometry::BspTree{.dimension = 3};
  try {
    result.complex = meshing_cells(ranks, network.table, std::exchange(result.mesh.batches, {}), options,
                                   result.report.threads);
  } catch (const geometry::Interrupted&) {
    result.report.interrupted = true;
  }
  malloc_trim(0);
}

/// Whether nothing is asked for that only cells tell.
bool is_surface_enough(const RunOptions& options) {
  const bool needs_cells = options.resume || options.snapshot || options.on_frame || options.contacts ||
                           options.level || options.cells || options.steps || options.budget_seconds ||
                           options.keep_out || !options.keep_in || !options.points.empty();
  return options.surface_only && !needs_cells;
}

/// Whether meshes that overlap themselves are looked for when it is known which do not: finding the surface
/// proves that. Not where a warning ends the run before anything is found.
bool tells_overlaps_late(const RunOptions& options, int dimension) {
  return dimension == 3 && is_surface_enough(options) && !options.strict;
}

/// Before the warnings of who reads the model.
void tell_overlaps(const Source& source, const RunOptions& options,
                   std::span<const model::TriangleMesh* const> sound, RunReport& report) {
  model::MeshOverlaps overlaps = overlaps_in(source, options, report.threads, sound);
  const auto place = report.warnings.begin() + static_cast<std::ptrdiff_t>(source.warnings.size());
  report.warnings.insert(place, overlaps.warnings.begin(), overlaps.warnings.end());
  for (auto& [where, file, primitive, triangles, volume] : overlaps.meshes)
    report.overlapping_meshes.push_back({where, file, primitive, triangles, volume});
}

/// The meshes of a network whose surface was found without cells that were proven not to overlap themselves.
std::vector<const model::TriangleMesh*> sound_meshes(const dataflow::Network<3>& network) {
  std::vector<const model::TriangleMesh*> meshes;
  for (const auto& producer : network.producers)
    if (producer.kind == dataflow::ProducerKind::mesh && !producer.is_empty() &&
        network.meshes[producer.index].is_embedded)
      meshes.push_back(network.meshes[producer.index].source);
  return meshes;
}

/// The surface alone, where that can be done. Collective.
std::optional<RunResult> run_without_cells(Ranks& ranks, dataflow::Network<3>& network,
                                           const RunOptions& options, const Source& source,
                                           RunReport& report) {
  if (!is_surface_enough(options) || !dataflow::has_plain_facets(network)) return std::nullopt;
  std::optional<RunResult> result;
  if (const auto failed = attempt(ranks, [&] { result = tracing(ranks, network, options, report); })) {
    if (geometry::Interruption::is_wanted()) throw geometry::Interrupted();
    report.notes.push_back("the surface could not be found without cells (" + failed->text +
                           "), so cells were made");
    return std::nullopt;
  }
  if (!result || result->report.interrupted) return result;
  if (tells_overlaps_late(options, 3)) tell_overlaps(source, options, sound_meshes(network), result->report);
  Looks<3>(network, options.finds_rounds).add_to(*result, {});
  describe_boundary(*result);
  if (options.strict) refuse_late_warnings(ranks, result->report, source, options);
  if (options.on_cells) options.on_cells(*result);
  return result;
}

/// Whether gluing cells is known to take more than finding the boundary without them. Not where operands
/// share hyperplanes: there are few cells then for so many facets.
bool shall_trace(const dataflow::Network<3>& network) {
  std::size_t of_meshes = 0, others = 0;
  for (const auto& producer : network.producers) others += producer.plane_count;
  for (const auto& mesh : network.meshes) of_meshes += mesh.facets.size();
  const std::size_t hyperplanes = network.table.size();
  return others < std::max(of_meshes, hyperplanes + hyperplanes / 8);
}

/// The boundary, where it is found sooner without the cells that are made, too; if that fails it is found
/// from them. Collective.
std::optional<TracedBoundary> boundary_before_cells(Ranks& ranks, dataflow::Network<3>& network,
                                                    const RunOptions& options, unsigned threads) {
  const bool is_wanted = options.traces_boundary && options.boundary && options.collect_cells &&
                         options.keep_in && !options.contacts &&
                         !options.surface_only;  // which has been tried
  const bool has_limits =
      options.resume || options.level || options.cells || options.steps || options.budget_seconds;
  if (!is_wanted || has_limits || !dataflow::has_plain_facets(network) || !shall_trace(network))
    return std::nullopt;
  const auto hyperplanes = static_cast<geometry::HyperplaneId>(network.table.size());
  std::optional<TracedBoundary> traced;
  const auto failed = attempt(ranks, [&] { traced = trace_boundary(ranks, network, options, threads); });
  network.table.take_back(hyperplanes);
  if (failed && geometry::Interruption::is_wanted()) throw geometry::Interrupted();
  return failed ? std::nullopt : std::move(traced);
}

/// Shows what there is after a computation superstep; each rank shows the cells of its own regions. @return
/// how that failed, alike on all ranks. Collective.
template <int D>
std::optional<FailedOutput> show_frame(Ranks& ranks, const dataflow::Network<D>& network,
                                       const Progress<D>& progress, Looks<D>& looks,
                                       const RunOptions& options, unsigned threads,
                                       const std::vector<std::int32_t>& rank_of_region) {
  ranks.begin("rendering", progress.steps - 1);
  return attempt(ranks, [&] {
    RegionMeshes meshes;
    ranks.agree([&] {
      CollectingConsumer collector;
      dataflow::Consumer* const consumers[] = {&collector};
      meshes = progress.meshes;
      const Recorded before = recorded(meshes);
      auto rest =
          provisional_cells<D>(network, progress.partition.regions, options, threads, before, consumers);
      divide<D>(rest, progress.region_numbers(), before, collector.take(), meshes);
    });
    RunResult now = collected(ranks, network, progress.partition, std::move(meshes), Collect::file,
                              rank_of_region.size());
    now.report.dimension = D;
    looks.add_to(now, rank_of_region);
    now.report.tolerance = options.tolerance;
    options.on_frame(now, progress.steps - 1);
  });
}

/// The text is the master's, but the files that it imports, and fonts, each rank reads for itself. Regions of
/// different models would not fit together.
/// @throws bsp2::Error on all ranks, if not all have compiled the same.
template <int D>
void check_same_model(Ranks& ranks, const dataflow::Network<D>& network, const std::string& model) {
  if (ranks.count() == 1) return;
  const auto all = all_gather(ranks, std::to_string(D) + ' ' + hyperplane_digest(network) + ' ' +
                                         std::to_string(network.program.size()));
  const auto other = std::find_if(all.begin(), all.end(),
                                  [&](const std::string& compiled) { return compiled != all.front(); });
  if (other != all.end())
    throw Error(model + ": rank " + std::to_string(other - all.begin()) +
                " has compiled another solid than rank 0: the files that the model imports, or its fonts, "
                "differ there");
}

void tell_of_refinement(RunReport& report, const RunOptions& options) {
  report.tolerance = options.tolerance;
  report.tolerance_by_place = options.tolerance_shares != nullptr;
  report.angle = options.angle;
  report.eye = options.eye;
}

/// As if a step had ended. Collective.
template <int D>
StepEnd before_first_step(Ranks& ranks, const Progress<D>& progress, const RunOptions& options) {
  StepEnd end{.stopped = true, .last = options.steps == 0U};
  if (end.last) end.stopped = !is_nothing_left(ranks, progress);
  if (options.cells)
    for (const std::uint64_t cells : all_gather(ranks, cells_now(progress, options.keep_out)))
      end.cells += cells;
  return end;
}

/// Hands the cells to whoever wants them now, and gives them up.
void give_cells(const RunOptions& options, RunResult& result) {
  options.on_cells(result);
  result.mesh.batches.clear();
  result.tree = geometry::BspTree{.dimension = result.report.dimension};
}

/// The loop of supersteps.
template <int D>
RunResult run_supersteps(Ranks& ranks, RunOptions options, const Source& source, RunReport report) {
  const auto own = std::make_shared<dataflow::Network<D>>(translation<D>(source, options, report.threads));
  const std::shared_ptr<const dataflow::Network<D>> held = own;
  const dataflow::Network<D>& network = *held;
  check_same_model(ranks, network, report.model);
  options.faces = options.faces || (options.closes_parts && network.is_divided());
  limit_refinement(network, options);
  if (network.is_round()) tell_of_refinement(report, options);
  report.warnings.insert(report.warnings.end(), network.warnings.begin(), network.warnings.end());
  if (options.strict) refuse_warnings(report.warnings);

  if constexpr (D == 3)
    if (auto surface = run_without_cells(ranks, *own, options, source, report)) return std::move(*surface);
  if (tells_overlaps_late(options, D)) tell_overlaps(source, options, {}, report);

  std::optional<TracedBoundary> traced;
  if constexpr (D == 3)
    traced = options.resume ? kept_boundary(ranks, options, network.parts.size())
                            : boundary_before_cells(ranks, *own, options, report.threads);
  if (options.resume && traced && is_boundary_enough(options)) options.collect_cells = false;

  Looks<D> looks(network, options.finds_rounds);
  ranks.begin("distribution", 0, Phase::preparation);
  auto [progress, rank_of_region] =
      options.resume ? load_progress<D>(ranks, network, options)
                     : begin_progress<D>(network, distribution<D>(ranks, network, options, report.threads));
  report.regions = static_cast<unsigned>(progress.partition.nodes.size() + 1);
  progress.keeps_cells = options.collect_cells;
  const std::unique_ptr<CellStream> streamed = stream_of(ranks, options, progress.meshes);
  CellStream* const stream = streamed.get();

  Saving saving;
  std::optional<FailedOutput> frame_failure;  // of the first one
  bool saves_late = false;                    // when it is sure that nothing is refused
  StepEnd end = before_first_step(ranks, progress, options);
  for (unsigned step = 0; !end.last; ++step) {
    ranks.begin("computation", progress.steps, Phase::computation);
    if (progress.steps > 0) move_regions(ranks, network, progress, rank_of_region, options.level);
    RunOptions of_step = options_of_step(options, saving.seconds);
    steer(ranks, options, progress.steps, D, of_step);
    const bool stopped =
        advance(ranks, network, progress, rank_of_region, of_step, end.cells, report.threads, stream);
    coarsen(ranks, network, progress, options, report.threads, stream);
    end = end_of_step(ranks, options, progress, stopped, step + 1);
    saves_late = options.strict && options.snapshot && end.last && !end.interrupted &&
                 is_nothing_left(ranks, progress);
    if (options.snapshot && !saves_late)
      saving.save(ranks, network, progress, options, source, !end.stopped, report.earlier);
    if (options.on_frame && !end.interrupted) {
      auto failed = show_frame(ranks, network, progress, looks, options, report.threads, rank_of_region);
      if (failed && !frame_failure) frame_failure = std::move(failed);
    }
  }

  if (frame_failure)
    report.failed.push_back({"the pictures of the steps: " + frame_failure->text, frame_failure->is_users});
  ranks.begin("collection");
  // What is left is made again to be drawn, which may take as long as it took: too long for who interrupts.
  if (!end.interrupted) draw_rest(network, progress, options, report.threads, stream);
  fill(report, network, sum_totals(ranks, network, progress.totals), options);
  report.complete = !end.stopped;
  report.interrupted = end.interrupted;
  RunResult result;
  if (end.interrupted) {
    if (saving.failure) report.failed.push_back(*saving.failure);
    result.report = std::move(report);
    return result;
  }
  CellShare to_glue;
  if (options.collect_cells) {
    if ((options.boundary || options.contacts) && !traced)
      to_glue = share_of(ranks, progress.meshes, rank_of_region.size());
    RegionMeshes meshes = saves_late ? progress.meshes : std::move(progress.meshes);
    result = collected(ranks, network, progress.partition, std::move(meshes), options.collect,
                       rank_of_region.size(), stream);
  }
  looks.add_to(result, rank_of_region);

  if (!options.points.empty() && result.is_collected && ranks.is_master())
    result.answers = querying<D>(network.table, result, options.points, report.threads);
  result.report = std::move(report);
  if (options.strict) {
    resolve(ranks, network, progress, std::exchange(to_glue, {}), std::exchange(traced, {}), options, result);
    refuse_late_warnings(ranks, result.report, source, options);
    if (saves_late)
      saving.save(ranks, network, progress, options, source, result.report.complete, result.report.earlier);
  }
  if (saving.failure) result.report.failed.push_back(*saving.failure);
  if constexpr (D == 3)
    if (options.complex && ranks.count() > 1) make_complex(ranks, network, options, result);
  if (options.can_be_asked && options.collect_cells && (result.is_collected || options.complex) &&
      ranks.is_master())
    result.asked = asked<D>(held, progress.partition, result.report.threads);
  if (options.on_cells) give_cells(options, result);
  if (!options.strict)
    resolve(ranks, network, progress, std::move(to_glue), std::move(traced), options, result);
  if (D == 3 && options.boundary && saving.is_saved && result.report.complete)
    keep_boundary(ranks, options, std::max(1U, progress.steps) - 1, result);
  return result;
}

}  // namespace

std::optional<FailedOutput> attempt(const Ranks& ranks, const std::function<void()>& work) {
  try {
    work();
  } catch (const AgreedFailure& failure) {
    return FailedOutput{failure.what(), failure.is_users};
  } catch (...) {
    if (ranks.count() > 1) throw;
    const Cause cause = cause_of_exception();
    return FailedOutput{cause.text, cause.is_users};
  }
  return std::nullopt;
}

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
  options.collect_cells = options.collect_cells || options.snapshot || options.on_frame;
  ranks.begin("compilation", 0, Phase::preparation);
  Source source = compilation(ranks, options);
  ranks.begin("broadcast", 0, Phase::preparation);
  broadcasting(ranks, source);
  report.threads = threads_of(options, ranks);
  ranks.begin("compilation", 0, Phase::preparation);
  source = parsed(std::move(source), options);
  report.model = options.model.string();
  report.ranks = static_cast<unsigned>(ranks.count());
  report.dimension = source.model.expression.dimension();
  if (options.tolerance_shares && (options.angle || options.snapshot || options.resume))
    throw Error("a size field goes neither with an angle nor with snapshots");
  if (options.tolerance_shares && report.dimension != 3)
    throw Error("size fields are for models of 3 dimensions, this one has " +
                std::to_string(report.dimension));
  if (options.angle && options.eye.empty()) throw Error("an angle needs an eye from which it is seen");
  if (!options.eye.empty() && options.eye.size() != static_cast<std::size_t>(report.dimension))
    throw Error("the eye has " + counted(options.eye.size(), "# coordinate[s], the model has ") +
                counted(report.dimension, "# dimension[s]"));
  report.primitives = source.model.primitive_count;
  report.warnings = source.warnings;
  report.warnings.insert(report.warnings.end(), source.model.warnings.begin(), source.model.warnings.end());
  if (!tells_overlaps_late(options, report.dimension)) tell_overlaps(source, options, {}, report);
  if (options.strict) refuse_warnings(report.warnings);
  report.notes = source.model.notes;

  RunResult result = geometry::in_dimension(report.dimension, [&](auto dimension) {
    return run_supersteps<dimension()>(ranks, options, source, std::move(report));
  });
  result.keeps_in = options.keep_in;
  result.keeps_fuzzy = options.keep_fuzzy;
  result.keeps_out = options.keep_out;
  if (ranks.is_master() && !result.report.interrupted) {
    for (std::string& warning : late_warnings(result.report, source, options))
      result.report.warnings.push_back(std::move(warning));
  }
  try {
    if (ranks.is_master())
      result.report.measures = measuring(source.model.expression, options, result.report);
  } catch (const geometry::Interrupted&) {  // what is there already stays
  }
  record_costs(ranks, result.report);
  return result;
}

RunResult run(const RunOptions& options) {
  Ranks alone;
  return run(options, alone);
}

}  // namespace bsp2::supersteps
