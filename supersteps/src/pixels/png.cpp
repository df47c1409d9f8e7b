#include "pixels/png.hpp"

#include <zlib.h>

#include <array>
#include <cstdlib>
#include <new>
#include <string_view>
#include <utility>
#include <vector>

namespace bsp2::supersteps {
namespace {

using Row = std::vector<std::uint8_t>;

std::string big_endian(std::uint32_t number) {
  std::string text;
  for (int shift = 24; shift >= 0; shift -= 8) text += static_cast<char>(number >> shift & 0xff);
  return text;
}

void append_chunk(std::string& file, std::string_view kind, std::string_view data) {
  const std::string body = std::string(kind) + std::string(data);
  file += big_endian(static_cast<std::uint32_t>(data.size())) + body;
  file += big_endian(
      static_cast<std::uint32_t>(crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size())));
}

/// Not multiplied by its opacity.
std::uint8_t plain(std::uint32_t channel, std::uint32_t opacity) {
  return static_cast<std::uint8_t>(opacity == 0 ? 0 : (255 * channel + opacity / 2) / opacity);
}

void unpack(std::span<const std::uint32_t> pixels, std::size_t channels, Row& row) {
  std::size_t at = 0;
  for (const std::uint32_t pixel : pixels) {
    const std::uint32_t opacity = channels == 4 ? pixel >> 24 : 255;
    for (int shift = 16; shift >= 0; shift -= 8) {
      const std::uint32_t channel = pixel >> shift & 0xff;
      row[at++] = opacity == 255 ? static_cast<std::uint8_t>(channel) : plain(channel, opacity);
    }
    if (channels == 4) row[at++] = static_cast<std::uint8_t>(opacity);
  }
}

/// What two of the filters of PNG leave: the difference to the left, or to above.
std::uint32_t filter(const Row& row, const Row* above, std::size_t channels, Row& filtered) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i < row.size(); ++i) {
    const std::uint8_t before = above != nullptr ? (*above)[i] : i >= channels ? row[i - channels] : 0;
    const auto difference = static_cast<std::uint8_t>(row[i] - before);
    filtered[i] = difference;
    sum += static_cast<std::uint32_t>(std::abs(static_cast<std::int8_t>(difference)));
  }
  return sum;
}

class Deflater {
 public:
  explicit Deflater(std::size_t expected) : buffer_(expected) {
    // What the filters leave of a picture is mostly runs: to look for more takes three times as long and
    // saves a twentieth.
    if (deflateInit2(&stream_, 6, Z_DEFLATED, 15, 9, Z_RLE) != Z_OK) throw std::bad_alloc();
  }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;
  ~Deflater() { deflateEnd(&stream_); }

  void add(const std::uint8_t* data, std::size_t size, bool is_last) {
    stream_.next_in = const_cast<Bytef*>(data);
    stream_.avail_in = static_cast<uInt>(size);
    do {
      stream_.next_out = buffer_.data();
      stream_.avail_out = static_cast<uInt>(buffer_.size());
      deflate(&stream_, is_last ? Z_FINISH : Z_NO_FLUSH);
      bytes_.append(reinterpret_cast<const char*>(buffer_.data()), buffer_.size() - stream_.avail_out);
    } while (stream_.avail_out == 0);
  }
  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  z_stream stream_{};
  std::vector<Bytef> buffer_;
  std::string bytes_;
};

}  // namespace

std::string png_file(std::span<const std::uint32_t> pixels, int width, int height, bool has_opacity) {
  constexpr std::uint8_t left = 1, up = 2;
  const std::size_t channels = has_opacity ? 4 : 3, columns = static_cast<std::size_t>(width);
  Row row(channels * columns), above(row.size()), by_left(row.size()), by_above(row.size());
  Deflater deflater(std::size_t{1} << 16);
  for (int y = 0; y < height; ++y) {
    unpack(pixels.subspan(static_cast<std::size_t>(y) * columns, columns), channels, row);
    const std::uint32_t to_left = filter(row, nullptr, channels, by_left),
                        to_above = filter(row, &above, channels, by_above);
    const bool is_up = to_above <= to_left;
    const std::uint8_t kind = is_up ? up : left;
    deflater.add(&kind, 1, false);
    deflater.add(is_up ? by_above.data() : by_left.data(), row.size(), y + 1 == height);
    std::swap(row, above);
  }
  std::string file = "\x89PNG\r\n\x1a\n";
  const std::array<char, 5> looks{8, static_cast<char>(has_opacity ? 6 : 2), 0, 0, 0};
  append_chunk(file, "IHDR",
               big_endian(static_cast<std::uint32_t>(width)) +
                   big_endian(static_cast<std::uint32_t>(height)) + std::string(looks.data(), looks.size()));
  append_chunk(file, "IDAT", deflater.take());
  append_chunk(file, "IEND", "");
  return file;
}

}  // namespace bsp2::supersteps
