#include "bsp2/supersteps/loop/tables.hpp"

#include <string>
#include <utility>

#include "bsp2/api/evaluation/ranks.hpp"
#include "bsp2/api/evaluation/run_options.hpp"

namespace bsp2 {
namespace {

void check_in_range(const char* what, unsigned number, unsigned most) {
  if (number < 1 || number > most)
    throw Error(std::string(what) + " is " + std::to_string(number) + "; it takes 1 to " +
                std::to_string(most));
}

constexpr unsigned most_nodes = 4096;

void check_counts(const std::vector<unsigned>& node_counts) {
  if (node_counts.empty()) throw Error("no numbers of nodes are named");
  for (const unsigned count : node_counts) check_in_range("a number of nodes", count, most_nodes);
}

std::vector<NodeFigures> figures_of(const std::vector<supersteps::NodeFigures>& nodes) {
  std::vector<NodeFigures> figures;
  for (const auto& node : nodes)
    figures.push_back({node.cells, node.facets, node.splits, node.predicates, node.seconds});
  return figures;
}

}  // namespace

std::vector<ClusterTable> measure_tables(const Expression& expression,
                                         const std::vector<unsigned>& node_counts,
                                         const std::vector<std::optional<unsigned>>& levels, bool with_facets,
                                         const Options& options) {
  return guarded([&] {
    constexpr unsigned most_level = 65535;
    check_counts(node_counts);
    if (!options.size_field.empty()) throw Error("tables know no size_field");
    for (const auto& level : levels)
      if (level) check_in_range("a level", *level, most_level);
    std::vector<std::string> ignored;
    const auto run = run_options(expression, options, ignored);
    std::vector<ClusterTable> tables;
    for (auto& measured : supersteps::measure_tables(run, node_counts, levels, with_facets)) {
      ClusterTable& table = tables.emplace_back();
      table.level = measured.level;
      table.regions = measured.regions;
      table.distribution_seconds = std::move(measured.distribution_seconds);
      for (const auto& nodes : measured.nodes) table.nodes.push_back(figures_of(nodes));
    }
    return tables;
  });
}

std::vector<SurfaceTable> measure_surface(const Expression& expression,
                                          const std::vector<unsigned>& node_counts, const Options& options) {
  return guarded([&] {
    check_counts(node_counts);
    std::vector<std::string> ignored;
    std::vector<SurfaceTable> tables;
    using Figures = supersteps::SurfaceFigures;
    for (const Figures& measured :
         supersteps::measure_surface(run_options(expression, options, ignored), node_counts))
      tables.push_back({measured.nodes, Figures::mean(measured.tracing), Figures::most(measured.tracing),
                        Figures::mean(measured.resolution), Figures::most(measured.resolution),
                        measured.joining, measured.triangles});
    return tables;
  });
}

}  // namespace bsp2
