#include "bsp2/io/files/file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "bsp2/geometry/support/error.hpp"

namespace bsp2::io {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(const std::string& what, const fs::path& path, std::error_code why) {
  throw Error(what + " '" + path.string() + "': " + why.message());
}

std::error_code last_error() { return {errno, std::generic_category()}; }

constexpr int most_links = 40;  // that lead to each other, as the system allows

/// Writes and closes; false with errno set if anything failed, be it the last byte.
bool write_all(int descriptor, const Pieces& next_piece) {
  for (std::string_view bytes = next_piece(); !bytes.empty(); bytes = next_piece())
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) {
        const int error = errno;
        ::close(descriptor);
        errno = error;
        return false;
      }
      bytes.remove_prefix(static_cast<std::size_t>(written));
    }
  return ::close(descriptor) == 0;
}

/// The file that a path stands for, be it there or not: links are followed, so that they survive the
/// renaming.
fs::path target_of(fs::path path) {
  std::error_code error;
  for (int links = 0; links < most_links && fs::is_symlink(path, error); ++links) {
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = folder_of(path) / target;
  }
  return path;
}

/// The number of a descriptor of this process by a name of it, such as /dev/stdout; none for other names.
std::optional<int> descriptor_of(fs::path path) {
  std::error_code error;
  const std::string own = "/proc/" + std::to_string(::getpid()) + "/fd";
  for (int links = 0; links < most_links; ++links) {
    const std::string folder = path.parent_path().string(), name = path.filename().string();
    if (folder == "/dev/fd" || folder == "/proc/self/fd" || folder == own) {
      int number = 0;
      const auto [end, failed] = std::from_chars(name.data(), name.data() + name.size(), number);
      const bool is_one = failed == std::errc() && end == name.data() + name.size();
      return is_one && ::fcntl(number, F_GETFD) >= 0 ? std::optional(number) : std::nullopt;
    }
    if (!fs::is_symlink(path, error)) break;
    const fs::path target = fs::read_symlink(path, error);
    if (error) break;
    path = (folder_of(path) / target).lexically_normal();
  }
  return std::nullopt;
}

/// This machine's name, as file systems are shared.
std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown";
}

/// A folder whose lock is held as long as the process lives that made it; the lock, or -1.
int lock_folder(const fs::path& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0 || ::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
  ::close(descriptor);
  return -1;
}

/// Removes what processes of this machine left that were killed. Where folders cannot be locked nothing is
/// removed.
void remove_abandoned(const fs::path& parent, const std::string& prefix) {
  constexpr auto surely_locked_by_now = std::chrono::minutes(1);
  std::error_code error;
  for (fs::directory_iterator at(parent, error), end; !error && at != end; at.increment(error)) {
    std::error_code ignored;
    if (!at->path().filename().string().starts_with(prefix) || !at->is_directory(ignored)) continue;
    const auto made = at->last_write_time(ignored);
    if (ignored || fs::file_time_type::clock::now() - made < surely_locked_by_now) continue;
    const int lock = lock_folder(at->path());
    if (lock < 0) continue;
    fs::remove_all(at->path(), ignored);
    ::close(lock);
  }
}

}  // namespace

void write_file(const fs::path& path, std::string_view bytes) {
  write_file(path, [&] { return std::exchange(bytes, {}); });
}

bool is_stream(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return (fs::exists(status) && !fs::is_regular_file(status) && !fs::is_directory(status)) ||
         descriptor_of(path).has_value();
}

void write_file(const fs::path& path, const Pieces& next_piece) {
  std::error_code error;
  if (const auto open = descriptor_of(path)) {
    const int own = ::fcntl(*open, F_DUPFD_CLOEXEC, 0);
    if (own < 0 || !write_all(own, next_piece)) fail("cannot write", path, last_error());
    return;
  }
  const fs::path target = target_of(path);
  const fs::file_status status = fs::status(target, error);
  if (fs::is_directory(status)) throw Error("cannot write '" + path.string() + "': it is a directory");
  if (fs::exists(status) && ::access(target.c_str(), W_OK) != 0) fail("cannot write", path, last_error());
  const bool in_place =
      fs::exists(status) && !fs::is_regular_file(status);  // /dev/null must remain what it is
  const fs::path name = in_place ? target
                                 : folder_of(target) / ("." + target.filename().string() + "." +
                                                        std::to_string(::getpid()) + ".tmp");
  const int descriptor = ::open(name.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (descriptor < 0) fail("cannot write", path, last_error());
  if (fs::is_regular_file(status))
    ::fchmod(descriptor,
             static_cast<mode_t>(status.permissions() & fs::perms::mask));  // what was private stays so
  const bool written = write_all(descriptor, next_piece);
  if (!written) error = last_error();
  if (in_place) {
    if (!written) fail("cannot write", path, error);
    return;
  }
  if (written) fs::rename(name, target, error);
  if (error) {
    std::error_code ignored;
    fs::remove(name, ignored);
    fail("cannot write", path, error);
  }
}

void make_folder(const fs::path& path) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_directory(path, error)) {
    throw Error("cannot write to the folder '" + path.string() + "': it is a file");
  }
  fs::create_directories(path, error);
  std::error_code ignored;
  if (error && !fs::is_directory(path, ignored)) fail("cannot make the folder", path, error);
}

void check_folder(const fs::path& path) {
  std::error_code error;
  fs::path existing = path;
  while (!fs::exists(existing, error) && existing.has_relative_path()) existing = folder_of(existing);
  if (!fs::is_directory(existing, error)) {
    throw Error("cannot write to the folder '" + path.string() + "': '" + existing.string() + "' is a file");
  }
  // Rights do not tell all: a file system may be read only, full, or none for users, as /proc.
  std::string name = (existing / ".bsp2-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) {
    const std::error_code why = last_error();
    if (existing == path) fail("cannot write to the folder", path, why);
    throw Error("cannot make the folder '" + path.string() + "': nothing can be written in '" +
                existing.string() + "' (" + why.message() + ")");
  }
  ::rmdir(name.c_str());
}

TemporaryDirectory::TemporaryDirectory(const fs::path& parent) {
  const std::string prefix = ".bsp2-" + host_name() + "-";
  remove_abandoned(parent, prefix);
  std::string name = (parent / (prefix + "XXXXXX")).string();
  if (::mkdtemp(name.data()) == nullptr) fail("cannot write to the folder", parent, last_error());
  path_ = name;
  lock_ = lock_folder(path_);
}

TemporaryDirectory::~TemporaryDirectory() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  if (lock_ >= 0) ::close(lock_);
}

}  // namespace bsp2::io
