#include <fcntl.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <system_error>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/csg.hpp"
#include "imports.hpp"

extern char** environ;

namespace bsp2::model {
namespace {

/// A folder that goes when it is done with.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "bsp2-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw Error("cannot make a folder in " + std::filesystem::temp_directory_path().string() + ": " + std::strerror(errno));
    path_ = name;
  }
  ~Scratch() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

/// Runs a program of the PATH, without a shell; what it prints goes to a file. @return what waitpid says.
/// @throws std::system_error if it cannot be started.
int run(std::vector<std::string> words, const std::filesystem::path& output) {
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, 0, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, 1, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&files, 1, 2);
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0], &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (error != 0) throw std::system_error(error, std::generic_category());
  int status = 0;
  while (waitpid(child, &status, 0) < 0)
    if (errno != EINTR) throw std::system_error(errno, std::generic_category());
  return status;
}

/// Lines of a file that begin with one of these words.
std::vector<std::string> lines_of(const std::filesystem::path& path, std::initializer_list<std::string_view> words) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);)
    if (std::any_of(words.begin(), words.end(), [&](std::string_view word) { return line.starts_with(word); })) lines.push_back(line);
  return lines;
}

}  // namespace

bool is_scad(const std::filesystem::path& path) { return lower_ending(path) == ".scad"; }

ModelText convert_scad(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code ignored;
  if (const auto status = std::filesystem::status(path, ignored); std::filesystem::is_fifo(status) || std::filesystem::is_character_file(status))
    throw Error(name + ": is a pipe or a device, and OpenSCAD source has to be a file; save it as one");
  read_text(path);  // says what is wrong with the file better than others
  const Scratch scratch;
  const std::filesystem::path made = scratch.path() / "model.csg", output = scratch.path() / "output.txt";
  int status = 0;
  try {
    status = run({"openscad", "-o", made.string(), std::filesystem::absolute(path).string()}, output);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::no_such_file_or_directory)
      throw Error(name + ": this is OpenSCAD source, and the program 'openscad' that translates it is not installed; install it, or convert " +
                  "the model elsewhere: openscad -o model.csg " + path.filename().string());
    throw Error(name + ": 'openscad' cannot be started: " + error.code().message());
  }
  // An assertion that fails leaves no node, and no exit code either.
  const auto is_empty = [&] { return read_text(made).find('(') == std::string::npos && !lines_of(output, {"ERROR"}).empty(); };
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || !std::filesystem::exists(made) || is_empty()) {
    std::string why;
    for (const std::string& line : lines_of(output, {"ERROR", "Can't", "Parser", "TRACE", "WARNING"})) why += (why.empty() ? "" : "; ") + line;
    if (why.empty())
      why = WIFSIGNALED(status) ? "it was ended by signal " + std::to_string(WTERMSIG(status))
                                : "exit code " + std::to_string(WEXITSTATUS(status));
    throw Error(name + ": openscad failed: " + why);
  }
  ModelText result{read_text(made), {}};
  for (const std::string& line : lines_of(output, {"WARNING", "DEPRECATED", "ERROR"})) result.warnings.push_back(name + ": openscad: " + line);
  return result;
}

}  // namespace bsp2::model
