#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace bsp2::io {

/// Where a file lies: "." where its path does not say.
inline std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

/// Writes a whole file at once: under a temporary name in the same folder, then renamed, so that nobody ever
/// sees half a file. What is no regular file (a device, a pipe) is written directly, as is what the process
/// has open already (/dev/stdout, /dev/fd/3), whatever it leads to; a symbolic link is followed. A file that
/// is replaced keeps its permissions; one that must not be written stays.
/// @throws bsp2::Error that names the path; the old file, if any, is untouched.
void write_file(const std::filesystem::path& path, std::string_view bytes);

/// Whether that is written directly, and makes no file beside it.
bool is_stream(const std::filesystem::path& path);

/// The next bytes of a file, at most some megabytes; none at its end. Throws nothing.
using Pieces = std::function<std::string_view()>;

/// Writes a file, as from bytes that are there, of pieces that are made one after the other: memory that is
/// used again is faster than new memory.
void write_file(const std::filesystem::path& path, const Pieces& next_piece);

/// Makes a folder and its parents if they are missing. @throws bsp2::Error, also where a file of that name
/// is.
void make_folder(const std::filesystem::path& path);

/// Would `make_folder` and files in it succeed? Asked before a long run, to fail early; leaves nothing: it
/// tries with a folder that it removes.
/// @throws bsp2::Error if not.
void check_folder(const std::filesystem::path& path);

/// A new, hidden folder in `parent` that is removed with what is left in it at the end of its life.
///
/// Files that belong together are written here and then moved to the parent, which is a rename. If the
/// process is killed the folder stays, and a later one on this machine that makes a folder in the same place
/// removes it, from a minute on: it is locked while its owner lives.
class TemporaryDirectory {
 public:
  /// @throws bsp2::Error if `parent` is no folder in which one can write.
  explicit TemporaryDirectory(const std::filesystem::path& parent);
  ~TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  int lock_ = -1;
};

}  // namespace bsp2::io
