#include "progress.hpp"

#include <hdf5.h>
#include <xxhash.h>

#include <algorithm>
#include <array>
#include <boost/serialization/string.hpp>
#include <numeric>

#include "bsp2/geometry/dimensions.hpp"
#include "bsp2/geometry/error.hpp"
#include "exchange.hpp"

// The head of a snapshot is made by the master and written by all.
namespace boost::serialization {
template <class Archive>
void serialize(Archive& archive, bsp2::io::SnapshotHead& head, unsigned) {
  archive & head.model & head.source & head.dimension & head.coincidence & head.keep_in & head.keep_fuzzy & head.keep_out & head.hyperplanes & head.steps;
  archive & head.complete & head.in_cells & head.out_cells & head.in_volume & head.digest & head.totals & head.partition_root;
  archive & head.partition_hyperplane & head.partition_children & head.superstep_name & head.superstep_step & head.superstep_rank;
  archive & head.superstep_seconds & head.superstep_work_seconds & head.superstep_predicted_seconds;
  archive & head.superstep_bytes_sent & head.superstep_bytes_received & head.superstep_cells;
}
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

using dataflow::Frontier;
using geometry::BspTree;

/// Children of this rank's tree as those of the trees of all ranks together: inherited ones are the same for all, then come
/// the others in the order of the ranks.
struct Shift {
  Recorded inherited, before;
  [[nodiscard]] std::int32_t operator()(std::int32_t child) const {
    if (child >= 0) return child + static_cast<std::int32_t>(static_cast<std::uint32_t>(child) < inherited.nodes ? 0 : before.nodes);
    return child - static_cast<std::int32_t>(static_cast<std::uint32_t>(~child) <= inherited.cells ? 0 : before.cells);  // leaf 0 is empty
  }
};

/// HDF5's access to a file that all ranks open together.
class SharedFileAccess {
 public:
  explicit SharedFileAccess(const Ranks& ranks) {
    if (ranks.count() == 1) return;
    id_ = H5Pcreate(H5P_FILE_ACCESS);
    if (id_ < 0 || H5Pset_fapl_mpio(id_, MPI_COMM_WORLD, MPI_INFO_NULL) < 0) throw std::runtime_error("HDF5 cannot use MPI");
  }
  ~SharedFileAccess() {
    if (id_ > 0) H5Pclose(id_);
  }
  SharedFileAccess(const SharedFileAccess&) = delete;
  SharedFileAccess& operator=(const SharedFileAccess&) = delete;
  [[nodiscard]] std::int64_t id() const { return id_; }

 private:
  hid_t id_ = 0;
};

template <int D>
io::SnapshotHead make_head(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress, const RunOptions& options, const Source& source,
                           bool complete, const std::vector<SuperstepRecord>& records) {
  const dataflow::Totals<D> totals = sum_totals(ranks, network, progress.totals);
  io::SnapshotHead head;
  if (ranks.is_master()) {
    head.model = options.model.string();
    head.source = source.text;
    head.dimension = D;
    head.coincidence = options.coincidence;
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
    head.partition_root = progress.partition.root;
    for (const auto& node : progress.partition.nodes) {
      head.partition_hyperplane.push_back(node.hyperplane);
      head.partition_children.insert(head.partition_children.end(), {node.negative, node.positive});
    }
    append_records(head, records);
  }
  if (ranks.count() > 1) broadcast(ranks, head);
  head.level = options.level;
  return head;
}

/// This rank's share, numbered through all shares.
template <int D>
void fill_share(io::Snapshot& snapshot, const Progress<D>& progress, const Shift& shift, std::uint32_t hyperplanes_before) {
  for (const dataflow::Region<D>& region : progress.partition.regions) {
    dataflow::Region<D> shifted{region.number, region.level, {}, region.program, region.frontier};
    std::uint64_t tokens = region.frontier.empty() ? 1 : 0;
    for (Frontier::Node& node : shifted.frontier.nodes) {
      if (node.kind == Frontier::Kind::emitted) node.value = shift(node.value);
      if (node.kind == Frontier::Kind::token) ++tokens;
    }
    snapshot.frontier_region.push_back(region.number);
    snapshot.frontier_tokens.push_back(tokens);
    snapshot.frontier_archive.push_back(dataflow::to_bytes(shifted));
  }
  snapshot.cells = progress.batches;
  snapshot.tree = progress.tree;
  for (auto& node : snapshot.tree.nodes) node = {hyperplanes_before + node.hyperplane, shift(node.negative), shift(node.positive)};
  for (std::uint32_t region = 0; region < progress.roots.size(); ++region)
    if (progress.roots[region] != BspTree::empty_leaf) {
      snapshot.finished_region.push_back(region);
      snapshot.finished_root.push_back(shift(progress.roots[region]));
    }
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
    hash = XXH3_64bits_withSeed(values.data(), sizeof values, hash);
  }
  return std::to_string(hash);
}

