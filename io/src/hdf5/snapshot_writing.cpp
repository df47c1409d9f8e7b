#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <numeric>
#include <span>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "files/replacing.hpp"
#include "hdf5/hdf5.hpp"
#include "hdf5/snapshot_format.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::CellBatch;
using hdf5::check;
using hdf5::Failure;
using hdf5::Handle;
using snapshot::eye_attribute;
using snapshot::file_access;
using snapshot::format_name;
using snapshot::format_version;

constexpr std::size_t slab = std::size_t{1} << 16;  // elements written at once, and of a chunk

/// How many elements of each kind all writers have, and where ours begin.
struct Share {
  std::uint64_t before = 0, mine = 0, total = 0, largest = 0;
};

/// Writes arrays together with the other writers.
///
/// What goes wrong here alone must not keep this process from the calls that are collective: the others would
/// wait for it for ever. So a failure is kept, the rest is written without data, and `rethrow` comes when the
/// file is closed. But after a failure of HDF5 itself the processes are in different places of it, and no
/// call brings them together: that is thrown at once.
class ArrayWriter {
 public:
  ArrayWriter(hid_t file, const SnapshotWriters& writers)
      : file_(file), writers_(writers), transfer_(H5Pcreate(H5P_DATASET_XFER), H5Pclose) {
    if (writers.count > 1) check(H5Pset_dxpl_mpio(transfer_, H5FD_MPIO_COLLECTIVE));
  }

  [[nodiscard]] bool has_failed() const { return failure_ != nullptr; }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

  /// One array. @param share of its rows. @param fill called with `append(span)` to hand over our rows, in
  /// order.
  template <typename T, typename Fill>
  void write(const char* name, const Share& share, std::size_t columns, const Fill& fill) {
    const std::array<hsize_t, 2> size{share.total, columns},
        chunk{std::clamp<hsize_t>(share.total, 1, slab), columns};
    const int rank = columns == 1 ? 1 : 2;
    const Handle space(H5Screate_simple(rank, size.data(), nullptr), H5Sclose);
    const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    check(H5Pset_attr_phase_change(creation, 0, 0));
    if (share.total > 0) {
      check(H5Pset_chunk(creation, rank, chunk.data()));
      check(H5Pset_fletcher32(creation));
      check(H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER));
    }
    const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
    check(H5Pset_create_intermediate_group(links, 1));
    Handle dataset(H5Dcreate2(file_, name, hdf5::file_type<T>(), space, links, creation, H5P_DEFAULT),
                   H5Dclose);
    if (share.total == 0) return;

    std::vector<T> buffer;
    hsize_t at = share.before, written = 0;
    std::uint64_t slabs = 0;
    const auto flush = [&] {
      ++slabs;
      const std::array<hsize_t, 2> start{at, 0}, count{buffer.size() / columns, columns};
      const Handle memory(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
      const Handle target(H5Scopy(space), H5Sclose);
      if (buffer.empty()) {
        check(H5Sselect_none(memory));
        check(H5Sselect_none(target));
      } else {
        check(H5Sselect_hyperslab(target, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
      }
      try {
        check(H5Dwrite(dataset, hdf5::memory_type<T>(), memory, target, transfer_, buffer.data()));
      } catch (const Failure&) {
        if (writers_.count > 1) dataset.abandon();  // to close it may be to wait for the others
        throw;
      }
      at += count[0];
      written += count[0];
      buffer.clear();
    };
    attempt([&] {
      rethrow();  // one failed already: no more data
      const std::size_t full = slab * columns;
      buffer.reserve(std::min<std::size_t>(full, share.mine * columns));
      fill([&](std::span<const T> values) {
        while (!values.empty()) {
          const std::size_t part = std::min(values.size(), full - buffer.size());
          buffer.insert(buffer.end(), values.begin(), values.begin() + static_cast<std::ptrdiff_t>(part));
          values = values.subspan(part);
          if (buffer.size() == full) flush();
        }
      });
      if (!buffer.empty()) flush();
      if (written != share.mine)
        throw std::logic_error(std::string("a snapshot's array ") + name +
                               " has not the length it was given");
    });
    buffer.clear();
    // A collective write needs everybody as often as the one with the most data.
    while (slabs < (share.largest + slab - 1) / slab) attempt(flush);
  }

  /// A list that the first writer has.
  template <typename T>
  void write_head(const char* name, std::span<const T> values) {
    const bool mine = writers_.rank == 0;
    write<T>(name, {mine ? 0 : values.size(), mine ? values.size() : 0, values.size(), values.size()}, 1,
             [&](const auto& append) {
               if (mine) append(values);
             });
  }

 private:
  hid_t file_;
  const SnapshotWriters& writers_;
  Handle transfer_;
  std::exception_ptr failure_;  // the first one

  template <typename Body>
  void attempt(const Body& body) {
    try {
      body();
    } catch (const Failure&) {
      if (writers_.count > 1) throw;
      if (!failure_) failure_ = std::current_exception();
    } catch (...) {
      if (!failure_) failure_ = std::current_exception();
    }
  }
};

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
      share.largest = std::max(share.largest, all[rank][kind]);
      share.mine = mine[kind];
    }
  return result;
}

