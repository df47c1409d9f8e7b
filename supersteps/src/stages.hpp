#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/dataflow/evaluate.hpp"
#include "bsp2/dataflow/partition.hpp"
#include "bsp2/model/csg.hpp"
#include "bsp2/supersteps/run.hpp"

/// The supersteps, one function and one file each; `run.cpp` has the loop.
namespace bsp2::supersteps {

/// Compilation: the symbolic model becomes a network with canonical hyperplanes, bounds and an estimate of the work.
/// Source: the paper, section 4.2, "Compilation".
template <int D>
dataflow::Network<D> compilation(const model::Model& model, const RunOptions& options);

/// Distribution: a BSP tree of regions with about equal work each; its depth does not depend on who computes.
/// Source: the paper, section 4.2, "Distribution".
template <int D>
dataflow::Partition<D> distribution(const dataflow::Network<D>& network, const RunOptions& options);

/// Computation: the workers refine the regions up to the budget; decided cells go to the consumers.
/// Source: the paper, section 4.2, "Computation".
template <int D>
dataflow::Evaluation<D> computation(const dataflow::Network<D>& network, std::vector<dataflow::Region<D>> regions,
                                    const RunOptions& options, unsigned threads, std::span<dataflow::Consumer* const> consumers);

/// Collection: IN cells are accumulated, FUZZY ones kept as what they became, OUT ones were dropped by the workers.
/// A consumer of the computation; what it holds becomes the solid mesh.
/// Source: the paper, section 4.2, "Collection".
class Collection : public dataflow::Consumer {
 public:
  void consume(const std::shared_ptr<const dataflow::Refinement>& refinement) override;
  /// The mesh, its batches in an order that does not depend on their arrival.
  SolidMesh take(int dimension);

 private:
  std::vector<std::shared_ptr<const dataflow::Refinement>> refinements_;  // shared with other consumers
};

/// What the cells are to each other and to the space around them.
struct Resolution {
  std::vector<geometry::Contact> contacts;            ///< when asked for
  std::optional<geometry::TriangleSurface> boundary;  ///< when asked for
};

/// Resolution: glues the IN cells. Where cells touch, on either side of a cut, of the same region or not, their facets are
/// matched hyperplane by hyperplane; what no other cell covers is the boundary.
/// D = 3 only; nothing is found for other dimensions.
/// Source: the paper, section 4.2, "Resolution".
template <int D>
Resolution resolution(const geometry::HyperplaneTable<D>& table, const SolidMesh& mesh, const RunOptions& options, unsigned threads);

/// The regions' BSP trees under the partition's.
template <int D>
geometry::BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition, dataflow::Evaluation<D>& evaluation);

}  // namespace bsp2::supersteps
