#include "queue/claim.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <fstream>
#include <system_error>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::api {
namespace fs = std::filesystem;
namespace {

std::string host_name() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

[[noreturn]] void cannot(const std::string& what, const fs::path& file, int error) {
  throw Error("cannot " + what + " '" + file.string() + "': " + std::generic_category().message(error));
}

double seconds_between(const timespec& earlier, const timespec& later) {
  return static_cast<double>(later.tv_sec - earlier.tv_sec) +
         1e-9 * static_cast<double>(later.tv_nsec - earlier.tv_nsec);
}

/// The clock that the claims' times are of; it may belong to another machine.
timespec file_system_now(const fs::path& folder) {
  const fs::path file = folder / ".clock";
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0 &&
      (errno == EACCES || errno == EROFS)) {  // who may only look has the clock of this machine
    timespec now{};
    ::clock_gettime(CLOCK_REALTIME, &now);
    return now;
  }
  if (descriptor < 0) cannot("write", file, errno);
  struct stat status {};
  const bool well = ::futimens(descriptor, nullptr) == 0 && ::fstat(descriptor, &status) == 0;
  const int error = errno;
  ::close(descriptor);
  if (!well) cannot("write", file, error);
  return status.st_mtim;
}

}  // namespace

std::string this_process() { return host_name() + " " + std::to_string(getpid()); }

std::unique_ptr<Claim> Claim::take(const fs::path& file, double lease_seconds) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor < 0 && errno == EEXIST) return nullptr;
  if (descriptor < 0) cannot("write", file, errno);
  const std::string owner = this_process() + "\n";
  const bool well = ::write(descriptor, owner.data(), owner.size()) == static_cast<ssize_t>(owner.size());
  const int error = errno;
  ::close(descriptor);
  if (!well) {
    ::unlink(file.c_str());
    cannot("write", file, error);
  }
  return std::unique_ptr<Claim>(new Claim(file, lease_seconds));
}

Claim::Claim(fs::path file, double lease_seconds)
    : file_(std::move(file)), heart_([this, lease_seconds] { touch_now_and_then(lease_seconds / 4); }) {}

void Claim::touch_now_and_then(double seconds) {
  std::unique_lock lock(mutex_);
  while (!ended_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return is_ended_; }))
    ::utimensat(AT_FDCWD, file_.c_str(), nullptr, 0);  // a claim that is gone was thought lost: no harm
}

Claim::~Claim() {
  {
    const std::lock_guard lock(mutex_);
    is_ended_ = true;
  }
  ended_.notify_all();
  heart_.join();
  ::unlink(file_.c_str());
}

std::optional<ClaimState> look_at_claim(const fs::path& file, double lease_seconds) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return std::nullopt;
  ClaimState state;
  state.touched = status.st_mtim;
  state.age_seconds = std::max(0.0, seconds_between(status.st_mtim, file_system_now(file.parent_path())));
  std::ifstream in(file);
  std::string host;
  pid_t pid = 0;
  if (in >> host >> pid) state.owner = host + " " + std::to_string(pid);
  const bool is_dead = pid > 0 && host == host_name() && ::kill(pid, 0) != 0 && errno == ESRCH;
  state.is_lost = is_dead || state.age_seconds > lease_seconds;
  return state;
}

std::string this_worker() {
  static std::atomic<unsigned> count{0};
  std::string name = this_process() + " " + std::to_string(count++);
  std::replace(name.begin(), name.end(), ' ', '.');
  return name;
}

void drop_lost_claim(const fs::path& file) {
  // Renamed first: of several who find it lost only one removes it, and not what another has made since.
  const fs::path aside = file.parent_path() / ("." + file.filename().string() + "." + this_worker());
  if (::rename(file.c_str(), aside.c_str()) == 0) ::unlink(aside.c_str());
}

}  // namespace bsp2::api
