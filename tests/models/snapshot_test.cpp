// Runs that are stopped and resumed, as a person or a batch script does it.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "support/listening.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int interrupted = 75;

struct Ended {
  int code;  // 128 + the signal if one ended it
  std::string text;
};

int code_of(int status) { return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status); }

class Session : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;
  std::string model_ = std::string(BSP2_SOURCE_DIR) + "/examples/leaning_tower.csg";
  fs::path snapshot_ = folder_.path() / "run.h5";
  fs::path output_ = folder_.path() / "output.txt";

  /// Starts the program; its output goes to a file.
  pid_t start(const std::vector<std::string>& arguments) {
    const pid_t child = fork();
    if (child != 0) return child;
    const int out = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    std::vector<char*> words{const_cast<char*>(BSP2_PROGRAM)};
    for (const std::string& word : arguments) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    execv(BSP2_PROGRAM, words.data());
    _exit(127);
  }
  Ended wait(pid_t child) {
    int status = 0;
    waitpid(child, &status, 0);
    std::ifstream in(output_);
    return {code_of(status), {std::istreambuf_iterator<char>(in), {}}};
  }
  static bool has_ended(pid_t child) {
    siginfo_t found{};
    waitid(P_PID, static_cast<id_t>(child), &found, WEXITED | WNOHANG | WNOWAIT);
    return found.si_pid == child;
  }
  Ended run(const std::vector<std::string>& arguments) { return wait(start(arguments)); }

  static std::string digest(const std::string& text) {
    const auto at = text.find("digest");
    return at == std::string::npos ? "none: " + text : text.substr(text.find_first_not_of(' ', at + 6), 32);
  }
  [[nodiscard]] std::string uninterrupted(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments{"run", model_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return digest(run(arguments).text);
  }
  /// Names of hidden files beside the snapshot.
  [[nodiscard]] std::vector<std::string> leftovers() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path()))
      if (entry.path().filename().string().starts_with("."))
        names.push_back(entry.path().filename().string());
    return names;
  }
};

TEST_F(Session, ResumedAfterAnyStepsEndsAsIfUninterrupted) {
  for (const std::vector<std::string>& fixed :
       {std::vector<std::string>{}, {"--regions", "4", "--level", "30", "--keep", "in", "--keep", "out"}}) {
    const std::string expected = uninterrupted(fixed);
    std::vector<std::string> arguments{"run", model_,    "--snapshot", snapshot_.string(), "--budget",
                                       "5ms", "--steps", "2",          "--order",          "priority"};
    arguments.insert(arguments.end(), fixed.begin(), fixed.end());
    EXPECT_EQ(run(arguments).code, 0);
    EXPECT_NE(run({"info", snapshot_.string()}).text.find("unfinished; go on"), std::string::npos);
    const Ended middle =
        run({"resume", snapshot_.string(), "--budget", "5ms", "--steps", "1", "--threads", "3"});
    EXPECT_EQ(middle.code, 0) << middle.text;
    EXPECT_NE(digest(middle.text), expected);
    const Ended ended = run({"resume", snapshot_.string()});
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_EQ(digest(ended.text), expected);
    EXPECT_EQ(digest(run({"resume", snapshot_.string()}).text), expected);  // nothing is left to do
    EXPECT_NE(run({"info", snapshot_.string()}).text.find("complete"), std::string::npos);
  }
}

TEST_F(Session, CurvedRunsGoOnToTheirTolerance) {
  model_ = std::string(BSP2_SOURCE_DIR) + "/examples/napkin_ring.csg";
  const std::string expected = uninterrupted({"--curved", "--tolerance", "0.02", "--regions", "4"});
  const Ended first = run({"run", model_, "--curved", "--tolerance", "0.02", "--regions", "4", "--snapshot",
                           snapshot_.string(), "--budget", "1ms", "--steps", "1"});
  EXPECT_EQ(first.code, 0) << first.text;
  EXPECT_NE(digest(first.text), expected);
  const Ended ended = run({"resume", snapshot_.string(), "--threads", "3"});
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_EQ(digest(ended.text), expected);
  // Coarse first, then finer.
  EXPECT_EQ(run({"run", model_, "--curved", "--tolerance", "0.5", "--regions", "4", "--snapshot",
                 snapshot_.string()})
                .code,
            0);
  EXPECT_EQ(digest(run({"resume", snapshot_.string(), "--tolerance", "0.02"}).text), expected);
}

