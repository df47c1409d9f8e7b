#include "bsp2/supersteps/loop/tables.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <utility>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "stages/stages.hpp"
#include "state/evaluate_options.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;
using Batches = std::vector<std::shared_ptr<const CellBatch>>;

double facet_area(const CellBatch& batch, std::size_t cell, std::size_t facet) {
  const auto points = batch.cell_points(cell);
  const auto corners = batch.vertices_of_facet(facet);
  std::array<double, 3> sum{};
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const double *p = &points[3 * corners[i]], *q = &points[3 * corners[(i + 1) % corners.size()]];
    for (std::size_t k = 0; k < 3; ++k)
      sum[k] += (p[(k + 1) % 3] - q[(k + 1) % 3]) * (p[(k + 2) % 3] + q[(k + 2) % 3]);
  }
  return std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / 2;
}

/// Copies of cells, FUZZY ones as if they were IN: the matching glues IN cells only.
Batches all_in(const Batches& batches) {
  Batches result;
  for (const auto& batch : batches) {
    const auto copy = std::make_shared<CellBatch>(*batch);
    std::fill(copy->label.begin(), copy->label.end(), geometry::Label::in);
    result.push_back(copy);
  }
  return result;
}

/// Facets that other cells cover less than wholly. A figure for a table: areas are compared as rounded
/// numbers.
std::uint64_t count_boundary_facets(const geometry::HyperplaneTable<3>& table, const Batches& cells,
                                    unsigned threads) {
  const Batches batches = all_in(cells);
  const auto contacts = contacts_among(table, batches, threads);
  std::map<std::pair<std::uint64_t, std::uint16_t>, double> covered;
  for (const geometry::Contact& contact : contacts)
    for (const std::size_t side : {0U, 1U})
      covered[{contact.cell[side], contact.facet[side]}] += contact.area;
  std::uint64_t count = 0, number = 0;
  for (const auto& batch : batches) {
    for (std::size_t cell = 0; cell < batch->size(); ++cell, ++number) {
      for (std::size_t facet = 0; facet < batch->facet_count(cell); ++facet) {
        const auto found = covered.find({number, static_cast<std::uint16_t>(facet)});
        const double area = facet_area(*batch, cell, batch->facet_offset[cell] + facet);
        if (found == covered.end() || found->second < (1 - 1e-6) * area) ++count;
      }
    }
  }
  return count;
}

dataflow::EvaluateOptions evaluate_options(const RunOptions& options, std::optional<unsigned> level) {
  Ranks alone;
  dataflow::EvaluateOptions evaluate = limits_of(options, threads_of(options, alone));
  evaluate.level = level;
  return evaluate;
}

/// Processor time of all threads of this process.
double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// At least so many regions for each of the most nodes: cuts add no cells, and the regions' works are only
/// estimated beforehand.
constexpr unsigned regions_of_a_node = 8;

/// The superstep computation of one node, whose regions the distribution has made. The least of several
/// times, as what else the machine does only makes them longer.
template <int D>
NodeFigures measure_node(const dataflow::Network<D>& network, const std::vector<dataflow::Region<D>>& regions,
                         const dataflow::EvaluateOptions& options, bool with_facets) {
  constexpr int most_times = 5;
  constexpr double enough_seconds = 0.5;
  NodeFigures figures;
  CollectingConsumer collector;
  double spent = 0;
  for (int time = 0; time < most_times && spent < enough_seconds; ++time) {
    collector.take();  // of the time before
    std::vector<dataflow::Consumer*> consumers{&collector};
    std::vector<dataflow::Region<D>> begun;
    for (const auto& region : regions) begun.push_back(region.copy());
    const double start = processor_seconds();
    const auto evaluation = dataflow::evaluate(network, std::move(begun), options, consumers);
    const double seconds = processor_seconds() - start;
    spent += seconds;
    figures.seconds =
        time == 0 ? seconds / options.threads : std::min(figures.seconds, seconds / options.threads);
    figures.cells = evaluation.totals.in_cells + evaluation.totals.fuzzy_cells;
    figures.splits = evaluation.totals.counts.splits;
    figures.predicates = evaluation.totals.counts.predicates;
  }
  if constexpr (D == 3) {
    if (!with_facets) return figures;
    Batches batches;
    for (const auto& refinement : collector.take()) batches.emplace_back(refinement, &refinement->cells);
    figures.facets = count_boundary_facets(network.table, batches, options.threads);
  }
  return figures;
}

