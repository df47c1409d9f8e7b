#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <optional>
#include <span>
#include <system_error>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "files/replacing.hpp"
#include "hdf5/arrays.hpp"
#include "hdf5/hdf5.hpp"
#include "hdf5/skeleton_driver.hpp"
#include "hdf5/snapshot_format.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::CellBatch;
using hdf5::check;
using hdf5::Failure;
using hdf5::Handle;
using hdf5::Share;
using snapshot::eye_attribute;
using snapshot::file_access;
using snapshot::format_name;
using snapshot::format_version;

/// Lengths of everything this writer has, in one order.
enum Count : std::size_t {
  cells,
  points,
  facets,
  corners,
  nodes,
  hyperplanes,
  frontier,
  archived,
  regions,
  count_kinds
};

std::vector<std::uint64_t> lengths(const Snapshot& snapshot) {
  std::vector<std::uint64_t> n(count_kinds, 0);
  for (const auto& batch : snapshot.cells) {
    n[cells] += batch->size();
    n[points] += batch->point_offset.back();
    n[facets] += batch->facet_offset.back();
    n[corners] += batch->facet_vertices.size();
  }
  n[nodes] = snapshot.tree.nodes.size();
  n[hyperplanes] = snapshot.tree.hyperplanes.size() / (static_cast<std::size_t>(snapshot.head.dimension) + 1);
  n[frontier] = snapshot.frontier_region.size();
  for (const std::string& archive : snapshot.frontier_archive) n[archived] += archive.size();
  n[regions] = snapshot.regions.size();
  return n;
}

std::vector<Share> shares(const Snapshot& snapshot, const SnapshotWriters& writers) {
  const auto mine = lengths(snapshot);
  std::vector<std::vector<std::uint64_t>> all{mine};
  if (writers.count > 1) all = writers.exchange(mine);
  std::vector<Share> result(count_kinds);
  for (std::size_t kind = 0; kind < count_kinds; ++kind)
    for (std::size_t rank = 0; rank < all.size(); ++rank) {
      Share& share = result[kind];
      if (static_cast<int>(rank) < writers.rank) share.before += all[rank][kind];
      share.total += all[rank][kind];
      share.mine = mine[kind];
    }
  return result;
}

/// One more row for the first writer: offsets begin with a 0.
Share offsets(Share share, int rank) {
  ++share.total;
  if (rank == 0)
    ++share.mine;
  else
    ++share.before;
  return share;
}

// What is in the file, for the one who makes the arrays and for those who write them: `Out` is ArrayMaker or
// ArrayWriter.

template <typename Out>
void write_cells(Out& out, const Snapshot& snapshot, const std::vector<Share>& share, int rank) {
  const auto column = [&]<typename T>(const char* name, const Share& rows, std::size_t columns,
                                      std::vector<T> CellBatch::*member) {
    out.template write<T>(name, rows, columns, [&](const auto& append) {
      for (const auto& batch : snapshot.cells) append(std::span<const T>((*batch).*member));
    });
  };
  const auto offset = [&](const char* name, const Share& rows, std::uint64_t base,
                          std::vector<std::uint32_t> CellBatch::*member) {
    out.template write<std::uint64_t>(name, offsets(rows, rank), 1, [&](const auto& append) {
      std::vector<std::uint64_t> ends;
      if (rank == 0) append(std::span<const std::uint64_t>(std::vector<std::uint64_t>{0}));
      for (const auto& batch : snapshot.cells) {
        const auto& local = (*batch).*member;
        ends.clear();
        for (std::size_t i = 1; i < local.size(); ++i) ends.push_back(base + local[i]);
        base += local.back();
        append(std::span<const std::uint64_t>(ends));
      }
    });
  };
  out.template write<double>("cells/points", share[points], static_cast<std::size_t>(snapshot.head.dimension),
                             [&](const auto& append) {
                               std::vector<double> batch_points;
                               for (const auto& batch : snapshot.cells) {
                                 batch_points = batch->points;
                                 for (double& x : batch_points) x += 0.0;  // no -0
                                 append(std::span<const double>(batch_points));
                               }
                             });
  offset("cells/point_offset", share[cells], share[points].before, &CellBatch::point_offset);
  offset("cells/facet_offset", share[cells], share[facets].before, &CellBatch::facet_offset);
  offset("cells/facet_vertex_offset", share[facets], share[corners].before, &CellBatch::facet_vertex_offset);
  column("cells/facet_vertices", share[corners], 1, &CellBatch::facet_vertices);
  column("cells/facet_hyperplane", share[facets], 1, &CellBatch::facet_hyperplane);
  out.template write<std::uint8_t>("cells/label", share[cells], 1, [&](const auto& append) {
    for (const auto& batch : snapshot.cells)
      append(std::span(reinterpret_cast<const std::uint8_t*>(batch->label.data()), batch->size()));
  });
  column("cells/primitive", share[cells], 1, &CellBatch::primitive);
  column("cells/part", share[cells], 1, &CellBatch::part);
  column("cells/region", share[cells], 1, &CellBatch::region);
  column("cells/level", share[cells], 1, &CellBatch::level);
  column("cells/volume", share[cells], 1, &CellBatch::volume);
}

