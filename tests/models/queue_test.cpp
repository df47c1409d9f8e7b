// The queue of independent jobs, as many processes use it: whatever happens to them, the merge is the run of
// one process.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "bsp2/io/outputs/snapshot.hpp"
#include "support/listening.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace {

namespace fs = std::filesystem;

struct Ended {
  int code;  // 128 + the signal if one ended it
  std::string text;
};

class Jobs : public testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;
  std::string model_ = std::string(BSP2_SOURCE_DIR) + "/examples/leaning_tower.csg";
  fs::path queue_ = folder_.path() / "queue";

  [[nodiscard]] fs::path output(pid_t child) const {
    return folder_.path() / ("output." + std::to_string(child));
  }
  pid_t start(const std::vector<std::string>& arguments) {
    const pid_t child = fork();
    if (child != 0) return child;
    const int out = open(output(getpid()).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666);
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
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), bytes(output(child))};
  }
  Ended run(const std::vector<std::string>& arguments) { return wait(start(arguments)); }
  static std::string bytes(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static std::string digest(const std::string& text) {
    const auto at = text.find("digest");
    return at == std::string::npos ? "none: " + text : text.substr(text.find_first_not_of(' ', at + 6), 32);
  }
  /// A job a region, unless the options say otherwise.
  void split(const std::vector<std::string>& options, const std::string& job_seconds = "0") {
    std::vector<std::string> arguments{"jobs",          "split",         model_,
                                       queue_.string(), "--job-seconds", job_seconds};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const Ended ended = run(arguments);
    ASSERT_EQ(ended.code, 0) << ended.text;
  }
  [[nodiscard]] std::vector<std::string> worker(const std::string& limit = "--budget",
                                                const std::string& value = "1h") const {
    return {"jobs", "run", queue_.string(), "--threads", "1", limit, value, "--lease", "2"};
  }
  /// Divides jobs by cells: seconds differ from machine to machine and under the sanitizers.
  [[nodiscard]] std::vector<std::string> worker(int cells) const {
    return worker("--cells", std::to_string(cells));
  }
  [[nodiscard]] std::size_t jobs() const {
    const std::string lines = bytes(queue_ / "jobs.txt");
    return static_cast<std::size_t>(std::ranges::count(lines, '\n'));
  }
  [[nodiscard]] std::size_t results() const {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(queue_ / "done"))
      count += entry.path().filename().string().starts_with(".") ? 0 : 1;
    return count;
  }
  /// What a run takes on this machine, in this build, at least.
  int milliseconds_of_run(const std::vector<std::string>& options) {
    std::vector<std::string> arguments{"run", model_, "--threads", "1"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    auto least = std::chrono::steady_clock::duration::max();
    for (int time = 0; time < 3; ++time) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_EQ(run(arguments).code, 0);
      least = std::min(least, std::chrono::steady_clock::now() - start);
    }
    return static_cast<int>(std::chrono::duration_cast<std::chrono::milliseconds>(least).count());
  }
  /// The folder stays: a worker may be about to write into it.
  void drop_claims() const {
    for (const auto& entry : fs::directory_iterator(queue_ / "claims")) fs::remove(entry.path());
  }
  void expect_merged(const std::vector<std::string>& options) {
    std::vector<std::string> arguments{"run", model_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const std::string expected = digest(run(arguments).text);
    const Ended merged = run({"jobs", "merge", queue_.string()});
    EXPECT_EQ(merged.code, 0) << merged.text;
    EXPECT_EQ(digest(merged.text), expected);
    EXPECT_FALSE(fs::exists(queue_ / ".joined.h5"));
  }
};

TEST_F(Jobs, GiveWhatARunGives) {
  const std::vector<std::string> options{"--regions", "16"};
  split(options);
  EXPECT_EQ(run(worker()).code, 0);
  EXPECT_EQ(results(), 16U);
  for (const auto& entry : fs::directory_iterator(queue_ / "done")) {  // what the plan took is not theirs
    const auto result = bsp2::io::read_snapshot(entry.path(), bsp2::io::SnapshotPart::head);
    EXPECT_EQ(result.head.superstep_name, std::vector<std::string>{"computation"});
  }
  expect_merged(options);
  const Ended status = run({"jobs", "status", queue_.string()});
  EXPECT_NE(status.text.find("16 finished; 100 %"), std::string::npos) << status.text;
  EXPECT_EQ(std::count(status.text.begin(), status.text.end(), '\n'), 1) << status.text;
  const Ended all = run({"jobs", "status", queue_.string(), "--all"});
  EXPECT_EQ(std::count(all.text.begin(), all.text.end(), '\n'), 1 + 2 + 16) << all.text;
}

TEST_F(Jobs, SayNothingWhereTheyAreToBeQuiet) {
  EXPECT_EQ(
      run({"jobs", "split", model_, queue_.string(), "--regions", "2", "--job-seconds", "0", "--quiet"}).text,
      "");
  EXPECT_EQ(run({"jobs", "run", queue_.string(), "--quiet"}).text, "");
  EXPECT_EQ(results(), 2U);
}

