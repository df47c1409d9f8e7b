#pragma once

#include <chrono>
#include <cstdint>
#include <cstdio>

namespace bsp2::jobs {

/// One line on a terminal that shows how far the work is. Debian has no well-kept library for it.
class ProgressBar {
 public:
  /// @param file where the bar is drawn if it is a terminal; else nothing is ever drawn.
  explicit ProgressBar(std::FILE* file);
  /// Draws even if `file` is no terminal, for tests.
  ProgressBar(std::FILE* file, bool draws) : file_(file), draws_(draws) {}
  ~ProgressBar() { clear(); }
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Ten times a second at most, however often it is called. @param done share of the work, in [0, 1].
  void show(double done, std::uint64_t cells);
  /// Removes the bar from the terminal.
  void clear();

 private:
  std::FILE* file_;
  bool draws_;
  bool visible_ = false;
  std::chrono::steady_clock::time_point next_{};
};

}  // namespace bsp2::jobs
