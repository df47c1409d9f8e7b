#pragma once

#include <mpi.h>

#include <cstddef>
#include <utility>
#include <vector>

namespace bsp2::bsplib {

/// Memory that the ranks of a node share, one part a rank, each beginning with a page. The last one that lets
/// go of it frees it; no rank waits for another in that.
///
/// It is POSIX shared memory that is allocated in full when it is made. MPI_Win_allocate_shared promises
/// memory without having it: Open MPI 4.1 hangs when the file system that backs it is too small, and the
/// program dies of a bus error when it becomes full later.
class SharedMemory {
 public:
  SharedMemory() = default;
  /// Zero bytes, `bytes` of them on this rank. Collective over the ranks of one node. On all ranks nothing if
  /// there is not enough.
  SharedMemory(MPI_Comm node, std::size_t bytes);
  ~SharedMemory() { release(); }
  SharedMemory(SharedMemory&& other) noexcept { *this = std::move(other); }
  SharedMemory& operator=(SharedMemory&& other) noexcept;

  bool empty() const { return base_ == nullptr; }
  std::byte* part(int rank_in_node) const { return base_ + begins_[static_cast<std::size_t>(rank_in_node)]; }
  void release();

 private:
  std::byte* base_ = nullptr;
  std::vector<std::size_t> begins_;  ///< of the parts, and the end
};

/// Whether all ranks say yes. Collective.
bool all_have(MPI_Comm comm, bool mine);

/// Where the ranks of `comm` that are in `node` have their part of its memory; null for the others.
std::vector<std::byte*> parts_by_rank(MPI_Comm comm, MPI_Comm node, const SharedMemory& memory);

}  // namespace bsp2::bsplib