/// A step takes up what earlier ones left without looking again at what they have ended.
TEST_F(Session, StepsOfMillisecondsComeToAnEnd) {
  model_ = std::string(BSP2_SOURCE_DIR) + "/examples/napkin_ring.csg";
  const std::string expected = uninterrupted({"--curved", "--tolerance", "0.01"});
  const Ended ended = run({"run", model_, "--curved", "--tolerance", "0.01", "--snapshot", snapshot_.string(),
                           "--budget", "3ms"});
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_EQ(digest(ended.text), expected);
  EXPECT_NE(run({"info", snapshot_.string()}).text.find("complete"), std::string::npos);
}

TEST_F(Session, ASnapshotOfALevelIsRefinedFurther) {
  const std::string expected = uninterrupted({"--level", "40"});
  EXPECT_EQ(run({"run", model_, "--level", "15", "--snapshot", snapshot_.string()}).code, 0);
  EXPECT_EQ(digest(run({"resume", snapshot_.string(), "--level", "40"}).text), expected);
  const Ended back = run({"resume", snapshot_.string(), "--level", "20"});
  EXPECT_EQ(back.code, 2);
  EXPECT_NE(back.text.find("level"), std::string::npos);
}

TEST_F(Session, SignalsEndTheStepWithASnapshot) {
  const std::string expected = uninterrupted();
  auto delay = 50ms;
  int attempts = 0;
  for (std::deque<int> signals{SIGTERM, SIGINT, SIGUSR1}; !signals.empty(); signals.pop_front()) {
    ASSERT_LT(attempts++, 50) << "no moment was found between the first cell and the last";
    const int signal = signals.front();
    fs::remove(snapshot_);
    const pid_t child = start({"run", model_, "--threads", "1", "--order", "priority", "--snapshot",
                               snapshot_.string(), "-o", (folder_.path() / "out").string()});
    bsp2::samples::wait_for_handler(child, signal);
    std::this_thread::sleep_for(delay);
    kill(child, signal);
    const Ended ended = wait(child);
    if (ended.code == 0) {  // a fast machine was done before
      delay = std::max(1ms, delay * 2 / 3);
      signals.push_back(signal);
      continue;
    }
    if (ended.text.find("anything to save") != std::string::npos) {  // a slow one was not there yet
      EXPECT_EQ(ended.code, interrupted);
      EXPECT_FALSE(fs::exists(snapshot_));
      delay *= 2;
      signals.push_back(signal);
      continue;
    }
    EXPECT_EQ(ended.code, interrupted) << ended.text;
    EXPECT_NE(ended.text.find("bsp2 resume"), std::string::npos) << ended.text;
    EXPECT_TRUE(leftovers().empty());
    EXPECT_EQ(digest(run({"resume", snapshot_.string()}).text), expected);
  }
}

