// A failure on one rank, in any superstep: all ranks end soon, with one message and the right code.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>

#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

/// Seconds in which all ranks have ended: far more than it takes on a busy machine, far less than anything
/// here waits or computes if nobody ends it.
constexpr double soon = 60;

struct Ended {
  int code = 0;
  double seconds = 0;
  std::string text;
  std::vector<std::string> messages;  // of bsp2, not of mpirun
};

Ended start(const std::string& environment, int ranks, const std::string& arguments) {
  const auto begin = std::chrono::steady_clock::now();
  const std::string command = environment + " timeout --kill-after=5 120 " + MPIEXEC +
                              " --oversubscribe -n " + std::to_string(ranks) + " " + FAILING_PROGRAM + " " +
                              arguments + " 2>&1";
  FILE* pipe = popen(command.c_str(), "r");
  std::string text;
  std::array<char, 4096> buffer;
  while (const std::size_t count = fread(buffer.data(), 1, buffer.size(), pipe))
    text.append(buffer.data(), count);
  Ended ended;
  ended.code = WEXITSTATUS(pclose(pipe));
  ended.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  ended.text = text;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);)
    // Where the launcher ends all, a master that has nothing yet may say that it was.
    if (line.starts_with("bsp2: ") && line.find("interrupted before") == std::string::npos)
      ended.messages.push_back(line);
  return ended;
}

std::string failing(const std::string& superstep, int rank, const std::string& how) {
  return "BSP2_FAIL_AT=" + superstep + " BSP2_FAIL_RANK=" + std::to_string(rank) + " BSP2_FAIL_HOW=" + how;
}

class Failure : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;

  [[nodiscard]] std::string out() const { return (folder_.path() / "out").string(); }

  /// Fails in a run of the model that writes all it can.
  /// @param model and options.
  /// @param lost what is then not there; empty: nothing is.
  void expect_agreed(const std::string& superstep, int ranks, int rank, const std::string& how,
                     const std::string& model, const std::string& collect = "file",
                     const std::string& lost = "") {
    SCOPED_TRACE(superstep + ", rank " + std::to_string(rank) + " of " + std::to_string(ranks) + ", " + how);
    const std::string place = ranks == 1 ? "" : " (" + superstep + ", rank " + std::to_string(rank) + ")";
    const std::string cause = how == "user" || how == "busy" ? "injected mistake"
                              : how == "ours"                ? "internal error: injected bug"
                                                             : "out of memory";
    const Ended ended =
        start(failing(superstep, rank, how), ranks,
              "run " + model + " --regions 8 --collect " + collect + " --threads 2 -o " + out());
    EXPECT_EQ(ended.code, how == "user" || how == "busy" ? 2 : 1);
    ASSERT_EQ(ended.messages.size(), 1U) << ended.text;
    EXPECT_TRUE(ended.messages[0].starts_with("bsp2: ") && ended.messages[0].ends_with(cause + place))
        << ended.messages[0];
    EXPECT_LT(ended.seconds, soon);
    for (const std::string name : {"report.json", "solid.pvtu", "view.png", "boundary.stl", "snapshot.h5"})
      EXPECT_EQ(fs::exists(out() + "/" + name), !lost.empty() && name != lost) << name << ended.text;
    if (fs::exists(out())) {
      for (const auto& entry : fs::directory_iterator(out()))
        EXPECT_FALSE(entry.path().filename().string().starts_with(".")) << entry;
    }
  }
};

TEST_F(Failure, EndsAllRanksInEverySuperstep) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  int turn = 0;
  for (const char* superstep : {"compilation", "broadcast", "distribution", "computation"}) {
    ++turn;
    expect_agreed(superstep, 3, turn / 2 % 2 == 0 ? 2 : 0, turn % 2 == 0 ? "user" : "ours", model);
  }
}

