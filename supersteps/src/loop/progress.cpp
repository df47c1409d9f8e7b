#include "loop/progress.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <boost/serialization/string.hpp>
#include <boost/serialization/vector.hpp>

#include "bsp2/dataflow/regions/portion.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "ranks/exchange.hpp"

// The head of a snapshot is made by the master and written by all.
namespace boost::serialization {
template <class Archive>
void serialize(Archive& archive, bsp2::io::SnapshotHead& head, unsigned) {
  archive& head.model& head.source& head.dimension& head.coincidence& head.curved& head.parts_by_colour& head
      .tolerance& head.angle& head.eye;
  archive& head.keep_in& head.keep_fuzzy& head.keep_out& head.hyperplanes& head.steps;
  archive& head.complete& head.in_cells& head.out_cells& head.in_volume& head.digest& head.totals& head
      .partition_root;
  archive& head.partition_hyperplane& head.partition_children& head.superstep_name& head.superstep_step& head
      .superstep_rank;
  archive& head.superstep_seconds& head.superstep_work_seconds& head.superstep_predicted_seconds;
  archive& head.superstep_bytes_sent& head.superstep_bytes_received& head.superstep_cells;
}
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using dataflow::Frontier;

template <int D>
io::SnapshotHead make_head(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress,
                           const RunOptions& options, const Source& source, bool complete,
                           const std::vector<SuperstepRecord>& records) {
  const dataflow::Totals<D> totals = sum_totals(ranks, network, progress.totals);
  io::SnapshotHead head;
  if (ranks.is_master()) {
    head.model = std::filesystem::absolute(options.model)
                     .string();  // its imports are found from wherever the run goes on
    head.source = source.text;
    head.dimension = D;
    head.coincidence = options.coincidence;
    head.curved = options.curved;
    head.parts_by_colour = options.parts_by_colour;
    head.tolerance = options.tolerance.value_or(0);
    if (options.angle) {
      head.angle = *options.angle;
      head.eye = options.eye;
    }
    head.keep_in = options.keep_in;
    head.keep_fuzzy = options.keep_fuzzy;
    head.keep_out = options.keep_out;
    head.hyperplanes = hyperplane_digest(network);
    head.steps = progress.steps;
    head.complete = complete;
    head.in_cells = totals.in_cells;
    head.out_cells = totals.out_cells;
    head.in_volume = totals.in.value().volume();
    head.digest = totals.digest.hex();
    head.totals = dataflow::to_bytes(totals);
    set_partition(head, progress.partition);
    append_records(head, records);
  }
  if (ranks.count() > 1) broadcast(ranks, head);
  head.level = options.level;
  return head;
}

/// Who gets which region of a snapshot: undecided ones by their tokens, the largest first; of finished ones,
/// which only have to be held, blocks that follow each other in the file. @param reopens what has ended is
/// looked at again.
std::vector<std::int32_t> deal_out(const io::Snapshot& head, std::size_t regions, int ranks, bool reopens) {
  constexpr double ended_work = 0.01;  // of an open token's: it is held, and drawn as one cell
  std::vector<std::int32_t> rank_of_region(regions, 0);
  std::uint64_t cells = 0, before = 0;
  for (const io::SnapshotRegion& region : head.regions) cells += region.cells;
  for (const io::SnapshotRegion& region : head.regions) {
    rank_of_region.at(region.number) =
        static_cast<std::int32_t>(before * static_cast<unsigned>(ranks) / std::max<std::uint64_t>(1, cells));
    before += region.cells;
    if (rank_of_region[region.number] >= ranks)
      rank_of_region[region.number] = ranks - 1;  // empty ones at the end
  }
  std::vector<double> work;
  for (std::size_t i = 0; i < head.frontier_tokens.size(); ++i) {
    const auto tokens = static_cast<double>(head.frontier_tokens[i]),
               open = static_cast<double>(head.frontier_open[i]);
    work.push_back(reopens ? tokens : open + ended_work * (tokens - open));
  }
  const auto owner = assign_regions(work, ranks);
  for (std::size_t i = 0; i < owner.size(); ++i) rank_of_region.at(head.frontier_region[i]) = owner[i];
  return rank_of_region;
}

}  // namespace