/// A model that has no end, but comes through a pipe, keeps the run from getting anywhere. It does come, as
/// ThreadSanitizer hands on no signal while the program waits in fopen or fread.
TEST_F(Session, ASignalBeforeAllTellsThatWhatIsThereIsOfAnEarlierRun) {
  const std::string out = (folder_.path() / "out").string(), pipe = (folder_.path() / "pipe.csg").string(),
                    small = (folder_.path() / "small.csg").string();
  const std::string nothing = "bsp2: interrupted before there was anything to save\n";
  const std::string others = "bsp2: the other files in '" + out + "' are of an earlier run\n";
  const auto of_earlier = [](const std::string& file) {
    return "bsp2: '" + file +
           "' is the snapshot of an earlier run: to resume it is not to go on with this one\n";
  };
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const int writer = open(pipe.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  ASSERT_GE(writer, 0);
  const std::string spaces(4096, ' ');
  std::ofstream(small) << "cube(1);";
  const auto interrupted_at_once = [&](const std::vector<std::string>& arguments) {
    std::vector<std::string> all{"run", pipe};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const pid_t child = start(all);
    bsp2::samples::wait_for_handler(child, SIGINT);
    kill(child, SIGINT);
    for (const auto end = std::chrono::steady_clock::now() + 60s;
         !has_ended(child) && std::chrono::steady_clock::now() < end;) {
      [[maybe_unused]] const auto written = write(writer, spaces.data(), spaces.size());
      std::this_thread::sleep_for(100us);
    }
    kill(child, SIGKILL);  // if it has not ended yet, it fails
    const Ended ended = wait(child);
    EXPECT_EQ(ended.code, interrupted) << ended.text;
    return ended.text;
  };
  EXPECT_EQ(interrupted_at_once({"-o", out}), nothing);
  ASSERT_EQ(run({"run", small, "-o", out}).code, 0);
  EXPECT_EQ(interrupted_at_once({"-o", out}), nothing + of_earlier(out + "/snapshot.h5") + others);
  EXPECT_EQ(interrupted_at_once({}), nothing);
  EXPECT_EQ(interrupted_at_once({"-o", out, "--snapshot", snapshot_.string()}), nothing + others);
  EXPECT_EQ(interrupted_at_once({"--snapshot", out + "/snapshot.h5"}),
            nothing + of_earlier(out + "/snapshot.h5"));
  close(writer);
}

/// The snapshot that is resumed is no earlier run's, by whatever path it is named.
TEST_F(Session, ASignalBeforeAllTellsNothingOfTheSnapshotThatIsResumed) {
  const std::string model = (folder_.path() / "model.csg").string(),
                    mesh = (folder_.path() / "mesh.off").string();
  std::ofstream(model) << "import(file = \"mesh.off\");";
  const auto write_mesh = [&](int idle_points) {
    std::ofstream out(mesh);
    out << "OFF\n" << idle_points + 4 << " 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n";
    for (int i = 0; i < idle_points; ++i) out << "7 8 9\n";
    out << "3 0 2 1\n3 0 1 3\n3 1 2 3\n3 2 0 3\n";
  };
  write_mesh(0);
  const Ended first = run({"run", model, "--snapshot", snapshot_.string()});
  ASSERT_EQ(first.code, 0) << first.text;
  Ended ended{0, ""};
  // While it is read the signal comes; on a busy machine it may be late, and then there is more to read.
  for (int idle_points = 4000000; ended.code == 0 && idle_points <= 64000000; idle_points *= 2) {
    write_mesh(idle_points);
    const pid_t child =
        start({"resume", snapshot_.string(), "--snapshot", (folder_.path() / "." / "run.h5").string()});
    bsp2::samples::wait_for_handler(child, SIGINT);
    kill(child, SIGINT);
    ended = wait(child);
  }
  EXPECT_EQ(ended.code, interrupted) << ended.text;
  EXPECT_EQ(ended.text, "bsp2: interrupted before there was anything to save\n");
}

TEST_F(Session, AKilledRunLosesOnlyItsLastStep) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string expected = uninterrupted();
  const auto whole = std::max(
      10ms, std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::steady_clock::now() - begin));
  const auto seed = bsp2::samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const char* wanted = std::getenv("BSP2_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : bsp2::samples::rounds(20);
  constexpr int least_kills = 5;  // where each takes long, as under a sanitizer
  const auto are_enough = [&](int killed) {
    return killed >= kills ||
           (wanted == nullptr && killed >= least_kills && std::chrono::steady_clock::now() - begin > 60s);
  };
  const auto resume = [&] {
    const Ended ended = run({"resume", snapshot_.string()});
    EXPECT_EQ(ended.code, 0) << ended.text;
    EXPECT_EQ(digest(ended.text), expected);
    EXPECT_TRUE(leftovers().empty());
    fs::remove(snapshot_);
  };
  for (int killed = 0, attempts = 0; !are_enough(killed); ++attempts) {
    ASSERT_LT(attempts, 10 * kills) << "the runs end before they are killed";
    std::vector<std::string> arguments{"run", model_};
    if (fs::exists(snapshot_)) arguments = {"resume", snapshot_.string()};
    arguments.insert(arguments.end(),
                     {"--snapshot", snapshot_.string(), "--budget", "20ms", "--threads", "2"});
    const pid_t child = start(arguments);
    std::this_thread::sleep_for(
        whole / 10 + std::chrono::milliseconds(random() % static_cast<unsigned>(2 * whole.count())));
    kill(child, SIGKILL);
    const Ended ended = wait(child);
    if (ended.code == 128 + SIGKILL) ++killed;
    if (!fs::exists(snapshot_)) continue;
    const Ended info = run({"info", snapshot_.string()});
    ASSERT_EQ(info.code, 0) << info.text;
    const bool is_complete = info.text.find("complete") != std::string::npos;
    if (is_complete || random() % 4 == 0) resume();
  }
  if (fs::exists(snapshot_)) resume();
}

