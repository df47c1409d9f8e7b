#include "bsp2/supersteps/stages/collection.hpp"

#include <algorithm>
#include <boost/serialization/utility.hpp>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/io/outputs/cad.hpp"
#include "bsp2/io/outputs/outline.hpp"
#include "bsp2/io/outputs/surface.hpp"
#include "bsp2/io/outputs/vtu.hpp"
#include "bsp2/model/mesh/cleaning.hpp"
#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

namespace boost::serialization {
template <>
struct is_bitwise_serializable<bsp2::geometry::BspTree::Node> : mpl::true_ {};
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using geometry::BspTree;
using geometry::CellBatch;

/// All of a region's mesh but its cells.
struct Forest {
  std::uint32_t& region;
  std::uint32_t& cells;
  BspTree& tree;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& region& cells& tree.dimension& tree.root& tree.nodes& tree.ids& tree.hyperplanes;
  }
};

}  // namespace

void send(Ranks& ranks, int to, RegionMesh mesh) {
  for (auto& batch : mesh.batches) {
    ranks.send(to, std::string(1, 'c') + dataflow::to_bytes(*batch));
    batch = nullptr;
  }
  ranks.send(to, std::string(1, 'r') + dataflow::to_bytes(Forest{mesh.region, mesh.cells, mesh.tree}));
}

bool receive(std::string_view message, RegionMesh& mesh) {
  const std::span<const char> bytes(message.data() + 1, message.size() - 1);
  if (message.front() == 'c') {
    const auto batch = std::make_shared<CellBatch>();
    dataflow::from_bytes(bytes, *batch);
    mesh.batches.push_back(batch);
    return false;
  }
  Forest forest{mesh.region, mesh.cells, mesh.tree};
  dataflow::from_bytes(bytes, forest);
  return true;
}

namespace {

void send(Ranks& ranks, int to, RegionMeshes meshes) {
  while (!meshes.empty()) send(ranks, to, std::move(meshes.extract(meshes.begin()).mapped()));
}

void receive(const Ranks& ranks, RegionMeshes& meshes) {
  RegionMesh mesh;
  for (const auto& message : ranks.received()) {
    if (!receive(message.bytes, mesh)) continue;
    const std::uint32_t region = mesh.region;
    meshes[region] = std::exchange(mesh, {});
  }
}

void to_master(Ranks& ranks, RegionMeshes& meshes) {
  if (!ranks.is_master()) send(ranks, 0, std::exchange(meshes, {}));
  ranks.sync();
  receive(ranks, meshes);
}

/// In each round every second of those that still hold cells hands them to its neighbour.
void up_a_tree(Ranks& ranks, RegionMeshes& meshes) {
  for (int stride = 1; stride < ranks.count(); stride *= 2) {
    if (ranks.rank() % (2 * stride) == stride) send(ranks, ranks.rank() - stride, std::exchange(meshes, {}));
    ranks.sync();
    receive(ranks, meshes);
  }
}

Collect decide(Ranks& ranks, const RegionMeshes& meshes, Collect how) {
  if (how != Collect::automatic) return how;
  std::uint64_t mine = 0, cells = 0;
  for (const auto& [number, mesh] : meshes) mine += mesh.cells;
  for (const std::uint64_t count : gather(ranks, mine)) cells += count;
  bool is_small = cells <= cells_of_a_master;
  broadcast(ranks, is_small);
  return is_small ? Collect::master : Collect::file;
}

}  // namespace

namespace {

/// The meshes get the cells that have gone ahead of them. @throws std::logic_error if some are missing.
void take_cells(RegionMeshes& meshes, RegionCells cells) {
  for (auto& [number, mesh] : meshes) {
    mesh.batches = std::move(cells[number]);
    std::uint64_t count = 0;
    for (const auto& batch : mesh.batches) count += batch->size();
    if (count != mesh.cells)
      throw std::logic_error("of region " + std::to_string(number) + " " +
                             counted(count, "# cell[s] came, not ") + std::to_string(mesh.cells));
  }
}

}  // namespace

bool collection(Ranks& ranks, RegionMeshes& meshes, Collect how, CellStream* stream) {
  if (ranks.count() == 1) return true;
  how = decide(ranks, meshes, how);
  const bool is_streamed = stream != nullptr && !stream->is_abandoned() && how != Collect::file;
  RegionCells cells;
  if (is_streamed) {
    for (auto& [number, mesh] : meshes) mesh.batches.clear();
    cells = stream->finish();
  }
  if (how == Collect::master) to_master(ranks, meshes);
  if (how == Collect::tree) up_a_tree(ranks, meshes);
  if (is_streamed && ranks.is_master()) take_cells(meshes, std::move(cells));
  return how != Collect::file;
}

