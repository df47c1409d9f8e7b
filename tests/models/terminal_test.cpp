// The program in a terminal: what a person sees who waits.
#include <gtest/gtest.h>
#include <pty.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

/// What the program has written to a terminal of so many columns, and how it ended.
struct Screen {
  std::string text;
  int status = 0;
};

/// @param seen is called with all that was written so far.
template <typename Seen>
Screen on_terminal(const std::vector<std::string>& arguments, unsigned short columns, Seen seen) {
  winsize size{};
  size.ws_col = columns;
  size.ws_row = 24;
  int terminal = -1;
  const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
  if (child == 0) {
    std::vector<char*> argv;
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    ::execv(BSP2_PROGRAM, argv.data());
    ::_exit(127);
  }
  Screen screen;
  std::array<char, 4096> buffer;
  for (ssize_t count = 0; (count = ::read(terminal, buffer.data(), buffer.size())) > 0;) {  // in the end EIO
    screen.text.append(buffer.data(), static_cast<std::size_t>(count));
    seen(child, terminal, screen.text);
  }
  ::waitpid(child, &screen.status, 0);
  ::close(terminal);
  return screen;
}

/// The lines that were drawn over each other. Each begins with a return and ends by erasing the rest.
std::vector<std::string> drawings(const std::string& text) {
  std::vector<std::string> lines;
  static const std::regex drawn("\r([^\r\n\x1b]+)\x1b\\[K");
  for (std::sregex_iterator at(text.begin(), text.end(), drawn), end; at != end; ++at)
    lines.push_back((*at)[1]);
  return lines;
}

class Terminal : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;

  /// Balls between cubes: both their cells and their surface take longer than a bar needs to show.
  std::vector<std::string> arguments(int n) {
    const fs::path model = folder_.path() / "model.csg";
    std::ofstream file(model);
    for (int i = 0; i < n * n * n; ++i)
      file << "multmatrix([[1,0,0," << i % n << "],[0,1,0," << i / n % n << "],[0,0,1," << i / n / n
           << "],[0,0,0,1]]){" << (i % 2 == 0 ? "cube(1)" : "sphere(r = 0.6, $fn = 16)") << ";}\n";
    file.close();
    return {"bsp2",
            "run",
            model.string(),
            "--threads",
            "2",
            "-o",
            (folder_.path() / "out").string(),
            "--boundary",
            (folder_.path() / "surface.ply").string()};
  }
};

TEST_F(Terminal, NamesEachSuperstepAndItsShareInOneLine) {
  const std::string ball = (folder_.path() / "ball.csg").string();
  std::ofstream(ball) << "sphere(r = 1);";
  const auto ignored = [](pid_t, int, const std::string&) {};
  const std::vector<unsigned short> widths = bsp2::samples::is_sanitized
                                                 ? std::vector<unsigned short>{40}
                                                 : std::vector<unsigned short>{40, 80, 120};
  for (const unsigned short columns : widths) {
    const Screen screen = on_terminal(arguments(11), columns, ignored);
    ASSERT_TRUE(WIFEXITED(screen.status) && WEXITSTATUS(screen.status) == 0) << screen.text;
    // On a fast machine its cells are there before the bar is. This takes a second on any.
    const Screen round = on_terminal(
        {"bsp2", "run", ball, "--curved", "--tolerance", "1e-4", "--budget", "1s"}, columns, ignored);
    std::set<std::string> with_share;
    for (const std::string& line : drawings(round.text + screen.text)) {
      EXPECT_LT(line.size(), columns) << line;
      if (line.find('%') != std::string::npos) with_share.insert(line.substr(0, line.find(' ')));
    }
    EXPECT_TRUE(with_share.contains("computation")) << columns << screen.text;
    EXPECT_TRUE(with_share.contains("resolution")) << columns << screen.text;
    // Nothing of them is left: what follows the last one begins with an erased line.
    const std::size_t summary = screen.text.find("primitives");
    ASSERT_NE(summary, std::string::npos);
    EXPECT_EQ(screen.text.find('%', summary), std::string::npos);
    EXPECT_GT(summary, screen.text.rfind("\x1b[K"));
  }
}

