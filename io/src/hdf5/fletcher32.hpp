#pragma once

#include <cstddef>
#include <cstdint>

namespace bsp2::io::hdf5 {

/// The checksum of a chunk as HDF5's filter `fletcher32` makes it, of parts in any order: who has only some
/// bytes of a chunk adds these, and the sums are joined.
///
/// It is two sums of the chunk's 16-bit words modulo 2^16 - 1: of all, and of all times how many come after
/// (and with) them.
/// J. G. Fletcher, An arithmetic checksum for serial transmissions, IEEE Transactions on Communications 30
/// (1982).
class Fletcher32 {
 public:
  /// Of nothing yet. @param bytes of the whole chunk, at most 2^25.
  explicit Fletcher32(std::size_t bytes) : words_((bytes + 1) / 2) {}
  /// Sums that somebody else has made of a chunk of this size.
  Fletcher32(std::size_t bytes, std::uint32_t simple, std::uint32_t weighted)
      : words_((bytes + 1) / 2), simple_(simple), weighted_(weighted) {}

  /// Bytes of the chunk that begin at `at`; nobody adds a byte twice. Zeros need not be added.
  void add(std::size_t at, const void* data, std::size_t bytes);
  void add(const Fletcher32& other);

  [[nodiscard]] std::uint32_t simple() const { return simple_; }
  [[nodiscard]] std::uint32_t weighted() const { return weighted_; }
  /// As it stands behind the chunk, little-endian.
  [[nodiscard]] std::uint32_t value() const { return weighted_ << 16 | simple_; }

 private:
  std::size_t words_;
  std::uint32_t simple_ = 0, weighted_ = 0;  // 0 only if there are nothing but zeros, else 1 to 2^16 - 1

  void add_sums(std::uint64_t simple, std::uint64_t weighted);
};

}  // namespace bsp2::io::hdf5
