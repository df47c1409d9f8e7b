#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "bsp2/bsp2.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2 {
namespace {

/// Boxes in random places, one minus the next and so on.
Expression random_boxes(std::mt19937& random, int count) {
  std::uniform_real_distribution<double> at(0, 8), length(1, 5);
  const auto box = [&] {
    return cuboid({length(random), length(random), length(random)})
        .rotate(10 * at(random), {at(random), at(random), 1})
        .translate({at(random), at(random), at(random)});
  };
  Expression solid = box();
  for (int i = 1; i < count; ++i) solid = i % 3 == 0 ? solid - box() : solid + box();
  return solid;
}

TEST(JobQueue, HasTheCellsOfAnEvaluation) {
  const std::uint32_t chosen = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(chosen));
  std::mt19937 random(chosen);
  for (int round = 0; round < samples::rounds(4); ++round) {
    const samples::TemporaryFolder folder;
    const Expression solid = random_boxes(random, 12);
    const auto path = folder.path() / "queue";
    const JobQueue queue = JobQueue::split(solid, path, 0, {.regions = 8});
    EXPECT_EQ(queue.jobs().size(), queue.size());
    EXPECT_THROW(queue.join(folder.path() / "early.h5"), Error) << "nothing is done";
    // Two workers, each with an object of its own; some jobs are divided.
    std::set<std::string> done;
    const auto work = [&](std::optional<std::uint64_t> cells, std::set<std::string>* names) {
      WorkOptions options{.threads = 1, .cells = cells};
      if (names != nullptr) options.done = [names](const Job& job, bool) { names->insert(job.name); };
      EXPECT_FALSE(JobQueue(path).work(options));
    };
    std::thread other([&] { work({}, nullptr); });
    work(20, &done);
    other.join();
    const std::vector<Job> jobs = queue.jobs();
    EXPECT_TRUE(std::all_of(jobs.begin(), jobs.end(), [](const Job& job) {
      return job.state == Job::State::finished || job.state == Job::State::divided;
    }));
    for (const std::string& name : done)
      EXPECT_TRUE(std::any_of(jobs.begin(), jobs.end(), [&](const Job& job) { return job.name == name; }));
    queue.join(folder.path() / "all.h5");
    const Result merged = resume(folder.path() / "all.h5"), direct = evaluate(solid, {.regions = 8});
    EXPECT_EQ(merged.digest(), direct.digest());
    EXPECT_TRUE(merged.is_complete());
  }
}

TEST(JobQueue, WhatIsMissingMayStayFuzzy) {
  const samples::TemporaryFolder folder;
  const std::uint32_t chosen = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(chosen));
  std::mt19937 random(chosen);
  const Expression solid = random_boxes(random, 12);
  const JobQueue queue = JobQueue::split(solid, folder.path() / "queue", 0, {.regions = 8});
  EXPECT_FALSE(queue.work({.threads = 1, .job = 0, .until_empty = false}));
  queue.join(folder.path() / "some.h5", true);
  const Result some = resume(folder.path() / "some.h5", {.steps = 0});
  EXPECT_FALSE(some.is_complete());
  EXPECT_LT(some.volume().least, some.volume().most);
  const double volume = evaluate(solid).volume().least;
  EXPECT_LE(some.volume().least, volume * (1 + 1e-12));
  EXPECT_GE(some.volume().most, volume * (1 - 1e-12));
}

TEST(JobQueue, StopsAndRefusesWhatMakesNoSense) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "queue";
  EXPECT_THROW(JobQueue{path}, Error);
  EXPECT_THROW(JobQueue::split(cube(), path, -1), Error);
  EXPECT_THROW(JobQueue::split(torus(1, 2), path), Error) << "thicker than it is wide";
  EXPECT_FALSE(std::filesystem::exists(path));
  const JobQueue queue = JobQueue::split(cube() + cube().translate({3, 0, 0}), path);
  EXPECT_THROW(JobQueue::split(cube(), path), Error) << "it is there";
  EXPECT_TRUE(queue.work({.stop = [] { return true; }}));
  EXPECT_THROW((void)queue.work({.job = static_cast<std::uint32_t>(queue.size())}), Error);
  for (const Job& job : queue.jobs()) EXPECT_EQ(job.state, Job::State::waiting);
}

TEST(ClusterTables, NodesShareTheCells) {
  const std::uint32_t chosen = samples::new_seed();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(chosen));
  std::mt19937 random(chosen);
  const Expression solid = random_boxes(random, 12);
  const Options options{.threads = 1, .regions = 8};
  const auto tables = measure_tables(solid, {1, 2, 4}, {std::nullopt}, false, options);
  ASSERT_EQ(tables.size(), 1U);
  ASSERT_EQ(tables[0].nodes.size(), 3U);
  EXPECT_EQ(tables[0].regions, 8U);
  const auto cells = [](const std::vector<NodeFigures>& nodes) {
    return std::accumulate(nodes.begin(), nodes.end(), std::uint64_t{0},
                           [](std::uint64_t sum, const NodeFigures& node) { return sum + node.cells; });
  };
  for (const auto& nodes : tables[0].nodes) EXPECT_EQ(cells(nodes), cells(tables[0].nodes[0]));
  EXPECT_THROW((void)measure_tables(solid, {}), Error);
}

}  // namespace
}  // namespace bsp2
