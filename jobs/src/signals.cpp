#include "bsp2/jobs/signals.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <string>

namespace bsp2::jobs {
namespace {

constexpr std::array watched{SIGINT, SIGTERM, SIGUSR1};
std::atomic<bool> came, asked;
std::string last_words;  // a handler may read it, as it is not changed while there is one
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler takes no locks");

/// As long as nobody has asked, nothing has been computed that could be saved.
void remember(int) {
  if (!asked) {
    [[maybe_unused]] const auto written = write(STDERR_FILENO, last_words.data(), last_words.size());
    _exit(interrupted_code);
  }
  came = true;
}

}  // namespace

SignalWatch::SignalWatch(const std::string& farewell) {
  last_words = farewell;
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
