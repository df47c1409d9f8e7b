#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace bsp2::model {

/// The entries of a zip file, whose bytes are in memory. What is read is unpacked piece by piece.
class ZipFile {
 public:
  /// An entry that is read from its beginning. Not longer than its file.
  class Entry {
   public:
    virtual ~Entry() = default;
    /// @return the number of bytes, 0 at the end, < 0 for an error.
    virtual int read(char* buffer, int size) = 0;
  };

  virtual ~ZipFile() = default;
  /// An entry by name (the case of letters makes no difference); null if there is none. @throws bsp2::Error,
  /// as `open_first`, for one that cannot be unpacked: it is encrypted, or packed in an unusual way.
  [[nodiscard]] virtual std::unique_ptr<Entry> open(const std::string& name) const = 0;
  /// The first entry with this ending, else the first one; null if there is none at all.
  [[nodiscard]] virtual std::unique_ptr<Entry> open_first(std::string_view ending) const = 0;
  /// All of a small entry; nothing if there is none or if it is longer than `most` bytes.
  [[nodiscard]] std::optional<std::string> text(const std::string& name, std::size_t most) const;
};

[[nodiscard]] inline bool is_zip(std::string_view bytes) { return bytes.starts_with("PK\x03\x04"); }

/// How much text may come out of one zip file, all its entries together: as much as solids that somebody made
/// take, and not as much as fits into the densest zip file, a thousand times its size.
class Unpacking {
 public:
  static constexpr std::size_t always = std::size_t{16} << 20,
                               most_times = 100;  // what we write is 6 times as long

  Unpacking(std::size_t zipped, std::string name)
      : left_(std::max(always, most_times * zipped)), name_(std::move(name)) {}
  /// As the entry's own. @throws bsp2::Error once there is more.
  int read(ZipFile::Entry& entry, char* buffer, int size);

 private:
  std::size_t left_;
  std::string name_;
};

/// @param bytes outlive the result. @throws bsp2::Error if they are no zip file.
std::unique_ptr<ZipFile> open_zip(std::string_view bytes, const std::filesystem::path& path);

}  // namespace bsp2::model
