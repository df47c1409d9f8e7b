#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <utility>

#include "bsp2/bsplib/error.hpp"
#include "bsp2/dataflow/constructs/part_outlines.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "ranks/exchange.hpp"
#include "stages/stages.hpp"

// Facets are told apart by group: those that lie on the cut of a node of the partition, and have been parted
// by it, belong to the node, all others to their region. Cells touch only in facets of one group: two of one
// region in one of the region, two of different regions in one of the node that parts them. So a region is
// glued where its cells are, and a node by one rank, to which the others send its facets. All is done group
// by group also where one rank has several: the result depends on the regions, and not on the ranks.

namespace boost::serialization {
template <class Archive>
void serialize(Archive& archive, bsp2::geometry::FacetSet& set, unsigned) {
  archive& set.hyperplane& set.facets& set.corners;
}
template <>
struct is_bitwise_serializable<bsp2::geometry::FacetSet::Facet> : mpl::true_ {};
template <>
struct is_bitwise_serializable<bsp2::geometry::FacetSet::Corner> : mpl::true_ {};
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using geometry::FacetIndex;
using geometry::FacetSet;
using Table = geometry::HyperplaneTable<3>;
using Names = std::shared_ptr<const geometry::PlaneNames>;

/// The share of the time in which facets are glued, as far as anybody who waits for the boundary cares.
constexpr double glued = 0.5;

/// What was found in some of the groups.
struct Share {
  std::vector<geometry::Contact> contacts;
  geometry::Skin skin;

  void append(const Share& other) {
    contacts.insert(contacts.end(), other.contacts.begin(), other.contacts.end());
    skin.append(other.skin);
  }
};

/// Groups of facets, one at a time: `load(i, facets)` gives the i-th one.
using Load = std::function<void(std::size_t, FacetSet&)>;

/// Every `step`-th group from the `first` one.
Share match(const Table& table, std::size_t count, const Load& load, std::size_t first, std::size_t step,
            const RunOptions& options) {
  Share share;
  geometry::FacetMatcher matcher(table, options.faces);
  FacetSet facets;
  for (std::size_t i = first; i < count; i += step) {
    load(i, facets);
    matcher.match(facets, options.contacts ? &share.contacts : nullptr,
                  options.boundary ? &share.skin : nullptr);
  }
  return share;
}

/// Groups know nothing of each other: they are dealt out to threads. @param meanwhile is called by this one,
/// again and again.
Share match_all(const Table& table, std::size_t count, const Load& load, const RunOptions& options,
                unsigned threads, const std::function<void()>& meanwhile) {
  std::vector<std::future<Share>> shares;
  for (unsigned i = 0; i < threads; ++i)
    shares.push_back(
        std::async(std::launch::async, [&, i] { return match(table, count, load, i, threads, options); }));
  Share all;
  for (auto& share : shares) {
    while (share.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) meanwhile();
    all.append(share.get());
  }
  return all;
}

/// The path of each region, from the leaf up: nodes of the partition and their hyperplanes.
using Paths = std::vector<std::vector<std::pair<geometry::HyperplaneId, std::uint32_t>>>;

Paths paths_of(const dataflow::Partition<3>& partition) {
  const auto regions = partition.nodes.size() + 1;
  std::vector<std::int64_t> node_parent(partition.nodes.size(), -1), region_parent(regions, -1);
  for (std::size_t i = 0; i < partition.nodes.size(); ++i)
    for (const std::int32_t child : {partition.nodes[i].negative, partition.nodes[i].positive})
      (child >= 0 ? node_parent.at(static_cast<std::size_t>(child))
                  : region_parent.at(static_cast<std::size_t>(~child))) = static_cast<std::int64_t>(i);
  Paths paths(regions);
  for (std::size_t region = 0; region < regions; ++region)
    for (std::int64_t at = region_parent[region]; at >= 0; at = node_parent[static_cast<std::size_t>(at)])
      paths[region].emplace_back(partition.nodes[static_cast<std::size_t>(at)].hyperplane,
                                 static_cast<std::uint32_t>(at));
  return paths;
}

/// Groups: a region by its number, then the nodes.
class Groups {
 public:
  explicit Groups(const dataflow::Partition<3>& partition)
      : regions_(static_cast<std::uint32_t>(partition.nodes.size() + 1)), paths_(paths_of(partition)) {}
  [[nodiscard]] std::uint32_t regions() const { return regions_; }
  [[nodiscard]] std::uint32_t of(std::uint32_t region, geometry::HyperplaneId id) const {
    for (const auto& [hyperplane, node] : paths_[region])
      if (hyperplane == id) return regions_ + node;
    return region;
  }
  /// Only those of nodes, or only those of regions.
  [[nodiscard]] std::function<std::uint32_t(std::uint32_t, geometry::HyperplaneId)> only(bool nodes) const {
    return [this, nodes](std::uint32_t region, geometry::HyperplaneId id) {
      const std::uint32_t group = of(region, id);
      return (group >= regions_) == nodes ? group : geometry::FacetGrouping::left_out;
    };
  }

