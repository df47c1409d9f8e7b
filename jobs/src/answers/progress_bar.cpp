#include "answers/progress_bar.hpp"

#include <spdlog/fmt/fmt.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <system_error>
#include <vector>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::jobs {
namespace {

using namespace std::chrono_literals;
using Seconds = std::chrono::duration<double>;

constexpr auto between_drawings = 100ms;
constexpr double hidden_seconds = 0.3;  // what is shorter than that needs no bar

/// "0:07", "12:34" or "1:02:03".
std::string time_text(double seconds) {
  const auto all = static_cast<std::uint64_t>(seconds);
  if (all < 3600) return fmt::format("{}:{:02}", all / 60, all % 60);
  return fmt::format("{}:{:02}:{:02}", all / 3600, all / 60 % 60, all % 60);
}

/// What is left of what has begun, if it goes on as it did; nothing where it is too early to tell.
std::optional<double> seconds_left(const ProgressState& state) {
  constexpr double too_early = 1, too_little = 0.02;
  if (!state.share || *state.share < too_little || state.seconds_of_this < too_early) return std::nullopt;
  return state.seconds_of_this * (1 - *state.share) / *state.share;
}

std::string bar_text(double share, std::size_t width) {
  const auto filled = static_cast<std::size_t>(share * static_cast<double>(width));
  return "[" + std::string(filled, '#') + std::string(width - filled, '.') + "]";
}

/// Columns of the terminal now: a window may have been narrowed.
std::size_t columns_of(std::FILE* file) {
  winsize size{};
  return ::ioctl(::fileno(file), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

/// Whether somebody else has the terminal now, as where a shell started the run with &.
bool is_in_background(std::FILE* file) { return ::tcgetpgrp(::fileno(file)) != ::getpgrp(); }

}  // namespace

std::string progress_line(const ProgressState& state, std::size_t columns) {
  constexpr std::size_t least_bar = 8, most_bar = 30;
  // The terminal shows a Ctrl-C as ^C behind it, and in its last column would begin a new line.
  const std::size_t room = std::max<std::size_t>(columns, 4) - 3;
  std::vector<std::string> rest;  // the first is the last to go
  if (state.share)
    rest.push_back(fmt::format("{:3} %", static_cast<int>(100 * std::clamp(*state.share, 0.0, 1.0))));
  rest.push_back(time_text(state.seconds));
  if (state.cells > 0) rest.push_back(counted(state.cells, "# cell[s]"));
  if (const auto left = seconds_left(state)) rest.push_back("about " + time_text(*left) + " left");
  std::string line = state.what.substr(0, room);
  std::size_t kept = 0, width = line.size();
  while (kept < rest.size() && width + 2 + rest[kept].size() <= room) width += 2 + rest[kept++].size();
  if (state.share && width + 4 + least_bar <= room)
    line += "  " + bar_text(std::clamp(*state.share, 0.0, 1.0), std::min(room - width - 4, most_bar));
  for (std::size_t i = 0; i < kept; ++i) line += "  " + rest[i];
  return line;
}

ProgressBar::ProgressBar(std::FILE* file)
    : file_(file), draws_(file != nullptr && ::isatty(::fileno(file)) != 0) {
  if (!draws_) return;
  try {
    drawer_ = std::thread([this] { draw_again_and_again(); });
  } catch (const std::system_error&) {
    draws_ = false;  // no run fails for want of a bar
  }
}

ProgressBar::~ProgressBar() {
  if (!draws_) return;
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
    erase();
  }
  end_.notify_all();
  drawer_.join();
}

void ProgressBar::begin(const std::string& what) {
  const std::lock_guard lock(mutex_);
  if (what != state_.what) began_ = std::chrono::steady_clock::now();
  state_ = {.what = what};
  shown_ = true;
}

void ProgressBar::show(double done, std::uint64_t cells) {
  const std::lock_guard lock(mutex_);
  state_.share = done;
  state_.cells = cells;
  shown_ = true;
}

void ProgressBar::clear() {
  const std::lock_guard lock(mutex_);
  shown_ = false;
  erase();
}

void ProgressBar::draw_again_and_again() {
  std::unique_lock lock(mutex_);
  while (!end_.wait_for(lock, between_drawings, [&] { return ends_; }))
    if (shown_) draw();
}

void ProgressBar::draw() {
  const auto now = std::chrono::steady_clock::now();
  state_.seconds = Seconds(now - start_).count();
  state_.seconds_of_this = Seconds(now - began_).count();
  if (state_.seconds < hidden_seconds || state_.what.empty() || is_in_background(file_)) return;
  const std::size_t columns = columns_of(file_);
  const std::string line = progress_line(state_, columns);
  std::fprintf(file_, "%s%s\033[K", to_its_start(columns).c_str(),
               line.c_str());  // and erase what stood behind it
  std::fflush(file_);
  drawn_ = line.size();
}

/// Where the window was narrowed, most terminals have folded the line: it begins some lines above.
std::string ProgressBar::to_its_start(std::size_t columns) const {
  const std::size_t folds = drawn_ == 0 ? 0 : (drawn_ - 1) / columns;
  return folds == 0 ? "\r" : fmt::format("\033[{}A\r\033[J", folds);
}

void ProgressBar::erase() {
  if (drawn_ == 0) return;
  std::fprintf(file_, "%s\033[K", to_its_start(columns_of(file_)).c_str());
  std::fflush(file_);
  drawn_ = 0;
}

}  // namespace bsp2::jobs
