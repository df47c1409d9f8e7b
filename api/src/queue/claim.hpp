#pragma once

#include <sys/types.h>

#include <condition_variable>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace bsp2::api {

/// A claim on a job: a file that only one can make, touched by a thread of its own while it lives, removed at
/// its end.
class Claim {
 public:
  /// @return nothing if somebody else has it. @throws bsp2::Error if the file cannot be made for another
  /// reason.
  static std::unique_ptr<Claim> take(const std::filesystem::path& file, double lease_seconds);
  ~Claim();
  Claim(const Claim&) = delete;
  Claim& operator=(const Claim&) = delete;

 private:
  Claim(std::filesystem::path file, double lease_seconds);
  void touch_now_and_then(double seconds);
  std::filesystem::path file_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool is_ended_ = false;
  std::thread heart_;
};

/// What is known of somebody's claim.
struct ClaimState {
  bool is_lost =
      false;  ///< not touched for as long as the lease, or of a process of this machine that is gone
  double age_seconds = 0;  ///< since it was touched, by the clock of the file system
  timespec touched{};
  std::string owner;  ///< HOST PID
};
/// @return nothing if there is no such claim.
std::optional<ClaimState> look_at_claim(const std::filesystem::path& file, double lease_seconds);

/// Removes a claim that is lost, so that the job can be taken again.
void drop_lost_claim(const std::filesystem::path& file);

/// This process, as owners are written: HOST PID.
std::string this_process();

/// For names of files that nobody else writes: of this process, and each time another.
std::string this_worker();

}  // namespace bsp2::api
