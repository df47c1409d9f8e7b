#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace bsp2::supersteps {

/// How ranks know of each other that they are still there, while their main threads have no time for MPI.
///
/// A thread of each rank sends a datagram to all others every some seconds, if the process has computed
/// since, has been in touch, or waits for others itself. So busy is not missing, but a process that is
/// stopped, sleeps, or hangs in the system is. Who waits for longer than the timeout, and has heard nothing
/// from some ranks for as long, says which they are and ends the run. Ranks that were never heard, as where
/// datagrams do not pass between nodes, are not judged.
class SignsOfLife {
 public:
  /// Tells all ranks where this one listens. MPI has been started. The timeout is what the environment of the
  /// first rank says (BSP2_TIMEOUT), else 300 seconds. Collective.
  /// @throws bsp2::Error on all ranks if it says something else than a number of seconds.
  SignsOfLife();
  ~SignsOfLife();
  SignsOfLife(const SignsOfLife&) = delete;
  SignsOfLife& operator=(const SignsOfLife&) = delete;

  /// 0: nobody is ever missing. Less than a second is a second.
  void set_timeout(double seconds);
  /// For the message.
  void set_superstep(const std::string& name);
  /// The main thread is well.
  void touch() { touched_.store(true, std::memory_order_relaxed); }
  /// It waits for others from now on, or does no longer.
  void set_waiting(bool waits);

 private:
  using Clock = std::chrono::steady_clock;
  struct Place;

  int rank_ = 0, socket_ = -1;
  std::uint64_t token_ = 0;  // of this run: other datagrams are nobody's
  std::vector<std::uint32_t> address_;
  std::vector<std::uint16_t> port_;  // as the network has both; 0: unknown
  std::vector<Clock::time_point> heard_;
  std::vector<bool> is_known_;  // ever heard

  std::mutex mutex_;
  std::condition_variable change_;
  double timeout_ = 0;
  std::string superstep_;
  bool over_ = false;
  std::atomic<bool> touched_{false};
  std::atomic<std::int64_t> waiting_since_{0};  // 0: does not wait
  double computed_ = 0;
  std::thread thread_;  // the last one: it uses the others

  void find(const std::vector<Place>& places, const std::string& here);
  void watch();
  void watch_until_over();
  bool is_well();
  void send() const;
  void receive(Clock::time_point now);
  /// Ends the run if it has to.
  void judge(Clock::time_point now, double timeout, const std::string& superstep) const;
};

}  // namespace bsp2::supersteps