template <int D>
dataflow::Totals<D> sum_totals(Ranks& ranks, const dataflow::Network<D>& network,
                               const dataflow::Totals<D>& totals) {
  dataflow::Totals<D> sum(network.table.radius(), network.table.width());
  sum.reset_bounds();
  for (const auto& part : gather(ranks, totals, sum)) sum += part;
  return sum;
}

template <int D>
BspTree join_trees(const dataflow::Network<D>& network, const dataflow::Partition<D>& partition, BspTree tree,
                   const std::vector<std::int32_t>& roots) {
  tree.dimension = D;
  const auto first = static_cast<std::int32_t>(tree.nodes.size());
  const auto child = [&](std::int32_t code) {
    return code >= 0 ? first + code : roots[static_cast<std::size_t>(~code)];
  };
  for (const auto& node : partition.nodes) {
    const auto h = network.table.rounded(node.hyperplane);
    tree.nodes.push_back({static_cast<std::uint32_t>(tree.hyperplanes.size() / (D + 1)), child(node.negative),
                          child(node.positive)});
    tree.ids.push_back(node.hyperplane);
    tree.hyperplanes.push_back(h.offset);
    tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
  }
  tree.root = child(partition.root);
  return tree;
}

namespace {

/// Names and colours of the parts of a surface.
io::SurfaceParts parts_of(const RunResult& result) {
  io::SurfaceParts parts;
  parts.names = result.part_names;
  parts.colours.resize(parts.names.size());
  for (const auto& part : result.report.named_parts)
    if (const auto number = static_cast<std::size_t>(part.part); number < parts.colours.size())
      parts.colours[number] = part.colour;
  parts.other_colour = uncoloured;
  return parts;
}

}  // namespace

namespace {

/// What was cleaned, for who gets the file.
std::string told(const CleaningReport& cleaning) {
  std::ostringstream text;
  text << cleaning.file.string() << ": ";
  if (cleaning.has_given_up) {
    text << "edges shorter and triangles thinner than " << cleaning.length
         << " were left as they are: without them the surface would cross itself, or some of it be inside "
            "out";
    return text.str();
  }
  text << "for edges and triangles below " << cleaning.length << ", "
       << counted(cleaning.merged_points, "# corner[s] [was|were] merged with others, ")
       << counted(cleaning.slivers, "# thin triangle[s] taken in by neighbours and ")
       << counted(cleaning.left_out, "# corner[s] left out") << "; no corner moved farther than "
       << cleaning.moved << ", and the volume changed by " << cleaning.volume_change;
  if (cleaning.left > 0)
    text << counted(cleaning.left,
                    "; # thin triangle[s] [is|are] left that could not go without spoiling others");
  return text.str();
}

/// Where the surface crosses itself whatever is cleaned, for who gets the file.
std::string told_of_crossings(const std::filesystem::path& path, const model::Cleaning& cleaning) {
  const auto& corner = cleaning.crossing_before.front().front();
  std::ostringstream text;
  text
      << path.string() << ": "
      << counted(cleaning.crossing_before.size(), "# triangle[s] [goes|go] through [another one|others]")
      << " where something was cleaned, the first at (" << corner[0] << ", " << corner[1] << ", " << corner[2]
      << "), and did so before, mostly since a solid is thinner than corners are rounded: programs that read "
         "the file may repair it";
  return text.str();
}

/// Which parts are not in the file, for who gets it.
std::string told_of_vanished(const std::filesystem::path& path, const std::vector<std::int32_t>& vanished,
                             double length, const io::SurfaceParts& parts) {
  std::ostringstream text;
  text << path.string() << ": nothing is left of ";
  std::vector<std::string> names;
  for (const std::int32_t part : vanished)
    if (part >= 0 && static_cast<std::size_t>(part) < parts.names.size())
      names.push_back(parts.names[static_cast<std::size_t>(part)]);
  if (names.size() < vanished.size()) names.push_back("no_part");
  if (parts.names.empty())
    text << "the solid";
  else
    text << parts_named(names);
  text << ", all of whose edges and triangles are below " << length;
  return text.str();
}

/// Whether a file needs what is between parts, and there is something.
bool needs_interfaces(const io::SurfaceFormat& format, const RunResult& result) {
  return format.closes_parts && result.faces && geometry::has_interfaces(*result.faces);
}

/// The surface for a file. @return the one that was found where nothing is to be cleaned.
const geometry::TriangleSurface& surface_for(const std::filesystem::path& path, RunResult& result,
                                             const geometry::TriangleSurface& found,
                                             std::optional<double> clean, unsigned threads,
                                             geometry::TriangleSurface& cleaned) {
  model::CleanLength length;
  (clean ? length.length : length.of_coordinate) = clean ? *clean : io::least_step(path);
  if (!(length.at(1) > 0)) return found;
  auto made = model::cleaned(found, length, threads);
  const bool is_single = io::surface_format(path)->is_single;
  if (!clean && !is_single && made.cleaning.is_changed() && io::changes_in_single(found))
    return found;  // the file holds all digits, and fewer would lose something
  const model::Cleaning& what = made.cleaning;
  cleaned = std::move(made.surface);
  if (!what.vanished.empty())
    result.report.warnings.push_back(told_of_vanished(path, what.vanished, what.length, parts_of(result)));
  if (!result.report.boundary) return cleaned;
  const CleaningReport report{path,          what.length,       what.merged_points,         what.slivers,
                              what.left_out, what.left,         cleaned.triangles.size(),   what.moved,
                              what.volume,   what.has_given_up, what.crossing_before.size()};
  result.report.boundary->cleaned.push_back(report);
  if (what.has_given_up)
    result.report.warnings.push_back(told(report) + (clean ? "; a smaller --clean may do" : ""));
  else if (clean && what.is_changed())  // what a format cannot hold anyway is no news
    result.report.notes.push_back(told(report));
  if (!what.crossing_before.empty()) result.report.warnings.push_back(told_of_crossings(path, what));
  return cleaned;
}

}  // namespace

