#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::supersteps {

/// What has been found of one region for good: its cells and the BSP tree over them. All numbers count within
/// the region, so it travels, and is stored, as it stands.
struct RegionMesh {
  std::uint32_t region = 0;
  std::vector<std::shared_ptr<const geometry::CellBatch>>
      batches;  // shared: the result's mesh holds the same ones
  std::uint32_t cells =
      0;  ///< of the tree; in the batches, if these have not gone ahead to the master (CellStream)
  /// Leaf k >= 1 is cell k - 1. Its root is that of the region, and an empty leaf while the region is
  /// unfinished: then the roots of the trees in it are known to the region's frontier.
  geometry::BspTree tree;
};

/// By the number of the region.
using RegionMeshes = std::map<std::uint32_t, RegionMesh>;

/// Cells of regions, and the trees over them, as one.
struct MergedMesh {
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
  std::uint64_t cells = 0;
  geometry::BspTree tree;           ///< a tree a region; its leaves count the cells of the batches
  std::vector<std::int32_t> roots;  ///< in the tree, of each region; empty leaves where it is not here
};

/// How many nodes and cells the largest meshes have: what an evaluation records is numbered from here.
struct Recorded {
  std::uint32_t nodes = 0, cells = 0;
};
Recorded recorded(const RegionMeshes& meshes);

/// A consumer of the computation: keeps its cells. IN cells are accumulated, FUZZY ones kept as what they
/// became, OUT ones were dropped by the workers.
class CollectingConsumer : public dataflow::Consumer {
 public:
  void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override {
    refinements_.push_back(refinement);
  }
  /// In an order that does not depend on their arrival: that in which the evaluation's trees count cells.
  std::vector<std::shared_ptr<const dataflow::Refinement>> take();

 private:
  std::vector<std::shared_ptr<const dataflow::Refinement>> refinements_;  // shared with other consumers
};

/// Which cells of an evaluation each of its regions has, in the order of the region's tree.
struct Assignment {
  /// Cells that follow each other in the evaluation, where they are counted in the order of
  /// CollectingConsumer::take.
  struct Run {
    std::uint64_t first = 0, count = 0;
  };
  int dimension = 3;
  std::vector<std::uint32_t> region;
  std::vector<std::uint64_t> end;  ///< of each region's runs
  std::vector<Run> runs;
  void add(std::uint32_t number, std::span<const std::uint64_t> cells);
};

/// Cells by the number of the region.
using RegionCells =
    std::map<std::uint32_t,
             std::vector<std::shared_ptr<const geometry::CellBatch>>>;  // shared as in RegionMesh

/// Deals the trees that an evaluation has found out to its regions. In the frontiers of what is unfinished
/// the roots of emitted subtrees are renumbered accordingly.
/// @param regions numbers of the regions that were evaluated, in their order. @param before what the
/// evaluation counted from.
/// @param meshes those of the regions, whose cells are counted; entries are added where there are none.
/// @return which cells are theirs.
template <int D>
Assignment divide_trees(dataflow::Evaluation<D>& evaluation, std::span<const std::uint32_t> regions,
                        const Recorded& before, RegionMeshes& meshes);

/// The cells of an evaluation region by region. @param refinements all of them, in order.
/// @throws std::out_of_range if the assignment is of another evaluation.
RegionCells divide_cells(const Assignment& assignment,
                         std::vector<std::shared_ptr<const dataflow::Refinement>> refinements);

/// Appends cells to the meshes of their regions.
void append(RegionMeshes& meshes, const RegionCells& cells);

/// Deals trees and cells out to the regions.
template <int D>
void divide(dataflow::Evaluation<D>& evaluation, std::span<const std::uint32_t> regions,
            const Recorded& before, std::vector<std::shared_ptr<const dataflow::Refinement>> refinements,
            RegionMeshes& meshes);

/// Where a child of a node is, or a root, when a tree with so many nodes and cells comes before its own.
/// @throws std::length_error if that cannot be numbered with 31 bits.
std::int32_t shifted(std::int32_t child, std::uint64_t nodes, std::uint64_t cells);

/// Appends another mesh of the same region, which counts from 0 too. The root becomes the other's, if it has
/// one.
/// @return where the other's nodes and cells begin.
Recorded append(RegionMesh& mesh, const RegionMesh& other);

/// All meshes as one, in the order of the regions. @param region_count of the whole partition.
/// @throws std::length_error if the nodes or cells cannot be numbered with 31 bits.
MergedMesh join(RegionMeshes meshes, int dimension, std::size_t region_count);

}  // namespace bsp2::supersteps