/// Disk full, and a snapshot of another version: nothing is lost.
TEST_F(Session, AFullDiskLeavesTheOldSnapshot) {
  const std::string expected = uninterrupted();
  ASSERT_EQ(run({"run", model_, "--budget", "5ms", "--steps", "1", "--order", "priority", "--snapshot",
                 snapshot_.string()})
                .code,
            0);
  const auto bytes = [&] {
    std::ifstream in(snapshot_, std::ios::binary);
    return std::string{std::istreambuf_iterator<char>(in), {}};
  };
  const std::string before = bytes();
  // A limit of the size of files stands for a full disk.
  const std::string limited = "ulimit -f " + std::to_string(before.size() / 1024 + 64) +
                              "; trap '' XFSZ; exec " + BSP2_PROGRAM + " resume " + snapshot_.string() +
                              " > " + output_.string() + " 2>&1";
  const int code = code_of(std::system(("bash -c \"" + limited + "\"").c_str()));
  std::ifstream out(output_);
  const std::string text{std::istreambuf_iterator<char>(out), {}};
  EXPECT_EQ(code, 2) << text;
  EXPECT_TRUE(text.starts_with("bsp2: cannot write the snapshot")) << text;
  EXPECT_EQ(text.find("cannot write", 10), std::string::npos) << text;
  EXPECT_EQ(digest(text), expected) << "what was computed is told all the same";
  EXPECT_TRUE(bytes() == before);
  EXPECT_TRUE(leftovers().empty());
  EXPECT_EQ(digest(run({"resume", snapshot_.string()}).text), expected);
}

TEST_F(Session, ExportsTheWholeAsItIs) {
  ASSERT_EQ(run({"run", model_, "--budget", "5ms", "--steps", "1", "--order", "priority", "--snapshot",
                 snapshot_.string()})
                .code,
            0);
  const Ended ended = run({"export", snapshot_.string(), "-o", (folder_.path() / "solid.pvtu").string()});
  EXPECT_EQ(ended.code, 0) << ended.text;
  EXPECT_TRUE(fs::exists(folder_.path() / "solid.pvtu"));
  EXPECT_EQ(run({"export", snapshot_.string(), "-o", (folder_.path() / "solid.xyz").string()}).code, 2);
}