template <typename Out>
void write_tree(Out& out, const Snapshot& snapshot, const std::vector<Share>& share) {
  out.template write<std::int32_t>("tree/children", share[nodes], 2, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes)
      append(std::span<const std::int32_t>(std::array{node.negative, node.positive}));
  });
  out.template write<std::uint32_t>("tree/node_hyperplane", share[nodes], 1, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes)
      append(std::span<const std::uint32_t>(std::array{node.hyperplane}));
  });
  out.template write<std::uint32_t>("tree/hyperplane_id", share[hyperplanes], 1,
                                    [&](const auto& append) { append(std::span(snapshot.tree.ids)); });
  out.template write<double>("tree/hyperplanes", share[hyperplanes],
                             static_cast<std::size_t>(snapshot.head.dimension) + 1,
                             [&](const auto& append) { append(std::span(snapshot.tree.hyperplanes)); });
}

template <typename Out>
void write_regions(Out& out, const Snapshot& snapshot, const Share& share) {
  const auto column = [&]<typename T>(const char* name, T SnapshotRegion::*member) {
    out.template write<T>(name, share, 1, [&](const auto& append) {
      for (const SnapshotRegion& region : snapshot.regions) append(std::span<const T>(&(region.*member), 1));
    });
  };
  column("regions/number", &SnapshotRegion::number);
  column("regions/root", &SnapshotRegion::root);
  column("regions/cells", &SnapshotRegion::cells);
  column("regions/nodes", &SnapshotRegion::nodes);
  column("regions/hyperplanes", &SnapshotRegion::hyperplanes);
}

template <typename Out>
void write_frontier(Out& out, const Snapshot& snapshot, const std::vector<Share>& share, int rank) {
  out.template write<std::uint32_t>("frontier/region", share[frontier], 1,
                                    [&](const auto& append) { append(std::span(snapshot.frontier_region)); });
  out.template write<std::uint64_t>("frontier/tokens", share[frontier], 1,
                                    [&](const auto& append) { append(std::span(snapshot.frontier_tokens)); });
  out.template write<std::uint64_t>("frontier/open", share[frontier], 1,
                                    [&](const auto& append) { append(std::span(snapshot.frontier_open)); });
  out.template write<std::uint64_t>("frontier/offset", offsets(share[frontier], rank), 1,
                                    [&](const auto& append) {
                                      std::vector<std::uint64_t> ends;
                                      if (rank == 0) ends.push_back(0);
                                      std::uint64_t end = share[archived].before;
                                      for (const std::string& archive : snapshot.frontier_archive)
                                        ends.push_back(end += archive.size());
                                      append(std::span<const std::uint64_t>(ends));
                                    });
  out.template write<char>("frontier/archive", share[archived], 1, [&](const auto& append) {
    for (const std::string& archive : snapshot.frontier_archive) append(std::span<const char>(archive));
  });
}

/// One a line.
std::string lines(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + '\n';
  return text;
}

void write_attributes(hid_t file, const SnapshotHead& head) {
  const auto number = [&](const char* name, const auto& value) { hdf5::write_attribute(file, name, value); };
  number("format", format_name);
  number("version", format_version);
  number("dimension", head.dimension);
  number("coincidence", head.coincidence);
  number("curved", static_cast<std::uint32_t>(head.curved));
  if (head.parts_by_colour) number("parts_by_colour", std::uint32_t{1});
  number("tolerance", head.tolerance);
  if (head.angle > 0) {
    number("angle", head.angle);
    for (std::size_t i = 0; i < head.eye.size(); ++i) number(eye_attribute(i).c_str(), head.eye[i]);
  }
  number("level", head.level ? static_cast<std::int32_t>(*head.level) : std::int32_t{-1});
  number("keep", static_cast<std::uint32_t>(head.keep_in | head.keep_fuzzy << 1 | head.keep_out << 2));
  number("hyperplanes", head.hyperplanes);
  number("steps", head.steps);
  number("complete", static_cast<std::uint32_t>(head.complete));
  number("in_cells", head.in_cells);
  number("out_cells", head.out_cells);
  number("in_volume", head.in_volume);
  number("digest", head.digest);
  number("partition_root", head.partition_root);
  if (head.is_portion) number("portion", std::uint32_t{1});
}