void write_boundary(RunResult& result, const std::filesystem::path& path, std::optional<double> clean,
                    unsigned threads) {
  io::SurfaceRemarks remarks;
  const io::SurfaceFormat* format = io::surface_format(path);
  if (format != nullptr && format->has_faces) {
    remarks.notes = io::write_cad(path, result.faces.value(), parts_of(result), result.untouched_rounds);
    if (!result.faces->is_closed)
      remarks.warning =
          path.string() +
          ": the faces do not bound solids everywhere, so CAD programs may refuse the file. This "
          "is a mistake of bsp2: please report the model";
  } else if (result.outlines) {
    remarks.notes = io::write_outline(path, *result.outlines, parts_of(result));
  } else {
    geometry::TriangleSurface by_part, cleaned;
    const bool by_parts = format != nullptr && needs_interfaces(*format, result);
    if (by_parts) by_part = geometry::surface_by_part(*result.faces);
    const auto& found = by_parts ? by_part : result.boundary.value();
    const auto& surface = surface_for(path, result, found, clean, threads, cleaned);
    remarks = io::write_surface(path, surface, parts_of(result), clean ? nullptr : &found);
  }
  if (!remarks.warning.empty()) result.report.warnings.push_back(remarks.warning);
  auto& notes = result.report.notes;
  notes.insert(notes.end(), remarks.notes.begin(), remarks.notes.end());
}

io::VtuOptions vtu_options(const RunResult& result) {
  io::VtuOptions options;
  options.rank_of_region = result.rank_of_region;
  options.part_names = result.part_names;
  for (const auto& colour : result.colour_of_primitive)
    options.colour_of_primitive.push_back(colour.value_or(uncoloured));
  options.other_colour = uncoloured;
  return options;
}

SimplexReport write_mesh(Ranks& ranks, const RunResult& result, const std::filesystem::path& pvtu, bool tets,
                         unsigned step) {
  std::optional<io::VtuShare> share;
  io::VtuShare::Size size;
  ranks.agree([&] {
    ranks.begin("collection", step);
    io::VtuOptions options = vtu_options(result);
    options.tets = tets;
    share.emplace(pvtu, result.report.dimension, result.mesh.batches, options);
    size = share->size();
  });
  io::VtuShare::Size all;
  std::uint64_t before = 0;
  const auto shares = all_gather(ranks, std::pair(size.pieces, size.has_polyhedra));
  for (std::size_t rank = 0; rank < shares.size(); ++rank) {
    if (rank < static_cast<std::size_t>(ranks.rank())) before += shares[rank].first;
    all.pieces += shares[rank].first;
    all.has_polyhedra = all.has_polyhedra || shares[rank].second;
  }
  ranks.agree([&] { share->write(before, all); });  // now all have written theirs
  ranks.agree([&] { share->publish(); });
  ranks.agree([&] {
    if (ranks.is_master()) share->finish();
  });
  SimplexReport report;
  const io::SimplexCount& mine = share->simplices();
  for (const auto& part : all_gather(ranks, SimplexReport{mine.simplices, mine.smallest_angle,
                                                          mine.incomplete_cells, mine.left_out_volume})) {
    report.simplices += part.simplices;
    report.smallest_angle = std::min(report.smallest_angle, part.smallest_angle);
    report.incomplete_cells += part.incomplete_cells;
    report.left_out_volume += part.left_out_volume;
  }
  return report;
}

#define BSP2_STAGE(D)                                                                                 \
  template dataflow::Totals<D> sum_totals<D>(Ranks&, const dataflow::Network<D>&,                     \
                                             const dataflow::Totals<D>&);                             \
  template BspTree join_trees<D>(const dataflow::Network<D>&, const dataflow::Partition<D>&, BspTree, \
                                 const std::vector<std::int32_t>&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
