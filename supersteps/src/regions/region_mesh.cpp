#include "regions/region_mesh.hpp"

#include <malloc.h>

#include <algorithm>
#include <limits>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::BspTree;
using geometry::CellBatch;

constexpr std::size_t cells_of_a_batch = 4096, cells_of_a_trim = 32768;

/// Cells of an evaluation by their number; a batch is given back when all of it has been copied.
class CellSource {
 public:
  explicit CellSource(std::vector<std::shared_ptr<const dataflow::Refinement>> refinements)
      : refinements_(std::move(refinements)) {
    std::uint64_t cells = 0;
    for (const auto& refinement : refinements_) {
      first_.push_back(cells);
      left_.push_back(refinement->cells.size());
      cells += refinement->cells.size();
    }
  }

  /// Copies the cells of one region, as many at a time as lie in one batch.
  std::vector<std::shared_ptr<const CellBatch>> copy(std::span<const Assignment::Run> runs, int dimension) {
    std::vector<std::shared_ptr<const CellBatch>> batches;
    std::shared_ptr<CellBatch> batch;
    const auto close = [&] {
      if (!batch) return;
      batch->shrink_to_fit();
      batches.push_back(std::move(batch));
      batch = nullptr;
    };
    for (Assignment::Run run : runs)
      while (run.count > 0) {
        if (!batch) {
          batch = std::make_shared<CellBatch>();
          batch->dimension = dimension;
        }
        const auto source = static_cast<std::size_t>(
                                std::upper_bound(first_.begin(), first_.end(), run.first) - first_.begin()) -
                            1;
        const std::uint64_t cell = run.first - first_.at(source);
        if (!refinements_[source] || cell >= refinements_[source]->cells.size())
          throw std::out_of_range("cells are dealt that do not exist");
        const CellBatch& from = refinements_[source]->cells;
        const std::uint64_t count =
            std::min({run.count, from.size() - cell, std::uint64_t{cells_of_a_batch - batch->size()}});
        batch->append(from, cell, count);
        run.first += count;
        run.count -= count;
        left_[source] -= std::min(count, left_[source]);
        if (left_[source] == 0) give_back(source);
        if (batch->size() == cells_of_a_batch) close();
      }
    close();
    return batches;
  }

 private:
  std::vector<std::shared_ptr<const dataflow::Refinement>> refinements_;
  std::vector<std::uint64_t> first_, left_;  // of each: its first cell, cells that nobody has taken
  std::size_t given_back_ = 0;               // cells, since memory was returned to the system

  /// All cells are there twice at no time: what is freed between arrays in use goes back, too.
  void give_back(std::size_t source) {
    given_back_ += refinements_[source]->cells.size();
    refinements_[source] = nullptr;
    if (given_back_ < cells_of_a_trim) return;
    malloc_trim(0);
    given_back_ = 0;
  }
};

/// Moves subtrees of an evaluation's tree into those of the regions.
class Grafter {
 public:
  Grafter(const BspTree& from, const Recorded& before)
      : from_(from), before_(before), place_(from.ids.size()), owner_(from.ids.size(), nobody) {}

  void begin(RegionMesh& mesh) {
    mesh_ = &mesh;
    cells_.clear();
    ++turn_;
  }
  /// @return the subtree's root within the region.
  std::int32_t graft(std::int32_t root) {
    std::int32_t result = BspTree::empty_leaf;
    left_.assign(1, {root, nobody, false});
    while (!left_.empty()) {
      const auto [code, parent, positive] = left_.back();
      left_.pop_back();
      const std::int32_t moved = take(code);
      if (parent == nobody)
        result = moved;
      else
        (positive ? mesh_->tree.nodes[parent].positive : mesh_->tree.nodes[parent].negative) = moved;
    }
    return result;
  }
  /// Numbers, in the evaluation, of the region's new cells.
  [[nodiscard]] std::span<const std::uint64_t> cells() const { return cells_; }

 private:
  static constexpr std::uint32_t nobody = ~0U;
  struct Pending {
    std::int32_t code;
    std::uint32_t parent;  // within the region
    bool positive;
  };
  const BspTree& from_;
  Recorded before_;
  std::vector<std::uint32_t> place_,
      owner_;  // of each hyperplane: in the region's list, if that is the region's turn
  std::uint32_t turn_ = 0;
  RegionMesh* mesh_ = nullptr;
  std::vector<std::uint64_t> cells_;
  std::vector<Pending> left_;