template <int D>
std::string hyperplane_digest(const dataflow::Network<D>& network) {
  std::uint64_t hash = network.table.size();
  for (std::size_t i = 0; i < network.table.size(); ++i) {
    const auto h = network.table.rounded(static_cast<geometry::HyperplaneId>(i));
    std::array<double, D + 1> values;
    std::copy(h.normal.begin(), h.normal.end(), values.begin());
    values[D] = h.offset;
    for (double& value : values) value += 0.0;  // 0 and -0 are one
    hash = XXH3_64bits_withSeed(values.data(), sizeof values, hash);
  }
  return std::to_string(hash);
}

void forget_records(io::SnapshotHead& head) {
  head.superstep_name.clear();
  head.superstep_step.clear();
  head.superstep_rank.clear();
  head.superstep_seconds.clear();
  head.superstep_work_seconds.clear();
  head.superstep_predicted_seconds.clear();
  head.superstep_bytes_sent.clear();
  head.superstep_bytes_received.clear();
  head.superstep_cells.clear();
}

void append_records(io::SnapshotHead& head, const std::vector<SuperstepRecord>& records) {
  for (const SuperstepRecord& record : records)
    for (std::size_t rank = 0; rank < record.seconds.size(); ++rank) {
      head.superstep_name.push_back(record.name);
      head.superstep_step.push_back(record.step);
      head.superstep_rank.push_back(static_cast<std::uint32_t>(rank));
      head.superstep_seconds.push_back(record.seconds[rank]);
      head.superstep_work_seconds.push_back(rank < record.work_seconds.size() ? record.work_seconds[rank]
                                                                              : record.seconds[rank]);
      head.superstep_predicted_seconds.push_back(record.predicted_seconds);
      head.superstep_bytes_sent.push_back(record.bytes_sent[rank]);
      head.superstep_bytes_received.push_back(record.bytes_received[rank]);
      head.superstep_cells.push_back(record.cells[rank]);
    }
}

std::vector<SuperstepRecord> records_of(const io::SnapshotHead& head) {
  std::vector<SuperstepRecord> records;
  for (std::size_t row = 0; row < head.superstep_name.size(); ++row) {
    if (head.superstep_rank[row] == 0) {
      SuperstepRecord record;
      record.name = head.superstep_name[row];
      record.step = head.superstep_step[row];
      record.predicted_seconds = head.superstep_predicted_seconds[row];
      records.push_back(record);
    }
    if (records.empty()) continue;
    SuperstepRecord& record = records.back();
    record.seconds.push_back(head.superstep_seconds[row]);
    record.work_seconds.push_back(head.superstep_work_seconds[row]);
    record.hidden_seconds.push_back(0);
    record.hidden_bytes.push_back(0);
    record.bytes_sent.push_back(head.superstep_bytes_sent[row]);
    record.bytes_received.push_back(head.superstep_bytes_received[row]);
    record.cells.push_back(head.superstep_cells[row]);
  }
  return records;
}

template <int D>
void add_share(io::Snapshot& snapshot, const Progress<D>& progress) {
  for (const dataflow::Region<D>& region : progress.partition.regions) {
    const dataflow::Remains remains = dataflow::remains_of(region.frontier);
    const std::uint64_t whole = region.frontier.empty() ? 1 : 0;
    snapshot.frontier_region.push_back(region.number);
    snapshot.frontier_tokens.push_back(whole + remains.tokens);
    snapshot.frontier_open.push_back(whole + remains.open);
    snapshot.frontier_archive.push_back(dataflow::to_bytes(region));
  }
  snapshot.tree.dimension = D;
  std::size_t nodes = 0, hyperplanes = 0;
  for (const auto& [number, mesh] : progress.meshes) {
    nodes += mesh.tree.nodes.size();
    hyperplanes += mesh.tree.ids.size();
  }
  snapshot.tree.nodes.reserve(nodes);
  snapshot.tree.ids.reserve(hyperplanes);
  snapshot.tree.hyperplanes.reserve(hyperplanes * (D + 1));
  for (const auto& [number, mesh] : progress.meshes) {
    snapshot.regions.push_back({number, mesh.tree.root, mesh.cells,
                                static_cast<std::uint32_t>(mesh.tree.nodes.size()),
                                static_cast<std::uint32_t>(mesh.tree.ids.size())});
    snapshot.cells.insert(snapshot.cells.end(), mesh.batches.begin(), mesh.batches.end());
    snapshot.tree.nodes.insert(snapshot.tree.nodes.end(), mesh.tree.nodes.begin(), mesh.tree.nodes.end());
    snapshot.tree.ids.insert(snapshot.tree.ids.end(), mesh.tree.ids.begin(), mesh.tree.ids.end());
    snapshot.tree.hyperplanes.insert(snapshot.tree.hyperplanes.end(), mesh.tree.hyperplanes.begin(),
                                     mesh.tree.hyperplanes.end());
  }
}

