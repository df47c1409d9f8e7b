#include "hdf5/arrays.hpp"

#include <cerrno>
#include <cstring>
#include <system_error>

#include "files/replacing.hpp"
#include "hdf5/fletcher32.hpp"

namespace bsp2::io::hdf5 {
namespace {

constexpr std::size_t sum_bytes = sizeof(std::uint32_t);

void write_or_throw(int descriptor, std::uint64_t at, const void* from, std::size_t bytes) {
  if (!write_at(descriptor, at, from, bytes)) throw Failure(std::generic_category().message(errno));
}

}  // namespace

Handle make_array(hid_t file, const char* name, hid_t type, std::uint64_t rows, std::size_t columns) {
  const std::array<hsize_t, 2> size{rows, columns}, chunk{chunk_rows(rows), columns};
  const int rank = columns == 1 ? 1 : 2;
  const Handle space(H5Screate_simple(rank, size.data(), nullptr), H5Sclose);
  const Handle creation(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  check(H5Pset_attr_phase_change(creation, 0, 0));
  if (rows > 0) {
    check(H5Pset_chunk(creation, rank, chunk.data()));
    check(H5Pset_fletcher32(creation));
    check(H5Pset_fill_time(creation, H5D_FILL_TIME_NEVER));
  }
  const Handle links(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  check(H5Pset_create_intermediate_group(links, 1));
  return {H5Dcreate2(file, name, type, space, links, creation, H5P_DEFAULT), H5Dclose};
}

void ArrayMaker::make(const char* name, hid_t type, std::size_t element_bytes, std::uint64_t rows,
                      std::size_t columns) {
  const Handle dataset = make_array(file_, name, type, rows, columns);
  const std::uint64_t chunk = chunk_rows(rows);
  const std::size_t bytes = chunk * columns * element_bytes + sum_bytes;
  if (nothing_bytes_ < bytes) {
    nothing_.reset(new char[bytes]);
    nothing_bytes_ = bytes;
  }
  for (hsize_t row = 0; row < rows; row += chunk) {
    const std::array<hsize_t, 2> at{row, 0};
    check(H5Dwrite_chunk(dataset, H5P_DEFAULT, 0, at.data(), bytes, nothing_.get()));
  }
}

void ArrayWriter::begin(const Share& share, std::size_t row_bytes) {
  share_ = share;
  row_bytes_ = row_bytes;
  next_row_ = share.before;
  wanted_ = bytes_to_write();
}

/// Up to the end of the chunk or of what is ours.
std::size_t ArrayWriter::bytes_to_write() const {
  const std::uint64_t chunk = chunk_rows(share_.total), chunk_end = (next_row_ / chunk + 1) * chunk;
  return (std::min(chunk_end, share_.before + share_.mine) - next_row_) * row_bytes_;
}

void ArrayWriter::append(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    if (wanted_ == 0) throw std::logic_error("a snapshot's array is longer than it was said to be");
    const std::size_t part = std::min(bytes.size(), wanted_ - buffer_.size());
    const auto* begin = reinterpret_cast<const char*>(bytes.data());
    buffer_.insert(buffer_.end(), begin, begin + part);
    bytes = bytes.subspan(part);
    if (buffer_.size() == wanted_) flush();
  }
}

void ArrayWriter::end(const char* name) {
  if (next_row_ != share_.before + share_.mine)
    throw std::logic_error(std::string("a snapshot's array ") + name + " has not the length it was given");
  const std::uint64_t chunk = chunk_rows(share_.total);
  places_ = places_.subspan((share_.total + chunk - 1) / chunk);
}

void ArrayWriter::flush() {
  const std::uint64_t chunk = chunk_rows(share_.total), in_chunk = next_row_ % chunk;
  const std::size_t chunk_bytes = chunk * row_bytes_, at = in_chunk * row_bytes_;
  const std::uint64_t place = places_[next_row_ / chunk];
  next_row_ += wanted_ / row_bytes_;
  if (next_row_ == share_.total) buffer_.resize(chunk_bytes - at);  // the last chunk is whole, too
  Fletcher32 sum(chunk_bytes);
  sum.add(at, buffer_.data(), buffer_.size());
  if (buffer_.size() == chunk_bytes) {
    const std::uint32_t value = sum.value();
    const auto* bytes = reinterpret_cast<const char*>(&value);
    buffer_.insert(buffer_.end(), bytes, bytes + sum_bytes);
  } else {
    shared_.push_back({place + chunk_bytes, chunk_bytes, sum.simple(), sum.weighted()});
  }
  write_or_throw(descriptor_, place + at, buffer_.data(), buffer_.size());
  buffer_.clear();
  wanted_ = bytes_to_write();
}

std::vector<std::uint64_t> ArrayWriter::shared_sums() const {
  std::vector<std::uint64_t> numbers;
  for (const Shared& chunk : shared_)
    numbers.insert(numbers.end(), {chunk.sum_place, chunk.simple, chunk.weighted});
  return numbers;
}

void ArrayWriter::write_shared_sums(const std::vector<std::vector<std::uint64_t>>& all, int rank) const {
  for (const Shared& chunk : shared_) {
    Fletcher32 sum(chunk.bytes);
    int first = -1;
    for (std::size_t other = 0; other < all.size(); ++other)
      for (std::size_t i = 0; i < all[other].size(); i += 3) {
        if (all[other][i] != chunk.sum_place) continue;
        if (first < 0) first = static_cast<int>(other);
        sum.add(Fletcher32(chunk.bytes, static_cast<std::uint32_t>(all[other][i + 1]),
                           static_cast<std::uint32_t>(all[other][i + 2])));
      }
    const std::uint32_t value = sum.value();
    if (first == rank) write_or_throw(descriptor_, chunk.sum_place, &value, sum_bytes);
  }
}

}  // namespace bsp2::io::hdf5