/// The folder of a resumed run has all that the folder of an uninterrupted one has.
TEST_F(Session, ResumedIntoAFolderLeavesItsSnapshotThereToo) {
  const fs::path out = folder_.path() / "out", there = out / "snapshot.h5",
                 other = folder_.path() / "other.h5";
  ASSERT_EQ(run({"run", model_, "--budget", "5ms", "--steps", "1", "--order", "priority", "--snapshot",
                 snapshot_.string()})
                .code,
            0);
  // Another one by name is the only one.
  EXPECT_EQ(run({"resume", snapshot_.string(), "--steps", "1", "--budget", "1ms", "-o", out.string(),
                 "--snapshot", other.string()})
                .code,
            0);
  EXPECT_TRUE(fs::exists(other));
  EXPECT_FALSE(fs::exists(there));
  const Ended ended = run({"resume", snapshot_.string(), "-o", out.string()});
  EXPECT_EQ(ended.code, 0) << ended.text;
  for (const char* name : {"report.json", "solid.pvtu", "view.png", "boundary.stl", "snapshot.h5"})
    EXPECT_TRUE(fs::exists(out / name)) << name;
  const std::string info = run({"info", there.string()}).text, kept = run({"info", snapshot_.string()}).text;
  EXPECT_NE(info.find("complete"), std::string::npos) << info;
  EXPECT_EQ(digest(info), digest(ended.text));
  EXPECT_NE(kept.find("complete"), std::string::npos) << kept;
  EXPECT_EQ(run({"resume", there.string(), "-o", out.string()}).code,
            0);  // it may be the one that is resumed
  EXPECT_EQ(digest(run({"info", there.string()}).text), digest(ended.text));
  for (const auto& entry : fs::directory_iterator(out))
    EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry.path();
}

/// A folder under the copy's unfinished name stands for a disk that is full by then.
TEST_F(Session, ACopyThatFailsTakesNothingElseAlong) {
  const fs::path out = folder_.path() / "out";
  ASSERT_EQ(run({"run", model_, "--budget", "5ms", "--steps", "1", "--order", "priority", "--snapshot",
                 snapshot_.string()})
                .code,
            0);
  fs::create_directories(out / ".snapshot.h5.part" / "taken");
  const std::string table = (out / "table.csv").string();
  const Ended ended = run({"resume", snapshot_.string(), "-o", out.string(), "--table", table});
  EXPECT_EQ(ended.code, 2) << ended.text;
  EXPECT_NE(ended.text.find("cannot write the snapshot '" + (out / "snapshot.h5").string() + "'"),
            std::string::npos)
      << ended.text;
  for (const char* name : {"report.json", "table.csv", "solid.pvtu"})
    EXPECT_TRUE(fs::exists(out / name)) << name;
  EXPECT_NE(run({"info", snapshot_.string()}).text.find("complete"), std::string::npos);
}

TEST_F(Session, RefusesWhatIsNoSnapshotWithOneMessage) {
  ASSERT_EQ(run({"run", model_, "--budget", "5ms", "--steps", "1", "--snapshot", snapshot_.string()}).code,
            0);
  std::ifstream in(snapshot_, std::ios::binary);
  const std::string good{std::istreambuf_iterator<char>(in), {}};
  const fs::path bad = folder_.path() / "bad.h5";
  std::vector<std::string> contents{"", "cube();", good.substr(0, good.size() / 2), good.substr(0, 100)};
  for (std::string damaged : {good, good}) {
    for (std::size_t i = damaged.size() / 3; i < damaged.size(); i += damaged.size() / 10)
      damaged[i] = static_cast<char>(~damaged[i]);
    contents.push_back(damaged);
  }
  for (const std::string& content : contents) {
    std::ofstream(bad, std::ios::binary) << content;
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"info", bad.string()},
          {"resume", bad.string()},
          {"export", bad.string(), "-o", (folder_.path() / "x.pvtu").string()}}) {
      const Ended ended = run(arguments);
      if (arguments[0] == "info" && content.size() == good.size()) continue;  // may read what is whole
      EXPECT_EQ(ended.code, 2) << arguments[0] << " " << content.size() << " " << ended.text;
      EXPECT_TRUE(ended.text.starts_with("bsp2: ")) << ended.text;
      EXPECT_EQ(std::count(ended.text.begin(), ended.text.end(), '\n'), 1) << ended.text;
    }
    std::ifstream again(bad, std::ios::binary);
    EXPECT_TRUE((std::string{std::istreambuf_iterator<char>(again), {}}) == content);  // untouched
  }
  EXPECT_EQ(run({"info", (folder_.path() / "missing.h5").string()}).code, 2);
  EXPECT_EQ(run({"run", model_, "--snapshot", folder_.path().string()}).code, 2);
  EXPECT_EQ(run({"run", model_, "--snapshot", "/dev/null"}).code, 2);
  EXPECT_EQ(run({"resume"}).code, 2);
}