/// What the first writer writes alone.
template <typename Out>
void write_head(Out& out, const SnapshotHead& head, const std::string& superstep_names, int rank) {
  const auto list = [&]<typename T>(const char* name, std::span<const T> values) {
    const std::uint64_t n = values.size();
    out.template write<T>(name, rank == 0 ? Share{0, n, n} : Share{n, 0, n}, 1, [&](const auto& append) {
      if (rank == 0) append(values);
    });
  };
  list.template operator()<char>("source/path", head.model);
  list.template operator()<char>("source/text", head.source);
  list.template operator()<char>("totals", head.totals);
  list.template operator()<std::uint32_t>("partition/hyperplane", head.partition_hyperplane);
  list.template operator()<std::int32_t>("partition/children", head.partition_children);
  list.template operator()<char>("supersteps/name", superstep_names);
  list.template operator()<std::uint32_t>("supersteps/step", head.superstep_step);
  list.template operator()<std::uint32_t>("supersteps/rank", head.superstep_rank);
  list.template operator()<double>("supersteps/seconds", head.superstep_seconds);
  list.template operator()<double>("supersteps/work_seconds", head.superstep_work_seconds);
  list.template operator()<double>("supersteps/predicted_seconds", head.superstep_predicted_seconds);
  list.template operator()<std::uint64_t>("supersteps/bytes_sent", head.superstep_bytes_sent);
  list.template operator()<std::uint64_t>("supersteps/bytes_received", head.superstep_bytes_received);
  list.template operator()<std::uint64_t>("supersteps/cells", head.superstep_cells);
}

/// What the file will take, rather a little more: chunks are whole, and HDF5 has its own data.
std::uint64_t bytes_of(const std::vector<Share>& share, const SnapshotHead& head) {
  const auto d = static_cast<std::uint64_t>(head.dimension);
  const auto array = [&](Count kind, std::uint64_t size) {
    const std::uint64_t rows = share[kind].total, chunk = hdf5::chunk_rows(rows);
    return (rows + chunk - 1) / chunk * chunk * size;
  };
  std::uint64_t bytes = array(points, 8 * d) + array(corners, 2) + array(frontier, 28) + array(archived, 1) +
                        array(regions, 20);
  for (const std::uint64_t size : {8, 8, 1, 4, 4, 4, 2, 8}) bytes += array(cells, size);
  for (const std::uint64_t size : {8, 4}) bytes += array(facets, size);
  for (const std::uint64_t size : {8, 4}) bytes += array(nodes, size);
  bytes += array(hyperplanes, 4) + array(hyperplanes, 8 * (d + 1));
  bytes +=
      head.source.size() + head.model.size() + head.totals.size() + head.partition_hyperplane.size() * 12;
  for (const std::string& name : head.superstep_name)
    bytes += name.size() + 1 + 56;  // a row of the table of supersteps
  return bytes + bytes / 64 + (std::uint64_t{1} << 16);
}

/// Better not to begin than to run into the end of a disk. @throws Failure if there is not enough room.
void check_room(const fs::path& path, std::uint64_t bytes) {
  if (const std::string why = lack_of_room(path, bytes); !why.empty()) throw Failure(why);
}

/// What the writing needs besides the snapshot.
struct Prepared {
  std::string superstep_names;
  std::vector<Share> share;
};

template <typename Out>
void write_arrays(Out& out, const Snapshot& snapshot, const Prepared& prepared, int rank) {
  const auto& [superstep_names, share] = prepared;
  write_head(out, snapshot.head, superstep_names, rank);
  write_frontier(out, snapshot, share, rank);
  write_cells(out, snapshot, share, rank);
  write_tree(out, snapshot, share);
  write_regions(out, snapshot, share[regions]);
}