 private:
  std::uint32_t regions_;
  Paths paths_;
};

/// Who glues each node of the partition: the rank that has most of its facets. Collective.
std::vector<int> owners_of_nodes(Ranks& ranks, const FacetIndex& index, std::size_t regions) {
  std::vector<std::uint64_t> mine(regions - 1);
  for (std::size_t i = 0; i < index.size(); ++i) mine[index.group(i) - regions] += index.count(i);
  const auto all = all_gather(ranks, mine);
  std::vector<int> owner(mine.size(), 0);
  for (std::size_t node = 0; node < owner.size(); ++node)
    for (int rank = 1; rank < ranks.count(); ++rank)
      if (all[static_cast<std::size_t>(rank)][node] > all[static_cast<std::size_t>(owner[node])][node])
        owner[node] = rank;
  return owner;
}

/// One name for each plane, the same on all ranks and for all groups. Collective.
Names agree_on_names(Ranks& ranks, const Table& table, const CellShare& share) {
  // Without families nobody has anything to tell.
  if (!geometry::has_families(table)) return std::make_shared<geometry::PlaneNames>(table);
  std::vector<geometry::HyperplaneId> mine, all;
  ranks.agree([&] { mine = geometry::family_planes(table, share.batches); });
  for (const auto& of_rank : all_gather(ranks, mine)) all.insert(all.end(), of_rank.begin(), of_rank.end());
  Names names;
  ranks.agree([&] { names = std::make_shared<geometry::PlaneNames>(table, std::move(all)); });
  return names;
}

/// Facets on their way to the rank that glues their node.
struct Interface {
  std::uint32_t node = 0;
  FacetSet facets;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& node& facets;
  }
};

using Nodes = std::map<std::uint32_t, FacetSet>;

/// Hands the facets on each node to the rank that glues it; they are on their way when this returns.
/// Collective.
/// @return those that stay here.
Nodes send_facets_of_nodes(Ranks& ranks, const dataflow::Network<3>& network, const Names& names,
                           const Groups& groups, const CellShare& share) {
  std::optional<FacetIndex> found;
  ranks.agree([&] {
    found.emplace(network.table, share.batches,
                  geometry::FacetGrouping{share.first_cell, groups.only(true), names});
  });
  const FacetIndex& index = *found;
  const auto owner = owners_of_nodes(ranks, index, groups.regions());
  Nodes nodes;
  for (std::size_t i = 0; i < index.size(); ++i) {
    Interface interface {
      index.group(i) - groups.regions(), {}
    };
    interface.facets.clear(index.hyperplane(i));
    index.append(i, interface.facets);
    if (owner[interface.node] == ranks.rank())
      nodes[interface.node] = std::move(interface.facets);
    else
      ranks.send(owner[interface.node], dataflow::to_bytes(interface));
  }
  ranks.begin_sync();
  return nodes;
}