#ifdef BSP2_MPIEXEC
TEST_F(Session, RanksWriteOneSnapshotAndAnyNumberOfThemGoesOn) {
  setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
  setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
  const std::string expected = uninterrupted({"--regions", "8"});
  const auto on_ranks = [&](int ranks, const std::string& arguments) {
    const std::string command = std::string(BSP2_MPIEXEC) + " --oversubscribe -n " + std::to_string(ranks) +
                                " " + BSP2_PROGRAM + " " + arguments + " --threads 1 > " + output_.string() +
                                " 2>&1";
    const int code = code_of(std::system(command.c_str()));
    std::ifstream in(output_);
    return Ended{code, {std::istreambuf_iterator<char>(in), {}}};
  };
  const std::string steps = " --budget 60ms --order priority --steps 1";
  const Ended first = on_ranks(2, "run " + model_ + " --regions 8 --snapshot " + snapshot_.string() + steps);
  EXPECT_EQ(first.code, 0) << first.text;
  EXPECT_NE(run({"info", snapshot_.string()}).text.find("unfinished; go on"), std::string::npos);
  const Ended second = on_ranks(3, "resume " + snapshot_.string() + steps);
  EXPECT_EQ(second.code, 0) << second.text;
  const fs::path copy = folder_.path() / "copy.h5";
  fs::copy_file(snapshot_, copy);
  EXPECT_EQ(digest(run({"resume", copy.string()}).text), expected);  // by one process
  EXPECT_EQ(digest(on_ranks(2, "resume " + snapshot_.string()).text), expected);
}
#endif

/// The program that docs/snapshots.md shows.
TEST_F(Session, IsReadByPythonInTenLines) {
  if (std::system("/usr/bin/python3 -c 'import h5py' 2>/dev/null") != 0)
    GTEST_SKIP() << "python3-h5py is not installed";
  ASSERT_EQ(run({"run", model_, "--snapshot", snapshot_.string()}).code, 0);
  std::ifstream docs(std::string(BSP2_SOURCE_DIR) + "/docs/snapshots.md");
  const std::string text{std::istreambuf_iterator<char>(docs), {}};
  const std::string fence = "```python\n";
  const auto begin = text.find(fence) + fence.size(), end = text.find("```", begin);
  ASSERT_LT(begin, end);
  ASSERT_NE(end, std::string::npos);
  std::ofstream(folder_.path() / "read.py") << text.substr(begin, end - begin);
  const std::string command = "cd " + folder_.path().string() + " && /usr/bin/python3 read.py > read.txt";
  ASSERT_EQ(std::system(command.c_str()), 0);
  std::ifstream out(folder_.path() / "read.txt");
  std::size_t cells = 0;
  double volume = 0;
  out >> cells >> volume;
  std::string info = run({"info", snapshot_.string()}).text;
  std::erase(info, ',');  // of thousands
  EXPECT_NE(info.find(std::to_string(cells) + " finished"), std::string::npos) << cells << info;
  EXPECT_NEAR(volume, 4992.14352895, 1e-4);
}

}  // namespace
