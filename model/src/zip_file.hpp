#pragma once

#include <zip.h>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace bsp2::model {

/// The entries of a zip file, whose bytes are in memory. What is read is unpacked piece by piece.
class ZipFile {
 public:
  /// @param bytes outlive this. @throws bsp2::Error if they are no zip file.
  ZipFile(std::string_view bytes, const std::filesystem::path& path);
  [[nodiscard]] static bool is_zip(std::string_view bytes) { return bytes.starts_with("PK\x03\x04"); }

  using Entry = std::unique_ptr<zip_file_t, int (*)(zip_file_t*)>;
  /// An entry by name (the case of letters makes no difference); null if there is none.
  [[nodiscard]] Entry open(const std::string& name) const;
  /// The first entry with this ending, else the first one; null if there is none at all.
  [[nodiscard]] Entry open_first(std::string_view ending) const;
  /// All of a small entry; nothing if there is none or if it is longer than `most` bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& name, std::size_t most) const;

 private:
  std::unique_ptr<zip_t, void (*)(zip_t*)> archive_;
};

}  // namespace bsp2::model