/// One more row for the first writer: offsets begin with a 0.
Share offsets(Share share, int rank) {
  ++share.total;
  ++share.largest;
  if (rank == 0)
    ++share.mine;
  else
    ++share.before;
  return share;
}

void write_cells(ArrayWriter& out, const Snapshot& snapshot, const std::vector<Share>& share, int rank) {
  const auto column = [&]<typename T>(const char* name, const Share& rows, std::size_t columns,
                                      std::vector<T> CellBatch::*member) {
    out.write<T>(name, rows, columns, [&](const auto& append) {
      for (const auto& batch : snapshot.cells) append(std::span<const T>((*batch).*member));
    });
  };
  const auto offset = [&](const char* name, const Share& rows, std::uint64_t base,
                          std::vector<std::uint32_t> CellBatch::*member) {
    out.write<std::uint64_t>(name, offsets(rows, rank), 1, [&](const auto& append) {
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
  column("cells/points", share[points], static_cast<std::size_t>(snapshot.head.dimension),
         &CellBatch::points);
  offset("cells/point_offset", share[cells], share[points].before, &CellBatch::point_offset);
  offset("cells/facet_offset", share[cells], share[facets].before, &CellBatch::facet_offset);
  offset("cells/facet_vertex_offset", share[facets], share[corners].before, &CellBatch::facet_vertex_offset);
  column("cells/facet_vertices", share[corners], 1, &CellBatch::facet_vertices);
  column("cells/facet_hyperplane", share[facets], 1, &CellBatch::facet_hyperplane);
  out.write<std::uint8_t>("cells/label", share[cells], 1, [&](const auto& append) {
    for (const auto& batch : snapshot.cells)
      append(std::span(reinterpret_cast<const std::uint8_t*>(batch->label.data()), batch->size()));
  });
  column("cells/primitive", share[cells], 1, &CellBatch::primitive);
  column("cells/part", share[cells], 1, &CellBatch::part);
  column("cells/region", share[cells], 1, &CellBatch::region);
  column("cells/level", share[cells], 1, &CellBatch::level);
  column("cells/volume", share[cells], 1, &CellBatch::volume);
}

void write_tree(ArrayWriter& out, const Snapshot& snapshot, const std::vector<Share>& share) {
  out.write<std::int32_t>("tree/children", share[nodes], 2, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes)
      append(std::span<const std::int32_t>(std::array{node.negative, node.positive}));
  });
  out.write<std::uint32_t>("tree/node_hyperplane", share[nodes], 1, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes)
      append(std::span<const std::uint32_t>(std::array{node.hyperplane}));
  });
  out.write<std::uint32_t>("tree/hyperplane_id", share[hyperplanes], 1,
                           [&](const auto& append) { append(std::span(snapshot.tree.ids)); });
  out.write<double>("tree/hyperplanes", share[hyperplanes],
                    static_cast<std::size_t>(snapshot.head.dimension) + 1,
                    [&](const auto& append) { append(std::span(snapshot.tree.hyperplanes)); });
}