/// The corrected model goes into a queue of the same name.
TEST_F(Jobs, LeaveNoFolderOfAModelThatIsRefused) {
  const std::string model = (folder_.path() / "model.csg").string();
  std::ofstream(model) << "cube(";
  EXPECT_EQ(run({"jobs", "split", model, queue_.string()}).code, 2);
  EXPECT_FALSE(fs::exists(queue_));
  std::ofstream(model) << "cube(1);";
  EXPECT_EQ(run({"jobs", "split", model, queue_.string()}).code, 0);
}

/// Also at a level, with OUT cells: joins across jobs, FUZZY cells, and the BSP tree that the picture is
/// drawn with.
TEST_F(Jobs, DivideThemselvesAndStillGiveWhatARunGives) {
  model_ = std::string(BSP2_SOURCE_DIR) + "/examples/mechanical_piece.csg";
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--regions", "4"},
        {"--regions", "2", "--level", "25", "--keep", "in", "--keep", "fuzzy", "--keep", "out"}}) {
    fs::remove_all(queue_);
    split(options);
    EXPECT_EQ(run(worker(60)).code, 0);
    EXPECT_GT(results(), 8U);
    expect_merged(options);
    const fs::path a = folder_.path() / "a.png", b = folder_.path() / "b.png",
                   snapshot = folder_.path() / "whole.h5";
    std::vector<std::string> plain{"run", model_, "--picture", a.string()};
    plain.insert(plain.end(), options.begin(), options.end());
    EXPECT_EQ(run(plain).code, 0);
    const Ended merged =
        run({"jobs", "merge", queue_.string(), "--picture", b.string(), "--snapshot", snapshot.string()});
    EXPECT_EQ(merged.code, 0) << merged.text;
    EXPECT_TRUE(bytes(a) == bytes(b));
    EXPECT_EQ(digest(run({"resume", snapshot.string()}).text), digest(merged.text));
  }
}

/// Round solids end at a tolerance, which is the plan's even where nobody chose it.
TEST_F(Jobs, RefineRoundSolidsAsARunDoes) {
  model_ = std::string(BSP2_SOURCE_DIR) + "/examples/napkin_ring.csg";
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{"--curved"}, {"--curved", "--tolerance", "0.01", "--regions", "2"}}) {
    fs::remove_all(queue_);
    split(options);
    EXPECT_EQ(
        run(worker("--budget", std::to_string(std::max(1, milliseconds_of_run(options) / 12)) + "ms")).code,
        0);
    EXPECT_GT(results(), 2U);
    expect_merged(options);
  }
}

/// Cells that have ended as thin enough are no work: a job that is divided has some that have not for either
/// half, whenever its time is up.
TEST_F(Jobs, AreDividedWhereBothHalvesHaveSomethingToDo) {
  model_ = std::string(BSP2_SOURCE_DIR) + "/examples/napkin_ring.csg";
  const std::vector<std::string> options{"--curved", "--tolerance", "0.1", "--regions", "2"};
  split(options);
  EXPECT_EQ(run(worker("--budget", "1ms")).code, 0);
  int divided = 0;
  for (const auto& entry : fs::directory_iterator(queue_ / "done")) {
    const auto result = bsp2::io::read_snapshot(entry.path(), bsp2::io::SnapshotPart::head);
    const auto sum = [](const std::vector<std::uint64_t>& numbers) {
      return std::accumulate(numbers.begin(), numbers.end(), std::uint64_t{0});
    };
    const std::uint64_t open = sum(result.frontier_open);
    EXPECT_TRUE(result.head.complete ? open == 0 : open > 1)
        << entry.path() << " " << open << " of " << sum(result.frontier_tokens);
    divided += result.head.complete ? 0 : 1;
  }
  EXPECT_GT(divided, 0);
  expect_merged(options);
}

/// Workers are killed at random moments while others go on; jobs are taken again, and some are evaluated
/// twice.
TEST_F(Jobs, SurviveTheirWorkers) {
  const auto seed = bsp2::samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const std::vector<std::string> options{"--regions", "8"};
  split(options);
  int killed = 0;
  for (int round = 0; round < bsp2::samples::all_rounds(8); ++round) {
    const pid_t first = start(worker(1000)), second = start(worker(1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 500));
    for (const pid_t child : {first, second}) {
      kill(child, SIGKILL);
      killed += wait(child).code == 128 + SIGKILL ? 1 : 0;
    }
    // A claim that vanishes under a living worker, and one whose owner is unknown.
    if (round % 2 == 0) drop_claims();
    std::ofstream(queue_ / "claims" / std::to_string(random() % 8)) << "";
  }
  EXPECT_GT(killed, 0);
  const pid_t first = start(worker(1500)), second = start(worker(1500));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  drop_claims();  // now both may evaluate the same job
  for (const pid_t child : {first, second}) {
    const Ended ended = wait(child);
    EXPECT_EQ(ended.code, 0) << ended.text;
  }
  const Ended rest = run(worker(1500));
  EXPECT_EQ(rest.code, 0) << rest.text;
  expect_merged(options);
}

