#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace bsp2::io {

/// Makes a zip file in memory. libzip would do, but brings OpenSSL along; zlib is here anyhow.
/// Source: PKWARE, ".ZIP file format specification" 6.3, sections 4.3 and 4.4.
class Zip {
 public:
  enum class Packing { deflate, store };
  /// @param name with /, of ASCII. @throws Error where zip files of 32 bits end, at 4 GiB.
  void add(std::string_view name, std::string_view bytes, Packing packing = Packing::deflate);
  /// The whole; nothing can be added any more.
  [[nodiscard]] std::string take();

 private:
  std::string bytes_, directory_;
  std::uint16_t entries_ = 0;
};

/// Bytes as zlib compresses them; with its header and checksum, or without, as in zip files.
enum class Wrapping { zlib, none };
std::string deflated(std::string_view bytes, Wrapping wrapping);

/// The checksum of zip and PNG files.
std::uint32_t crc32_of(std::string_view bytes);

}  // namespace bsp2::io
