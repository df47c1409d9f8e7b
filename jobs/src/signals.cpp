#include "bsp2/jobs/signals.hpp"

#include <array>
#include <csignal>

namespace bsp2::jobs {
namespace {

constexpr std::array watched{SIGINT, SIGTERM, SIGUSR1};
volatile std::sig_atomic_t came = 0;

void remember(int) { came = 1; }

}  // namespace

SignalWatch::SignalWatch() {
  came = 0;
  struct sigaction action {};
  action.sa_handler = remember;
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  for (const int signal : watched) sigaction(signal, &action, nullptr);
}

SignalWatch::~SignalWatch() {
  for (const int signal : watched) std::signal(signal, SIG_DFL);
}

bool SignalWatch::interrupted() { return came != 0; }

}  // namespace bsp2::jobs
