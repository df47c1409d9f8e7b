#include "bsp2/supersteps/collection.hpp"

#include <algorithm>
#include <boost/serialization/utility.hpp>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/dimensions.hpp"
#include "bsp2/io/vtu.hpp"
#include "exchange.hpp"
#include "stages.hpp"

namespace boost::serialization {
template <>
struct is_bitwise_serializable<bsp2::geometry::BspTree::Node> : mpl::true_ {};
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using geometry::BspTree;
using geometry::CellBatch;

/// All of a part but its cells.
struct Forest {
  std::vector<std::uint32_t>& regions;
  std::vector<std::int32_t>& roots;
  BspTree& tree;
  Recorded& elsewhere;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & regions & roots & tree.dimension & tree.nodes & tree.ids & tree.hyperplanes & elsewhere.nodes & elsewhere.cells;
  }
};

/// Batches travel one by one, the trees follow them.
void send(Ranks& ranks, int to, Part part) {
  for (auto& batch : part.batches) {
    ranks.send(to, dataflow::to_bytes(*batch));
    batch = nullptr;
  }
  ranks.send(to, dataflow::to_bytes(Forest{part.regions, part.roots, part.tree, part.elsewhere}));
}

/// Shifts a child of a BSP node of a part to where its node or cell is in the whole; what the master has from a resumed
/// snapshot stays where it is.
std::int32_t shifted(std::int32_t child, const Part& part, const Part& whole, std::size_t nodes) {
  if (child == BspTree::empty_leaf) return child;
  const std::int64_t number = child >= 0 ? child : ~child;  // of a node, or of a cell from 1 on
  if (child >= 0 ? number < part.elsewhere.nodes : number <= part.elsewhere.cells) return child;
  const std::int64_t moved = child >= 0 ? number - part.elsewhere.nodes + whole.elsewhere.nodes + static_cast<std::int64_t>(nodes)
                                        : ~(number - part.elsewhere.cells + whole.elsewhere.cells + static_cast<std::int64_t>(whole.cells));
  if (moved > std::numeric_limits<std::int32_t>::max() || moved < std::numeric_limits<std::int32_t>::min())
    throw std::length_error("a BSP tree of more than 2^31 nodes or cells; --collect file needs none");
  return static_cast<std::int32_t>(moved);
}

void append(Part& whole, Part part) {
  const std::size_t nodes = whole.tree.nodes.size();
  const auto width = static_cast<std::size_t>(whole.tree.dimension) + 1;
  const auto hyperplanes = static_cast<std::uint32_t>(whole.tree.hyperplanes.size() / width);
  for (const BspTree::Node& node : part.tree.nodes)
    whole.tree.nodes.push_back({node.hyperplane + hyperplanes, shifted(node.negative, part, whole, nodes), shifted(node.positive, part, whole, nodes)});
  whole.tree.ids.insert(whole.tree.ids.end(), part.tree.ids.begin(), part.tree.ids.end());
  whole.tree.hyperplanes.insert(whole.tree.hyperplanes.end(), part.tree.hyperplanes.begin(), part.tree.hyperplanes.end());
  for (const std::int32_t root : part.roots) whole.roots.push_back(shifted(root, part, whole, nodes));
  whole.regions.insert(whole.regions.end(), part.regions.begin(), part.regions.end());
  std::move(part.batches.begin(), part.batches.end(), std::back_inserter(whole.batches));
  whole.cells += part.cells;
}

/// What arrived, each sender's batches and then its trees.
void receive(const Ranks& ranks, Part& whole) {
  Part part;
  const auto& messages = ranks.received();
  for (std::size_t i = 0; i < messages.size(); ++i) {
    const bool is_last = i + 1 == messages.size() || messages[i + 1].source != messages[i].source;
    if (is_last) {
      Forest forest{part.regions, part.roots, part.tree, part.elsewhere};
      dataflow::from_bytes(messages[i].bytes, forest);
      append(whole, std::exchange(part, {}));
    } else {
      const auto batch = std::make_shared<CellBatch>();
      dataflow::from_bytes(messages[i].bytes, *batch);
      part.cells += batch->size();
      part.batches.push_back(batch);
    }
  }
}