template <int D>
RegionMeshes meshes_of(const io::Snapshot& snapshot) {
  RegionMeshes meshes;
  auto batch = snapshot.cells.begin();
  auto node = snapshot.tree.nodes.begin();
  auto id = snapshot.tree.ids.begin();
  auto hyperplane = snapshot.tree.hyperplanes.begin();
  for (const io::SnapshotRegion& region : snapshot.regions) {
    RegionMesh& mesh = meshes[region.number];
    mesh.region = region.number;
    while (mesh.cells < region.cells) {
      mesh.cells += static_cast<std::uint32_t>((*batch)->size());
      mesh.batches.push_back(*batch++);
    }
    mesh.tree.dimension = D;
    mesh.tree.root = region.root;
    mesh.tree.nodes.assign(node, node + region.nodes);
    mesh.tree.ids.assign(id, id + region.hyperplanes);
    mesh.tree.hyperplanes.assign(hyperplane, hyperplane + region.hyperplanes * (D + 1));
    node += region.nodes;
    id += region.hyperplanes;
    hyperplane += region.hyperplanes * (D + 1);
  }
  return meshes;
}

template <int D>
dataflow::Partition<D> partition_of(const io::SnapshotHead& head) {
  dataflow::Partition<D> partition;
  partition.root = head.partition_root;
  for (std::size_t i = 0; i < head.partition_hyperplane.size(); ++i)
    partition.nodes.push_back(
        {head.partition_hyperplane[i], head.partition_children[2 * i], head.partition_children[2 * i + 1]});
  return partition;
}

template <int D>
void set_partition(io::SnapshotHead& head, const dataflow::Partition<D>& partition) {
  head.partition_root = partition.root;
  head.partition_hyperplane.clear();
  head.partition_children.clear();
  for (const auto& node : partition.nodes) {
    head.partition_hyperplane.push_back(node.hyperplane);
    head.partition_children.insert(head.partition_children.end(), {node.negative, node.positive});
  }
}

template <int D>
void Progress<D>::add(const std::vector<std::uint32_t>& regions, dataflow::Evaluation<D>& evaluation,
                      const Recorded& before, CollectingConsumer& collector, CellStream* stream) {
  totals += evaluation.totals;
  if (!keeps_cells) return;
  const Assignment assignment = divide_trees<D>(evaluation, regions, before, meshes);
  RegionCells cells;
  if (stream == nullptr || stream->holds_here()) cells = divide_cells(assignment, collector.take());
  if (stream == nullptr || stream->keeps()) append(meshes, cells);
  if (stream != nullptr) stream->deal(assignment, cells);
}

template <int D>
std::vector<std::uint32_t> Progress<D>::region_numbers() const {
  std::vector<std::uint32_t> numbers;
  for (const auto& region : partition.regions) numbers.push_back(region.number);
  return numbers;
}

template <int D>
Started<D> begin_progress(const dataflow::Network<D>& network, Distribution<D> distribution) {
  Progress<D> progress(network);
  progress.partition = std::move(distribution.partition);
  return {std::move(progress), std::move(distribution.rank_of_region)};
}

template <int D>
void save_progress(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress,
                   const RunOptions& options, const Source& source, bool complete,
                   const std::vector<SuperstepRecord>& records) {
  io::Snapshot snapshot;
  snapshot.head = make_head(ranks, network, progress, options, source, complete, records);
  add_share(snapshot, progress);
  io::SnapshotWriters writers;
  writers.rank = ranks.rank();
  writers.count = ranks.count();
  writers.exchange = [&ranks](const std::vector<std::uint64_t>& numbers) {
    return all_gather(ranks, numbers);
  };
  io::write_snapshot(*options.snapshot, snapshot, writers);
}

bool are_same_limits(const io::SnapshotHead& head, const RunOptions& options) {
  if (options.level != head.level || options.tolerance.value_or(0) != head.tolerance ||
      options.angle.value_or(0) != head.angle)
    return false;
  return !options.angle || options.eye == head.eye;
}

namespace {

/// All that is undecided is looked at again.
void reopen(Frontier& frontier) {
  for (Frontier::Node& node : frontier.nodes) node.ended = 0;
}

}  // namespace

