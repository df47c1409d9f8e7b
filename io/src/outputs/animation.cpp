#include "bsp2/io/outputs/animation.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/io/files/file.hpp"

extern char** environ;

namespace bsp2::io {
namespace fs = std::filesystem;

namespace {

// --- APNG: the chunks of PNG files, with two kinds more
// (https://www.w3.org/TR/png-3/#apng-frame-based-animation) ---

std::string big_endian(std::uint32_t number, int bytes = 4) {
  std::string text;
  for (int i = bytes; i-- > 0;) text += static_cast<char>(number >> 8 * i & 0xff);
  return text;
}

std::string chunk(std::string_view kind, std::string_view data) {
  const std::string body = std::string(kind) + std::string(data);
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(body.data()), static_cast<uInt>(body.size()));
  return big_endian(static_cast<std::uint32_t>(data.size())) + body +
         big_endian(static_cast<std::uint32_t>(sum));
}

constexpr std::string_view signature = "\x89PNG\r\n\x1a\n";

/// Calls visit(kind, data) for the chunks of a PNG file. @pre it is one.
template <typename Visit>
void for_each_chunk(std::string_view png, Visit visit) {
  constexpr std::size_t around = 12;  // length, kind and sum
  for (std::size_t at = signature.size(); at + around <= png.size();) {
    std::size_t length = 0;
    for (std::size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<unsigned char>(png[at + i]);
    if (length > png.size() - at - around) throw std::logic_error("a picture is no PNG file");
    visit(png.substr(at + 4, 4), png.substr(at + 8, length));
    at += length + around;
  }
}

class Apng final : public Animation {
 public:
  Apng(fs::path path, double rate) : path_(std::move(path)), rate_(rate) {}

  void add(std::string_view png) override {
    std::string head, data;
    for_each_chunk(png, [&](std::string_view kind, std::string_view of_chunk) {
      if (kind == "IHDR") head = of_chunk;
      if (kind == "IDAT") data += of_chunk;
    });
    if (head_.empty()) head_ = head;
    if (head != head_) throw std::logic_error("pictures of an animation differ in size");
    // Number, width and height, the place, how long it is shown; it stays until the next one, which replaces
    // it.
    body_ += chunk("fcTL", big_endian(sequence_++) + head.substr(0, 8) + big_endian(0) + big_endian(0) +
                               duration() + std::string(2, '\0'));
    body_ += frames_++ == 0 ? chunk("IDAT", data) : chunk("fdAT", big_endian(sequence_++) + data);
  }

  void end() override {
    write_file(path_, std::string(signature) + chunk("IHDR", head_) +
                          chunk("acTL", big_endian(frames_) + big_endian(0)) + body_ + chunk("IEND", ""));
  }

 private:
  fs::path path_;
  double rate_;
  /// Of a picture, in seconds: a fraction of two numbers of two bytes.
  [[nodiscard]] std::string duration() const {
    const auto bytes = [](double number) {
      return big_endian(static_cast<std::uint32_t>(std::lround(number)), 2);
    };
    if (rate_ < 1) return bytes(100 / rate_) + bytes(100);
    const double whole = rate_ < 600 ? 100 : 10;
    return bytes(whole) + bytes(whole * rate_);
  }
  std::string head_, body_;
  std::uint32_t sequence_ = 0, frames_ = 0;
};

// --- all others ---

std::optional<fs::path> found_program(const std::string& name) {
  const char* folders = std::getenv("PATH");
  if (folders == nullptr) return std::nullopt;
  for (std::string_view rest(folders); !rest.empty();) {
    const std::size_t end = std::min(rest.find(':'), rest.size());
    const fs::path program = fs::path(rest.substr(0, end)) / name;
    if (::access(program.c_str(), X_OK) == 0) return program;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return std::nullopt;
}

/// Pictures go to it through a pipe. It writes beside the file, which is put in its place at the end.
class Ffmpeg final : public Animation {
 public:
  Ffmpeg(fs::path path, double rate, const fs::path& program)
      : path_(std::move(path)), part_(path_.string() + ".part" + path_.extension().string()) {
    std::array<int, 2> pipe{};
    if (::pipe2(pipe.data(), O_CLOEXEC) != 0) fail(std::generic_category().message(errno));
    posix_spawnattr_t apart;  // signals of the terminal are for us
    posix_spawnattr_init(&apart);
    posix_spawnattr_setflags(&apart, POSIX_SPAWN_SETPGROUP);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, pipe[0], STDIN_FILENO);
    std::vector<std::string> words{program.string(), "-loglevel",          "error", "-y", "-f", "image2pipe",
                                   "-framerate",     std::to_string(rate), "-i",    "-"};
    for (const char* word : filters()) words.emplace_back(word);
    words.push_back("file:" + part_.string());
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    const int error = ::posix_spawn(&process_, program.c_str(), &actions, &apart, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&apart);
    ::close(pipe[0]);
    pipe_ = pipe[1];
    if (error != 0) {
      ::close(pipe_);
      fail("ffmpeg cannot be started: " + std::generic_category().message(error));
    }
  }
  ~Ffmpeg() override {
    if (process_ != 0) {
      ::kill(process_, SIGKILL);
      wait();
    }
    std::error_code gone;
    fs::remove(part_, gone);
  }

  void add(std::string_view png) override {
    // Where it has ended, writing is an error and no signal.
    struct sigaction ignored {
    }, before{};
    ignored.sa_handler = SIG_IGN;
    sigaction(SIGPIPE, &ignored, &before);
    while (!png.empty()) {
      const ssize_t written = ::write(pipe_, png.data(), png.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) break;
      png.remove_prefix(static_cast<std::size_t>(written));
    }
    sigaction(SIGPIPE, &before, nullptr);
    if (!png.empty()) fail("ffmpeg has ended early; what it says is above");
  }

  void end() override {
    if (wait() != 0) fail("ffmpeg could not make it; what it says is above");
    std::error_code error;
    fs::rename(part_, path_, error);
    if (error) fail(error.message());
  }

 private:
  fs::path path_, part_;
  pid_t process_ = 0;
  int pipe_ = -1;

  [[noreturn]] void fail(const std::string& why) const {
    throw Error("cannot write '" + path_.string() + "': " + why);
  }
  /// Colours of a .gif are chosen by all pictures; players want even sizes and halved colours of an .mp4.
  [[nodiscard]] std::vector<const char*> filters() const {
    if (path_.extension() == ".gif") return {"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"};
    return {"-vf", "crop=trunc(iw/2)*2:trunc(ih/2)*2", "-pix_fmt", "yuv420p"};
  }
  int wait() {
    if (pipe_ >= 0) ::close(std::exchange(pipe_, -1));
    int status = 0;
    while (::waitpid(process_, &status, 0) < 0 && errno == EINTR) {
    }
    process_ = 0;
    return status;
  }
};

}  // namespace

std::string animation_endings() { return ".apng, .gif, .mp4 or .webm"; }

bool is_animation(const fs::path& path) {
  constexpr std::array endings{".apng", ".gif", ".mp4", ".webm"};
  return std::find(endings.begin(), endings.end(), path.extension().string()) != endings.end();
}

void Animation::check(const fs::path& path) {
  if (!is_animation(path))
    throw Error("cannot write '" + path.string() + "': an animation ends in " + animation_endings());
  if (path.extension() != ".apng" && !found_program("ffmpeg"))
    throw Error("cannot write '" + path.string() + "': " + path.extension().string() +
                " is made by the program ffmpeg, which is not installed (Debian: apt-get install ffmpeg); "
                ".apng needs nothing");
}

std::unique_ptr<Animation> Animation::begin(const fs::path& path, double rate) {
  check(path);
  if (path.extension() == ".apng") return std::make_unique<Apng>(path, rate);
  return std::make_unique<Ffmpeg>(path, rate, found_program("ffmpeg").value());
}

}  // namespace bsp2::io
