#include <algorithm>
#include <stdexcept>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/outputs/snapshot.hpp"
#include "hdf5/hdf5.hpp"
#include "hdf5/snapshot_format.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

using geometry::CellBatch;
using hdf5::Failure;
using snapshot::eye_attribute;
using snapshot::format_name;
using snapshot::format_version;
using snapshot::oldest_version;

SnapshotHead read_head(hid_t file) {
  SnapshotHead head;
  head.dimension = hdf5::read_attribute<std::int32_t>(file, "dimension");
  if (!geometry::is_dimension(head.dimension))
    throw Failure("its dimension is " + std::to_string(head.dimension));
  head.coincidence = hdf5::read_attribute<double>(file, "coincidence");
  head.curved = hdf5::read_attribute<std::uint32_t>(file, "curved") != 0;
  head.parts_by_colour = H5Aexists(file, "parts_by_colour") > 0;
  head.tolerance = hdf5::read_attribute<double>(file, "tolerance");
  if (H5Aexists(file, "angle") > 0) {
    head.angle = hdf5::read_attribute<double>(file, "angle");
    for (std::int32_t i = 0; i < head.dimension; ++i)
      head.eye.push_back(
          hdf5::read_attribute<double>(file, eye_attribute(static_cast<std::size_t>(i)).c_str()));
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
  head.has_surface = H5Lexists(file, snapshot::surface_group, H5P_DEFAULT) > 0;
  head.has_faces = H5Lexists(file, snapshot::faces_group, H5P_DEFAULT) > 0;
  head.model = hdf5::read_text(file, "source/path");
  head.source = hdf5::read_text(file, "source/text");
  head.totals = hdf5::read_text(file, "totals");
  head.partition_hyperplane = hdf5::read_array<std::uint32_t>(file, "partition/hyperplane");
  head.partition_children = hdf5::read_array<std::int32_t>(file, "partition/children");
  if (head.partition_children.size() != 2 * head.partition_hyperplane.size())
    throw Failure("the partition is incomplete");
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
  if (head.superstep_step.size() != rows || head.superstep_rank.size() != rows ||
      head.superstep_seconds.size() != rows || head.superstep_work_seconds.size() != rows ||
      head.superstep_predicted_seconds.size() != rows || head.superstep_bytes_sent.size() != rows ||
      head.superstep_bytes_received.size() != rows || head.superstep_cells.size() != rows)
    throw Failure("the table of the supersteps is incomplete");
  return head;
}

/// Offsets must go up from 0 to the end of what they divide.
void check_offsets(const std::vector<std::uint64_t>& offset, std::size_t parts, std::size_t end,
                   const char* name) {
  if (offset.size() != parts + 1 || offset.front() != 0 || offset.back() != end ||
      !std::is_sorted(offset.begin(), offset.end()))
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
void read_frontier(hid_t file, Snapshot& snapshot, SnapshotPart part,
                   const std::function<bool(std::uint32_t)>& wanted) {
  const auto region = hdf5::read_array<std::uint32_t>(file, "frontier/region");
  const auto tokens = hdf5::read_array<std::uint64_t>(file, "frontier/tokens"),
             offset = hdf5::read_array<std::uint64_t>(file, "frontier/offset");
  // Files of before it was told apart have none: there all tokens count as open.
  const auto open = H5Lexists(file, "frontier/open", H5P_DEFAULT) > 0
                        ? hdf5::read_array<std::uint64_t>(file, "frontier/open")
                        : tokens;
  if (tokens.size() != region.size() || open.size() != region.size())
    throw Failure("the frontier is incomplete");
  check_offsets(offset, region.size(), hdf5::array_length(file, "frontier/archive"), "of the frontier");
  Rows archives;
  std::vector<std::uint64_t> lengths;
  for (std::size_t i = 0; i < region.size(); ++i) {
    if (wanted && !wanted(region[i])) continue;
    if (open[i] > tokens[i]) throw Failure("the tokens of the frontier do not fit");
    snapshot.frontier_region.push_back(region[i]);
    snapshot.frontier_tokens.push_back(tokens[i]);
    snapshot.frontier_open.push_back(open[i]);
    if (part == SnapshotPart::head) continue;
    add_rows(archives, offset[i], offset[i + 1]);
    lengths.push_back(offset[i + 1] - offset[i]);
  }
  // At once: for each small one alone a chunk would be read, and its checksum made.
  const auto bytes = hdf5::read_rows<char>(file, "frontier/archive", archives);
  auto at = bytes.begin();
  for (const std::uint64_t length : lengths) {
    const auto end = at + static_cast<std::ptrdiff_t>(length);
    snapshot.frontier_archive.emplace_back(at, end);
    at = end;
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
  const auto cells = hdf5::read_array<std::uint32_t>(file, "regions/cells"),
             nodes = hdf5::read_array<std::uint32_t>(file, "regions/nodes"),
             hyperplanes = hdf5::read_array<std::uint32_t>(file, "regions/hyperplanes");
  const std::size_t n = number.size();
  if (root.size() != n || cells.size() != n || nodes.size() != n || hyperplanes.size() != n)
    throw Failure("the list of regions is incomplete");
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
  if (cell != hdf5::array_length(file, "cells/label") ||
      node != hdf5::array_length(file, "tree/node_hyperplane") ||
      hyperplane != hdf5::array_length(file, "tree/hyperplane_id"))
    throw Failure("the list of regions does not fit its cells");
  return rows;
}

/// Reads what an array of offsets divides into parts: their lengths. @param parts is replaced by the rows of
/// the contents.
std::vector<std::uint32_t> read_lengths(hid_t file, const char* name, Rows& parts, std::uint64_t end) {
  std::vector<std::uint32_t> lengths;
  Rows contents;
  for (const auto& [begin, last] : parts) {
    const auto offset = hdf5::read_rows<std::uint64_t>(file, name, {{begin, last + 1}});
    if (!std::is_sorted(offset.begin(), offset.end()) || offset.back() > end)
      throw Failure(std::string("the offsets ") + name + " do not fit");
    for (std::size_t i = 0; i + 1 < offset.size(); ++i)
      lengths.push_back(static_cast<std::uint32_t>(offset[i + 1] - offset[i]));
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
  Slices<std::uint32_t> point_count(
      read_lengths(file, "cells/point_offset", points, hdf5::array_length(file, "cells/points") / d));
  Slices<std::uint32_t> facet_count(
      read_lengths(file, "cells/facet_offset", facets, hdf5::array_length(file, "cells/facet_hyperplane")));
  Rows corners = facets;
  Slices<std::uint32_t> corner_count(read_lengths(file, "cells/facet_vertex_offset", corners,
                                                  hdf5::array_length(file, "cells/facet_vertices")));
  Slices<double> all_points(hdf5::read_rows<double>(file, "cells/points", points, d));
  Slices<std::uint16_t> facet_vertices(hdf5::read_rows<std::uint16_t>(file, "cells/facet_vertices", corners));
  Slices<std::int32_t> facet_hyperplane(
      hdf5::read_rows<std::int32_t>(file, "cells/facet_hyperplane", facets));
  Slices<std::uint8_t> label(hdf5::read_rows<std::uint8_t>(file, "cells/label", rows));
  Slices<std::int32_t> primitive(hdf5::read_rows<std::int32_t>(file, "cells/primitive", rows));
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
        if (value > static_cast<std::uint8_t>(geometry::Label::fuzzy))
          throw Failure("a cell has no known label");
        batch->label.push_back(static_cast<geometry::Label>(value));
      }
      batch->primitive = primitive.next(n);
      batch->part = part.next(n);
      batch->region = region.next(n);
      batch->level = level.next(n);
      batch->volume = volume.next(n);
      if (std::any_of(batch->region.begin(), batch->region.end(),
                      [&](std::uint32_t number) { return number != of.number; }))
        throw Failure("a cell is in another region's place");
      snapshot.cells.push_back(std::move(batch));
    }
}

void read_tree(hid_t file, Snapshot& snapshot, const Rows& nodes, const Rows& hyperplanes) {
  snapshot.tree.dimension = snapshot.head.dimension;
  const auto children = hdf5::read_rows<std::int32_t>(file, "tree/children", nodes, 2);
  const auto hyperplane = hdf5::read_rows<std::uint32_t>(file, "tree/node_hyperplane", nodes);
  snapshot.tree.hyperplanes = hdf5::read_rows<double>(file, "tree/hyperplanes", hyperplanes,
                                                      static_cast<std::size_t>(snapshot.head.dimension) + 1);
  snapshot.tree.ids = hdf5::read_rows<std::uint32_t>(file, "tree/hyperplane_id", hyperplanes);
  for (std::size_t i = 0; i < hyperplane.size(); ++i)
    snapshot.tree.nodes.push_back({hyperplane[i], children[2 * i], children[2 * i + 1]});
  auto node = snapshot.tree.nodes.begin();
  for (const SnapshotRegion& region : snapshot.regions) {
    const auto fits = [&](std::int32_t child) {
      return child >= 0 ? static_cast<std::uint32_t>(child) < region.nodes
                        : static_cast<std::uint32_t>(~child) <= region.cells;
    };
    bool all_fit = fits(region.root);
    for (std::uint32_t i = 0; i < region.nodes; ++i, ++node)
      all_fit =
          all_fit && fits(node->negative) && fits(node->positive) && node->hyperplane < region.hyperplanes;
    if (!all_fit) throw Failure("the tree does not fit its cells");
  }
}

bool has_mark(hid_t file) {
  return H5Aexists(file, "format") > 0 && hdf5::read_text_attribute(file, "format") == format_name;
}

}  // namespace

bool snapshot::is_of_others(const fs::path& path) {
  const hdf5::Silence silence;
  try {
    const hdf5::Handle access = file_access();
    const hdf5::Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, access), H5Fclose);
    return !has_mark(file);
  } catch (const hdf5::Failure&) {
    return false;  // it is damaged, and may have been one
  }
}

void snapshot::check_format(hid_t file, const fs::path& path) {
  if (!has_mark(file) || H5Aexists(file, "version") <= 0)
    throw Error("'" + path.string() + "' is an HDF5 file, but no snapshot of bsp2");
  const auto version = hdf5::read_attribute<std::int32_t>(file, "version");
  if (version < oldest_version || version > format_version)
    throw Error("the snapshot '" + path.string() + "' has version " + std::to_string(version) +
                " of the format, this program reads versions " + std::to_string(oldest_version) + " to " +
                std::to_string(format_version) + "; use the program that wrote it");
}

Snapshot snapshot::read(const fs::path& path, SnapshotPart part,
                        const std::function<bool(std::uint32_t)>& wanted) {
  return of_file(path, [&](hid_t file) {
    Snapshot result;
    result.head = read_head(file);
    read_frontier(file, result, part, wanted);
    const Wanted rows = read_regions(file, result, wanted);
    if (part == SnapshotPart::all) {
      read_cells(file, result, rows.cells);
      read_tree(file, result, rows.nodes, rows.hyperplanes);
    }
    return result;
  });
}

}  // namespace bsp2::io
