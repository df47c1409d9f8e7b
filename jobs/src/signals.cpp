#include "bsp2/jobs/signals.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <string_view>

namespace bsp2::jobs {
namespace {

constexpr std::array watched{SIGINT, SIGTERM, SIGUSR1};
std::atomic<bool> came, asked, speaks;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler takes no locks");

/// As long as nobody has asked, nothing has been computed that could be saved.
void remember(int) {
  if (!asked) {
    constexpr std::string_view text = "bsp2: interrupted before there was anything to save\n";
    if (speaks) [[maybe_unused]] const auto written = write(STDERR_FILENO, text.data(), text.size());
    _exit(interrupted_code);
  }
  came = true;
}

}  // namespace

SignalWatch::SignalWatch(bool speaks_) {
  speaks = speaks_;
  came = asked = false;
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (const int signal : watched) sigaction(signal, &action, nullptr);
}

SignalWatch::~SignalWatch() {
  for (const int signal : watched) std::signal(signal, SIG_DFL);
}

bool SignalWatch::interrupted() {
  asked = true;
  return came;
}

}  // namespace bsp2::jobs
