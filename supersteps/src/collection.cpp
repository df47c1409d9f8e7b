#include <algorithm>

#include "bsp2/geometry/dimensions.hpp"
#include "exchange.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

void Collection::consume(const std::shared_ptr<const dataflow::Refinement>& refinement) { refinements_.push_back(refinement); }

SolidMesh Collection::take(int dimension) {
  std::sort(refinements_.begin(), refinements_.end(), [](const auto& a, const auto& b) {
    return a->worker != b->worker ? a->worker < b->worker : a->first < b->first;
  });
  SolidMesh mesh;
  mesh.dimension = dimension;
  for (const auto& refinement : refinements_) mesh.batches.emplace_back(refinement, &refinement->cells);
  refinements_.clear();
  return mesh;
}

template <int D>
dataflow::Totals<D> sum_totals(Ranks& ranks, const dataflow::Network<D>& network, const dataflow::Totals<D>& totals) {
  dataflow::Totals<D> sum(network.table.radius(), network.table.width());
  sum.reset_bounds();
  for (const auto& part : gather(ranks, totals, sum)) sum += part;
  return sum;
}

template <int D>
geometry::BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition, dataflow::Evaluation<D>& evaluation) {
  geometry::BspTree tree = std::move(evaluation.tree);
  const auto first = static_cast<std::int32_t>(tree.nodes.size());
  const auto child = [&](std::int32_t code) { return code >= 0 ? first + code : evaluation.region_roots[static_cast<std::size_t>(~code)]; };
  for (const auto& node : partition.nodes) {
    const auto h = network.table.rounded(node.hyperplane);
    tree.nodes.push_back({static_cast<std::uint32_t>(tree.hyperplanes.size() / (D + 1)), child(node.negative), child(node.positive)});
    tree.ids.push_back(node.hyperplane);
    tree.hyperplanes.push_back(h.offset);
    tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
  }
  tree.root = child(partition.root);
  return tree;
}

#define BSP2_STAGE(D)                                                                                                               \
  template dataflow::Totals<D> sum_totals<D>(Ranks&, const dataflow::Network<D>&, const dataflow::Totals<D>&);                      \
  template geometry::BspTree join_trees<D>(const dataflow::Network<D>&, const dataflow::Partition<D>&, dataflow::Evaluation<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
