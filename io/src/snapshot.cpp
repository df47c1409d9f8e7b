#include "bsp2/io/snapshot.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <exception>
#include <numeric>
#include <span>
#include <system_error>

#include "bsp2/geometry/error.hpp"
#include "bsp2/io/file.hpp"
#include "hdf5.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::CellBatch;
using hdf5::check;
using hdf5::Failure;
using hdf5::Handle;

const std::string format_name = "bsp2 snapshot";
constexpr std::int32_t format_version = 2;
constexpr std::size_t slab = std::size_t{1} << 16;  // elements written at once, and of a chunk

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }
fs::path unfinished_name(const fs::path& path) { return folder_of(path) / ("." + path.filename().string() + ".part"); }

/// How many elements of each kind all writers have, and where ours begin.
struct Share {
  std::uint64_t before = 0, mine = 0, total = 0, largest = 0;
};

/// Writes arrays together with the other writers.
///
/// What goes wrong here alone must not keep this process from the calls that are collective: the others would wait for it
/// for ever. So a failure is kept, the rest is written without data, and `rethrow` comes when the file is closed. But after a
/// failure of HDF5 itself the processes are in different places of it, and no call brings them together: that is thrown at once.
class ArrayWriter {
 public:
  ArrayWriter(hid_t file, const SnapshotWriters& writers) : file_(file), writers_(writers), transfer_(H5Pcreate(H5P_DATASET_XFER), H5Pclose) {
    if (writers.count > 1) check(H5Pset_dxpl_mpio(transfer_, H5FD_MPIO_COLLECTIVE));
  }

  [[nodiscard]] bool has_failed() const { return failure_ != nullptr; }
  void rethrow() const {
    if (failure_) std::rethrow_exception(failure_);
  }

