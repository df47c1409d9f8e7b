#include "readers/reader_main.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>

namespace bsp2::model {
namespace {

/// Lowers a limit, if it is not that low already. @param hard at most that can be asked for later.
void limit(int resource, rlim_t most, rlim_t hard) {
  rlimit now{};
  const auto which = static_cast<__rlimit_resource_t>(resource);
  if (::getrlimit(which, &now) != 0) return;
  now.rlim_max = std::min(now.rlim_max, hard);  // none is the largest number
  now.rlim_cur = std::min({now.rlim_cur, most, now.rlim_max});
  ::setrlimit(which, &now);
}

/// Seconds of the processor, for a file of so many megabytes.
rlim_t seconds_to_read(rlim_t megabytes) { return 10 + 20 * megabytes; }
rlim_t seconds_for_all(rlim_t megabytes) { return 900 + 60 * megabytes; }

rlim_t size_of(const std::string& path) {
  std::error_code unknown;
  const auto size = std::filesystem::file_size(path, unknown);
  return unknown ? 0 : static_cast<rlim_t>(size);
}

/// Of the processor, by this process.
rlim_t seconds_taken() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<rlim_t>(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec);
}

/// Far above what a sound file of this size takes, about 30 times its bytes: a damaged one does not fill the
/// machine, nor run for ever.
void limit_process(const std::string& path) {
  const rlim_t bytes = size_of(path), memory = (rlim_t{1} << 30) + 100 * bytes;
  limit(RLIMIT_DATA, memory, memory);
  limit(RLIMIT_CPU, seconds_to_read(bytes >> 20), seconds_for_all(bytes >> 20));
  limit(RLIMIT_CORE, 0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);  // nobody would listen
  std::signal(SIGPIPE, SIG_DFL);
}

}  // namespace

void file_is_read() {
  rlimit now{};
  if (::getrlimit(RLIMIT_CPU, &now) != 0) return;
  now.rlim_cur = now.rlim_max;
  ::setrlimit(RLIMIT_CPU, &now);
}

MendingLimit::MendingLimit(const std::string& path) {
  limit(RLIMIT_CPU, seconds_taken() + seconds_to_read(size_of(path) >> 20), RLIM_INFINITY);
}
MendingLimit::~MendingLimit() { file_is_read(); }

int read_for_model(int argc, char** argv, void (*read)(const ReadRequest& request, PartsWriter& parts)) {
  if (argc != 6) {
    std::fputs("This program reads files for bsp2; it is not started by hand.\n", stderr);
    return 2;
  }
  std::FILE* const pipe = ::fdopen(::dup(1), "wb");
  const int nowhere = ::open("/dev/null", O_WRONLY);
  if (pipe == nullptr || nowhere < 0 || ::dup2(nowhere, 1) < 0) return 1;
  const ReadRequest request{argv[1], std::atof(argv[2]), std::atof(argv[3]), std::atof(argv[4]),
                            std::atof(argv[5])};
  limit_process(request.path);
  PartsWriter parts(pipe);
  const auto tell = [&](const std::string& text) { parts.text(PartsStream::Record::error, text); };
  try {
    parts.text(PartsStream::Record::layout, BSP2_MODULE_LAYOUT);
    try {
      read(request, parts);
      parts.end();
    } catch (const std::bad_alloc&) {
      tell(
          "takes more memory than there is for a file of its size; it is damaged, or made to do harm, or "
          "asked for too finely");
    } catch (const std::exception& error) {
      tell(error.what());
    }
  } catch (const std::exception&) {
  }
  std::fflush(pipe);
  ::_exit(0);  // libraries take long to put away what goes anyhow
}

}  // namespace bsp2::model