  std::int32_t take(std::int32_t code) {
    BspTree& tree = mesh_->tree;
    if (code < 0) {
      const auto leaf = static_cast<std::uint32_t>(~code);
      if (leaf <= before_.cells) return code;  // empty, or of an earlier step
      cells_.push_back(leaf - before_.cells - 1);
      return ~static_cast<std::int32_t>(mesh_->cells + cells_.size());
    }
    if (static_cast<std::uint32_t>(code) < before_.nodes) return code;
    const BspTree::Node& node = from_.nodes[static_cast<std::uint32_t>(code) - before_.nodes];
    const auto number = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes.push_back({hyperplane(node.hyperplane), BspTree::empty_leaf, BspTree::empty_leaf});
    left_.push_back({node.positive, number, true});
    left_.push_back({node.negative, number, false});
    return static_cast<std::int32_t>(number);
  }
  std::uint32_t hyperplane(std::uint32_t index) {
    BspTree& tree = mesh_->tree;
    if (owner_[index] != turn_) {
      owner_[index] = turn_;
      place_[index] = static_cast<std::uint32_t>(tree.ids.size());
      const auto width = static_cast<std::size_t>(tree.dimension) + 1;
      tree.ids.push_back(from_.ids[index]);
      const auto begin = from_.hyperplanes.begin() + static_cast<std::ptrdiff_t>(index * width);
      tree.hyperplanes.insert(tree.hyperplanes.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
    }
    return place_[index];
  }
};

}  // namespace

void Assignment::add(std::uint32_t number, std::span<const std::uint64_t> cells) {
  const std::size_t before = runs.size();
  for (const std::uint64_t cell : cells) {
    if (runs.size() > before && runs.back().first + runs.back().count == cell)
      ++runs.back().count;
    else
      runs.push_back({cell, 1});
  }
  region.push_back(number);
  end.push_back(runs.size());
}

Recorded recorded(const RegionMeshes& meshes) {
  Recorded most;
  for (const auto& [number, mesh] : meshes) {
    most.nodes = std::max(most.nodes, static_cast<std::uint32_t>(mesh.tree.nodes.size()));
    most.cells = std::max(most.cells, mesh.cells);
  }
  return most;
}

std::vector<std::shared_ptr<const dataflow::Refinement>> CollectingConsumer::take() {
  std::sort(refinements_.begin(), refinements_.end(), [](const auto& a, const auto& b) {
    return a->worker != b->worker ? a->worker < b->worker : a->first < b->first;
  });
  return std::exchange(refinements_, {});
}

namespace {

void shrink_to_fit(BspTree& tree) {
  tree.nodes.shrink_to_fit();
  tree.ids.shrink_to_fit();
  tree.hyperplanes.shrink_to_fit();
}

}  // namespace

template <int D>
Assignment divide_trees(dataflow::Evaluation<D>& evaluation, std::span<const std::uint32_t> regions,
                        const Recorded& before, RegionMeshes& meshes) {
  Assignment assignment;
  assignment.dimension = D;
  Grafter grafter(evaluation.tree, before);
  auto unfinished = evaluation.unfinished.begin();
  for (std::size_t i = 0; i < regions.size(); ++i) {
    RegionMesh& mesh = meshes[regions[i]];
    mesh.region = regions[i];
    mesh.tree.dimension = D;
    grafter.begin(mesh);
    if (unfinished != evaluation.unfinished.end() && unfinished->number == regions[i]) {
      for (auto& node : unfinished->frontier.nodes)
        if (node.kind == dataflow::Frontier::Kind::emitted) node.value = grafter.graft(node.value);
      ++unfinished;
    } else {
      mesh.tree.root = grafter.graft(evaluation.region_roots[i]);
    }
    shrink_to_fit(mesh.tree);
    mesh.cells += static_cast<std::uint32_t>(grafter.cells().size());
    assignment.add(regions[i], grafter.cells());
  }
  evaluation.tree = {};
  return assignment;
}

RegionCells divide_cells(const Assignment& assignment,
                         std::vector<std::shared_ptr<const dataflow::Refinement>> refinements) {
  CellSource source(std::move(refinements));
  RegionCells cells;
  std::uint64_t begin = 0;
  for (std::size_t i = 0; i < assignment.region.size(); begin = assignment.end[i++])
    cells[assignment.region[i]] = source.copy(
        std::span(assignment.runs).subspan(begin, assignment.end[i] - begin), assignment.dimension);
  return cells;
}