  /// One array. @param share of its rows. @param fill called with `append(span)` to hand over our rows, in order.
  template <typename T, typename Fill>
  void write(const char* name, const Share& share, std::size_t columns, const Fill& fill) {
    const std::array<hsize_t, 2> size{share.total, columns}, chunk{std::clamp<hsize_t>(share.total, 1, slab), columns};
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
    Handle dataset(H5Dcreate2(file_, name, hdf5::file_type<T>(), space, links, creation, H5P_DEFAULT), H5Dclose);
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
      if (written != share.mine) throw std::logic_error(std::string("a snapshot's array ") + name + " has not the length it was given");
    });
    buffer.clear();
    // A collective write needs everybody as often as the one with the most data.
    while (slabs < (share.largest + slab - 1) / slab) attempt(flush);
  }

  /// A list that the first writer has.
  template <typename T>
  void write_head(const char* name, std::span<const T> values) {
    const bool mine = writers_.rank == 0;
    write<T>(name, {mine ? 0 : values.size(), mine ? values.size() : 0, values.size(), values.size()}, 1, [&](const auto& append) {
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
enum Count : std::size_t { cells, points, facets, corners, nodes, hyperplanes, frontier, archived, regions, count_kinds };

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
  const auto column = [&]<typename T>(const char* name, const Share& rows, std::size_t columns, std::vector<T> CellBatch::*member) {
    out.write<T>(name, rows, columns, [&](const auto& append) {
      for (const auto& batch : snapshot.cells) append(std::span<const T>((*batch).*member));
    });
  };
  const auto offset = [&](const char* name, const Share& rows, std::uint64_t base, std::vector<std::uint32_t> CellBatch::*member) {
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
  column("cells/points", share[points], static_cast<std::size_t>(snapshot.head.dimension), &CellBatch::points);
  offset("cells/point_offset", share[cells], share[points].before, &CellBatch::point_offset);
  offset("cells/facet_offset", share[cells], share[facets].before, &CellBatch::facet_offset);
  offset("cells/facet_vertex_offset", share[facets], share[corners].before, &CellBatch::facet_vertex_offset);
  column("cells/facet_vertices", share[corners], 1, &CellBatch::facet_vertices);
  column("cells/facet_hyperplane", share[facets], 1, &CellBatch::facet_hyperplane);
  out.write<std::uint8_t>("cells/label", share[cells], 1, [&](const auto& append) {
    for (const auto& batch : snapshot.cells) append(std::span(reinterpret_cast<const std::uint8_t*>(batch->label.data()), batch->size()));
  });
  column("cells/part", share[cells], 1, &CellBatch::part);
  column("cells/region", share[cells], 1, &CellBatch::region);
  column("cells/level", share[cells], 1, &CellBatch::level);
  column("cells/volume", share[cells], 1, &CellBatch::volume);
}

void write_tree(ArrayWriter& out, const Snapshot& snapshot, const std::vector<Share>& share) {
  out.write<std::int32_t>("tree/children", share[nodes], 2, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes) append(std::span<const std::int32_t>(std::array{node.negative, node.positive}));
  });
  out.write<std::uint32_t>("tree/node_hyperplane", share[nodes], 1, [&](const auto& append) {
    for (const auto& node : snapshot.tree.nodes) append(std::span<const std::uint32_t>(std::array{node.hyperplane}));
  });
  out.write<std::uint32_t>("tree/hyperplane_id", share[hyperplanes], 1, [&](const auto& append) { append(std::span(snapshot.tree.ids)); });
  out.write<double>("tree/hyperplanes", share[hyperplanes], static_cast<std::size_t>(snapshot.head.dimension) + 1,
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
  out.write<std::uint32_t>("frontier/region", share[frontier], 1, [&](const auto& append) { append(std::span(snapshot.frontier_region)); });
  out.write<std::uint64_t>("frontier/tokens", share[frontier], 1, [&](const auto& append) { append(std::span(snapshot.frontier_tokens)); });
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

/// The coordinates of the eye are attributes; they are there only if there is an eye.
std::string eye_attribute(std::size_t axis) { return "eye_" + std::to_string(axis + 1); }

void write_head(hid_t file, ArrayWriter& out, const SnapshotHead& head, const std::string& superstep_names) {
  const auto number = [&](const char* name, const auto& value) { hdf5::write_attribute(file, name, value); };
  number("format", format_name);
  number("version", format_version);
  number("dimension", head.dimension);
  number("coincidence", head.coincidence);
  number("curved", static_cast<std::uint32_t>(head.curved));
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

/// Metadata with checksums, and no open dataset that keeps a file open after it was closed.
Handle file_access(std::int64_t given) {
  Handle access(given != 0 ? H5Pcopy(static_cast<hid_t>(given)) : H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  check(H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110));
  check(H5Pset_fclose_degree(access, H5F_CLOSE_STRONG));
  return access;
}

/// Whether all writers are well. Collective.
bool all_well(bool well, const SnapshotWriters& writers) {
  if (writers.count == 1) return well;
  for (const auto& answer : writers.exchange({well ? 1U : 0U}))
    if (answer.front() == 0) return false;
  return true;
}

/// MPI-IO does not tell why a write failed, so the system is asked again: a write behind what is there fails likewise.
/// @return its reason; empty if that write succeeds.
std::string reason_of_failed_write(const fs::path& file) {
  const std::vector<char> bytes(std::size_t{1} << 20);
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  ssize_t written = descriptor < 0 ? -1 : 0;
  for (std::size_t left = bytes.size(); left > 0 && written >= 0; left -= static_cast<std::size_t>(std::max<ssize_t>(0, written)))
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
  std::uint64_t bytes = array(points, 8 * d) + array(corners, 2) + array(frontier, 20) + array(archived, 1) + array(regions, 20);
  for (const std::uint64_t size : {8, 8, 1, 4, 4, 2, 8}) bytes += array(cells, size);
  for (const std::uint64_t size : {8, 4}) bytes += array(facets, size);
  for (const std::uint64_t size : {8, 4}) bytes += array(nodes, size);
  bytes += array(hyperplanes, 4) + array(hyperplanes, 8 * (d + 1));
  bytes += head.source.size() + head.model.size() + head.totals.size() + head.partition_hyperplane.size() * 12;
  for (const std::string& name : head.superstep_name) bytes += name.size() + 1 + 56;  // a row of the table of supersteps
  return bytes + bytes / 64 + (std::uint64_t{1} << 16);
}

/// Several writers that run into the end of a disk leave HDF5 in states from which it cannot find back together: better not to
/// begin. @throws Failure if there is not enough room.
void check_room(const fs::path& folder, std::uint64_t bytes) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error || space.available >= bytes) return;
  throw Failure("No space left on device: " + std::to_string(bytes) + " bytes are needed, " + std::to_string(space.available) + " are free");
}

/// What the writing needs besides the snapshot. From here on all that may throw on one process alone is in the
/// ArrayWriter's hands: nearly every call of HDF5 is collective, to begin with the copy of a property list.
struct Prepared {
  std::string superstep_names;
  std::vector<Share> share;
};

void write_file(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers, const Prepared& prepared) {
  const auto& [superstep_names, share] = prepared;
  const Handle access = file_access(writers.file_access);
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  ArrayWriter out(file, writers);
  try {
    write_head(file, out, snapshot.head, superstep_names);
    write_frontier(out, snapshot, share, writers.rank);
    write_cells(out, snapshot, share, writers.rank);
    write_tree(out, snapshot, share);
    write_regions(out, snapshot, share[regions]);
    // To close a file together that could not be written, HDF5 takes different ways on the processes, and they wait for each
    // other for ever. So it stays open.
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

/// To the disk, not only to the system's cache.
void sync(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced && error != EINVAL) throw Failure(std::generic_category().message(error));
}

/// Whatever ends the writing, no unfinished file stays.
struct LeavesNothing {
  fs::path unfinished;  // empty: it is another one's
  ~LeavesNothing() {
    std::error_code ignored;
    if (!unfinished.empty()) fs::remove(unfinished, ignored);
  }
};

[[noreturn]] void refuse(const fs::path& path, const std::string& why) {
  throw Error("cannot write the snapshot '" + path.string() + "': " + why + "; the one before it, if any, is as it was");
}

/// Runs a part of the writing on this process, then asks the others. @throws bsp2::Error on all if it failed on one.
template <typename Body>
void together(const fs::path& path, const SnapshotWriters& writers, const Body& body) {
  std::string why;
  try {
    body();
  } catch (const Failure& failure) {
    why = failure.what();
    if (why.empty()) why = "it failed";
  }
  if (!all_well(why.empty(), writers)) refuse(path, why.empty() ? "another process failed" : why);
}

/// The part in which HDF5 is collective. Where it fails on one process alone, the others may wait in it for ever, so nobody
/// waits for them: whoever runs all processes has to end them.
void write_together(const fs::path& path, const fs::path& unfinished, const Snapshot& snapshot, const SnapshotWriters& writers, const Prepared& prepared) {
  if (writers.count == 1) return together(path, writers, [&] { write_file(unfinished, snapshot, writers, prepared); });
  try {
    write_file(unfinished, snapshot, writers, prepared);
    together(path, writers, [] {});  // nobody goes on to the file's name before all have closed it
  } catch (const Failure& failure) {
    const std::string reason = reason_of_failed_write(unfinished);
    std::error_code ignored;
    fs::remove(unfinished, ignored);
    refuse(path, reason.empty() ? failure.what() : reason);
  }
}

// --- Reading ---

SnapshotHead read_head(hid_t file) {
  SnapshotHead head;
  head.dimension = hdf5::read_attribute<std::int32_t>(file, "dimension");
  if (head.dimension < 1 || head.dimension > 6) throw Failure("its dimension is " + std::to_string(head.dimension));
  head.coincidence = hdf5::read_attribute<double>(file, "coincidence");
  head.curved = hdf5::read_attribute<std::uint32_t>(file, "curved") != 0;
  head.tolerance = hdf5::read_attribute<double>(file, "tolerance");
  if (H5Aexists(file, "angle") > 0) {
    head.angle = hdf5::read_attribute<double>(file, "angle");
    for (std::int32_t i = 0; i < head.dimension; ++i) head.eye.push_back(hdf5::read_attribute<double>(file, eye_attribute(static_cast<std::size_t>(i)).c_str()));
  }
  const auto level = hdf5::read_attribute<std::int32_t>(file, "level");
  if (level >= 0) head.level = static_cast<std::uint32_t>(level);
  const auto keep = hdf5::read_attribute<std::uint32_t>(file, "keep");
  head.keep_in = (keep & 1U) != 0;
  head.keep_fuzzy = (keep & 2U) != 0;
  head.keep_out = (keep & 4U) != 0;
  head.hyperplanes = hdf5::read_text_attribute(file, "hyperplanes");
  head.steps = hdf5::read_attribute<std::uint32_t>(file, "steps");
  head.complete = hdf5::read_attribute<std::uint32_t>(file, "complete") != 0;
  head.in_cells = hdf5::read_attribute<std::uint64_t>(file, "in_cells");
  head.out_cells = hdf5::read_attribute<std::uint64_t>(file, "out_cells");
  head.in_volume = hdf5::read_attribute<double>(file, "in_volume");
  head.digest = hdf5::read_text_attribute(file, "digest");
  head.partition_root = hdf5::read_attribute<std::int32_t>(file, "partition_root");
  head.is_portion = H5Aexists(file, "portion") > 0;
  head.model = hdf5::read_text(file, "source/path");
  head.source = hdf5::read_text(file, "source/text");
  head.totals = hdf5::read_text(file, "totals");
  head.partition_hyperplane = hdf5::read_array<std::uint32_t>(file, "partition/hyperplane");
  head.partition_children = hdf5::read_array<std::int32_t>(file, "partition/children");
  if (head.partition_children.size() != 2 * head.partition_hyperplane.size()) throw Failure("the partition is incomplete");
  const std::string names = hdf5::read_text(file, "supersteps/name");
  for (std::size_t begin = 0; begin < names.size();) {
    const std::size_t end = std::min(names.find('\n', begin), names.size());
    head.superstep_name.push_back(names.substr(begin, end - begin));
    begin = end + 1;
  }
  head.superstep_step = hdf5::read_array<std::uint32_t>(file, "supersteps/step");
  head.superstep_rank = hdf5::read_array<std::uint32_t>(file, "supersteps/rank");
  head.superstep_seconds = hdf5::read_array<double>(file, "supersteps/seconds");
  head.superstep_work_seconds = hdf5::read_array<double>(file, "supersteps/work_seconds");
  head.superstep_predicted_seconds = hdf5::read_array<double>(file, "supersteps/predicted_seconds");
  head.superstep_bytes_sent = hdf5::read_array<std::uint64_t>(file, "supersteps/bytes_sent");
  head.superstep_bytes_received = hdf5::read_array<std::uint64_t>(file, "supersteps/bytes_received");
  head.superstep_cells = hdf5::read_array<std::uint64_t>(file, "supersteps/cells");
  const std::size_t rows = head.superstep_name.size();
  if (head.superstep_step.size() != rows || head.superstep_rank.size() != rows || head.superstep_seconds.size() != rows || head.superstep_work_seconds.size() != rows ||
      head.superstep_predicted_seconds.size() != rows || head.superstep_bytes_sent.size() != rows || head.superstep_bytes_received.size() != rows ||
      head.superstep_cells.size() != rows)
    throw Failure("the table of the supersteps is incomplete");
  return head;
}

/// Offsets must go up from 0 to the end of what they divide.
void check_offsets(const std::vector<std::uint64_t>& offset, std::size_t parts, std::size_t end, const char* name) {
  if (offset.size() != parts + 1 || offset.front() != 0 || offset.back() != end || !std::is_sorted(offset.begin(), offset.end()))
    throw Failure(std::string("the offsets ") + name + " do not fit");
}

/// Rows of all arrays of one kind that are wanted, in order: pairs of a begin and an end.
using Rows = std::vector<std::pair<std::uint64_t, std::uint64_t>>;

void add_rows(Rows& rows, std::uint64_t begin, std::uint64_t end) {
  if (begin == end) return;
  if (!rows.empty() && rows.back().second == begin)
    rows.back().second = end;
  else
    rows.emplace_back(begin, end);
}

/// The unfinished regions that are wanted.
void read_frontier(hid_t file, Snapshot& snapshot, SnapshotPart part, const std::function<bool(std::uint32_t)>& wanted) {
  const auto region = hdf5::read_array<std::uint32_t>(file, "frontier/region");
  const auto tokens = hdf5::read_array<std::uint64_t>(file, "frontier/tokens"), offset = hdf5::read_array<std::uint64_t>(file, "frontier/offset");
  if (tokens.size() != region.size()) throw Failure("the frontier is incomplete");
  check_offsets(offset, region.size(), hdf5::array_length(file, "frontier/archive"), "of the frontier");
  for (std::size_t i = 0; i < region.size(); ++i) {
    if (wanted && !wanted(region[i])) continue;
    snapshot.frontier_region.push_back(region[i]);
    snapshot.frontier_tokens.push_back(tokens[i]);
    if (part == SnapshotPart::head) continue;
    const auto bytes = hdf5::read_rows<char>(file, "frontier/archive", {{offset[i], offset[i + 1]}});
    snapshot.frontier_archive.emplace_back(bytes.begin(), bytes.end());
  }
}

/// Of each kind, the rows of the wanted regions.
struct Wanted {
  Rows cells, nodes, hyperplanes;
};

/// The list of regions, those that are wanted.
Wanted read_regions(hid_t file, Snapshot& snapshot, const std::function<bool(std::uint32_t)>& wanted) {
  const auto number = hdf5::read_array<std::uint32_t>(file, "regions/number");
  const auto root = hdf5::read_array<std::int32_t>(file, "regions/root");
  const auto cells = hdf5::read_array<std::uint32_t>(file, "regions/cells"), nodes = hdf5::read_array<std::uint32_t>(file, "regions/nodes"),
             hyperplanes = hdf5::read_array<std::uint32_t>(file, "regions/hyperplanes");
  const std::size_t n = number.size();
  if (root.size() != n || cells.size() != n || nodes.size() != n || hyperplanes.size() != n) throw Failure("the list of regions is incomplete");
  Wanted rows;
  std::uint64_t cell = 0, node = 0, hyperplane = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!wanted || wanted(number[i])) {
      snapshot.regions.push_back({number[i], root[i], cells[i], nodes[i], hyperplanes[i]});
      add_rows(rows.cells, cell, cell + cells[i]);
      add_rows(rows.nodes, node, node + nodes[i]);
      add_rows(rows.hyperplanes, hyperplane, hyperplane + hyperplanes[i]);
    }
    cell += cells[i];
    node += nodes[i];
    hyperplane += hyperplanes[i];
  }
  if (cell != hdf5::array_length(file, "cells/label") || node != hdf5::array_length(file, "tree/node_hyperplane") || hyperplane != hdf5::array_length(file, "tree/hyperplane_id"))
    throw Failure("the list of regions does not fit its cells");
  return rows;
}

/// Reads what an array of offsets divides into parts: their lengths. @param parts is replaced by the rows of the contents.
std::vector<std::uint32_t> read_lengths(hid_t file, const char* name, Rows& parts, std::uint64_t end) {
  std::vector<std::uint32_t> lengths;
  Rows contents;
  for (const auto& [begin, last] : parts) {
    const auto offset = hdf5::read_rows<std::uint64_t>(file, name, {{begin, last + 1}});
    if (!std::is_sorted(offset.begin(), offset.end()) || offset.back() > end) throw Failure(std::string("the offsets ") + name + " do not fit");
    for (std::size_t i = 0; i + 1 < offset.size(); ++i) lengths.push_back(static_cast<std::uint32_t>(offset[i + 1] - offset[i]));
    add_rows(contents, offset.front(), offset.back());
  }
  parts = contents;
  return lengths;
}

/// Hands out the elements of an array in order.
template <typename T>
class Slices {
 public:
  explicit Slices(std::vector<T> values) : values_(std::move(values)) {}
  std::vector<T> next(std::size_t count) {
    if (count > values_.size() - at_) throw Failure("the cells are incomplete");
    at_ += count;
    const auto end = values_.begin() + static_cast<std::ptrdiff_t>(at_);
    return {end - static_cast<std::ptrdiff_t>(count), end};
  }

 private:
  std::vector<T> values_;
  std::size_t at_ = 0;
};

/// Offsets that begin with 0, from lengths.
std::vector<std::uint32_t> offsets_of(const std::vector<std::uint32_t>& lengths) {
  std::vector<std::uint32_t> offset{0};
  for (const std::uint32_t length : lengths) offset.push_back(offset.back() + length);
  return offset;
}

/// The cells of the wanted regions, in batches of one region each.
void read_cells(hid_t file, Snapshot& snapshot, const Rows& rows) {
  const auto d = static_cast<std::size_t>(snapshot.head.dimension);
  Rows points = rows, facets = rows;
  Slices<std::uint32_t> point_count(read_lengths(file, "cells/point_offset", points, hdf5::array_length(file, "cells/points") / d));
  Slices<std::uint32_t> facet_count(read_lengths(file, "cells/facet_offset", facets, hdf5::array_length(file, "cells/facet_hyperplane")));
  Rows corners = facets;
  Slices<std::uint32_t> corner_count(read_lengths(file, "cells/facet_vertex_offset", corners, hdf5::array_length(file, "cells/facet_vertices")));
  Slices<double> all_points(hdf5::read_rows<double>(file, "cells/points", points, d));
  Slices<std::uint16_t> facet_vertices(hdf5::read_rows<std::uint16_t>(file, "cells/facet_vertices", corners));
  Slices<std::int32_t> facet_hyperplane(hdf5::read_rows<std::int32_t>(file, "cells/facet_hyperplane", facets));
  Slices<std::uint8_t> label(hdf5::read_rows<std::uint8_t>(file, "cells/label", rows));
  Slices<std::int32_t> part(hdf5::read_rows<std::int32_t>(file, "cells/part", rows));
  Slices<std::uint32_t> region(hdf5::read_rows<std::uint32_t>(file, "cells/region", rows));
  Slices<std::uint16_t> level(hdf5::read_rows<std::uint16_t>(file, "cells/level", rows));
  Slices<double> volume(hdf5::read_rows<double>(file, "cells/volume", rows));

  constexpr std::size_t batch_cells = 4096;
  for (const SnapshotRegion& of : snapshot.regions)
    for (std::size_t left = of.cells; left > 0;) {
      const std::size_t n = std::min(left, batch_cells);
      left -= n;
      auto batch = std::make_shared<CellBatch>();
      batch->dimension = snapshot.head.dimension;
      batch->point_offset = offsets_of(point_count.next(n));
      batch->facet_offset = offsets_of(facet_count.next(n));
      batch->facet_vertex_offset = offsets_of(corner_count.next(batch->facet_offset.back()));
      batch->points = all_points.next(batch->point_offset.back() * d);
      batch->facet_vertices = facet_vertices.next(batch->facet_vertex_offset.back());
      batch->facet_hyperplane = facet_hyperplane.next(batch->facet_offset.back());
      for (const std::uint8_t value : label.next(n)) {
        if (value > static_cast<std::uint8_t>(geometry::Label::fuzzy)) throw Failure("a cell has no known label");
        batch->label.push_back(static_cast<geometry::Label>(value));
      }
      batch->part = part.next(n);
      batch->region = region.next(n);
      batch->level = level.next(n);
      batch->volume = volume.next(n);
      if (std::any_of(batch->region.begin(), batch->region.end(), [&](std::uint32_t number) { return number != of.number; })) throw Failure("a cell is in another region's place");
      snapshot.cells.push_back(std::move(batch));
    }
}

void read_tree(hid_t file, Snapshot& snapshot, const Rows& nodes, const Rows& hyperplanes) {
  snapshot.tree.dimension = snapshot.head.dimension;
  const auto children = hdf5::read_rows<std::int32_t>(file, "tree/children", nodes, 2);
  const auto hyperplane = hdf5::read_rows<std::uint32_t>(file, "tree/node_hyperplane", nodes);
  snapshot.tree.hyperplanes = hdf5::read_rows<double>(file, "tree/hyperplanes", hyperplanes, static_cast<std::size_t>(snapshot.head.dimension) + 1);
  snapshot.tree.ids = hdf5::read_rows<std::uint32_t>(file, "tree/hyperplane_id", hyperplanes);
  for (std::size_t i = 0; i < hyperplane.size(); ++i) snapshot.tree.nodes.push_back({hyperplane[i], children[2 * i], children[2 * i + 1]});
  auto node = snapshot.tree.nodes.begin();
  for (const SnapshotRegion& region : snapshot.regions) {
    const auto fits = [&](std::int32_t child) { return child >= 0 ? static_cast<std::uint32_t>(child) < region.nodes : static_cast<std::uint32_t>(~child) <= region.cells; };
    bool all_fit = fits(region.root);
    for (std::uint32_t i = 0; i < region.nodes; ++i, ++node) all_fit = all_fit && fits(node->negative) && fits(node->positive) && node->hyperplane < region.hyperplanes;
    if (!all_fit) throw Failure("the tree does not fit its cells");
  }
}

/// Is it ours, and of this version?
void check_format(hid_t file, const fs::path& path) {
  if (H5Aexists(file, "format") <= 0 || H5Aexists(file, "version") <= 0 || hdf5::read_text_attribute(file, "format") != format_name)
    throw Error("'" + path.string() + "' is an HDF5 file, but no snapshot of bsp2");
  const auto version = hdf5::read_attribute<std::int32_t>(file, "version");
  if (version != format_version)
    throw Error("the snapshot '" + path.string() + "' has version " + std::to_string(version) + " of the format, this program reads version " +
                std::to_string(format_version) + "; use the program that wrote it");
}

}  // namespace

