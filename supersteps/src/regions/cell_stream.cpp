#include "regions/cell_stream.hpp"

#include <algorithm>
#include <boost/serialization/utility.hpp>
#include <chrono>

#include "ranks/exchange.hpp"

namespace boost::serialization {
template <>
struct is_bitwise_serializable<bsp2::supersteps::Assignment::Run> : mpl::true_ {};
}  // namespace boost::serialization

namespace bsp2::supersteps {
namespace {

// Letters that messages begin with; `send` of a mesh and ProgressExchange use others.
constexpr char some_cells = 'C', cells_of_region = 'B', a_dealing = 'D';

/// Cells of one worker of a rank. @tparam Batch const where they are sent.
template <typename Batch>
struct SentCells {
  Batch& cells;
  std::int32_t rank = 0;
  std::uint32_t worker = 0;
  std::uint64_t first = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& cells& rank& worker& first;
  }
};

template <typename Batch>
struct SentRegion {
  Batch& cells;
  std::uint32_t region = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& cells& region;
  }
};

struct SentDealing {
  Assignment assignment;
  std::int32_t rank = 0;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& assignment.dimension& assignment.region& assignment.end& assignment.runs& rank;
  }
};

template <typename T>
std::string message_of(char letter, const T& content) {
  std::string bytes = dataflow::to_bytes(content);
  bytes.insert(bytes.begin(), letter);
  return bytes;
}

}  // namespace

/// The first of the pair that this rank belongs to when it hands over: of the rounds of a tree, the one that
/// its lowest bit says.
int CellStream::next_rank() const {
  const int rank = ranks_.rank();
  return how_ == Collect::tree ? rank & (rank - 1) : 0;
}

void CellStream::begin(RegionMeshes& meshes) {
  for (auto& [number, mesh] : meshes) {
    if (ranks_.is_master()) {
      put({{number, mesh.batches}});
    } else {
      for (const auto& batch : mesh.batches)
        waiting_.push_back(
            message_of(cells_of_region, SentRegion<const geometry::CellBatch>{*batch, number}));
    }
    if (!keeps_) mesh.batches.clear();
  }
}

void CellStream::consume(const std::shared_ptr<const dataflow::Refinement>& refinement) {
  if (ranks_.is_master() || is_abandoned_) return;
  const auto start = std::chrono::steady_clock::now();
  waiting_.push_back(
      message_of(some_cells, SentCells<const geometry::CellBatch>{refinement->cells, ranks_.rank(),
                                                                  refinement->worker, refinement->first}));
  ranks_.hide(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
}

void CellStream::deal(const Assignment& assignment, const RegionCells& cells) {
  if (is_abandoned_) return;
  if (ranks_.is_master())
    put(cells);
  else
    waiting_.push_back(message_of(a_dealing, SentDealing{assignment, ranks_.rank()}));
}

bool CellStream::send() {
  const int to = next_rank();
  const bool is_passed_on = to != 0 && !waiting_.empty();
  for (; !waiting_.empty(); waiting_.pop_front()) ranks_.send(to, waiting_.front());
  return is_passed_on;
}

void CellStream::take(std::string_view message) {
  if (is_abandoned_) return;
  if (!ranks_.is_master()) {
    waiting_.emplace_back(message);
    return;
  }
  const std::span<const char> bytes(message.data() + 1, message.size() - 1);
  if (message.front() == some_cells) {
    const auto found = std::make_shared<dataflow::Refinement>();
    SentCells<geometry::CellBatch> sent{found->cells};
    dataflow::from_bytes(bytes, sent);
    found->worker = sent.worker;
    found->first = sent.first;
    count_ += found->cells.size();
    undealt_[sent.rank].consume(found);
  } else if (message.front() == cells_of_region) {
    const auto batch = std::make_shared<geometry::CellBatch>();
    SentRegion<geometry::CellBatch> sent{*batch};
    dataflow::from_bytes(bytes, sent);
    put({{sent.region, {batch}}});
  } else {
    SentDealing sent;
    dataflow::from_bytes(bytes, sent);
    const RegionCells cells = divide_cells(sent.assignment, undealt_[sent.rank].take());
    for (const auto& [region, batches] : cells)
      for (const auto& batch : batches) count_ -= batch->size();  // they have been counted
    put(cells);
  }
}

void CellStream::put(const RegionCells& cells) {
  for (const auto& [region, batches] : cells) {
    auto& all = cells_[region];
    all.insert(all.end(), batches.begin(), batches.end());
    for (const auto& batch : batches) count_ += batch->size();
  }
}

bool CellStream::is_full() const { return how_ == Collect::automatic && count_ > cells_of_a_master; }

void CellStream::abandon() {
  is_abandoned_ = true;
  waiting_.clear();
  undealt_.clear();
  cells_.clear();
}

RegionCells CellStream::finish() {
  int hops = 1;
  if (how_ == Collect::tree)  // as many as the rank with the most bits needs
    for (int last = ranks_.count() - 1; last > 1; last /= 2) ++hops;
  for (; hops > 0; --hops) {
    send();
    ranks_.sync();
    for (const auto& message : ranks_.received()) take(message.bytes);
  }
  return std::exchange(cells_, {});
}

}  // namespace bsp2::supersteps
