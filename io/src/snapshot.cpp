#include "bsp2/io/snapshot.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
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

constexpr auto format_name = "bsp2 snapshot";
constexpr std::int32_t format_version = 1;
constexpr std::size_t slab = std::size_t{1} << 17;  // elements written at once, and of a chunk

fs::path folder_of(const fs::path& file) { return file.has_parent_path() ? file.parent_path() : fs::path("."); }
fs::path unfinished_name(const fs::path& path) { return folder_of(path) / ("." + path.filename().string() + ".part"); }

/// How many elements of each kind all writers have, and where ours begin.
struct Share {
  std::uint64_t before = 0, mine = 0, total = 0, largest = 0;
};

/// Writes arrays together with the other writers.
class ArrayWriter {
 public:
  ArrayWriter(hid_t file, const SnapshotWriters& writers) : file_(file), writers_(writers), transfer_(H5Pcreate(H5P_DATASET_XFER), H5Pclose) {
    if (writers.count > 1) check(H5Pset_dxpl_mpio(transfer_, H5FD_MPIO_COLLECTIVE));
  }

  /// One array. @param share of its rows. @param fill called with `append(span)` to hand over our rows, in order.
  template <typename T, typename Fill>
  void write(const std::string& name, const Share& share, std::size_t columns, const Fill& fill) {
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
    const Handle dataset(H5Dcreate2(file_, name.c_str(), hdf5::file_type<T>(), space, links, creation, H5P_DEFAULT), H5Dclose);
    if (share.total == 0) return;

    std::vector<T> buffer;
    hsize_t at = share.before, written = 0;
    std::uint64_t slabs = 0;
    const auto flush = [&] {
      const std::array<hsize_t, 2> start{at, 0}, count{buffer.size() / columns, columns};
      const Handle memory(H5Screate_simple(rank, count.data(), nullptr), H5Sclose);
      const Handle target(H5Scopy(space), H5Sclose);
      if (buffer.empty()) {
        check(H5Sselect_none(memory));
        check(H5Sselect_none(target));
      } else {
        check(H5Sselect_hyperslab(target, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr));
      }
      check(H5Dwrite(dataset, hdf5::memory_type<T>(), memory, target, transfer_, buffer.data()));
      at += count[0];
      written += count[0];
      ++slabs;
      buffer.clear();
    };
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
    if (written != share.mine) throw std::logic_error("a snapshot's array " + name + " has not the length it was given");
    // A collective write needs everybody as often as the one with the most data.
    while (slabs < (share.largest + slab - 1) / slab) flush();
  }

  /// A list that the first writer has.
  template <typename T>
  void write_head(const std::string& name, std::span<const T> values) {
    const bool mine = writers_.rank == 0;
    write<T>(name, {mine ? 0 : values.size(), mine ? values.size() : 0, values.size(), values.size()}, 1, [&](const auto& append) {
      if (mine) append(values);
    });
  }

 private:
  hid_t file_;
  const SnapshotWriters& writers_;
  Handle transfer_;
};

