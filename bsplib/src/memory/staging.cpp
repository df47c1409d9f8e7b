#include "memory/staging.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

namespace bsp2::bsplib {

namespace {

constexpr std::size_t alignment = 64;  // a cache line
constexpr std::size_t stream_room = 4096;

std::size_t aligned(std::size_t n) { return (n + alignment - 1) & ~(alignment - 1); }

}  // namespace

Staging::Staging(MPI_Comm comm, std::size_t half_bytes) {
  int size = 0;
  MPI_Comm_size(comm, &size);
  peers_.assign(static_cast<std::size_t>(size), nullptr);
  constexpr std::size_t more_than_any = std::size_t{1} << 46U;  // so that no sum overflows
  data_bytes_ = aligned(std::min(half_bytes, more_than_any));
  if (size > 1 && half_bytes > 0) share(comm, data_bytes_ + aligned(data_bytes_ / 1024 + stream_room));
}

void Staging::share(MPI_Comm comm, std::size_t half_bytes) {
  MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &node_);
  int node_size = 0;
  MPI_Comm_size(node_, &node_size);
  if (node_size == 1) return;
  memory_ = SharedMemory(node_, 2 * half_bytes);
  if (memory_.empty()) return;
  peers_ = parts_by_rank(comm, node_, memory_);
  int rank = 0;
  MPI_Comm_rank(node_, &rank);
  base_ = memory_.part(rank);
  half_bytes_ = half_bytes;
}

Staging::~Staging() = default;

void Staging::release() {
  memory_.release();
  if (node_ != MPI_COMM_NULL) MPI_Comm_free(&node_);
  half_bytes_ = 0;
}

Staging::Block Staging::allocate_shared(std::size_t bytes) {
  const std::size_t size = aligned(std::max<std::size_t>(bytes, 1));
  if (size > half_bytes_ - top_) return {};
  const std::size_t where = half_ * half_bytes_ + top_;
  top_ += size;
  return {base_ + where, size, where};
}

Staging::Block Staging::allocate_data(std::size_t bytes) {
  return has_room(bytes) ? allocate(bytes) : allocate_private(bytes);
}

Staging::Block Staging::allocate(std::size_t bytes) {
  if (const Block block = allocate_shared(bytes); block.data) return block;
  return allocate_private(bytes);
}

Staging::Block Staging::allocate_private(std::size_t bytes) {
  const std::size_t size = aligned(std::max<std::size_t>(bytes, 1));
  auto found = free_.lower_bound(size);
  Heap heap;
  if (found != free_.end() && found->first <= 4 * size) {
    heap = std::move(found->second);
    free_.erase(found);
  } else {
    // Where needs grow from superstep to superstep, none of the old blocks would ever serve again.
    if (found == free_.end() && !free_.empty()) free_.erase(std::prev(found));
    heap = {std::unique_ptr<std::byte[]>(new std::byte[size]), size};
  }
  used_[half_].push_back(std::move(heap));
  return {used_[half_].back().data.get(), used_[half_].back().capacity, wire::nowhere};
}

bool Staging::extend(Block& block, std::size_t capacity) {
  if (block.where == wire::nowhere || block.where + block.capacity != half_ * half_bytes_ + top_)
    return false;
  const std::size_t more = aligned(capacity) - block.capacity;
  if (more > half_bytes_ - top_) return false;
  top_ += more;
  block.capacity += more;
  return true;
}

void Staging::shrink(Block& block, std::size_t bytes) {
  if (block.where == wire::nowhere || block.where + block.capacity != half_ * half_bytes_ + top_) return;
  const std::size_t capacity = std::min(block.capacity, aligned(std::max<std::size_t>(bytes, 1)));
  top_ -= block.capacity - capacity;
  block.capacity = capacity;
}

void Staging::flip() {
  half_ ^= 1U;
  top_ = 0;
  for (auto& heap : used_[half_]) {
    const std::size_t capacity = heap.capacity;
    free_.emplace(capacity, std::move(heap));
  }
  used_[half_].clear();
}

}  // namespace bsp2::bsplib
