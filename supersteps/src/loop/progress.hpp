#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "bsp2/io/outputs/snapshot.hpp"
#include "stages/stages.hpp"

namespace bsp2::supersteps {

/// How far a run is on this rank: what has been found for good, and what is left. Snapshots hold it.
template <int D>
struct Progress {
  explicit Progress(const dataflow::Network<D>& network)
      : totals(network.table.radius(), network.table.width()) {
    totals.reset_bounds();
  }
  dataflow::Partition<D> partition;  ///< its regions: this rank's that are unfinished
  dataflow::Totals<D> totals;        ///< of the cells that this rank has emitted
  RegionMeshes meshes;               ///< these cells, if they are collected
  bool keeps_cells = true;           ///< they are collected
  unsigned steps = 0;                ///< computation supersteps

  /// Evaluates regions and takes in what that finds: evaluate(before, consumers), where `before` is what it
  /// counts from. @param numbers of the regions. @param collects whether their cells are wanted.
  /// @param consumers besides the one that collects. @param stream that sends cells to the master; may be
  /// null.
  /// @return what `evaluate` returns: an Evaluation<D>.
  template <typename Evaluate>
  dataflow::Evaluation<D> take_in(const std::vector<std::uint32_t>& numbers, bool collects,
                                  std::vector<dataflow::Consumer*> consumers, CellStream* stream,
                                  const Evaluate& evaluate) {
    CollectingConsumer collector;
    if (collects) consumers.insert(consumers.begin(), &collector);
    const Recorded before = recorded(meshes);
    dataflow::Evaluation<D> evaluation = evaluate(before, consumers);
    add(numbers, evaluation, before, collector, stream);
    return evaluation;
  }
  [[nodiscard]] std::vector<std::uint32_t> region_numbers() const;

 private:
  void add(const std::vector<std::uint32_t>& regions, dataflow::Evaluation<D>& evaluation,
           const Recorded& before, CollectingConsumer& collector, CellStream* stream);
};

/// Progress, and who computes which region.
template <int D>
using Started = std::pair<Progress<D>, std::vector<std::int32_t>>;

/// The start of a run.
template <int D>
Started<D> begin_progress(const dataflow::Network<D>& network, Distribution<D> distribution);

/// Who shall have which region, by what is left to do: the region with most of it goes to the rank with the
/// least, but stays where it is if that makes hardly a difference, or if it is no work. @param owner who has
/// it now. @return who gets it.
std::vector<std::int32_t> reassign_regions(const std::vector<double>& work,
                                           const std::vector<std::int32_t>& owner, int ranks);

/// Moves unfinished regions between ranks, with their frontiers and what has been found of them, so that all
/// have about as much left to do. The cells remain what they are. Collective. @param level at which cells are
/// left, and no work.
/// @return whether any moved.
template <int D>
bool move_regions(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
                  std::vector<std::int32_t>& rank_of_region, std::optional<unsigned> level);

/// Gives back what is whole on both sides of a cut between regions, and emits the cells of regions that are
/// one cell for good. Collective; of a held region its number, label and part travel, and no cells.
/// @see dataflow::coarsen
template <int D>
void coarsen(Ranks& ranks, const dataflow::Network<D>& network, Progress<D>& progress,
             const RunOptions& options, unsigned threads, CellStream* stream);

/// Writes the progress of all ranks as one snapshot, together. Collective.
/// @param records the table of the supersteps so far, on the master.
/// @throws bsp2::Error if the file cannot be written.
template <int D>
void save_progress(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress,
                   const RunOptions& options, const Source& source, bool complete,
                   const std::vector<SuperstepRecord>& records);

/// Of all rounded hyperplanes: equal where the ids mean the same.
template <int D>
std::string hyperplane_digest(const dataflow::Network<D>& network);

/// Appends what this process alone has to a snapshot; the head stays as it is.
template <int D>
void add_share(io::Snapshot& snapshot, const Progress<D>& progress);

/// The meshes of the regions that have been read.
template <int D>
RegionMeshes meshes_of(const io::Snapshot& snapshot);

/// The table of supersteps, as a snapshot holds it.
void forget_records(io::SnapshotHead& head);
void append_records(io::SnapshotHead& head, const std::vector<SuperstepRecord>& records);
std::vector<SuperstepRecord> records_of(const io::SnapshotHead& head);

/// The partition that a snapshot names, without regions.
template <int D>
dataflow::Partition<D> partition_of(const io::SnapshotHead& head);
template <int D>
void set_partition(io::SnapshotHead& head, const dataflow::Partition<D>& partition);

/// Reads a snapshot back: its regions are dealt out to the ranks, and each reads the cells of its own.
/// Collective.
/// @throws bsp2::Error if the snapshot is damaged, or was written by a program that compiles the model
/// differently.
template <int D>
Started<D> load_progress(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options);

/// Whether a run leaves the same cells FUZZY as the one that wrote the snapshot.
bool are_same_limits(const io::SnapshotHead& head, const RunOptions& options);

/// The options with those that a snapshot fixes, and its table of supersteps.
/// @throws bsp2::Error if they contradict the snapshot.
RunOptions resumed_options(const RunOptions& options, std::vector<SuperstepRecord>& records);

}  // namespace bsp2::supersteps
