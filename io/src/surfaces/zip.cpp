#include "surfaces/zip.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <limits>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::io {
namespace {

constexpr std::uint32_t local_signature = 0x04034b50, central_signature = 0x02014b50,
                        end_signature = 0x06054b50;
constexpr std::uint16_t version_needed = 20, stored = 0, by_deflate = 8;
constexpr std::uint32_t first_day = 0x00210000;  // 1980-01-01, 0:00: equal surfaces make equal files

void append(std::string& to, std::initializer_list<std::pair<std::uint32_t, int>> numbers) {
  for (const auto& [number, bytes] : numbers)
    for (int i = 0; i < bytes; ++i) to += static_cast<char>(number >> 8 * i & 0xff);
}

}  // namespace

std::uint32_t crc32_of(std::string_view bytes) {
  return static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string deflated(std::string_view bytes, Wrapping wrapping) {
  constexpr int window = 15, memory = 9;
  z_stream stream{};
  // Level 4 packs text of numbers as tightly as the default does, in half the time.
  if (deflateInit2(&stream, 4, Z_DEFLATED, wrapping == Wrapping::zlib ? window : -window, memory,
                   Z_DEFAULT_STRATEGY) != Z_OK)
    throw std::bad_alloc();
  std::string packed(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
  std::size_t written = 0;
  int state = Z_OK;
  while (state == Z_OK) {  // the counters of zlib have 32 bits
    constexpr std::size_t most = std::numeric_limits<uInt>::max() / 2;
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(std::min(bytes.size(), most));
    const uInt given = stream.avail_in;
    stream.next_out = reinterpret_cast<Bytef*>(packed.data() + written);
    stream.avail_out = static_cast<uInt>(std::min(packed.size() - written, most));
    const uInt room = stream.avail_out;
    state = deflate(&stream, bytes.size() > most ? Z_NO_FLUSH : Z_FINISH);
    bytes.remove_prefix(given - stream.avail_in);
    written += room - stream.avail_out;
  }
  deflateEnd(&stream);
  if (state != Z_STREAM_END) throw std::bad_alloc();
  packed.resize(written);
  return packed;
}

void Zip::add(std::string_view name, std::string_view bytes, Packing packing) {
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max();
  std::string packed;
  if (packing == Packing::deflate) packed = deflated(bytes, Wrapping::none);
  const std::string_view content = packing == Packing::deflate ? packed : bytes;
  if (bytes.size() > most || bytes_.size() + content.size() + directory_.size() + 1024 > most)
    throw Error("it would be larger than 4 GiB, which such packed files cannot be");
  const std::string_view signs = name;
  std::string head;  // what the entry and the directory both have
  append(head, {{version_needed, 2},
                {0, 2},
                {packing == Packing::deflate ? by_deflate : stored, 2},
                {first_day, 4},
                {crc32_of(bytes), 4},
                {static_cast<std::uint32_t>(content.size()), 4},
                {static_cast<std::uint32_t>(bytes.size()), 4},
                {static_cast<std::uint32_t>(signs.size()), 2},
                {0, 2}});
  append(directory_, {{central_signature, 4}, {version_needed, 2}});
  directory_ += head;
  append(directory_, {{0, 2}, {0, 2}, {0, 2}, {0, 4}, {static_cast<std::uint32_t>(bytes_.size()), 4}});
  directory_ += signs;
  append(bytes_, {{local_signature, 4}});
  ((bytes_ += head) += signs) += content;
  ++entries_;
}

std::string Zip::take() {
  const auto at = static_cast<std::uint32_t>(bytes_.size());
  bytes_ += directory_;
  append(bytes_, {{end_signature, 4},
                  {0, 2},
                  {0, 2},
                  {entries_, 2},
                  {entries_, 2},
                  {static_cast<std::uint32_t>(directory_.size()), 4},
                  {at, 4},
                  {0, 2}});
  return std::move(bytes_);
}

}  // namespace bsp2::io
