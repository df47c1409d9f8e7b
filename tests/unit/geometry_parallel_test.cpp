#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <vector>

#include "bsp2/geometry/hyperplane_table.hpp"
#include "bsp2/geometry/parallel.hpp"

namespace bsp2::geometry {
namespace {

TEST(ForEachRange, CoversEveryNumberOnce) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < 200; ++round) {
    const std::size_t count = random() % 300, grain = 1 + random() % 40;
    std::vector<int> seen(count);  // each touched by one thread only
    std::atomic<bool> too_long = false;
    for_each_range(count, grain, random() % 5, [&](std::size_t first, std::size_t end) {
      if (end - first > grain || first >= end) too_long = true;
      for (std::size_t i = first; i < end; ++i) ++seen[i];
    });
    EXPECT_FALSE(too_long);
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(count)) << "grain " << grain;
  }
}

TEST(ForEachRange, PassesOnWhatOneThrowsAfterAllHaveEnded) {
  for (std::size_t bad = 0; bad < 20; ++bad) {
    std::atomic<int> running = 0;
    const auto work = [&](std::size_t first, std::size_t) {
      ++running;
      const bool throws = first == bad;
      --running;
      if (throws) throw std::runtime_error("bad");
    };
    EXPECT_THROW(for_each_range(20, 1, 3, work), std::runtime_error) << bad;
    EXPECT_EQ(running, 0);
  }
}

TEST(RoundOccurrences, FindsTheSameOnAnyNumberOfThreads) {
  const unsigned seed = std::random_device{}();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  HyperplaneTable<3> table({-4, -4, -4}, {4, 4, 4}, 8);
  const auto covectors = unit_box<3>().covectors;
  const std::uint32_t first = table.add_covectors(covectors);
  for (int k = 0; k < 500; ++k) {
    Matrix<3> matrix;
    for (auto& row : matrix)
      for (auto& entry : row) entry = unit(random);
    const std::uint32_t map = table.add_map(matrix);
    for (std::uint32_t i = 0; i < covectors.size(); ++i) table.add_occurrence(map, first + i);
  }
  HyperplaneTable<3> alone = table;
  alone.round_occurrences(1);
  table.round_occurrences(4);
  ASSERT_EQ(table.size(), 500 * covectors.size());
  for (HyperplaneId i = 0; i < table.size(); ++i) {
    const Hyperplane<3> a = alone.rounded(i), b = table.rounded(i);
    ASSERT_TRUE(a.normal == b.normal && a.offset == b.offset && a.error == b.error) << "occurrence " << i;
  }
}

}  // namespace
}  // namespace bsp2::geometry
