#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/dataflow/evaluate/frontier.hpp"
#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/consumer.hpp"
#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell.hpp"
#include "bsp2/geometry/cells/measures.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/order.hpp"

namespace bsp2::meshing {
class SizeField;
}

namespace bsp2::dataflow {

struct EvaluateOptions {
  unsigned threads = 1;
  Order order = Order::depth;
  std::vector<double> eye;  ///< D numbers: with Order::priority, what looks largest from here is refined
                            ///< first (none: what is largest); and see `angle`
  std::optional<unsigned> level;  ///< what is undecided so deep in the BSP tree is left
  std::optional<double>
      tolerance;  ///< what is undecided about round solids in cells thinner than this is left
  /// Shares of the tolerance by place, which the middle of a cell looks up: of D = 3, and not with `angle`.
  std::shared_ptr<const meshing::SizeField> tolerance_shares;
  std::optional<double> angle;  ///< likewise in cells that are seen thinner than this from `eye`, in radians
  std::optional<double> budget_seconds;  ///< what is undecided then is left; making the cells of frontiers
                                         ///< again is no part of it
  std::optional<std::uint64_t>
      cells;  ///< likewise once there are so many cells more than at the beginning, undecided ones counted
  std::function<bool()> interrupted;  ///< asked some fifty times a second by the calling thread: true ends
                                      ///< the evaluation likewise
  /// The limits (level, tolerance, angle, eye) are those of the evaluation that left the frontiers: cells
  /// that ended there as deep, thin or small enough are not looked at again. Otherwise all are.
  bool same_limits = false;
  /// What is left is suspended: it comes back as the frontiers of Evaluation::unfinished. Otherwise it
  /// becomes FUZZY cells.
  bool suspend = false;
  /// A region that turns out to be one cell, IN or OUT and wanted, comes back as unfinished, its cell held:
  /// what is beyond the cut that made the region may turn out alike, and then the whole is given back. See
  /// coarsening.hpp.
  bool hold_uniform_regions = false;
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells go to the consumers
  bool record_tree = false;
  /// How many nodes and cells earlier evaluations of the same run have recorded: those of this one are
  /// numbered from here, so that all trees together are one after the other.
  std::uint32_t recorded_nodes = 0, recorded_cells = 0;
};

/// A region of space: a leaf of the partition, its cell, and the expression localized there or, once its
/// evaluation has been suspended, what is left of it.
template <int D>
struct Region {
  std::uint32_t number = 0;  ///< its name: its place among all regions of the partition
  std::uint16_t level = 0;
  geometry::Cell<D> cell;
  std::vector<Word> program;  ///< of a region that is not begun
  Frontier frontier;          ///< of one that is
  [[nodiscard]] Region copy() const { return {number, level, cell.copy(), program, frontier}; }
  /// How many cells its picture has: what is undecided, and what is held; OUT cells where they are kept.
  [[nodiscard]] std::uint64_t cells_left(bool keep_out) const {
    if (frontier.empty()) return 1;
    return static_cast<std::uint64_t>(
        std::count_if(frontier.nodes.begin(), frontier.nodes.end(), [&](const Frontier::Node& node) {
          return node.kind == Frontier::Kind::token ||
                 (node.kind == Frontier::Kind::held && (keep_out || node.label != geometry::Label::out));
        }));
  }
};

/// Order-independent sum of 128-bit hashes of cells: label, primitive, named part, level, coordinates byte
/// for byte, and which corners each facet has. Which region they are in does not count: the cells are the
/// same for any number of regions.
struct Digest {
  std::array<std::uint64_t, 2> words{};
  void add(const geometry::CellBatch& batch, std::size_t cell);
  /// Adds a cell that has not been written to a batch.
  template <int D>
  void add(const geometry::Cell<D>& cell, geometry::Label label, std::int32_t primitive, std::int32_t part,
           std::uint16_t level);
  Digest& operator+=(const Digest& other);
  [[nodiscard]] std::string hex() const;
};

/// Sums over the cells that were emitted; equal in every run, whatever the number of threads and their timing
/// (but for the kernel's counts: after a suspension cells are split again).
template <int D>
struct Totals {
  Totals(double radius, double width) : in(radius, width), fuzzy(radius, width), fuzzy_below(radius, width) {}
  geometry::MomentSum<D> in, fuzzy;
  std::vector<geometry::MomentSum<D>>
      parts;  ///< the IN cells of each part that has a name; may end before the last one
  /// At most the integrals over the FUZZY cells of min(x_i x_j, 0). So what the solid has in them is between
  /// these and `fuzzy` less these: with `in`, an interval that holds the solid's moment.
  geometry::MomentSum<D> fuzzy_below;
  std::uint64_t in_cells = 0, fuzzy_cells = 0, out_cells = 0;  ///< OUT cells only where they are kept
  std::array<double, D> lower, upper;  ///< of the IN cells; lower > upper where there are none
  unsigned level = 0;                  ///< the deepest cell
  Digest digest;                       ///< of the cells that are kept
  geometry::KernelCounts counts;
  void reset_bounds();
  /// The sum over a part's IN cells.
  geometry::MomentSum<D>& of_part(std::size_t part);
  Totals& operator+=(const Totals& other);
};

template <int D>
struct Evaluation {
  Totals<D> totals;
  /// One tree a region, in the order of the regions, when asked for; an empty leaf where the region is
  /// unfinished. Node recorded_nodes + i is tree.nodes[i]; leaf recorded_cells + k, k >= 1, is cell k - 1 of
  /// the refinements sorted by worker and first cell.
  std::vector<std::int32_t> region_roots;
  geometry::BspTree tree;
  std::vector<std::uint64_t> cells_of_worker;
  std::vector<Region<D>> unfinished;  ///< with `suspend` or `hold_uniform_regions`: the regions in which
                                      ///< something is left, in their order
  bool stopped = false;               ///< ended by time, cells or interruption, not by having no more to do
};

/// Evaluates the regions of a network with a context of worker threads that steal work from each other.
///
/// Each worker takes a token (a FUZZY cell and its localized expression), fires it through the network, and
/// either emits the decided cell to the consumers or splits it in two tokens. Where both halves turn out
/// alike, the cell is given back whole. The cells depend on the network, the regions and the level alone; so
/// do the cells of several evaluations together that go on where the one before was suspended. Thread rule:
/// called by one thread, which serves the consumers until all is done.
/// @param regions fresh ones, or the unfinished ones of earlier evaluations, with their cells.
/// @throws what a worker or a consumer threw first; std::invalid_argument if a frontier is no tree.
template <int D>
Evaluation<D> evaluate(const Network<D>& network, std::vector<Region<D>> regions,
                       const EvaluateOptions& options, std::span<Consumer* const> consumers);

/// The picture of what is unfinished, as it is: FUZZY cells where something is undecided, and the cells that
/// are held since their parents may be given back. With what has been emitted they fill the space.
/// Provisional: nothing is refined, the regions stay as they are, and the next picture replaces this one.
/// Portions of others are left empty.
/// @param options as for `evaluate`; what is as deep as its level is FUZZY only if it is undecided when
/// looked at closely. Budget, cells and suspend are ignored.
template <int D>
Evaluation<D> picture(const Network<D>& network, std::span<const Region<D>> regions, EvaluateOptions options,
                      std::span<Consumer* const> consumers);

}  // namespace bsp2::dataflow