TEST_F(Terminal, NarrowedAndStoppedLeavesNoLines) {
  bool is_narrow = false, is_stopped = false;
  std::size_t narrowed_at = 0;
  const Screen screen =
      on_terminal(arguments(13), 100, [&](pid_t child, int terminal, const std::string& text) {
        const auto count = drawings(text).size();
        if (!is_narrow && count >= 2) {
          winsize size{};
          size.ws_col = 30;
          size.ws_row = 24;
          ::ioctl(terminal, TIOCSWINSZ, &size);
          is_narrow = true;
          narrowed_at = count;
        }
        if (is_narrow && !is_stopped && count >= narrowed_at + 3) {
          ::kill(child, SIGINT);
          is_stopped = true;
        }
      });
  ASSERT_TRUE(is_stopped) << screen.text;
  ASSERT_TRUE(WIFEXITED(screen.status)) << screen.text;
  const auto lines = drawings(screen.text);
  for (std::size_t i = narrowed_at + 1; i < lines.size(); ++i) EXPECT_LT(lines[i].size(), 30u) << lines[i];
}

/// An animation that is stopped leaves no file, and tells scripts that it is to be made again.
TEST_F(Terminal, AnAnimationThatIsStoppedIsNotWritten) {
  const std::string model = (folder_.path() / "model.csg").string(),
                    snapshot = (folder_.path() / "run.h5").string(),
                    film = (folder_.path() / "turn.apng").string();
  std::ofstream(model) << "difference() { cube(2); sphere(r = 1.5, $fn = 40); }";
  const auto ignored = [](pid_t, int, const std::string&) {};
  ASSERT_EQ(on_terminal({"bsp2", "run", model, "--snapshot", snapshot}, 80, ignored).status, 0);
  bool is_typed = false;
  const Screen screen = on_terminal(
      {"bsp2", "render", snapshot, "-o", film, "--turntable", "5000", "--size", "500x500", "--threads", "1"},
      80, [&](pid_t, int terminal, const std::string& text) {
        if (is_typed || drawings(text).size() < 2) return;
        is_typed = ::write(terminal, "\x03", 1) == 1;
      });
  ASSERT_TRUE(is_typed) << screen.text;
  constexpr int interrupted = 75;
  EXPECT_TRUE(WIFEXITED(screen.status) && WEXITSTATUS(screen.status) == interrupted) << screen.text;
  EXPECT_NE(screen.text.find("bsp2: interrupted"), std::string::npos) << screen.text;
  EXPECT_NE(screen.text.find("turn.apng' is not written"), std::string::npos) << screen.text;
  EXPECT_FALSE(fs::exists(film));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator{}), 2);
}

/// Ctrl-C is typed: the terminal shows ^C behind the bar, and what is said takes the place of both.
TEST_F(Terminal, IsCleanAfterCtrlC) {
  bool is_typed = false;
  const Screen screen = on_terminal(arguments(40), 80, [&](pid_t, int terminal, const std::string& text) {
    if (is_typed || drawings(text).size() < 2) return;
    is_typed = ::write(terminal, "\x03", 1) == 1;
  });
  ASSERT_TRUE(is_typed) << screen.text;
  const std::size_t typed = screen.text.find("^C"), said = screen.text.find("bsp2: interrupted");
  ASSERT_NE(typed, std::string::npos) << screen.text;
  ASSERT_NE(said, std::string::npos) << screen.text;
  EXPECT_LT(typed, said);
  EXPECT_EQ(screen.text.substr(said - 4, 4), "\r\x1b[K") << screen.text;
  for (const std::string& line : drawings(screen.text)) EXPECT_LE(line.size() + 2, 79U) << line;
}

}  // namespace
