#include "program/signals.hpp"

#include <unistd.h>

#include <array>
#include <atomic>
#include <csignal>
#include <string>
#include <string_view>

namespace bsp2::jobs {
namespace {

constexpr std::array watched{SIGINT, SIGTERM, SIGUSR1};
std::atomic<bool> came, asked, answers, is_terminal;
std::string last_words;  // a handler may read it, as it is not changed while there is one
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler takes no locks");

constexpr std::string_view in_midst =
    "bsp2: interrupted; ending once what there is has been written, or at once if interrupted again\n";

/// In the place of what stands on the line: a bar of progress, and the terminal's ^C. At once, as others
/// write, too.
void say(std::string_view text) {
  constexpr std::string_view clear = "\r\033[K";
  std::array<char, 1024> all;
  std::size_t size = 0;
  for (const std::string_view part : {is_terminal ? clear : std::string_view(), text})
    for (const char c : part.substr(0, all.size() - size)) all[size++] = c;
  [[maybe_unused]] const auto written = write(STDERR_FILENO, all.data(), size);
}

/// As long as nobody has asked, nothing has been computed that could be saved.
void remember(int) {
  if (!asked) {
    say(last_words);
    _exit(interrupted_code);
  }
  came = true;
  if (answers) say(in_midst);
}

}  // namespace

SignalWatch::SignalWatch(const std::string& farewell, bool speaks) {
  last_words = farewell;
  answers = speaks;
  is_terminal = isatty(STDERR_FILENO) != 0;
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
