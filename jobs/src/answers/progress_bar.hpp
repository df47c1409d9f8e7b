#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace bsp2::jobs {

/// What a run is at.
struct ProgressState {
  std::string what;             ///< a superstep, or the file that is written
  std::optional<double> share;  ///< done of it, in [0, 1], where that is known
  std::uint64_t cells = 0;      ///< so far; 0: none to tell of
  double seconds = 0;           ///< since the run began
  double seconds_of_this = 0;   ///< since `what` began
};

/// One line that fits into so many columns: what there is no room for is left out, the estimate first, then
/// the cells.
std::string progress_line(const ProgressState& state, std::size_t columns);

/// One line on a terminal that shows how far the work is, until the last file is written. Debian has no
/// well-kept library for it. It is drawn by a thread of its own, since the one that works may be in a library
/// for minutes. All functions may be called by any thread.
class ProgressBar {
 public:
  /// @param file where the bar is drawn if it is a terminal; else, also if there is none, nothing is ever
  /// drawn and no thread started.
  explicit ProgressBar(std::FILE* file);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  /// Something else begins: a superstep, or "writing FILE".
  void begin(const std::string& what);
  /// @param done share of what has begun, in [0, 1].
  void show(double done, std::uint64_t cells);
  /// Removes the bar from the terminal, where something else is to be printed. It comes back with the next
  /// begin or show.
  void clear();

 private:
  void draw_again_and_again();
  void draw();
  void erase();
  [[nodiscard]] std::string to_its_start(std::size_t columns) const;

  std::FILE* file_;
  bool draws_, shown_ = false, ends_ = false;
  std::size_t drawn_ = 0;  ///< letters that stand on the terminal
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), began_ = start_;
  ProgressState state_;
  std::mutex mutex_;
  std::condition_variable end_;
  std::thread drawer_;
};

}  // namespace bsp2::jobs