void check_snapshot_path(const fs::path& path) {
  check_folder(folder_of(path));
  std::error_code error;
  if (!path.has_filename() || fs::is_directory(path, error)) throw Error("cannot write the snapshot '" + path.string() + "': it is a directory");
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) throw Error("cannot write the snapshot '" + path.string() + "': it is no regular file");
}

void write_snapshot(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers) {
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
  together(path, writers, [&] { prepared = {lines(snapshot.head.superstep_name), shares(snapshot, writers)}; });
  together(path, writers, [&] {
    if (writers.rank == 0) check_room(folder_of(path), bytes_of(prepared.share, snapshot.head));
  });
  write_together(path, unfinished, snapshot, writers, prepared);
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    sync(unfinished, O_RDWR);
    std::error_code error;
    fs::rename(unfinished, path, error);
    if (error) throw Failure(error.message());
    sync(folder_of(path), O_RDONLY | O_DIRECTORY);
  });
}

Snapshot read_snapshot(const fs::path& path, SnapshotPart part, const std::function<bool(std::uint32_t)>& wanted) {
  const hdf5::Silence silence;
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw Error("cannot read '" + path.string() + "': " + std::generic_category().message(errno));
  ::close(descriptor);
  std::error_code error;
  if (!fs::is_regular_file(path, error)) throw Error("cannot read '" + path.string() + "': it is no file");
  try {
    if (H5Fis_hdf5(path.c_str()) <= 0) throw Error("'" + path.string() + "' is no snapshot of bsp2, or it is damaged");
    const Handle access = file_access(0);
    const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    check_format(file, path);
    Snapshot snapshot;
    snapshot.head = read_head(file);
    read_frontier(file, snapshot, part, wanted);
    const Wanted rows = read_regions(file, snapshot, wanted);
    if (part == SnapshotPart::all) {
      read_cells(file, snapshot, rows.cells);
      read_tree(file, snapshot, rows.nodes, rows.hyperplanes);
    }
    return snapshot;
  } catch (const Failure& failure) {
    throw Error("the snapshot '" + path.string() + "' is damaged or truncated (" + failure.what() + ")");
  } catch (const std::length_error&) {
    throw Error("the snapshot '" + path.string() + "' is damaged (an array of impossible length)");
  }
}

}  // namespace bsp2::io