/// Takes regions from the front of a share, some at a time: their index is small against their cells.
class RegionsInTurn {
 public:
  explicit RegionsInTurn(CellShare& share) : share_(share) {
    std::size_t facets = 0;
    for (const auto& batch : share.batches) facets += batch->facet_hyperplane.size();
    enough_ = std::max<std::size_t>(facets / 32, std::size_t{1} << 14);
  }
  /// How much of all has been taken, up to 1.
  [[nodiscard]] double taken() const {
    return share_.batches.empty() ? 1 : static_cast<double>(at_) / static_cast<double>(share_.batches.size());
  }
  /// The next ones; none at the end. What is taken is gone from the share.
  [[nodiscard]] CellShare next() {
    CellShare some;
    std::size_t facets = 0;
    for (; at_ < share_.batches.size() && (facets < enough_ || continues_region()); ++at_) {
      facets += share_.batches[at_]->facet_hyperplane.size();
      some.batches.push_back(std::move(share_.batches[at_]));
      some.first_cell.push_back(share_.first_cell[at_]);
      last_region_ = region_of(*some.batches.back());
    }
    return some;
  }

 private:
  CellShare& share_;
  std::size_t at_ = 0, enough_ = 0;
  std::optional<std::uint32_t> last_region_;

  static std::optional<std::uint32_t> region_of(const geometry::CellBatch& batch) {
    return batch.empty() ? std::nullopt : std::optional(batch.region.front());
  }
  [[nodiscard]] bool continues_region() const { return region_of(*share_.batches[at_]) == last_region_; }
};

/// Glues the regions of this rank. The share is given up piece by piece.
void glue_regions(const dataflow::Network<3>& network, const Names& names, const Groups& groups,
                  CellShare& cells, const RunOptions& options, unsigned threads,
                  const std::function<void()>& meanwhile, const geometry::ToldShare& told, Share& all) {
  std::size_t many_vertices = std::size_t{1} << 16;
  RegionsInTurn regions(cells);
  double done = 0;
  for (CellShare some = regions.next(); !some.batches.empty(); some = regions.next()) {
    geometry::Interruption::check();
    if (told) told(std::exchange(done, regions.taken()));
    const FacetIndex index(network.table, some.batches, {some.first_cell, groups.only(false), names});
    const auto load = [&](std::size_t i, FacetSet& facets) {
      facets.clear(index.hyperplane(i));
      index.append(i, facets);
    };
    all.append(match_all(network.table, index.size(), load, options, threads, meanwhile));
    some = {};
    malloc_trim(0);  // regions are small, so their arrays lie among others
    if (all.skin.vertices.size() < many_vertices) continue;
    all.skin.weld();
    many_vertices = std::max(many_vertices, 2 * all.skin.vertices.size());
  }
}

/// Glues the nodes of the partition that fall to this rank, with the facets that the others have sent.
void glue_nodes(const Ranks& ranks, const Table& table, Nodes nodes, const RunOptions& options,
                unsigned threads, Share& all) {
  for (const auto& message : ranks.received()) {
    Interface interface;
    dataflow::from_bytes(message.bytes, interface);
    FacetSet& set = nodes[interface.node];
    set.hyperplane = interface.facets.hyperplane;
    set.append(interface.facets);
  }
  std::vector<FacetSet> sets;
  for (auto& [node, set] : nodes) sets.push_back(std::move(set));
  all.append(match_all(
      table, sets.size(), [&](std::size_t i, FacetSet& facets) { facets = std::move(sets[i]); }, options,
      threads, [] {}));
  std::sort(all.contacts.begin(), all.contacts.end(),
            [](const auto& a, const auto& b) { return a.cell < b.cell; });
  all.skin.weld();
}

/// Glues what this rank has, and the nodes of the partition that fall to it. The share is given up piece by
/// piece. Collective.
Share glue(Ranks& ranks, const dataflow::Network<3>& network, const dataflow::Partition<3>& partition,
           CellShare cells, const RunOptions& options, unsigned threads) {
  std::optional<Groups> made;
  ranks.agree([&] { made.emplace(partition); });
  const Groups& groups = *made;
  const Names names = agree_on_names(ranks, network.table, cells);
  Nodes nodes = send_facets_of_nodes(ranks, network, names, groups, cells);
  const auto meanwhile = [&] {
    if (ranks.is_syncing()) ranks.try_sync();
  };
  Share all;
  // What goes wrong here must not leave the others waiting for what is on its way.
  std::exception_ptr failure;
  try {
    glue_regions(network, names, groups, cells, options, threads, meanwhile,
                 told_share(ranks, options, 0, options.boundary ? glued : 1), all);
  } catch (const bsplib::Error&) {
    throw;
  } catch (...) {
    failure = std::current_exception();
  }
  if (ranks.is_syncing()) ranks.wait();
  ranks.agree([&] {
    if (failure) std::rethrow_exception(failure);
    glue_nodes(ranks, network.table, std::move(nodes), options, threads, all);
  });
  return all;
}