void append_records(io::SnapshotHead& head, const std::vector<SuperstepRecord>& records) {
  for (const SuperstepRecord& record : records)
    for (std::size_t rank = 0; rank < record.seconds.size(); ++rank) {
      head.superstep_name.push_back(record.name);
      head.superstep_step.push_back(record.step);
      head.superstep_rank.push_back(static_cast<std::uint32_t>(rank));
      head.superstep_seconds.push_back(record.seconds[rank]);
      head.superstep_work_seconds.push_back(rank < record.work_seconds.size() ? record.work_seconds[rank] : record.seconds[rank]);
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
    record.bytes_sent.push_back(head.superstep_bytes_sent[row]);
    record.bytes_received.push_back(head.superstep_bytes_received[row]);
    record.cells.push_back(head.superstep_cells[row]);
  }
  return records;
}

template <int D>
dataflow::Partition<D> partition_of(const io::SnapshotHead& head) {
  dataflow::Partition<D> partition;
  partition.root = head.partition_root;
  for (std::size_t i = 0; i < head.partition_hyperplane.size(); ++i)
    partition.nodes.push_back({head.partition_hyperplane[i], head.partition_children[2 * i], head.partition_children[2 * i + 1]});
  return partition;
}

template <int D>
void add_share(io::Snapshot& snapshot, const Progress<D>& progress) {
  fill_share(snapshot, progress, {progress.inherited, {}}, 0);
}

template <int D>
void Progress<D>::add(std::vector<std::uint32_t> regions, dataflow::Evaluation<D> evaluation, Keeper& keeper) {
  totals += evaluation.totals;
  Part part = keeper.take<D>(std::move(regions), std::move(evaluation));
  for (std::size_t i = 0; i < part.regions.size(); ++i) roots[part.regions[i]] = part.roots[i];
  std::move(part.batches.begin(), part.batches.end(), std::back_inserter(batches));
  tree.append(part.tree);
  cells += static_cast<std::uint32_t>(part.cells);
}

template <int D>
Part Progress<D>::take() {
  Part part;
  part.elsewhere = inherited_elsewhere;
  part.batches = std::move(batches);
  part.cells = cells;
  part.tree = std::move(tree);
  for (std::uint32_t region = 0; region < roots.size(); ++region)
    if (roots[region] != BspTree::empty_leaf) {
      part.regions.push_back(region);
      part.roots.push_back(roots[region]);
    }
  return part;
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
  progress.roots.assign(distribution.rank_of_region.size(), BspTree::empty_leaf);
  progress.partition = std::move(distribution.partition);
  return {std::move(progress), std::move(distribution.rank_of_region)};
}

template <int D>
void save_progress(Ranks& ranks, const dataflow::Network<D>& network, const Progress<D>& progress, const RunOptions& options, const Source& source,
                   bool complete, const std::vector<SuperstepRecord>& records) {
  io::Snapshot snapshot;
  snapshot.head = make_head(ranks, network, progress, options, source, complete, records);
  Shift shift{progress.inherited, {}};
  std::uint32_t hyperplanes_before = 0;
  if (ranks.count() > 1) {
    const Recorded recorded = progress.recorded();
    const auto all = all_gather(ranks, std::vector<std::uint32_t>{recorded.nodes - progress.inherited.nodes, recorded.cells - progress.inherited.cells,
                                                                  static_cast<std::uint32_t>(progress.tree.hyperplanes.size() / (D + 1))});
    for (std::size_t rank = 0; rank < static_cast<std::size_t>(ranks.rank()); ++rank) {
      shift.before.nodes += all[rank][0];
      shift.before.cells += all[rank][1];
      hyperplanes_before += all[rank][2];
    }
  }
  fill_share(snapshot, progress, shift, hyperplanes_before);
  const SharedFileAccess access(ranks);
  io::SnapshotWriters writers;
  writers.rank = ranks.rank();
  writers.count = ranks.count();
  writers.file_access = access.id();
  writers.exchange = [&ranks](const std::vector<std::uint64_t>& numbers) { return all_gather(ranks, numbers); };
  io::write_snapshot(*options.snapshot, snapshot, writers);
}

