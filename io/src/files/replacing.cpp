#include "files/replacing.hpp"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/io/files/file.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;

fs::path unfinished_name(const fs::path& path) {
  return folder_of(path) / ("." + path.filename().string() + ".part");
}

WritingLock::WritingLock(const fs::path& path)
    : mark_(folder_of(path) / ("." + path.filename().string() + ".lock")) {
  using namespace std::chrono_literals;
  const auto end = std::chrono::steady_clock::now() + 1min;
  for (Try result = try_once(); result != Try::held; result = try_once()) {
    if (std::chrono::steady_clock::now() > end) {
      why_not_ = "another run is writing it";
      return;
    }
    if (result == Try::busy) std::this_thread::sleep_for(20ms);
  }
}

/// The mark may be taken away between opening and locking it: then there is a new one.
auto WritingLock::try_once() -> Try {
  const int descriptor = ::open(mark_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (descriptor < 0) return Try::held;  // what is written tells why nothing can be
  struct flock all {};
  all.l_type = F_WRLCK;
  all.l_whence = SEEK_SET;
  if (::fcntl(descriptor, F_OFD_SETLK, &all) != 0) {
    const bool is_busy = errno == EAGAIN || errno == EACCES;
    if (!is_busy) ::unlink(mark_.c_str());  // there are no locks here
    ::close(descriptor);
    return is_busy ? Try::busy : Try::held;
  }
  struct stat own {
  }, named{};
  if (::fstat(descriptor, &own) != 0 || ::stat(mark_.c_str(), &named) != 0 || own.st_ino != named.st_ino) {
    ::close(descriptor);
    return Try::gone;
  }
  descriptor_ = descriptor;
  return Try::held;
}

WritingLock::~WritingLock() {
  if (descriptor_ < 0) return;
  ::unlink(mark_.c_str());
  ::close(descriptor_);
}

std::string lack_of_room(const fs::path& path, std::uint64_t bytes) {
  std::error_code unknown;
  const fs::space_info space = fs::space(folder_of(path), unknown);
  if (unknown || space.available >= bytes) return "";
  return "No space left on device: " + counted(bytes, "# byte[s] [is|are] needed, ") +
         std::to_string(space.available) + " are free";
}

bool write_at(int descriptor, std::uint64_t at, const void* from, std::size_t bytes) {
  const auto* begin = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t part = ::pwrite(descriptor, begin, bytes, static_cast<off_t>(at));
    if (part < 0 && errno == EINTR) continue;
    if (part < 0) return false;
    begin += part;
    at += static_cast<std::uint64_t>(part);
    bytes -= static_cast<std::size_t>(part);
  }
  return true;
}

std::error_code sync_to_disk(const fs::path& path, int flags) {
  const int descriptor = ::open(path.c_str(), flags | O_CLOEXEC);
  const bool synced = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = synced ? 0 : errno;
  if (descriptor < 0) return {error, std::generic_category()};
  ::close(descriptor);
  return {error == EINVAL ? 0 : error, std::generic_category()};
}

std::error_code put_in_place(const fs::path& path) {
  const fs::path unfinished = unfinished_name(path);
  std::error_code ignored;
  if (const fs::file_status old = fs::status(path, ignored); fs::is_regular_file(old))
    fs::permissions(unfinished, old.permissions(), ignored);
  std::error_code error = sync_to_disk(unfinished, O_RDWR);
  if (!error) fs::rename(unfinished, path, error);
  if (!error) error = sync_to_disk(folder_of(path), O_RDONLY | O_DIRECTORY);
  return error;
}

}  // namespace bsp2::io