/// What a node's part of the distribution takes, on one thread: the most of several nodes, evenly chosen
/// among those that find regions.
template <int D>
double measure_distribution(const dataflow::Network<D>& network, const RunOptions& options, unsigned nodes) {
  constexpr unsigned most_measured = 8;
  const unsigned measured = std::min(nodes, most_measured);
  double most = 0;
  for (unsigned i = 0; i < measured; ++i) {
    bool is_idle = true;
    for (unsigned node = i * nodes / measured; is_idle && node < (i + 1) * nodes / measured; ++node) {
      const double start = processor_seconds();
      is_idle = part_of_distribution<D>(network, options, {node, nodes}, 1).regions.empty();
      most = std::max(most, processor_seconds() - start);
    }
  }
  return most;
}

template <int D>
Resolved measure_resolution(const dataflow::Network<D>& network, const RunOptions& options,
                            const std::vector<unsigned>& node_counts, std::optional<unsigned> level,
                            bool with_facets) {
  RunOptions of_level = options;
  of_level.level = level;
  const unsigned most_nodes = *std::max_element(node_counts.begin(), node_counts.end());
  if (!options.regions)
    of_level.regions = std::max(1U << dataflow::suggested_depth(network), regions_of_a_node * most_nodes);
  Ranks alone;
  const unsigned threads = threads_of(options, alone);
  const auto partition = distribution<D>(alone, network, of_level, threads, most_nodes).partition;
  Resolved result{level, static_cast<unsigned>(partition.work.size()), {}, {}};
  for (const unsigned count : node_counts) {
    result.distribution_seconds.push_back(measure_distribution<D>(network, of_level, count));
    // The regions are the same for any number of nodes, but few nodes do not look below them.
    const auto work = count == most_nodes
                          ? partition.work
                          : distribution<D>(alone, network, of_level, threads, count).partition.work;
    const auto owner = assign_regions(work, static_cast<int>(count));
    auto& nodes = result.nodes.emplace_back();
    for (unsigned node = 0; node < count; ++node) {
      std::vector<dataflow::Region<D>> regions;
      for (const auto& region : partition.regions)
        if (owner[region.number] == static_cast<std::int32_t>(node)) regions.push_back(region.copy());
      nodes.push_back(measure_node<D>(network, regions, evaluate_options(options, level), with_facets));
    }
  }
  return result;
}

/// Counts the cells of each level; its levels are the resolutions to show.
class Levels : public dataflow::Consumer {
 public:
  void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override {
    for (const std::uint16_t level : refinement->cells.level) {
      ++cells_[level];
      ++all_;
    }
  }
  /// The level above which a share of the cells lies.
  [[nodiscard]] unsigned quantile(double share) const {
    double below = 0;
    for (const auto& [level, count] : cells_) {
      below += static_cast<double>(count);
      if (below >= share * static_cast<double>(all_)) return std::max(1U, level);
    }
    return 1;
  }

 private:
  std::map<unsigned, std::uint64_t> cells_;
  std::uint64_t all_ = 0;
};

template <int D>
std::vector<Resolved> measure(const Source& source, RunOptions options,
                              const std::vector<unsigned>& node_counts,
                              std::vector<std::optional<unsigned>> levels, bool with_facets) {
  Ranks alone;
  const dataflow::Network<D> network = translation<D>(source, options, threads_of(options, alone));
  limit_refinement(network, options);
  if (levels.empty()) {
    Levels seen;
    std::vector<dataflow::Consumer*> consumers{&seen};
    dataflow::evaluate(network, dataflow::partition(network, 0).regions, evaluate_options(options, {}),
                       consumers);
    levels = {seen.quantile(0.05), seen.quantile(0.25), std::nullopt};
  }
  std::vector<Resolved> result;
  for (const auto& level : levels)
    result.push_back(measure_resolution<D>(network, options, node_counts, level, with_facets));
  return result;
}

}  // namespace

std::vector<Resolved> measure_tables(const RunOptions& options, const std::vector<unsigned>& node_counts,
                                     std::vector<std::optional<unsigned>> levels, bool with_facets) {
  Ranks alone;
  const Source source = parsed(compilation(alone, options), options);
  return geometry::in_dimension(source.model.expression.dimension(), [&](auto dimension) {
    return measure<dimension()>(source, options, node_counts, std::move(levels), with_facets);
  });
}

}  // namespace bsp2::supersteps
