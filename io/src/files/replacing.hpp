#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <system_error>

// How a large file takes the place of another: it is written beside it, brought to the disk, and only then
// renamed. For the program and for the modules, which take nothing from it: each has these compiled in.

namespace bsp2::io {

/// Where it is written: `.NAME.part` in the same folder.
std::filesystem::path unfinished_name(const std::filesystem::path& path);

/// While it lives no other process that has one for the same path writes that file: who comes later waits, a
/// minute at most. Its mark is `.NAME.lock`. Where the file system knows no locks it is none.
class WritingLock {
 public:
  explicit WritingLock(const std::filesystem::path& path);
  ~WritingLock();
  WritingLock(const WritingLock&) = delete;
  WritingLock& operator=(const WritingLock&) = delete;
  /// What has kept it from being one; empty: nothing.
  [[nodiscard]] const std::string& why_not() const { return why_not_; }

 private:
  std::filesystem::path mark_;
  int descriptor_ = -1;
  std::string why_not_;

  enum class Try : std::uint8_t { held, busy, gone };
  Try try_once();
};

/// Whether a file of so many bytes can be written beside `path`. @return what is missing; empty if nothing
/// is, or if nobody knows.
std::string lack_of_room(const std::filesystem::path& path, std::uint64_t bytes);

/// Writes all of it. @return false if the system does not: `errno` has the reason.
bool write_at(int descriptor, std::uint64_t at, const void* from, std::size_t bytes);

/// To the disk, not only to the system's cache. Nothing where the file system cannot do that. @param flags to
/// open it with.
std::error_code sync_to_disk(const std::filesystem::path& path, int flags);

/// Gives what is written under its unfinished name the name of `path`: whenever the machine stops, there is a
/// whole file, the old or the new one.
std::error_code put_in_place(const std::filesystem::path& path);

}  // namespace bsp2::io