template <int D>
Started<D> load_progress(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options) {
  const io::Snapshot list = io::read_snapshot(*options.resume, io::SnapshotPart::head);
  const io::SnapshotHead& head = list.head;
  if (head.hyperplanes != hyperplane_digest(network))
    throw Error("the snapshot '" + options.resume->string() +
                "' was written by a program that compiles its model differently; use that one, or run the "
                "model anew");
  Progress<D> progress(network);
  std::vector<std::int32_t> rank_of_region;
  const bool same_limits = are_same_limits(head, options);
  try {
    progress.steps = head.steps;
    progress.partition = partition_of<D>(head);
    rank_of_region = deal_out(list, progress.partition.nodes.size() + 1, ranks.count(), !same_limits);
    const auto is_mine = [&](std::uint32_t region) { return rank_of_region[region] == ranks.rank(); };
    const auto part = options.collect_cells ? io::SnapshotPart::all : io::SnapshotPart::frontier;
    const io::Snapshot mine = io::read_snapshot(*options.resume, part, is_mine);
    if (options.collect_cells) progress.meshes = meshes_of<D>(mine);
    std::vector<dataflow::Region<D>> regions;
    for (const std::string& archive : mine.frontier_archive) {
      dataflow::from_bytes(std::span<const char>(archive), regions.emplace_back());
      if (!same_limits) reopen(regions.back().frontier);
    }
    dataflow::add_regions(network, progress.partition, std::move(regions));
    if (ranks.is_master()) dataflow::from_bytes(std::span<const char>(head.totals), progress.totals);
  } catch (const Error&) {
    throw;
  } catch (const std::exception& error) {  // archives and numbers that checksums cannot guard against
    throw Error("the snapshot '" + options.resume->string() + "' is damaged (" + error.what() + ")");
  }
  return {std::move(progress), std::move(rank_of_region)};
}

RunOptions resumed_options(const RunOptions& options, std::vector<SuperstepRecord>& records) {
  const io::SnapshotHead head = io::read_snapshot(*options.resume, io::SnapshotPart::head).head;
  if (head.is_portion)
    throw Error("the snapshot '" + options.resume->string() +
                "' is what one job of a queue found; put all together with 'bsp2 jobs merge'");
  records = records_of(head);
  RunOptions resumed = options;
  resumed.model = head.model;
  resumed.coincidence = head.coincidence;
  resumed.curved = head.curved;
  resumed.parts_by_colour = head.parts_by_colour;
  if (!options.tolerance && head.tolerance > 0) resumed.tolerance = head.tolerance;
  if (!options.angle && head.angle > 0) {
    resumed.angle = head.angle;
    if (options.eye.empty()) resumed.eye = head.eye;
  }
  resumed.keep_in = head.keep_in;
  resumed.keep_fuzzy = head.keep_fuzzy;
  resumed.keep_out = head.keep_out;
  if (options.boundary && !head.keep_in)
    throw Error("the snapshot '" + options.resume->string() +
                "' keeps no IN cells: they have the surface; run the model with --keep in");
  if (!options.level) resumed.level = head.level;
  if (resumed.level && (!head.level || *resumed.level < *head.level) && options.level)
    throw Error("the snapshot '" + options.resume->string() + "' is refined to " +
                (head.level ? "level " + std::to_string(*head.level) : "any level") +
                " already; ask for a deeper level, or run the model anew");
  return resumed;
}

#define BSP2_STAGE(D)                                                                                        \
  template struct Progress<D>;                                                                               \
  template Started<D> begin_progress<D>(const dataflow::Network<D>&, Distribution<D>);                       \
  template void save_progress<D>(Ranks&, const dataflow::Network<D>&, const Progress<D>&, const RunOptions&, \
                                 const Source&, bool, const std::vector<SuperstepRecord>&);                  \
  template Started<D> load_progress<D>(Ranks&, const dataflow::Network<D>&, const RunOptions&);              \
  template std::string hyperplane_digest<D>(const dataflow::Network<D>&);                                    \
  template dataflow::Partition<D> partition_of<D>(const io::SnapshotHead&);                                  \
  template void set_partition<D>(io::SnapshotHead&, const dataflow::Partition<D>&);                          \
  template void add_share<D>(io::Snapshot&, const Progress<D>&);                                             \
  template RegionMeshes meshes_of<D>(const io::Snapshot&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
