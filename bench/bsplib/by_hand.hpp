#pragma once

#include <mpi.h>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <vector>

/// What a careful MPI programmer writes for a superstep of equally large puts to one neighbour, the measure
/// of the layer: pack, Alltoall of the counts, Alltoallv of the data, unpack, Barrier. Buffers are allocated
/// once.
class ByHand {
 public:
  ByHand(MPI_Comm comm, std::size_t capacity)
      : comm_(comm), packed_(new std::byte[capacity]), arrived_(new std::byte[capacity]) {
    int p = 0;
    MPI_Comm_size(comm, &p);
    for (auto* counts : {&sent_, &received_, &sent_at_, &received_at_})
      counts->resize(static_cast<std::size_t>(p));
  }

  void put(const void* source, std::uint64_t offset, std::size_t bytes) {
    std::memcpy(packed_.get() + size_, &offset, sizeof offset);
    std::memcpy(packed_.get() + size_ + sizeof offset, source, bytes);
    size_ += sizeof offset + bytes;
  }

  /// @param bytes of one put
  void sync(int neighbour, std::byte* memory, std::size_t bytes) {
    std::fill(sent_.begin(), sent_.end(), 0);
    sent_[static_cast<std::size_t>(neighbour)] = static_cast<int>(size_);
    MPI_Alltoall(sent_.data(), 1, MPI_INT, received_.data(), 1, MPI_INT, comm_);
    std::size_t total = 0;
    for (std::size_t i = 0; i < received_.size(); ++i) {
      received_at_[i] = static_cast<int>(total);
      total += static_cast<std::size_t>(received_[i]);
    }
    MPI_Alltoallv(packed_.get(), sent_.data(), sent_at_.data(), MPI_BYTE, arrived_.get(), received_.data(),
                  received_at_.data(), MPI_BYTE, comm_);
    for (std::size_t at = 0; at < total; at += sizeof(std::uint64_t) + bytes) {
      std::uint64_t offset;
      std::memcpy(&offset, arrived_.get() + at, sizeof offset);
      std::memcpy(memory + offset, arrived_.get() + at + sizeof offset, bytes);
    }
    size_ = 0;
    MPI_Barrier(comm_);
  }

 private:
  MPI_Comm comm_;
  std::unique_ptr<std::byte[]> packed_, arrived_;
  std::size_t size_ = 0;
  std::vector<int> sent_, received_, sent_at_, received_at_;
};