void write_regions(ArrayWriter& out, const Snapshot& snapshot, const Share& share) {
  const auto column = [&]<typename T>(const char* name, T SnapshotRegion::*member) {
    out.write<T>(name, share, 1, [&](const auto& append) {
      for (const SnapshotRegion& region : snapshot.regions) append(std::span<const T>(&(region.*member), 1));
    });
  };
  column("regions/number", &SnapshotRegion::number);
  column("regions/root", &SnapshotRegion::root);
  column("regions/cells", &SnapshotRegion::cells);
  column("regions/nodes", &SnapshotRegion::nodes);
  column("regions/hyperplanes", &SnapshotRegion::hyperplanes);
}

void write_frontier(ArrayWriter& out, const Snapshot& snapshot, const std::vector<Share>& share, int rank) {
  out.write<std::uint32_t>("frontier/region", share[frontier], 1,
                           [&](const auto& append) { append(std::span(snapshot.frontier_region)); });
  out.write<std::uint64_t>("frontier/tokens", share[frontier], 1,
                           [&](const auto& append) { append(std::span(snapshot.frontier_tokens)); });
  out.write<std::uint64_t>("frontier/open", share[frontier], 1,
                           [&](const auto& append) { append(std::span(snapshot.frontier_open)); });
  out.write<std::uint64_t>("frontier/offset", offsets(share[frontier], rank), 1, [&](const auto& append) {
    std::vector<std::uint64_t> ends;
    if (rank == 0) ends.push_back(0);
    std::uint64_t end = share[archived].before;
    for (const std::string& archive : snapshot.frontier_archive) ends.push_back(end += archive.size());
    append(std::span<const std::uint64_t>(ends));
  });
  out.write<char>("frontier/archive", share[archived], 1, [&](const auto& append) {
    for (const std::string& archive : snapshot.frontier_archive) append(std::span<const char>(archive));
  });
}

/// One a line.
std::string lines(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += word + '\n';
  return text;
}

void write_head(hid_t file, ArrayWriter& out, const SnapshotHead& head, const std::string& superstep_names) {
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
  out.write_head<char>("source/path", head.model);
  out.write_head<char>("source/text", head.source);
  out.write_head<char>("totals", head.totals);
  out.write_head<std::uint32_t>("partition/hyperplane", head.partition_hyperplane);
  out.write_head<std::int32_t>("partition/children", head.partition_children);
  out.write_head<char>("supersteps/name", superstep_names);
  out.write_head<std::uint32_t>("supersteps/step", head.superstep_step);
  out.write_head<std::uint32_t>("supersteps/rank", head.superstep_rank);
  out.write_head<double>("supersteps/seconds", head.superstep_seconds);
  out.write_head<double>("supersteps/work_seconds", head.superstep_work_seconds);
  out.write_head<double>("supersteps/predicted_seconds", head.superstep_predicted_seconds);
  out.write_head<std::uint64_t>("supersteps/bytes_sent", head.superstep_bytes_sent);
  out.write_head<std::uint64_t>("supersteps/bytes_received", head.superstep_bytes_received);
  out.write_head<std::uint64_t>("supersteps/cells", head.superstep_cells);
}

/// Whether all writers are well. Collective.
bool all_well(bool well, const SnapshotWriters& writers) {
  if (writers.count == 1) return well;
  for (const auto& answer : writers.exchange({well ? 1U : 0U}))
    if (answer.front() == 0) return false;
  return true;
}

/// MPI-IO does not tell why a write failed, so the system is asked again: a write behind what is there fails
/// likewise.
/// @return its reason; empty if that write succeeds.
std::string reason_of_failed_write(const fs::path& file) {
  const std::vector<char> bytes(std::size_t{1} << 20);
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  ssize_t written = descriptor < 0 ? -1 : 0;
  for (std::size_t left = bytes.size(); left > 0 && written >= 0;
       left -= static_cast<std::size_t>(std::max<ssize_t>(0, written)))
    written = ::write(descriptor, bytes.data(), left);
  const std::string reason = written < 0 ? std::generic_category().message(errno) : "";
  if (descriptor >= 0) ::close(descriptor);
  return reason;
}

