#include <bit>
#include <unordered_map>

#include "instantiate.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

template <int D>
dataflow::Partition<D> distribution(const dataflow::Network<D>& network, const RunOptions& options) {
  const unsigned regions = options.regions.value_or(1);
  return dataflow::partition(network, static_cast<unsigned>(std::bit_width(std::bit_ceil(std::max(1u, regions))) - 1));
}

template <int D>
geometry::BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition, dataflow::Evaluation<D>& evaluation) {
  geometry::BspTree tree = std::move(evaluation.tree);
  const auto first = static_cast<std::int32_t>(tree.nodes.size());
  const auto child = [&](std::int32_t code) { return code >= 0 ? first + code : evaluation.region_roots[static_cast<std::size_t>(~code)]; };
  for (const auto& node : partition.nodes) {
    const auto h = network.table.rounded(node.hyperplane);
    tree.nodes.push_back({static_cast<std::uint32_t>(tree.hyperplanes.size() / (D + 1)), child(node.negative), child(node.positive)});
    tree.hyperplanes.push_back(h.offset);
    tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
  }
  tree.root = child(partition.root);
  return tree;
}

#define BSP2_STAGE(D)                                                                                         \
  template dataflow::Partition<D> distribution<D>(const dataflow::Network<D>&, const RunOptions&);            \
  template geometry::BspTree join_trees<D>(const dataflow::Network<D>&, const dataflow::Partition<D>&, dataflow::Evaluation<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