/// Lengths of everything this writer has, in one order.
enum Count : std::size_t { cells, points, facets, corners, nodes, hyperplanes, frontier, archived, finished, count_kinds };

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
  n[finished] = snapshot.finished_region.size();
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
    out.write<T>(std::string("cells/") + name, rows, columns, [&](const auto& append) {
      for (const auto& batch : snapshot.cells) append(std::span<const T>((*batch).*member));
    });
  };
  const auto offset = [&](const char* name, const Share& rows, std::uint64_t base, std::vector<std::uint32_t> CellBatch::*member) {
    out.write<std::uint64_t>(std::string("cells/") + name, offsets(rows, rank), 1, [&](const auto& append) {
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
  column("points", share[points], static_cast<std::size_t>(snapshot.head.dimension), &CellBatch::points);
  offset("point_offset", share[cells], share[points].before, &CellBatch::point_offset);
  offset("facet_offset", share[cells], share[facets].before, &CellBatch::facet_offset);
  offset("facet_vertex_offset", share[facets], share[corners].before, &CellBatch::facet_vertex_offset);
  column("facet_vertices", share[corners], 1, &CellBatch::facet_vertices);
  column("facet_hyperplane", share[facets], 1, &CellBatch::facet_hyperplane);
  out.write<std::uint8_t>("cells/label", share[cells], 1, [&](const auto& append) {
    for (const auto& batch : snapshot.cells) append(std::span(reinterpret_cast<const std::uint8_t*>(batch->label.data()), batch->size()));
  });
  column("part", share[cells], 1, &CellBatch::part);
  column("region", share[cells], 1, &CellBatch::region);
  column("level", share[cells], 1, &CellBatch::level);
  column("volume", share[cells], 1, &CellBatch::volume);
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
  out.write<std::uint32_t>("tree/finished_region", share[finished], 1, [&](const auto& append) { append(std::span(snapshot.finished_region)); });
  out.write<std::int32_t>("tree/finished_root", share[finished], 1, [&](const auto& append) { append(std::span(snapshot.finished_root)); });
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

void write_head(hid_t file, ArrayWriter& out, const SnapshotHead& head) {
  const auto number = [&](const char* name, auto value) { hdf5::write_attribute(file, name, value); };
  number("format", std::string(format_name));
  number("version", format_version);
  number("dimension", head.dimension);
  number("coincidence", head.coincidence);
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
  if (head.is_portion) {
    number("earlier_nodes", head.earlier_nodes);
    number("earlier_cells", head.earlier_cells);
  }
  out.write_head<char>("source/path", head.model);
  out.write_head<char>("source/text", head.source);
  out.write_head<char>("totals", head.totals);
  out.write_head<std::uint32_t>("partition/hyperplane", head.partition_hyperplane);
  out.write_head<std::int32_t>("partition/children", head.partition_children);
  std::string names;  // one a line
  for (const std::string& name : head.superstep_name) names += name + '\n';
  out.write_head<char>("supersteps/name", names);
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

void write_file(const fs::path& path, const Snapshot& snapshot, const SnapshotWriters& writers) {
  const std::vector<Share> share = shares(snapshot, writers);
  const Handle access = file_access(writers.file_access);
  Handle file(H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose);
  ArrayWriter out(file, writers);
  write_head(file, out, snapshot.head);
  write_frontier(out, snapshot, share, writers.rank);
  write_cells(out, snapshot, share, writers.rank);
  write_tree(out, snapshot, share);
  file.close();
}

/// To the disk, not only to the system's cache.
void sync(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!synced && error != EINVAL) throw Failure(std::generic_category().message(error));
}

/// Whether all writers are well. Collective.
bool all_well(bool well, const SnapshotWriters& writers) {
  if (writers.count == 1) return well;
  for (const auto& answer : writers.exchange({well ? 1U : 0U}))
    if (answer.front() == 0) return false;
  return true;
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
  if (all_well(why.empty(), writers)) return;
  std::error_code ignored;
  if (writers.rank == 0) fs::remove(unfinished_name(path), ignored);
  throw Error("cannot write the snapshot '" + path.string() + "': " + (why.empty() ? "another process failed" : why) +
              "; the one before it, if any, is as it was");
}

// --- Reading ---

SnapshotHead read_head(hid_t file) {
  SnapshotHead head;
  head.dimension = hdf5::read_attribute<std::int32_t>(file, "dimension");
  if (head.dimension < 1 || head.dimension > 6) throw Failure("its dimension is " + std::to_string(head.dimension));
  head.coincidence = hdf5::read_attribute<double>(file, "coincidence");
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
  head.is_portion = H5Aexists(file, "earlier_nodes") > 0;
  if (head.is_portion) {
    head.earlier_nodes = hdf5::read_attribute<std::uint32_t>(file, "earlier_nodes");
    head.earlier_cells = hdf5::read_attribute<std::uint32_t>(file, "earlier_cells");
  }
  head.recorded_nodes = static_cast<std::uint32_t>(hdf5::array_length(file, "tree/node_hyperplane"));
  head.recorded_cells = static_cast<std::uint32_t>(hdf5::array_length(file, "cells/label"));
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

void read_frontier(hid_t file, Snapshot& snapshot, SnapshotPart part) {
  snapshot.frontier_region = hdf5::read_array<std::uint32_t>(file, "frontier/region");
  snapshot.frontier_tokens = hdf5::read_array<std::uint64_t>(file, "frontier/tokens");
  if (snapshot.frontier_tokens.size() != snapshot.frontier_region.size()) throw Failure("the frontier is incomplete");
  if (part == SnapshotPart::head) return;
  const std::string archive = hdf5::read_text(file, "frontier/archive");
  const auto offset = hdf5::read_array<std::uint64_t>(file, "frontier/offset");
  check_offsets(offset, snapshot.frontier_region.size(), archive.size(), "of the frontier");
  for (std::size_t i = 0; i + 1 < offset.size(); ++i) snapshot.frontier_archive.push_back(archive.substr(offset[i], offset[i + 1] - offset[i]));
}

/// All cells of the file, cut into batches whose offsets fit 32 bits.
void read_cells(hid_t file, Snapshot& snapshot) {
  const auto d = static_cast<std::size_t>(snapshot.head.dimension);
  const auto all_points = hdf5::read_array<double>(file, "cells/points", d);
  const auto point_offset = hdf5::read_array<std::uint64_t>(file, "cells/point_offset"), facet_offset = hdf5::read_array<std::uint64_t>(file, "cells/facet_offset"),
             corner_offset = hdf5::read_array<std::uint64_t>(file, "cells/facet_vertex_offset");
  const auto facet_vertices = hdf5::read_array<std::uint16_t>(file, "cells/facet_vertices");
  const auto facet_hyperplane = hdf5::read_array<std::int32_t>(file, "cells/facet_hyperplane");
  const auto label = hdf5::read_array<std::uint8_t>(file, "cells/label");
  const auto part = hdf5::read_array<std::int32_t>(file, "cells/part");
  const auto region = hdf5::read_array<std::uint32_t>(file, "cells/region");
  const auto level = hdf5::read_array<std::uint16_t>(file, "cells/level");
  const auto volume = hdf5::read_array<double>(file, "cells/volume");
  const std::size_t n = label.size();
  check_offsets(point_offset, n, all_points.size() / d, "of the points");
  check_offsets(facet_offset, n, facet_hyperplane.size(), "of the facets");
  check_offsets(corner_offset, facet_hyperplane.size(), facet_vertices.size(), "of the facets' vertices");
  if (part.size() != n || region.size() != n || level.size() != n || volume.size() != n) throw Failure("the cells are incomplete");

  constexpr std::size_t batch_cells = 4096;
  const auto slice = [](const auto& from, std::uint64_t begin, std::uint64_t end, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(begin), from.begin() + static_cast<std::ptrdiff_t>(end));
  };
  const auto ends = [](const std::vector<std::uint64_t>& from, std::uint64_t begin, std::uint64_t end, std::vector<std::uint32_t>& to) {
    for (std::uint64_t i = begin + 1; i <= end; ++i) to.push_back(static_cast<std::uint32_t>(from[i] - from[begin]));
  };
  for (std::size_t begin = 0; begin < n; begin += batch_cells) {
    const std::size_t end = std::min(n, begin + batch_cells);
    auto batch = std::make_shared<CellBatch>();
    batch->dimension = snapshot.head.dimension;
    const std::uint64_t facet = facet_offset[begin], last_facet = facet_offset[end];
    slice(all_points, point_offset[begin] * d, point_offset[end] * d, batch->points);
    ends(point_offset, begin, end, batch->point_offset);
    ends(facet_offset, begin, end, batch->facet_offset);
    ends(corner_offset, facet, last_facet, batch->facet_vertex_offset);
    slice(facet_vertices, corner_offset[facet], corner_offset[last_facet], batch->facet_vertices);
    slice(facet_hyperplane, facet, last_facet, batch->facet_hyperplane);
    for (std::size_t i = begin; i < end; ++i) {
      if (label[i] > static_cast<std::uint8_t>(geometry::Label::fuzzy)) throw Failure("a cell has no known label");
      batch->label.push_back(static_cast<geometry::Label>(label[i]));
    }
    slice(part, begin, end, batch->part);
    slice(region, begin, end, batch->region);
    slice(level, begin, end, batch->level);
    slice(volume, begin, end, batch->volume);
    snapshot.cells.push_back(std::move(batch));
  }
}

void read_tree(hid_t file, Snapshot& snapshot) {
  snapshot.tree.dimension = snapshot.head.dimension;
  const auto children = hdf5::read_array<std::int32_t>(file, "tree/children", 2);
  const auto hyperplane = hdf5::read_array<std::uint32_t>(file, "tree/node_hyperplane");
  snapshot.tree.hyperplanes = hdf5::read_array<double>(file, "tree/hyperplanes", static_cast<std::size_t>(snapshot.head.dimension) + 1);
  snapshot.tree.ids = hdf5::read_array<std::uint32_t>(file, "tree/hyperplane_id");
  snapshot.finished_region = hdf5::read_array<std::uint32_t>(file, "tree/finished_region");
  snapshot.finished_root = hdf5::read_array<std::int32_t>(file, "tree/finished_root");
  const std::size_t hyperplanes = snapshot.tree.hyperplanes.size() / (static_cast<std::size_t>(snapshot.head.dimension) + 1);
  if (children.size() != 2 * hyperplane.size() || snapshot.tree.ids.size() != hyperplanes || snapshot.finished_root.size() != snapshot.finished_region.size()) throw Failure("the tree is incomplete");
  for (std::size_t i = 0; i < hyperplane.size(); ++i) snapshot.tree.nodes.push_back({hyperplane[i], children[2 * i], children[2 * i + 1]});
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
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    std::error_code error;
    fs::create_directories(folder_of(path), error);
    // What HDF5 would say about a missing folder or a missing right is not for users.
    const int descriptor = ::open(unfinished.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
    if (descriptor < 0) throw Failure(std::generic_category().message(errno));
    ::close(descriptor);
  });
  together(path, writers, [&] { write_file(unfinished, snapshot, writers); });
  together(path, writers, [&] {
    if (writers.rank != 0) return;
    sync(unfinished, O_RDWR);
    std::error_code error;
    fs::rename(unfinished, path, error);
    if (error) throw Failure(error.message());
    sync(folder_of(path), O_RDONLY | O_DIRECTORY);
  });
}

Snapshot read_snapshot(const fs::path& path, SnapshotPart part) {
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
    read_frontier(file, snapshot, part);
    if (part == SnapshotPart::all) {
      read_cells(file, snapshot);
      read_tree(file, snapshot);
    }
    return snapshot;
  } catch (const Failure& failure) {
    throw Error("the snapshot '" + path.string() + "' is damaged or truncated (" + failure.what() + ")");
  } catch (const std::length_error&) {
    throw Error("the snapshot '" + path.string() + "' is damaged (an array of impossible length)");
  }
}

}  // namespace bsp2::io
