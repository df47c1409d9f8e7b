// Accounting, prediction, the file of machines, and how much memory the layer keeps.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "bsp2/bsplib/memory.hpp"

namespace {

using namespace bsp2::bsplib;
namespace fs = std::filesystem;

TEST(Cost, CountsBytesAndMessagesInAndOut) {
  World world;
  const int p = world.nprocs(), me = world.pid(), next = (me + 1) % p;
  Array<char> array(world, 100000);
  const std::vector<char> data(70000);
  std::vector<char> got(500);
  array.put(next, std::span(data).first(100), 0);
  array.put(next, std::span(data).first(200), 1000);
  array.hpput(next, data, 2000);
  array.get(next, 0, got);
  world.sync();
  const SuperstepCost cost = world.costs().recent.back();
  EXPECT_EQ(cost.superstep, 0U);
  const std::uint64_t bytes = p == 1 ? 0 : 100 + 200 + 70000 + 500, messages = p == 1 ? 0 : 4;
  EXPECT_EQ(cost.bytes_out, bytes);
  EXPECT_EQ(cost.bytes_in, bytes);
  EXPECT_EQ(cost.messages_out, messages);
  EXPECT_EQ(cost.messages_in, messages);
  EXPECT_EQ(world.costs().supersteps, 1U);
}

TEST(Cost, HIsTheLargestOfAllRanks) {
  World world;
  Array<char> array(world, 1000);
  if (world.pid() == 0)
    for (int pid = 1; pid < world.nprocs(); ++pid) array.put(pid, std::vector<char>(300), 0);
  world.sync();
  world.sync();
  const auto& recent = world.costs().recent;
  EXPECT_EQ(recent[0].h_bytes, 300U * static_cast<unsigned>(world.nprocs() - 1));
  EXPECT_EQ(recent[1].h_bytes, 0U);
}

TEST(Cost, WIsTheLongestWorkOfAllRanks) {
  World world;
  world.sync();
  if (world.pid() == world.nprocs() - 1) std::this_thread::sleep_for(std::chrono::milliseconds(50));
  world.sync();
  const SuperstepCost cost = world.costs().recent.back();
  EXPECT_GE(cost.max_work_seconds, 0.045);
  const CostReport& all = world.costs();  // with the first superstep, which others may leave later
  EXPECT_GE(all.work_seconds + all.sync_seconds, 0.045);
  if (world.pid() == world.nprocs() - 1) {
    EXPECT_GE(cost.work_seconds, 0.045);
  }
}

TEST(Cost, WorkBeforeAnArrayIsMadeCounts) {
  World world;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  Array<char> array(world, 100);
  world.sync();
  EXPECT_GE(world.costs().recent.back().work_seconds, 0.025);
  EXPECT_GE(world.costs().recent.back().max_work_seconds, 0.025);
}

TEST(Cost, PredictsWithTheMachine) {
  World world;
  EXPECT_FALSE(world.machine().has_value()) << "the tests run without a machine file";
  world.set_machine({world.nprocs(), 1e9, 1e-3, 5.0});
  Array<char> array(world, 100);
  array.put((world.pid() + 1) % world.nprocs(), std::vector<char>(100), 0);
  world.sync();
  world.sync();
  const SuperstepCost cost = world.costs().recent[0];
  const double h = world.nprocs() == 1 ? 0.0 : 100.0;
  ASSERT_TRUE(cost.predicted_seconds.has_value());
  EXPECT_DOUBLE_EQ(*cost.predicted_seconds, cost.max_work_seconds + 1e-3 * h + 5.0);
  const double other =
      world.costs().recent[1].max_work_seconds;  // however long the ranks had to wait for a core
  EXPECT_NEAR(world.costs().predicted_seconds, 10.0 + 1e-3 * h + cost.max_work_seconds + other, 1e-9);
}

TEST(Cost, KeepsOnlyTheRecentSupersteps) {
  World world(MPI_COMM_WORLD, WorldOptions{.kept_costs = 5});
  for (int i = 0; i < 12; ++i) world.sync();
  EXPECT_EQ(world.costs().recent.size(), 5U);
  EXPECT_EQ(world.costs().recent.front().superstep, 7U);
  EXPECT_EQ(world.costs().supersteps, 12U);
}

/// Puts that grow must not leave the memory of all before them behind: that would be 582 MiB here.
TEST(Memory, OfGrowingPutsIsGivenBack) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "AddressSanitizer keeps memory that was given back";
#endif
  constexpr std::size_t most = std::size_t{12} << 20, step = std::size_t{128} << 10;
  World world(MPI_COMM_WORLD, WorldOptions{.staging_bytes = 0});
  std::vector<char> data(most), target(most);
  Registered<char> shared(world, target);
  world.sync();
  const auto peak_mib = [] {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    return usage.ru_maxrss / 1024;
  };
  const long before = peak_mib();
  for (std::size_t bytes = step; bytes <= most; bytes += step) {
    shared.put(world.pid(), std::span<const char>(data).first(bytes), 0);
    world.sync();
  }
  EXPECT_LT(peak_mib() - before, 200);
}

TEST(MachineFile, KeepsOneMachineANumberOfProcesses) {
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  const fs::path directory = fs::temp_directory_path() / ("bsplib_cost_test." + std::to_string(getpid()));
  const fs::path file = directory / "deep" / "machine.json";
  EXPECT_TRUE(load_machines(file).empty());
  store_machine(file, {2, 1e9, 1e-9, 1e-6});
  store_machine(file, {4, 2e9, 2e-9, 2e-6});
  store_machine(file, {2, 3e9, 3e-9, 3e-6});
  const auto machines = load_machines(file);
  ASSERT_EQ(machines.size(), 2U);
  EXPECT_DOUBLE_EQ(find_machine(machines, 2)->g, 3e-9);
  EXPECT_DOUBLE_EQ(find_machine(machines, 64)->l, 2e-6);
  EXPECT_FALSE(find_machine({}, 1).has_value());
  std::ofstream(file) << "not json";
  EXPECT_THROW(load_machines(file), std::runtime_error);
  fs::remove_all(directory);
}

}  // namespace
