#include "bsp2/supersteps/loop/tables.hpp"

#include "evaluation/ranks.hpp"
#include "evaluation/run_options.hpp"

namespace bsp2 {
namespace {

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
    if (node_counts.empty()) throw Error("no numbers of nodes are named");
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

}  // namespace bsp2