/// The outlines of a plane solid, on the master: it gets the cells of all, region by region. Collective.
std::optional<std::vector<geometry::PartOutline>> outlines_of(Ranks& ranks,
                                                              const dataflow::Network<2>& network,
                                                              CellShare share) {
  std::vector<std::string> bytes;
  ranks.agree([&] {
    for (const auto& batch : share.batches)
      if (!ranks.is_master()) bytes.push_back(dataflow::to_bytes(*batch));
  });
  for (std::string& batch : bytes) ranks.send(0, std::move(batch));
  ranks.sync();
  std::optional<std::vector<geometry::PartOutline>> outlines;
  ranks.agree([&] {
    if (!ranks.is_master()) return;
    for (const auto& message : ranks.received()) {
      const auto batch = std::make_shared<geometry::CellBatch>();
      dataflow::from_bytes(message.bytes, *batch);
      share.batches.push_back(batch);
    }
    const auto region_of = [](const auto& batch) { return batch->empty() ? 0 : batch->region.front(); };
    std::stable_sort(share.batches.begin(), share.batches.end(),
                     [&](const auto& a, const auto& b) { return region_of(a) < region_of(b); });
    outlines = dataflow::part_outlines(network, share.batches);
  });
  return outlines;
}

}  // namespace

CellShare share_of(Ranks& ranks, const RegionMeshes& meshes, std::size_t regions) {
  std::vector<std::uint64_t> cells(regions), first(regions);
  for (const auto& [number, mesh] : meshes) cells[number] = mesh.cells;
  const auto all = all_gather(ranks, cells);
  std::uint64_t before = 0;
  for (std::size_t region = 0; region < regions; ++region) {
    first[region] = before;
    for (const auto& of_rank : all) before += of_rank[region];
  }
  CellShare share;
  for (const auto& [number, mesh] : meshes)
    for (const auto& batch : mesh.batches) {
      share.batches.push_back(batch);
      share.first_cell.push_back(first[number]);
      first[number] += batch->size();
    }
  return share;
}

template <int D>
Resolution resolution(Ranks& ranks, const dataflow::Network<D>& network,
                      const dataflow::Partition<D>& partition, CellShare share, const RunOptions& options,
                      unsigned threads) {
  Resolution result;
  if constexpr (D == 3) {
    Share mine = glue(ranks, network, partition, std::move(share), options, threads);
    result.contacts = std::move(mine.contacts);
    if (!options.boundary) return result;
    ranks.begin("resolution", 1);
    find_boundary(ranks, network.table, std::move(mine.skin), options.faces, threads, result.boundary,
                  result.faces, told_share(ranks, options, glued, 1));
  } else if constexpr (D == 2)
    if (options.boundary && options.outlines) result.outlines = outlines_of(ranks, network, std::move(share));
  return result;
}

geometry::ToldShare told_share(const Ranks& ranks, const RunOptions& options, double from, double to) {
  if (!ranks.is_master() || !options.on_progress) return {};
  return [&options, from, to](double done) { options.on_progress(from + done * (to - from), 0); };
}

std::vector<geometry::Contact> contacts_among(
    const Table& table, std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
    unsigned threads) {
  RunOptions options;
  options.contacts = true;
  const FacetIndex index(table, batches);
  const auto load = [&](std::size_t i, FacetSet& facets) {
    facets.clear(index.hyperplane(i));
    index.append(i, facets);
  };
  return match_all(table, index.size(), load, options, threads, [] {}).contacts;
}

#define BSP2_STAGE(D)                                                                                   \
  template Resolution resolution<D>(Ranks&, const dataflow::Network<D>&, const dataflow::Partition<D>&, \
                                    CellShare, const RunOptions&, unsigned);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
