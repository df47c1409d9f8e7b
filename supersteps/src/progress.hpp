#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bsp2/io/snapshot.hpp"
#include "stages.hpp"

namespace bsp2::supersteps {

/// How far a run is on this rank: what has been found for good, and what is left. Snapshots hold it.
template <int D>
struct Progress {
  explicit Progress(const dataflow::Network<D>& network) : totals(network.table.radius(), network.table.width()) {
    totals.reset_bounds();
    tree.dimension = D;
  }
  dataflow::Partition<D> partition;  ///< its regions: this rank's that are unfinished
  dataflow::Totals<D> totals;        ///< of the cells that this rank has emitted
  std::vector<std::shared_ptr<const geometry::CellBatch>> batches;  ///< these cells, if they are collected
  geometry::BspTree tree;            ///< above them
  std::vector<std::int32_t> roots;   ///< in the tree, of each region by number; empty where it is not this rank's or unfinished
  std::uint32_t cells = 0;           ///< how many the tree counts
  unsigned steps = 0;                ///< computation supersteps
  /// What the snapshot that the run goes on from had recorded. The master holds it; its numbers come first on all ranks.
  Recorded inherited, inherited_elsewhere;

  /// Takes in what an evaluation has found. @param regions the numbers of its regions.
  void add(std::vector<std::uint32_t> regions, dataflow::Evaluation<D> evaluation, Keeper& keeper);
  /// What has been found, for the collection; the sums and the partition remain.
  Part take();
  [[nodiscard]] std::vector<std::uint32_t> region_numbers() const;
  [[nodiscard]] Recorded recorded() const {
    return {inherited_elsewhere.nodes + static_cast<std::uint32_t>(tree.nodes.size()), inherited_elsewhere.cells + cells};
  }
};

/// Progress, and who computes which region.
template <int D>
using Started = std::pair<Progress<D>, std::vector<std::int32_t>>;

/// The start of a run.
template <int D>
Started<D> begin_progress(const dataflow::Network<D>& network, Distribution<D> distribution);

/// Writes the progress of all ranks as one snapshot, together. Collective.
/// @param records the table of the supersteps so far, on the master.
/// @throws bsp2::Error if the file cannot be written.
template <int D>
void save_progress(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress, const RunOptions& options, const Source& source,
                   bool complete, const std::vector<SuperstepRecord>& records);

/// Of all rounded hyperplanes: equal where the ids mean the same.
template <int D>
std::string hyperplane_digest(const dataflow::Network<D>& network);

/// Appends what this process alone has to a snapshot; the head stays as it is.
template <int D>
void add_share(io::Snapshot& snapshot, const Progress<D>& progress);

/// The table of supersteps, as a snapshot holds it.
void append_records(io::SnapshotHead& head, const std::vector<SuperstepRecord>& records);
std::vector<SuperstepRecord> records_of(const io::SnapshotHead& head);

/// The partition that a snapshot names, without regions.
template <int D>
dataflow::Partition<D> partition_of(const io::SnapshotHead& head);

/// Reads a snapshot back: its unfinished regions are dealt out to the ranks, its finished cells go to the master. Collective.
/// @throws bsp2::Error if the snapshot is damaged, or was written by a program that compiles the model differently.
template <int D>
Started<D> load_progress(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options);

/// The options with those that a snapshot fixes, and its table of supersteps.
/// @throws bsp2::Error if they contradict the snapshot.
RunOptions resumed_options(const RunOptions& options, std::vector<SuperstepRecord>& records);

}  // namespace bsp2::supersteps
