#include "import/reader_process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/module.hpp"
#include "import/part_names.hpp"
#include "import/parts_stream.hpp"

extern char** environ;

namespace bsp2::model {
namespace {

/// A program at work, whose output is read. It ends with this.
class Reading {
 public:
  explicit Reading(std::vector<std::string> words) {
    std::array<int, 2> ends{};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) fail_to_start(errno);
    output_ = ends[0];
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t files;
    ::posix_spawn_file_actions_init(&files);
    ::posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
    ::posix_spawn_file_actions_adddup2(&files, ends[1], 1);
    ::posix_spawn_file_actions_addopen(&files, 2, "/dev/null", O_WRONLY, 0);
    const int error = ::posix_spawn(&child_, arguments[0], &files, nullptr, arguments.data(), environ);
    ::posix_spawn_file_actions_destroy(&files);
    ::close(ends[1]);
    if (error != 0) {
      ::close(output_);
      child_ = 0;
      fail_to_start(error);
    }
  }
  ~Reading() {
    if (output_ >= 0) ::close(output_);
    if (child_ == 0) return;
    ::kill(child_, SIGKILL);
    reap();
  }
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;

  /// @return false if the output ends before.
  bool read(void* into, std::size_t size) {
    for (char* at = static_cast<char*>(into); size > 0;) {
      wait_for_output();
      const ssize_t got = ::read(output_, at, std::min(size, std::size_t{1} << 20));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      at += got;
      size -= static_cast<std::size_t>(got);
    }
    return true;
  }
  /// What waitpid says. What is still written is not read any more.
  int wait() {
    ::close(output_);
    output_ = -1;
    return reap();
  }

 private:
  /// @throws Interrupted if somebody wants the work to end meanwhile.
  void wait_for_output() const {
    constexpr int most = 10;  // milliseconds
    pollfd output{output_, POLLIN, 0};
    do {
      geometry::Interruption::check();
    } while (::poll(&output, 1, most) == 0);
  }
  int reap() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0)
      if (errno != EINTR) {
        status = 0;
        break;
      }
    child_ = 0;
    return status;
  }
  [[noreturn]] static void fail_to_start(int error) {
    throw Error(std::string("the program that reads it cannot be started: ") + std::strerror(error));
  }

  pid_t child_ = 0;
  int output_ = -1;
};

/// What a program tells, as parts. It is not trusted more than the file that it reads.
class PartsReader {
 public:
  using Record = PartsStream::Record;
  explicit PartsReader(Reading& from) : from_(from) {}

  /// @return false if it was cut off.
  bool read(ImportedParts& parts) {
    for (Record record{}; from_.read(&record, 1);) {
      switch (record) {
        case Record::layout:
          if (!is_layout(text())) return false;
          break;
        case Record::warning:
          parts.warnings.push_back(text());
          break;
        case Record::note:
          parts.notes.push_back(text());
          break;
        case Record::error:
          error_ = text();
          return false;
        case Record::part:
          parts.parts.push_back(part());
          break;
        case Record::sizes:
          each<std::array<double, 4>>([&](const auto& row) { parts.sizes.push_back(row); });
          break;
        case Record::end:
          return is_whole_ && has_layout_;
        default:
          return false;
      }
      if (!is_whole_) return false;
    }
    return false;
  }
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  bool is_layout(const std::string& layout) {
    has_layout_ = layout == BSP2_MODULE_LAYOUT;
    if (!has_layout_)
      error_ =
          "the program that reads it belongs to another build of bsp2; build or install the program and its "
          "modules together";
    return has_layout_;
  }

  template <typename T>
  T number() {
    T value{};
    is_whole_ = is_whole_ && from_.read(&value, sizeof value);
    return is_whole_ ? value : T{};
  }

  std::string text() {
    const auto size = number<std::uint64_t>();
    std::string text(size <= PartsStream::most_text ? size : 0, '\0');
    is_whole_ = is_whole_ && size <= PartsStream::most_text && from_.read(text.data(), text.size());
    return text;
  }

  /// Grows with what comes, not with what is said to come.
  template <typename T, typename Take>
  void each(Take take) {
    constexpr std::uint64_t at_once = 1 << 14;
    std::vector<T> some;
    for (auto left = number<std::uint64_t>(); left > 0 && is_whole_; left -= some.size()) {
      some.resize(std::min(left, at_once));
      is_whole_ = from_.read(some.data(), some.size() * sizeof(T));
      if (is_whole_)
        for (const T& one : some) take(one);
    }
  }

  ImportedPart part() {
    ImportedPart part;
    part.name = printable_name(text());
    const bool has_colour = number<char>() != 0;
    const auto colour = number<Colour>();
    if (has_colour) part.colour = colour;
    each<Point3>([&](const Point3& point) { part.mesh.add_point(point); });
    each<std::array<std::uint32_t, 3>>([&](const auto& corners) {
      for (const std::uint32_t corner : corners) is_whole_ = is_whole_ && corner < part.mesh.points.size();
      if (is_whole_) part.mesh.add_face(corners);
    });
    return part;
  }

  Reading& from_;
  bool is_whole_ = true, has_layout_ = false;
  std::string error_;
};

/// Why a program has told nothing.
std::string reason_of(int status, const std::string& library) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU)
    return library + " takes too long to read it; it is damaged, or made to do harm, or asked for too finely";
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL)
    return library + " was stopped while it read it: the memory is full, or somebody has ended it";
  if (WIFSIGNALED(status))
    return library + " fails to read it (signal " + std::to_string(WTERMSIG(status)) +
           "), so it is damaged or unusual; have the program that wrote it write it again";
  return "the program that reads it ended with exit code " + std::to_string(WEXITSTATUS(status)) +
         " and without a word; a library that it needs may be missing";
}

}  // namespace

ImportedParts parts_by_program(const std::string& program, const std::string& library,
                               const std::filesystem::path& path, const Fineness& fineness) {
  const std::filesystem::path file = module_folder() / program;
  std::error_code error;
  if (!std::filesystem::exists(file, error))
    throw Error("cannot start " + program + ", which reads " + path.string() + ": " +
                why_not_in(file.parent_path()));
  const auto number = [](double x) {
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.17g", x);
    return std::string(text.data());
  };
  const Resolution& resolution = fineness.resolution;
  try {
    Reading reading({file.string(), std::filesystem::absolute(path).string(), number(resolution.fn),
                     number(resolution.fa), number(resolution.fs), number(fineness.deflection)});
    ImportedParts parts;
    PartsReader reader(reading);
    if (reader.read(parts)) return parts;
    throw Error(reader.error().empty() ? reason_of(reading.wait(), library) : reader.error());
  } catch (const geometry::Interrupted&) {
    throw;
  } catch (const Error& failure) {
    throw Error(path.string() + ": " + failure.what());
  }
}

}  // namespace bsp2::model
