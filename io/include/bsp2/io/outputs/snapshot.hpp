#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/geometry/cells/bsp_tree.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/brep.hpp"

namespace bsp2::io {

/// What a snapshot tells about its run; the same on all processes that write it together.
struct SnapshotHead {
  std::string model;   ///< path of the source
  std::string source;  ///< its text: a snapshot can be resumed without the file
  std::int32_t dimension = 3;
  double coincidence = 1e-9;
  bool curved = false;                 ///< how the source was read
  bool parts_by_colour = false;        ///< its colours divide the model into parts
  std::optional<std::uint32_t> level;  ///< at which cells are left
  double tolerance = 0;                ///< where round solids are left; 0: nowhere
  double angle = 0;                    ///< likewise, as seen from `eye`, in degrees
  std::vector<double> eye;             ///< D coordinates, or none
  bool keep_in = true, keep_fuzzy = true, keep_out = false;
  std::string
      hyperplanes;  ///< a digest of the compiled hyperplanes, to notice a program that compiles differently
  std::uint32_t steps = 0;  ///< computation supersteps so far
  bool complete = false;    ///< nothing is left but what `level` leaves
  std::uint64_t in_cells = 0, out_cells = 0;
  double in_volume = 0;                         ///< of the finished cells
  std::string digest;                           ///< likewise
  std::string totals;                           ///< all sums, archived
  bool has_surface = false, has_faces = false;  ///< read, and not written: see add_surface
  bool is_portion = false;  ///< it holds a part of a run: only with the other parts can one go on from it
  // The partition: node i cuts by hyperplane[i], its children are children[2 i] and [2 i + 1] as Partition
  // has them.
  std::int32_t partition_root = -1;
  std::vector<std::uint32_t> partition_hyperplane;
  std::vector<std::int32_t> partition_children;
  // The table of the supersteps, a row for each of them and rank.
  std::vector<std::string> superstep_name;
  std::vector<std::uint32_t> superstep_step, superstep_rank;
  std::vector<double> superstep_seconds, superstep_work_seconds, superstep_predicted_seconds;
  std::vector<std::uint64_t> superstep_bytes_sent, superstep_bytes_received, superstep_cells;
};

/// What has been finished of one region: how much of the arrays is its own, which are divided region by
/// region.
struct SnapshotRegion {
  std::uint32_t number = 0;
  std::int32_t root = -1;  ///< in the region's tree; an empty leaf if the region is unfinished
  std::uint32_t cells = 0, nodes = 0, hyperplanes = 0;
  friend bool operator==(const SnapshotRegion&, const SnapshotRegion&) = default;
};

/// All that a run needs to go on: its head, the regions that are unfinished, and what is finished.
///
/// When several processes write, each has its own regions and all that belongs to them.
struct Snapshot {
  SnapshotHead head;
  // Unfinished regions: number, undecided tokens, how many of them have not ended, and the region as an
  // archive.
  std::vector<std::uint32_t> frontier_region;
  std::vector<std::uint64_t> frontier_tokens, frontier_open;
  std::vector<std::string> frontier_archive;
  // Finished cells, and the BSP trees above them: for each of these regions its own, one after the other. A
  // batch has cells of one region; nodes, leaves and hyperplanes of a tree count within the region. The
  // tree's own root is not used.
  std::vector<SnapshotRegion> regions;
  std::vector<std::shared_ptr<const geometry::CellBatch>> cells;  // shared: consumers hold the same batches
  geometry::BspTree tree;
};

/// The processes that write one snapshot together: all that MPI has started, or by default this one alone,
/// which needs no MPI.
struct SnapshotWriters {
  int rank = 0, count = 1;
  /// Everybody's numbers in the order of the ranks. Collective.
  std::function<std::vector<std::vector<std::uint64_t>>(const std::vector<std::uint64_t>&)> exchange;
};

/// That a snapshot cannot be written: all writers know, and can go on.
class RefusedSnapshot : public Error {
 public:
  using Error::Error;
};

/// Writes a snapshot as HDF5: under another name (`.NAME.part`) in the same folder, to the disk, and then
/// renamed, so that whenever the machine stops there is a whole snapshot, the old or the new one. Makes the
/// folder if it is missing. Collective: all writers call it; data are written collectively, each process its
/// own.
/// @throws bsp2::Error on all writers if the file cannot be written; the old one is untouched, nothing else
/// is left. It is a RefusedSnapshot unless several writers were stopped in the middle of HDF5, where some may
/// wait for ever.
void write_snapshot(const std::filesystem::path& path, const Snapshot& snapshot,
                    const SnapshotWriters& writers = {});

/// Could `write_snapshot` succeed? Asked before a long run; makes nothing. @throws bsp2::Error if not.
void check_snapshot_path(const std::filesystem::path& path);

/// Copies a snapshot as `write_snapshot` writes one: under another name, to the disk, and then renamed.
/// Nothing if both are one file.
/// @throws bsp2::Error if the copy cannot be written; an old file in its place is untouched, nothing else is
/// left.
void copy_snapshot(const std::filesystem::path& from, const std::filesystem::path& to);

/// Whether a file is there that begins as those of HDF5 do; whether it is a snapshot, of whatever version, or
/// one that is damaged.
bool is_hdf5(const std::filesystem::path& path);
bool is_snapshot(const std::filesystem::path& path);

/// Is there a file to read? It need not be a snapshot. @throws bsp2::Error if not, which tells what there is
/// instead.
void check_snapshot_is_readable(const std::filesystem::path& path);

enum class SnapshotPart : std::uint8_t {
  head,      ///< and the lists of the regions: unfinished ones with their tokens, others with their cells
  frontier,  ///< and the archives of the unfinished ones
  all        ///< and the cells and trees
};

/// Reads a snapshot, up to a part. Not collective: each process reads what it wants.
/// @param wanted regions; none: all. The lists hold the others neither.
/// @throws bsp2::Error if there is no such file, it is no snapshot of bsp2, of another version of the format,
/// truncated or damaged (all data have checksums).
Snapshot read_snapshot(const std::filesystem::path& path, SnapshotPart part = SnapshotPart::all,
                       const std::function<bool(std::uint32_t region)>& wanted = {});

/// The surface of the IN cells of a snapshot.
struct SnapshotSurface {
  geometry::TriangleSurface triangles;
  std::optional<geometry::Brep> faces;
};

/// Puts the surface of its cells into a snapshot, in the place of what was there: the file is replaced as
/// write_snapshot does it. By one process. @param faces may be null.
/// @throws bsp2::Error if that cannot be done; the snapshot is as it was.
void add_surface(const std::filesystem::path& path, const geometry::TriangleSurface& surface,
                 const geometry::Brep* faces);

/// @return none if the snapshot has no surface. @param parts how many the model has: others are refused.
/// @param with_faces whether these are read, if they are there. @throws bsp2::Error as read_snapshot.
std::optional<SnapshotSurface> read_surface(const std::filesystem::path& path, std::int32_t parts,
                                            bool with_faces);

}  // namespace bsp2::io