/// Where the snapshot, the boundary or the picture fails on one rank, all go on with the rest.
TEST_F(Failure, InOneOutputLeavesTheOthers) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  const auto expect_lost = [&](const std::string& superstep, int ranks, int rank, const std::string& how,
                               const std::string& collect, const std::string& lost) {
    fs::remove_all(out());
    expect_agreed(superstep, ranks, rank, how, model, collect, lost);
  };
  expect_lost("resolution", 1, 0, "worker", "file", "boundary.stl");
  expect_lost("resolution", 2, 0, "user", "master", "boundary.stl");
  expect_lost("resolution", 3, 1, "ours", "file", "boundary.stl");
  expect_lost("resolution", 3, 1, "worker", "file", "boundary.stl");
  expect_lost("rendering", 3, 2, "ours", "file", "view.png");
  expect_lost("rendering", 2, 0, "user", "master", "view.png");
  expect_lost("snapshot", 3, 2, "ours", "file", "snapshot.h5");
  expect_lost("snapshot", 1, 0, "user", "file", "snapshot.h5");
}

/// The other rank would compute for hours: it must not finish that first.
TEST_F(Failure, OfAThreadEndsWhatTheOthersCompute) {
  const fs::path model = folder_.path() / "endless.csg";
  std::ofstream(model) << "sphere(r = 10);\n";
  for (const int rank : {0, 1})
    expect_agreed("computation", 2, rank, "worker", model.string() + " --curved --tolerance 1e-9");
}

/// Nobody waits for a rank that does not listen.
TEST_F(Failure, EndsRanksThatAreBusyWithSomethingElse) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  expect_agreed("distribution", 2, 1, "busy", model);
}

/// All ranks refuse a snapshot for which there is no room: nothing half written is left, and the old one is.
TEST_F(Failure, OfAFullDiskNamesTheFileAndTheReason) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "menger_sponge.csg",
                 disk = folder_.path() / "disk";
  const std::string snapshot = (disk / "run.h5").string(),
                    arguments = "run " + model.string() + " --regions 16 --threads 1 --snapshot " + snapshot;
  fs::create_directory(disk);
  // 140 kB are needed.
  for (const std::string size : {"40k", "132k"}) {
    const std::string mount = "mount -t tmpfs -o size=" + size + " none " + disk.string();
    if (std::system(("unshare -m " + mount + " 2>/dev/null").c_str()) != 0)
      GTEST_SKIP() << "no file system can be mounted here";
    for (const int ranks : {1, 2, 3}) {
      SCOPED_TRACE(size + ", " + std::to_string(ranks) + " ranks");
      const Ended ended = start("unshare -m bash -c '" + mount + " && \"$@\"; code=$?; ls -A " +
                                    disk.string() + "; exit $code' - env",
                                ranks, arguments);
      EXPECT_EQ(ended.code, 2) << ended.text;
      ASSERT_EQ(ended.messages.size(), 1U) << ended.text;
      EXPECT_TRUE(ended.messages[0].starts_with("bsp2: cannot write the snapshot '" + snapshot +
                                                "': No space left on device"))
          << ended.messages[0];
      EXPECT_LT(ended.seconds, soon);
      EXPECT_EQ(ended.text.find("\nrun.h5"), std::string::npos) << ended.text;
      EXPECT_EQ(ended.text.find("\n.run.h5"), std::string::npos) << ended.text;
    }
  }
}

