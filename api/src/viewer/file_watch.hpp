#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>

namespace bsp2::api {

/// Whether files have been saved. It looks again and again, as programs save in many ways. One thread.
class FileWatch {
 public:
  /// @param model a model or a snapshot.
  explicit FileWatch(std::filesystem::path model);
  /// Whether anything differs from when this was made or `begin` was called. Looks at most ten times a
  /// second.
  [[nodiscard]] bool has_changed();
  /// From here on.
  void begin();

 private:
  struct Stamp {
    std::int64_t seconds = 0, nanoseconds = 0;
    std::uint64_t inode = 0, bytes = 0;
    friend bool operator==(const Stamp&, const Stamp&) = default;
  };
  std::filesystem::path model_;
  std::map<std::filesystem::path, Stamp> stamps_;
  std::chrono::steady_clock::time_point looked_;
  bool changed_ = false;

  static Stamp stamp_of(const std::filesystem::path& file);
};

}  // namespace bsp2::api