void to_master(Ranks& ranks, Part& part) {
  if (!ranks.is_master()) send(ranks, 0, std::exchange(part, {}));
  ranks.sync();
  receive(ranks, part);
}

/// In each round every second of those that still hold cells hands them to its neighbour: the order of ranks remains.
void up_a_tree(Ranks& ranks, Part& part) {
  for (int stride = 1; stride < ranks.count(); stride *= 2) {
    if (ranks.rank() % (2 * stride) == stride) send(ranks, ranks.rank() - stride, std::exchange(part, {}));
    ranks.sync();
    receive(ranks, part);
  }
}

Collect decide(Ranks& ranks, const Part& part, Collect how) {
  if (how != Collect::automatic) return how;
  std::uint64_t cells = 0;
  for (const std::uint64_t count : gather(ranks, part.cells)) cells += count;
  bool is_small = cells <= cells_of_a_master;
  broadcast(ranks, is_small);
  return is_small ? Collect::master : Collect::file;
}

}  // namespace

template <int D>
Part Keeper::take(std::vector<std::uint32_t> regions, dataflow::Evaluation<D> evaluation) {
  std::sort(refinements_.begin(), refinements_.end(), [](const auto& a, const auto& b) {
    return a->worker != b->worker ? a->worker < b->worker : a->first < b->first;
  });
  Part part;
  for (const auto& refinement : refinements_) {
    part.batches.emplace_back(refinement, &refinement->cells);
    part.cells += refinement->cells.size();
  }
  refinements_.clear();
  part.regions = std::move(regions);
  part.roots = std::move(evaluation.region_roots);
  part.tree = std::move(evaluation.tree);
  return part;
}

bool collection(Ranks& ranks, Part& part, Collect how) {
  if (ranks.count() == 1) return true;
  how = decide(ranks, part, how);
  if (how == Collect::master) to_master(ranks, part);
  if (how == Collect::tree) up_a_tree(ranks, part);
  return how != Collect::file;
}

template <int D>
dataflow::Totals<D> sum_totals(Ranks& ranks, const dataflow::Network<D>& network, const dataflow::Totals<D>& totals) {
  dataflow::Totals<D> sum(network.table.radius(), network.table.width());
  sum.reset_bounds();
  for (const auto& part : gather(ranks, totals, sum)) sum += part;
  return sum;
}

template <int D>
BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition, BspTree tree,
                   const std::vector<std::int32_t>& roots) {
  tree.dimension = D;
  const auto first = static_cast<std::int32_t>(tree.nodes.size());
  const auto child = [&](std::int32_t code) { return code >= 0 ? first + code : roots[static_cast<std::size_t>(~code)]; };
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

void write_mesh(Ranks& ranks, const RunResult& result, const std::filesystem::path& pvtu, bool tets) {
  ranks.begin("collection");
  io::VtuOptions options;
  options.tets = tets;
  options.rank_of_region = result.rank_of_region;
  for (const auto& colour : result.colour_of_part) options.colour_of_part.push_back(colour.value_or(uncoloured));
  options.other_colour = uncoloured;
  io::VtuShare share(pvtu, result.report.dimension, result.mesh.batches, options);
  const auto size = share.size();
  io::VtuShare::Size all;
  std::uint64_t before = 0;
  const auto shares = all_gather(ranks, std::pair(size.pieces, size.has_polyhedra));
  for (std::size_t rank = 0; rank < shares.size(); ++rank) {
    if (rank < static_cast<std::size_t>(ranks.rank())) before += shares[rank].first;
    all.pieces += shares[rank].first;
    all.has_polyhedra = all.has_polyhedra || shares[rank].second;
  }
  share.write(before, all);
  ranks.sync();  // now all have written theirs
  share.publish();
  ranks.sync();
  if (ranks.is_master()) share.finish();
}

#define BSP2_STAGE(D)                                                                                                               \
  template Part Keeper::take<D>(std::vector<std::uint32_t>, dataflow::Evaluation<D>);                                               \
  template dataflow::Totals<D> sum_totals<D>(Ranks&, const dataflow::Network<D>&, const dataflow::Totals<D>&);                      \
  template BspTree join_trees<D>(const dataflow::Network<D>&, const dataflow::Partition<D>&, BspTree, const std::vector<std::int32_t>&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