/// A rank that is stopped, or sleeps, is missed by one of those that wait for it; what is busy is not
/// missing.
TEST_F(Failure, ARankWithoutASignOfLifeIsMissed) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  const std::string snapshot = (folder_.path() / "run.h5").string(),
                    run = "run " + model.string() + " --regions 8 --threads 1 --snapshot " + snapshot;
  ASSERT_EQ(start("", 2, run).code, 0);
  const auto size = fs::file_size(snapshot);
  struct {
    int ranks, missing;
    const char *superstep, *how;
  } const cases[] = {{2, 0, "compilation", "stopped"},
                     {2, 1, "distribution", "asleep"},
                     {3, 2, "snapshot", "stopped"},
                     {4, 1, "computation", "stopped"}};
  for (const auto& [ranks, missing, superstep, how] : cases) {
    SCOPED_TRACE(std::string(superstep) + " of " + std::to_string(ranks) + " ranks, " + how);
    Ended ended = start(failing(superstep, missing, how), ranks, run + " --timeout 3");
    std::erase_if(ended.messages,
                  [](const std::string& line) {  // what the launcher's end makes the master say
                    return line.find("is the snapshot of an earlier run") != std::string::npos;
                  });
    EXPECT_NE(ended.code, 0);
    ASSERT_EQ(ended.messages.size(), 1U) << ended.text;
    EXPECT_TRUE(ended.messages[0].starts_with("bsp2: rank " + std::to_string(missing) +
                                              " is missing in the superstep '"))
        << ended.messages[0];
    EXPECT_NE(ended.messages[0].find("no sign of life for 3 s"), std::string::npos) << ended.messages[0];
    EXPECT_GT(ended.seconds, 3);
    EXPECT_LT(ended.seconds, soon);
    EXPECT_EQ(fs::file_size(snapshot), size);
    EXPECT_NE(start("", 1, "info " + snapshot).text.find("complete"), std::string::npos);
  }
  const Ended busy = start(failing("distribution", 1, "computing"), 2, run + " --timeout 3");
  EXPECT_EQ(busy.code, 0) << busy.text;
  EXPECT_GT(busy.seconds, 5);
  EXPECT_TRUE(busy.messages.empty()) << busy.text;
  const Ended wrong = start("BSP2_TIMEOUT=soon", 2, run);
  EXPECT_NE(wrong.code, 0);
  EXPECT_NE(wrong.text.find("BSP2_TIMEOUT must be a number of seconds, 0 for ever, not 'soon'"),
            std::string::npos)
      << wrong.text;
}

/// Not where a superstep begins but anywhere in it, or in what comes after: in the middle of messages, of
/// files, of threads.
TEST_F(Failure, AtAnyAllocationEndsAllRanks) {
  const fs::path model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  const char* wanted = std::getenv("BSP2_FAILURES");
  const int rounds = wanted != nullptr ? std::atoi(wanted) : 1;
  const unsigned seed = wanted != nullptr ? std::random_device{}() : 1;
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  int harmless = 0;
  for (int round = 0; round < rounds; ++round)
    for (const std::string superstep : {"compilation", "broadcast", "distribution", "computation", "snapshot",
                                        "collection", "rendering", "resolution"}) {
      const bool in_worker = superstep == "computation" || superstep == "resolution";
      for (const std::string thread : {"main", "worker"}) {
        if (thread == "worker" && !in_worker) continue;
        const auto allocation =
            static_cast<int>(std::exp(std::uniform_real_distribution<double>(0, std::log(300.0))(random)));
        const int ranks = 2 + static_cast<int>(random() % 2),
                  rank = static_cast<int>(random() % static_cast<unsigned>(ranks));
        const std::string how = thread + ":" + std::to_string(allocation);
        SCOPED_TRACE(superstep + ", rank " + std::to_string(rank) + " of " + std::to_string(ranks) + ", " +
                     how);
        Ended ended = start(failing(superstep, rank, how), ranks,
                            "run " + model.string() + " --regions 8 --collect file --threads 2 -o " + out());
        if (ended.code == 0) {  // some can be done without: that of std::stable_sort
          EXPECT_TRUE(fs::exists(out() + "/report.json")) << ended.text;
          EXPECT_TRUE(ended.messages.empty()) << ended.text;
          ++harmless;
          fs::remove_all(out());
          continue;
        }
        EXPECT_EQ(ended.code, 1);
        ASSERT_EQ(ended.messages.size(), 1U) << ended.text;
        EXPECT_TRUE(ended.messages[0].starts_with("bsp2: ")) << ended.messages[0];
        EXPECT_NE(ended.messages[0].find("out of memory ("), std::string::npos) << ended.messages[0];
        EXPECT_TRUE(ended.messages[0].ends_with(", rank " + std::to_string(rank) + ")")) << ended.messages[0];
        EXPECT_LT(ended.seconds, soon);
        fs::remove_all(out());
      }
    }
  EXPECT_LE(harmless, 2 * rounds);
}

}  // namespace