/// The file without what is in its arrays. For the first writer. @return where their chunks belong.
std::vector<std::uint64_t> make_file(const fs::path& path, const Snapshot& snapshot,
                                     const Prepared& prepared) {
  const hdf5::Silence silence;
  const hdf5::SkeletonDriver driver;
  const Handle access = file_access();
  driver.set(access);
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  write_attributes(file, snapshot.head);
  hdf5::ArrayMaker arrays(file);
  write_arrays(arrays, snapshot, prepared, 0);
  file.close();
  return hdf5::SkeletonDriver::take_places();
}

/// An open file.
class Descriptor {
 public:
  Descriptor(const fs::path& path, int flags) : number_(::open(path.c_str(), flags | O_CLOEXEC, 0666)) {
    if (number_ < 0) fail();
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  operator int() const { return number_; }
  /// To the disk. A page that belongs to two machines may then not be written back whole from this one's
  /// cache. @throws Failure
  void sync() const {
    if (::fsync(number_) != 0 && errno != EINVAL) fail();
    ::posix_fadvise(number_, 0, 0, POSIX_FADV_DONTNEED);
  }
  /// @throws Failure: some systems tell only now that the disk is full.
  void close() {
    if (::close(std::exchange(number_, -1)) != 0) fail();
  }

 private:
  int number_;
  [[noreturn]] static void fail() { throw Failure(std::generic_category().message(errno)); }
};

/// Whatever ends the writing, no unfinished file stays.
struct LeavesNothing {
  fs::path unfinished;  // empty: it is another one's
  ~LeavesNothing() {
    std::error_code ignored;
    if (!unfinished.empty()) fs::remove(unfinished, ignored);
  }
};

std::string refusal(const fs::path& path, const std::string& why) {
  return "cannot write the snapshot '" + path.string() + "': " + why +
         "; the one before it, if any, is as it was";
}

/// Runs a part of the writing on this process, then asks the others. @throws bsp2::Error on all if it failed
/// on one.
template <typename Body>
void together(const fs::path& path, const SnapshotWriters& writers, const Body& body) {
  std::string why;
  try {
    body();
  } catch (const Failure& failure) {
    why = failure.what();
    if (why.empty()) why = "it failed";
  }
  if (writers.count > 1)
    for (const auto& letters : writers.exchange({why.begin(), why.end()}))
      if (why.empty()) why.assign(letters.begin(), letters.end());
  if (!why.empty()) throw RefusedSnapshot(refusal(path, why));
}

/// Fills the arrays of a file that is made; each writer its own rows.
void fill_file(const fs::path& path, const fs::path& unfinished, const Snapshot& snapshot,
               const SnapshotWriters& writers, const Prepared& prepared,
               const std::vector<std::uint64_t>& places) {
  std::optional<Descriptor> file;
  std::optional<hdf5::ArrayWriter> arrays;
  together(path, writers, [&] {
    arrays.emplace(file.emplace(unfinished, O_WRONLY), places);
    write_arrays(*arrays, snapshot, prepared, writers.rank);
  });
  std::vector<std::vector<std::uint64_t>> sums;
  if (writers.count > 1) sums = writers.exchange(arrays->shared_sums());
  together(path, writers, [&] {
    arrays->write_shared_sums(sums, writers.rank);
    if (writers.count > 1) file->sync();
    file->close();
  });
}

}  // namespace

void snapshot::write(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers) {
  const fs::path unfinished = unfinished_name(path);
  std::optional<WritingLock> lock;
  LeavesNothing clean_up{};  // before there is a lock the unfinished file is another run's
  const Prepared prepared{lines(snapshot.head.superstep_name), shares(snapshot, writers)};
  std::vector<std::uint64_t> places;
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    std::error_code error;
    fs::create_directories(folder_of(path), error);
    lock.emplace(path);
    if (!lock->why_not().empty()) throw Failure(lock->why_not());
    clean_up.unfinished = unfinished;
    // What HDF5 would say about a missing folder or a missing right is not for users.
    Descriptor(unfinished, O_WRONLY | O_CREAT | O_TRUNC).close();
    check_room(path, bytes_of(prepared.share, snapshot.head));
    places = make_file(unfinished, snapshot, prepared);
    if (writers.count > 1) Descriptor(unfinished, O_RDWR).sync();
  });
  if (writers.count > 1) places = writers.exchange(places).front();
  fill_file(path, unfinished, snapshot, writers, prepared, places);
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    if (const std::error_code error = put_in_place(path)) throw Failure(error.message());
  });
}

}  // namespace bsp2::io
