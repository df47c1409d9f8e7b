#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/geometry/bsp_tree.hpp"
#include "bsp2/geometry/cell_batch.hpp"

namespace bsp2::io {

/// What a snapshot tells about its run; the same on all processes that write it together.
struct SnapshotHead {
  std::string model;   ///< path of the source
  std::string source;  ///< its text: a snapshot can be resumed without the file
  std::int32_t dimension = 3;
  double coincidence = 1e-9;
  std::optional<std::uint32_t> level;  ///< at which cells are left
  bool keep_in = true, keep_fuzzy = true, keep_out = false;
  std::string hyperplanes;   ///< a digest of the compiled hyperplanes, to notice a program that compiles differently
  std::uint32_t steps = 0;   ///< computation supersteps so far
  bool complete = false;     ///< nothing is left but what `level` leaves
  std::uint64_t in_cells = 0, out_cells = 0;
  double in_volume = 0;      ///< of the finished cells
  std::string digest;        ///< likewise
  std::string totals;        ///< all sums, archived
  std::uint32_t recorded_nodes = 0, recorded_cells = 0;  ///< of the tree, and finished cells in the file; found by reading it
  bool is_portion = false;   ///< it holds a part of a run: only with the other parts can one go on from it
  std::uint32_t earlier_nodes = 0, earlier_cells = 0;  ///< of a portion: numbers below these are of what it went on from
  // The partition: node i cuts by hyperplane[i], its children are children[2 i] and [2 i + 1] as Partition has them.
  std::int32_t partition_root = -1;
  std::vector<std::uint32_t> partition_hyperplane;
  std::vector<std::int32_t> partition_children;
  // The table of the supersteps, a row for each of them and rank.
  std::vector<std::string> superstep_name;
  std::vector<std::uint32_t> superstep_step, superstep_rank;
  std::vector<double> superstep_seconds, superstep_work_seconds, superstep_predicted_seconds;
  std::vector<std::uint64_t> superstep_bytes_sent, superstep_bytes_received, superstep_cells;
};

/// All that a run needs to go on: its head, the regions that are unfinished, and what is finished.
///
/// When several processes write, each has its own share of all but the head; cells and nodes of the tree are numbered
/// through all shares in the order of the processes.
struct Snapshot {
  SnapshotHead head;
  // Unfinished regions: number, undecided tokens, and the region as an archive.
  std::vector<std::uint32_t> frontier_region;
  std::vector<std::uint64_t> frontier_tokens;
  std::vector<std::string> frontier_archive;
  // Finished cells, and the BSP tree above them (its root is not used): the root of each region that is finished.
  std::vector<std::shared_ptr<const geometry::CellBatch>> cells;  // shared: consumers hold the same batches
  geometry::BspTree tree;
  std::vector<std::uint32_t> finished_region;
  std::vector<std::int32_t> finished_root;
};

/// The processes that write one snapshot together. By default: this one alone, which needs no MPI.
struct SnapshotWriters {
  int rank = 0, count = 1;
  /// HDF5's file-access property list (a hid_t) for a file that all of them open; 0: the default one.
  std::int64_t file_access = 0;
  /// Everybody's numbers in the order of the ranks. Collective.
  std::function<std::vector<std::vector<std::uint64_t>>(const std::vector<std::uint64_t>&)> exchange;
};

/// Writes a snapshot as HDF5: under another name (`.NAME.part`) in the same folder, to the disk, and then renamed, so that
/// whenever the machine stops there is a whole snapshot, the old or the new one. Makes the folder if it is missing.
/// Collective: all writers call it; data are written collectively, each process its own.
/// @throws bsp2::Error on all writers if the file cannot be written; the old one is untouched, nothing else is left.
void write_snapshot(const std::filesystem::path& path, const Snapshot& snapshot, const SnapshotWriters& writers = {});

/// Could `write_snapshot` succeed? Asked before a long run; makes nothing. @throws bsp2::Error if not.
void check_snapshot_path(const std::filesystem::path& path);

enum class SnapshotPart : std::uint8_t {
  head,      ///< and the numbers of the unfinished regions and their tokens
  frontier,  ///< and their archives
  all        ///< and the finished cells with their tree
};

/// Reads a snapshot, up to a part. Not collective.
/// @throws bsp2::Error if there is no such file, it is no snapshot of bsp2, of another version of the format, truncated or
/// damaged (all data have checksums).
Snapshot read_snapshot(const std::filesystem::path& path, SnapshotPart part = SnapshotPart::all);

}  // namespace bsp2::io
