#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <regex>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <unordered_map>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "import/imports.hpp"

extern char** environ;

namespace bsp2::model {
namespace {

/// A folder that goes when it is done with.
class Scratch {
 public:
  Scratch() {
    std::string name = (std::filesystem::temp_directory_path() / "bsp2-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr)
      throw Error("cannot make a folder in " + std::filesystem::temp_directory_path().string() + ": " +
                  std::strerror(errno));
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

/// @return what waitpid says. @throws Interrupted if somebody wants the work to end meanwhile; so has the
/// child.
int wait_for(pid_t child) {
  using namespace std::chrono_literals;
  int status = 0;
  for (auto pause = 1ms;; pause = std::min(2 * pause, std::chrono::milliseconds(50))) {
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child) return status;
    if (ended < 0 && errno != EINTR) throw std::system_error(errno, std::generic_category());
    if (geometry::Interruption::is_wanted()) {
      ::kill(child, SIGKILL);
      waitpid(child, &status, 0);
      throw geometry::Interrupted();
    }
    std::this_thread::sleep_for(pause);
  }
}

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
  return wait_for(child);
}

/// Lines of a file that begin with one of these words, each once, with how often it is there; the first of
/// very many.
std::vector<std::string> lines_of(const std::filesystem::path& path,
                                  std::initializer_list<std::string_view> words) {
  constexpr std::size_t most_lines = 100;
  std::vector<std::string> lines;
  std::vector<std::size_t> times;
  std::unordered_map<std::string, std::size_t> known;
  std::size_t left_out = 0;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (std::none_of(words.begin(), words.end(),
                     [&](std::string_view word) { return line.starts_with(word); }))
      continue;
    if (const auto found = known.find(line); found != known.end()) {
      ++times[found->second];
    } else if (lines.size() < most_lines) {
      known.emplace(line, lines.size());
      lines.push_back(line);
      times.push_back(1);
    } else {
      ++left_out;
    }
  }
  for (std::size_t i = 0; i < lines.size(); ++i)
    if (times[i] > 1) lines[i] += " (" + counted(times[i], "# time[s])");
  if (left_out > 0) lines.push_back(counted(left_out, "and # more line[s]"));
  return lines;
}

/// What openscad said, as one text.
std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += (text.empty() ? "" : "; ") + line;
  return text;
}

/// What to do where openscad did not find something.
std::string advice_for(const std::string& said) {
  const bool is_file =
      said.find("Can't open") != std::string::npos || said.find("Can't find") != std::string::npos;
  return is_file ? ". Install what is missing where openscad looks for libraries, or name its folder in "
                   "OPENSCADPATH"
         : said.find("unknown module 'part'") != std::string::npos
             ? ". OpenSCAD has no parts, which are of .csg: color what belongs together, and add --parts "
               "colour"
             : "";
}

/// Whether a string of openscad's output ends at a quotation mark: the arguments go on after it, or end.
bool ends_string(std::string_view text, std::size_t mark) {
  static const std::regex rest(
      R"(\s*(\)\s*[;{]|\]\s*[,\])]|,\s*(["\[\d.-]|(true|false|undef)\b|[$\w]+\s*=)))");
  return std::regex_search(text.begin() + static_cast<std::ptrdiff_t>(mark) + 1,
                           text.begin() + static_cast<std::ptrdiff_t>(std::min(text.size(), mark + 200)),
                           rest, std::regex_constants::match_continuous);
}

/// OpenSCAD 2021.01 writes strings as they are: a backslash in one is none of ours, and a quotation mark not
/// its end.
std::string with_escapes(const std::string& text) {
  std::string result;
  bool is_within = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_mark = text[i] == '"', is_end = is_mark && is_within && ends_string(text, i);
    if (is_within && !is_end && (is_mark || text[i] == '\\')) result += '\\';
    if (is_mark && (!is_within || is_end)) is_within = !is_within;
    result += text[i];
  }
  return result;
}

/// What the installed openscad means by its strings.
std::string read_strings(std::string text, const std::filesystem::path& output) {
  std::string escaped = with_escapes(text);
  if (escaped == text) return text;
  run({"openscad", "--version"}, output);
  const std::vector<std::string> version = lines_of(output, {"OpenSCAD version 20"});
  constexpr int last_without_escapes = 2021;
  const bool is_plain =
      !version.empty() &&
      std::atoi(version[0].c_str() + std::strlen("OpenSCAD version ")) <= last_without_escapes;
  return is_plain ? escaped : text;
}

}  // namespace

bool is_scad(const std::filesystem::path& path) { return lower_ending(path) == ".scad"; }

ModelText convert_scad(const std::filesystem::path& path) {
  const std::string name = path.string();
  std::error_code ignored;
  if (const auto status = std::filesystem::status(path, ignored);
      std::filesystem::is_fifo(status) || std::filesystem::is_character_file(status))
    throw Error(name + ": is a pipe or a device, and OpenSCAD source has to be a file; save it as one");
  read_text(path);  // says what is wrong with the file better than others
  const Scratch scratch;
  const std::filesystem::path made = scratch.path() / "model.csg", output = scratch.path() / "output.txt";
  int status = 0;
  try {
    status = run({"openscad", "-o", made.string(), std::filesystem::absolute(path).string()}, output);
  } catch (const std::system_error& error) {
    if (error.code() == std::errc::no_such_file_or_directory)
      throw Error(name +
                  ": this is OpenSCAD source, and the program 'openscad' that translates it is not "
                  "installed; install it, or convert " +
                  "the model elsewhere: openscad -o model.csg " + path.filename().string());
    throw Error(name + ": 'openscad' cannot be started: " + error.code().message());
  }
  // An assertion that fails leaves no node, and no exit code either.
  const auto holds_nothing = [&] {
    return std::filesystem::file_size(made) == 0 || read_text(made).find('(') == std::string::npos;
  };
  const bool has_ended = WIFEXITED(status) && WEXITSTATUS(status) == 0 && std::filesystem::exists(made),
             is_empty = has_ended && holds_nothing();
  if (!has_ended || (is_empty && !lines_of(output, {"ERROR"}).empty())) {
    std::string why = joined(lines_of(output, {"ERROR", "Can't", "Parser", "TRACE", "WARNING"}));
    if (why.empty())
      why = WIFSIGNALED(status) ? "it was ended by signal " + std::to_string(WTERMSIG(status))
                                : "exit code " + std::to_string(WEXITSTATUS(status));
    throw Error(name + ": openscad failed: " + why + advice_for(why));
  }
  if (is_empty) {
    const std::string said = joined(lines_of(output, {"WARNING", "DEPRECATED"}));
    throw Error(name + ": holds no model: openscad makes nothing of it" +
                (said.empty() ? "" : ", and says: " + said + advice_for(said)));
  }
  ModelText result;
  for (const std::string& line : lines_of(output, {"WARNING", "DEPRECATED", "ERROR"}))
    result.warnings.push_back(name + ": openscad: " + line + advice_for(line));
  result.text = read_strings(read_text(made), output);
  return result;
}

}  // namespace bsp2::model
