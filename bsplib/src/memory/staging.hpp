#pragma once

#include <mpi.h>

#include <cstddef>
#include <map>
#include <memory>
#include <vector>

#include "memory/shared_memory.hpp"
#include "support/wire.hpp"

namespace bsp2::bsplib {

/// Memory for what a superstep sends. Ranks of one node read each other's without a transfer.
///
/// Two halves take turns. What rank s stages in superstep k is read by t in sync k, and as messages until t
/// enters sync k+1; s writes this half again only after its own sync k+1, so no further synchronization is
/// needed. When a half is full, or there is no shared memory, private memory serves; that travels in
/// messages.
class Staging {
 public:
  struct Block {
    std::byte* data = nullptr;
    std::size_t capacity = 0;
    std::size_t where = wire::nowhere;  ///< offset for the other ranks, or nowhere
  };

  /// Collective over comm. Shared memory is used where there is enough.
  Staging(MPI_Comm comm, std::size_t half_bytes);
  ~Staging();
  Staging(const Staging&) = delete;
  Staging& operator=(const Staging&) = delete;

  Block allocate(std::size_t bytes);
  /// For data beside a stream. It leaves some room to streams and replies: what fits as one put then fits cut
  /// into small ones, too, which add a record of 8 bytes to every 16 KiB.
  Block allocate_data(std::size_t bytes);
  /// Whether data of this size would be where other ranks can read it.
  bool has_room(std::size_t bytes) const { return top_ + bytes <= data_bytes_ && half_bytes_ > 0; }
  /// Only what other ranks can read and write; nothing if there is no room.
  Block allocate_shared(std::size_t bytes);
  /// The opposite: memory of this process.
  Block allocate_private(std::size_t bytes);
  /// Makes a block larger where it is, if it was the last one allocated.
  bool extend(Block& block, std::size_t capacity);
  /// Where another rank's staging memory is in this address space; null if it is on another node.
  std::byte* peer(int rank) const { return peers_[static_cast<std::size_t>(rank)]; }
  /// The ranks that share memory; null if there is none.
  MPI_Comm node() const { return memory_.empty() ? MPI_COMM_NULL : node_; }
  /// Leaves such a block only so many bytes.
  void shrink(Block& block, std::size_t bytes);
  /// After a sync: the other half's turn.
  void flip();
  /// Collective: gives the shared memory back.
  void release();

 private:
  void share(MPI_Comm comm, std::size_t half_bytes);
  MPI_Comm node_ = MPI_COMM_NULL;
  SharedMemory memory_;
  std::byte* base_ = nullptr;
  std::size_t half_bytes_ = 0, top_ = 0;
  std::size_t data_bytes_ = 0;  ///< of a half: where data beside streams ends
  unsigned half_ = 0;
  std::vector<std::byte*> peers_;
  struct Heap {
    std::unique_ptr<std::byte[]> data;
    std::size_t capacity;
  };
  std::multimap<std::size_t, Heap> free_;
  std::vector<Heap> used_[2];
};

}  // namespace bsp2::bsplib
