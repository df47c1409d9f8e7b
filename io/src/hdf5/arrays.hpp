#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hdf5/hdf5.hpp"

// How several processes write the arrays of one file, each its own rows: one makes the file and all arrays
// without their contents (skeleton_driver.hpp), tells where the chunks are, and then each writes its bytes
// there. Nobody waits for another one, no byte is written twice or sent to somebody else, and HDF5 is not
// asked by several. Its own collective writing takes five to ten times as long.

namespace bsp2::io::hdf5 {

static_assert(std::endian::native == std::endian::little, "arrays are written as they are in memory");

/// How many rows of an array all writers have, and where ours begin.
struct Share {
  std::uint64_t before = 0, mine = 0, total = 0;
};

/// How an array of so many rows is cut.
inline constexpr std::uint64_t most_chunk_rows = std::uint64_t{1} << 16;
inline std::uint64_t chunk_rows(std::uint64_t rows) {
  return std::clamp<std::uint64_t>(rows, 1, most_chunk_rows);
}

/// An array of a snapshot, in the groups that its name tells: in chunks with checksums. The caller fills it.
Handle make_array(hid_t file, const char* name, hid_t type, std::uint64_t rows, std::size_t columns);

/// Makes arrays without their contents, in a file that the SkeletonDriver writes.
class ArrayMaker {
 public:
  explicit ArrayMaker(hid_t file) : file_(file) {}
  /// As ArrayWriter has it.
  template <typename T, typename Fill>
  void write(const char* name, const Share& share, std::size_t columns, const Fill&) {
    make(name, file_type<T>(), sizeof(T), share.total, columns);
  }

 private:
  hid_t file_;
  std::unique_ptr<char[]> nothing_;  // as large as any chunk, never read
  std::size_t nothing_bytes_ = 0;

  void make(const char* name, hid_t type, std::size_t element_bytes, std::uint64_t rows, std::size_t columns);
};

/// Writes our rows of arrays, in the order in which they were made.
class ArrayWriter {
 public:
  /// @param descriptor of the file. @param places of all chunks of all arrays.
  ArrayWriter(int descriptor, std::span<const std::uint64_t> places)
      : descriptor_(descriptor), places_(places) {}

  /// One array. @param fill called with `append(span)` to hand over our rows, in order.
  /// @throws Failure if they cannot be written.
  template <typename T, typename Fill>
  void write(const char* name, const Share& share, std::size_t columns, const Fill& fill) {
    begin(share, sizeof(T) * columns);
    fill([&](std::span<const T> values) { append(std::as_bytes(values)); });
    end(name);
  }

  /// What all have to know of the chunks in which others have rows, too.
  [[nodiscard]] std::vector<std::uint64_t> shared_sums() const;
  /// Writes the checksums of these. @param all what every writer has, in one order.
  void write_shared_sums(const std::vector<std::vector<std::uint64_t>>& all, int rank) const;

 private:
  /// A chunk that is not ours alone.
  struct Shared {
    std::uint64_t sum_place, bytes;
    std::uint32_t simple, weighted;
  };

  int descriptor_;
  std::span<const std::uint64_t> places_;  // from the array at hand on
  Share share_;
  std::size_t row_bytes_ = 0;
  std::uint64_t next_row_ = 0;  // the first one in the buffer
  std::size_t wanted_ = 0;      // bytes up to the end of the chunk, or of what is ours
  std::vector<char> buffer_;
  std::vector<Shared> shared_;

  void begin(const Share& share, std::size_t row_bytes);
  void append(std::span<const std::byte> bytes);
  void end(const char* name);
  [[nodiscard]] std::size_t bytes_to_write() const;
  void flush();
};

}  // namespace bsp2::io::hdf5
