#pragma once

#include <string>

namespace bsp2::jobs {

/// The program's exit code after a signal ended a run early: "try again later" (EX_TEMPFAIL of sysexits.h),
/// for batch scripts that requeue.
inline constexpr int interrupted_code = 75;

/// While one lives, SIGINT, SIGTERM and SIGUSR1 (which Slurm sends before a time limit) are remembered
/// instead of ending the program. The second one of a kind ends it at once, as ever; and before interrupted()
/// is asked for the first time, already the first one does, with the exit code `interrupted_code`.
class SignalWatch {
 public:
  /// @param farewell lines for stderr, should the first signal end the program; empty: nothing, as of several
  /// ranks one is enough.
  /// @param speaks a line for stderr also where a signal is remembered. Not on several ranks: there one that
  /// fails has the others signalled.
  explicit SignalWatch(const std::string& farewell = "bsp2: interrupted before there was anything to save\n",
                       bool speaks = true);
  ~SignalWatch();
  SignalWatch(const SignalWatch&) = delete;
  SignalWatch& operator=(const SignalWatch&) = delete;
  /// Whether one has come. Any thread.
  static bool interrupted();
};

}  // namespace bsp2::jobs
