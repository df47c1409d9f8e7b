#pragma once

#include <pthread.h>
#include <sched.h>

#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <optional>

namespace bsp2::geometry {

/// Threads that are started by one, and waited for together.
///
/// Linux leaves a new thread on the processor of the one that starts it now and then, also where others are
/// idle, and if that one goes on working nothing moves it for up to 3.5 milliseconds as measured. So each
/// begins where it should, and may go anywhere from then on.
class Threads {
 public:
  enum class Begin {
    here,      ///< on this processor: the caller is about to wait
    elsewhere  ///< on any other one that the caller may use: it goes on working
  };

  Threads() = default;
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;
  /// Waits for all; what they threw is lost.
  ~Threads() { wait(); }

  /// @param stack_bytes 0: as many as usual. @throws std::system_error if the system has no thread left.
  void start(std::function<void()> work, Begin where, std::size_t stack_bytes = 0);
  /// Waits for all, and passes on what the first of them that failed has thrown.
  void join();

 private:
  struct Call {
    std::function<void()> work;
    std::optional<cpu_set_t> allowed;  // the processors that it may use when it has begun, if it may not yet
    std::exception_ptr failure;
    pthread_t thread;
  };
  std::deque<Call> calls_;  // which stay where they are

  static void* run(void* call);
  void wait();
};

}  // namespace bsp2::geometry