void append(RegionMeshes& meshes, const RegionCells& cells) {
  for (const auto& [region, batches] : cells) {
    auto& all = meshes.at(region).batches;
    all.insert(all.end(), batches.begin(), batches.end());
  }
}

template <int D>
void divide(dataflow::Evaluation<D>& evaluation, std::span<const std::uint32_t> regions,
            const Recorded& before, std::vector<std::shared_ptr<const dataflow::Refinement>> refinements,
            RegionMeshes& meshes) {
  append(meshes, divide_cells(divide_trees<D>(evaluation, regions, before, meshes), std::move(refinements)));
}

std::int32_t shifted(std::int32_t child, std::uint64_t nodes, std::uint64_t cells) {
  if (child == BspTree::empty_leaf) return child;
  const std::uint64_t number =
      child >= 0 ? static_cast<std::uint64_t>(child) + nodes : static_cast<std::uint64_t>(~child) + cells;
  if (number > std::numeric_limits<std::int32_t>::max())
    throw std::length_error("a BSP tree of more than 2^31 nodes or cells; --collect file needs none");
  return child >= 0 ? static_cast<std::int32_t>(number) : ~static_cast<std::int32_t>(number);
}

namespace {

/// Appends a tree; its nodes and leaves count behind those that are there.
void append(BspTree& whole, const BspTree& tree, std::uint64_t cells) {
  const std::uint64_t nodes = whole.nodes.size();
  const auto hyperplanes = static_cast<std::uint32_t>(whole.ids.size());
  for (const BspTree::Node& node : tree.nodes)
    whole.nodes.push_back({node.hyperplane + hyperplanes, shifted(node.negative, nodes, cells),
                           shifted(node.positive, nodes, cells)});
  whole.ids.insert(whole.ids.end(), tree.ids.begin(), tree.ids.end());
  whole.hyperplanes.insert(whole.hyperplanes.end(), tree.hyperplanes.begin(), tree.hyperplanes.end());
}

}  // namespace

Recorded append(RegionMesh& mesh, const RegionMesh& other) {
  const Recorded before{static_cast<std::uint32_t>(mesh.tree.nodes.size()), mesh.cells};
  mesh.region = other.region;
  mesh.tree.dimension = other.tree.dimension;
  append(mesh.tree, other.tree, mesh.cells);
  if (other.tree.root != BspTree::empty_leaf)
    mesh.tree.root = shifted(other.tree.root, before.nodes, before.cells);
  mesh.batches.insert(mesh.batches.end(), other.batches.begin(), other.batches.end());
  mesh.cells += other.cells;
  return before;
}

MergedMesh join(RegionMeshes meshes, int dimension, std::size_t region_count) {
  MergedMesh whole;
  whole.tree.dimension = dimension;
  whole.roots.assign(region_count, BspTree::empty_leaf);
  std::size_t nodes = 0, hyperplanes = 0;
  for (const auto& [number, mesh] : meshes) {
    nodes += mesh.tree.nodes.size();
    hyperplanes += mesh.tree.ids.size();
  }
  nodes += region_count;  // room for the partition's own
  hyperplanes += region_count;
  whole.tree.nodes.reserve(nodes);
  whole.tree.ids.reserve(hyperplanes);
  whole.tree.hyperplanes.reserve(hyperplanes * static_cast<std::size_t>(dimension + 1));
  while (!meshes.empty()) {
    const RegionMesh mesh = std::move(meshes.extract(meshes.begin()).mapped());
    const std::uint64_t before = whole.tree.nodes.size();
    append(whole.tree, mesh.tree, whole.cells);
    whole.roots.at(mesh.region) = shifted(mesh.tree.root, before, whole.cells);
    whole.batches.insert(whole.batches.end(), mesh.batches.begin(), mesh.batches.end());
    whole.cells += mesh.cells;
  }
  return whole;
}

#define BSP2_STAGE(D)                                                                                \
  template Assignment divide_trees<D>(dataflow::Evaluation<D>&, std::span<const std::uint32_t>,      \
                                      const Recorded&, RegionMeshes&);                               \
  template void divide<D>(dataflow::Evaluation<D>&, std::span<const std::uint32_t>, const Recorded&, \
                          std::vector<std::shared_ptr<const dataflow::Refinement>>, RegionMeshes&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