/// What the file will take, rather a little more: chunks are whole, and HDF5 has its own data.
std::uint64_t bytes_of(const std::vector<Share>& share, const SnapshotHead& head) {
  const auto d = static_cast<std::uint64_t>(head.dimension);
  const auto array = [&](Count kind, std::uint64_t size) {
    const std::uint64_t rows = share[kind].total, chunk = std::clamp<std::uint64_t>(rows, 1, slab);
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

/// Several writers that run into the end of a disk leave HDF5 in states from which it cannot find back
/// together: better not to begin. @throws Failure if there is not enough room.
void check_room(const fs::path& path, std::uint64_t bytes) {
  if (const std::string why = lack_of_room(path, bytes); !why.empty()) throw Failure(why);
}

/// What the writing needs besides the snapshot. From here on all that may throw on one process alone is in
/// the ArrayWriter's hands: nearly every call of HDF5 is collective, to begin with the copy of a property
/// list.
struct Prepared {
  std::string superstep_names;
  std::vector<Share> share;
};

void write_file(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers,
                const Prepared& prepared) {
  const auto& [superstep_names, share] = prepared;
  const Handle access = file_access(writers.count);
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  ArrayWriter out(file, writers);
  try {
    write_head(file, out, snapshot.head, superstep_names);
    write_frontier(out, snapshot, share, writers.rank);
    write_cells(out, snapshot, share, writers.rank);
    write_tree(out, snapshot, share);
    write_regions(out, snapshot, share[regions]);
    // To close a file together that could not be written, HDF5 takes different ways on the processes, and
    // they wait for each other for ever. So it stays open.
    if (writers.count > 1 && !all_well(!out.has_failed(), writers))
      file.abandon();
    else
      file.close();
  } catch (...) {
    if (writers.count > 1) file.abandon();
    out.rethrow();  // what failed first is the cause
    throw;
  }
  out.rethrow();
}

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
  if (!all_well(why.empty(), writers))
    throw RefusedSnapshot(refusal(path, why.empty() ? "another process failed" : why));
}

/// The part in which HDF5 is collective. Where it fails on one process alone, the others may wait in it for
/// ever, so nobody waits for them: whoever runs all processes has to end them.
void write_together(const fs::path& path, const fs::path& unfinished, const Snapshot& snapshot,
                    const SnapshotWriters& writers, const Prepared& prepared) {
  if (writers.count == 1)
    return together(path, writers, [&] { write_file(unfinished, snapshot, writers, prepared); });
  try {
    write_file(unfinished, snapshot, writers, prepared);
    together(path, writers, [] {});  // nobody goes on to the file's name before all have closed it
  } catch (const Failure& failure) {
    const std::string reason = reason_of_failed_write(unfinished);
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    throw Error(refusal(path, reason.empty() ? failure.what() : reason));
  }
}

}  // namespace

void snapshot::write(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers) {
  const hdf5::Silence silence;
  const fs::path unfinished = unfinished_name(path);
  const LeavesNothing clean_up{writers.rank == 0 ? unfinished : fs::path()};
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    std::error_code error;
    fs::create_directories(folder_of(path), error);
    // What HDF5 would say about a missing folder or a missing right is not for users.
    const int descriptor = ::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor < 0) throw Failure(std::generic_category().message(errno));
    ::close(descriptor);
  });
  Prepared prepared;
  together(path, writers, [&] {
    prepared = {lines(snapshot.head.superstep_name), shares(snapshot, writers)};
  });
  together(path, writers, [&] {
    if (writers.rank == 0) check_room(path, bytes_of(prepared.share, snapshot.head));
  });
  write_together(path, unfinished, snapshot, writers, prepared);
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    if (const std::error_code error = put_in_place(path)) throw Failure(error.message());
  });
}

}  // namespace bsp2::io
