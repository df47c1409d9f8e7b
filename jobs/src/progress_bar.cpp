#include "bsp2/jobs/progress_bar.hpp"

#include <unistd.h>

#include <algorithm>
#include <string>

namespace bsp2::jobs {

ProgressBar::ProgressBar(std::FILE* file) : ProgressBar(file, ::isatty(::fileno(file)) != 0) {}

void ProgressBar::show(double done, std::uint64_t cells) {
  const auto now = std::chrono::steady_clock::now();
  if (!draws_ || now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  constexpr int width = 40;
  const double share = std::clamp(done, 0.0, 1.0);
  const auto filled = static_cast<std::size_t>(width * share);
  const std::string bar = std::string(filled, '#') + std::string(width - filled, '.');
  std::fprintf(file_, "\r[%s] %3d %%  %llu cells ", bar.c_str(), static_cast<int>(100 * share),
               static_cast<unsigned long long>(cells));
  std::fflush(file_);
  visible_ = true;
}

void ProgressBar::clear() {
  if (!visible_) return;
  std::fputs("\r\033[K", file_);  // to the start of the line, and erase it
  std::fflush(file_);
  visible_ = false;
}

}  // namespace bsp2::jobs