/// Many small regions share jobs; who is killed loses at most the job that it had.
TEST_F(Jobs, OfManySmallRegionsSurviveKills) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "workers are killed before they have begun";
#endif
  const auto seed = bsp2::samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const std::vector<std::string> options{"--regions", "2048"};
  split(options, "0.1");
  for (int again = 0; again < 20 && jobs() > 200; ++again) {  // the machine was held up as it was measured
    fs::remove_all(queue_);
    split(options, "0.1");
  }
  EXPECT_LE(jobs(), 200U);
  std::size_t before = 0;
  for (int round = 0; round < 10; ++round) {
    const pid_t first = start(worker()), second = start(worker());
    for (const pid_t child : {first, second}) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50 + random() % 200));
      kill(child, SIGKILL);
      wait(child);
    }
    EXPECT_GE(results(), before);
    before = results();
  }
  EXPECT_EQ(run(worker()).code, 0);
  EXPECT_EQ(results(), jobs());
  std::uintmax_t size = 0;
  for (const auto& entry : fs::directory_iterator(queue_ / "done"))  // but what killed workers left
    size += entry.path().filename().string().starts_with(".") ? 0 : entry.file_size();
  const fs::path whole = folder_.path() / "whole.h5";
  EXPECT_EQ(run({"run", model_, "--regions", "2048", "--snapshot", whole.string()}).code, 0);
  EXPECT_LT(size, 2 * fs::file_size(whole));
  expect_merged(options);
}

/// How fast the machine is decides in between.
TEST_F(Jobs, AreAsLongAsIsAskedFor) {
  split({"--regions", "64"}, "1000000");
  EXPECT_LE(jobs(), 2U);  // one more has the regions in which nothing is undecided
  EXPECT_EQ(run(worker()).code, 0);
  expect_merged({"--regions", "64"});
  fs::remove_all(queue_);
  split({"--regions", "64"});
  EXPECT_GT(jobs(), 32U);
  EXPECT_EQ(run({"jobs", "split", model_, queue_.string(), "--job-seconds", "-1"}).code, 2);
}

TEST_F(Jobs, ASignalKeepsWhatWasFound) {
  const std::vector<std::string> options{"--regions", "1"};
  split(options);
  const pid_t child = start(worker());
  bsp2::samples::wait_for_handler(child, SIGUSR1);
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  kill(child, SIGUSR1);
  const Ended ended = wait(child);
  if (ended.code != 0) {  // a fast machine was done before
    EXPECT_EQ(ended.code, 75) << ended.text;
  }
  EXPECT_EQ(run(worker()).code, 0);
  expect_merged(options);
}

TEST_F(Jobs, TellWhatIsMissing) {
  split({"--regions", "4"});
  EXPECT_EQ(run({"jobs", "run", queue_.string(), "--job", "2"}).code, 0);
  EXPECT_EQ(results(), 1U);
  const Ended refused = run({"jobs", "merge", queue_.string(), "-o", (folder_.path() / "out").string()});
  EXPECT_EQ(refused.code, 2);
  EXPECT_NE(refused.text.find("no result of jobs 0, 1, 3;"), std::string::npos) << refused.text;
  EXPECT_FALSE(fs::exists(folder_.path() / "out"));
  const Ended partial = run({"jobs", "merge", queue_.string(), "--partial"});
  EXPECT_EQ(partial.code, 0) << partial.text;
  EXPECT_EQ(partial.text.find("FUZZY                   0 cells"), std::string::npos) << partial.text;
  EXPECT_EQ(run({"jobs", "run", queue_.string(), "--job", "4"}).code, 2);
  EXPECT_EQ(run({"jobs", "split", model_, queue_.string()}).code, 2);
  EXPECT_EQ(run({"jobs", "run", folder_.path().string()}).code, 2);
  EXPECT_EQ(run({"resume", (queue_ / "done" / "2.h5").string()}).code, 2);
  EXPECT_EQ(run({"jobs"}).code, 2);
  // A result that is damaged is named; without it the job is to be done again.
  const fs::path bad = queue_ / "done" / "2.h5";
  fs::resize_file(bad, fs::file_size(bad) / 2);
  const Ended damaged = run(worker());
  EXPECT_EQ(damaged.code, 2);
  EXPECT_NE(damaged.text.find("2.h5"), std::string::npos) << damaged.text;
  fs::remove(bad);
  EXPECT_EQ(run(worker()).code, 0);
  expect_merged({"--regions", "4"});
}

}  // namespace