template <int D>
Started<D> load_progress(Ranks& ranks, const dataflow::Network<D>& network, const RunOptions& options) {
  io::Snapshot snapshot = io::read_snapshot(*options.resume, ranks.is_master() ? io::SnapshotPart::all : io::SnapshotPart::frontier);
  const io::SnapshotHead& head = snapshot.head;
  if (head.hyperplanes != hyperplane_digest(network))
    throw Error("the snapshot '" + options.resume->string() + "' was written by a program that compiles its model differently; use that one, or run the model anew");
  Progress<D> progress(network);
  std::vector<std::int32_t> rank_of_region;
  try {
    progress.steps = head.steps;
    progress.partition = partition_of<D>(head);
    progress.roots.assign(progress.partition.nodes.size() + 1, BspTree::empty_leaf);
    rank_of_region.assign(progress.roots.size(), 0);
    std::vector<std::size_t> order(snapshot.frontier_region.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return snapshot.frontier_tokens[a] > snapshot.frontier_tokens[b]; });
    for (std::size_t i = 0; i < order.size(); ++i) {
      const int owner = static_cast<int>(i) % ranks.count();
      rank_of_region.at(snapshot.frontier_region[order[i]]) = owner;
      if (owner != ranks.rank()) continue;
      dataflow::Region<D> region;
      dataflow::from_bytes(std::span<const char>(snapshot.frontier_archive[order[i]]), region);
      region.cell = dataflow::region_cell(network, progress.partition, region.number);
      progress.partition.regions.push_back(std::move(region));
    }
    progress.inherited = {head.recorded_nodes, head.recorded_cells};
    if (!ranks.is_master()) {
      progress.inherited_elsewhere = progress.inherited;
      return {std::move(progress), std::move(rank_of_region)};
    }
    dataflow::from_bytes(std::span<const char>(head.totals), progress.totals);
    progress.batches = std::move(snapshot.cells);
    for (const auto& batch : progress.batches) progress.cells += static_cast<std::uint32_t>(batch->size());
    progress.tree = std::move(snapshot.tree);
    for (std::size_t i = 0; i < snapshot.finished_region.size(); ++i) progress.roots.at(snapshot.finished_region[i]) = snapshot.finished_root[i];
  } catch (const std::exception& error) {  // archives and numbers that checksums cannot guard against
    throw Error("the snapshot '" + options.resume->string() + "' is damaged (" + error.what() + ")");
  }
  return {std::move(progress), std::move(rank_of_region)};
}

RunOptions resumed_options(const RunOptions& options, std::vector<SuperstepRecord>& records) {
  const io::SnapshotHead head = io::read_snapshot(*options.resume, io::SnapshotPart::head).head;
  if (head.is_portion) throw Error("the snapshot '" + options.resume->string() + "' is what one job of a queue found; put all together with 'bsp2 jobs merge'");
  records = records_of(head);
  RunOptions resumed = options;
  resumed.model = head.model;
  resumed.coincidence = head.coincidence;
  resumed.keep_in = head.keep_in;
  resumed.keep_fuzzy = head.keep_fuzzy;
  resumed.keep_out = head.keep_out;
  // The cells of a region may be with the master, from before, and with the rank that goes on with it: only together are they one part.
  if (resumed.collect == Collect::file || resumed.collect == Collect::automatic) resumed.collect = Collect::master;
  if (!options.level) resumed.level = head.level;
  if (resumed.level && (!head.level || *resumed.level < *head.level) && options.level)
    throw Error("the snapshot '" + options.resume->string() + "' is refined to " + (head.level ? "level " + std::to_string(*head.level) : "any level") +
                " already; ask for a deeper level, or run the model anew");
  return resumed;
}

#define BSP2_STAGE(D)                                                                                                                         \
  template struct Progress<D>;                                                                                                                \
  template Started<D> begin_progress<D>(const dataflow::Network<D>&, Distribution<D>);                                                        \
  template void save_progress<D>(Ranks&, const dataflow::Network<D>&, const Progress<D>&, const RunOptions&, const Source&, bool,             \
                                 const std::vector<SuperstepRecord>&);                                                                        \
  template Started<D> load_progress<D>(Ranks&, const dataflow::Network<D>&, const RunOptions&);                                               \
  template std::string hyperplane_digest<D>(const dataflow::Network<D>&);                                                                     \
  template dataflow::Partition<D> partition_of<D>(const io::SnapshotHead&);                                                                   \
  template void add_share<D>(io::Snapshot&, const Progress<D>&);
BSP2_FOR_EACH_DIMENSION(BSP2_STAGE)
#undef BSP2_STAGE

}  // namespace bsp2::supersteps
