// Collectives against their definitions.
#include "bsp2/bsplib/collectives.hpp"

#include <gtest/gtest.h>

#include <boost/serialization/string.hpp>
#include <functional>
#include <string>
#include <vector>

namespace {

using namespace bsp2::bsplib;

std::string name(int pid) { return std::string(1, static_cast<char>('a' + pid)); }

TEST(CollectivesTest, EveryOneOnNumbers) {
  World world;
  Collectives<int> all(world);
  const int p = world.nprocs(), me = world.pid();
  for (int root = 0; root < p; ++root) {
    EXPECT_EQ(all.broadcast(10 * me, root), 10 * root);
    const auto gathered = all.gather(me * me, root);
    ASSERT_EQ(gathered.size(), me == root ? static_cast<std::size_t>(p) : 0U);
    for (std::size_t i = 0; i < gathered.size(); ++i) EXPECT_EQ(gathered[i], static_cast<int>(i * i));
  }
  EXPECT_EQ(all.reduce(me + 1, std::plus<>()), p * (p + 1) / 2);
  EXPECT_EQ(all.scan(me + 1, std::plus<>()), (me + 1) * (me + 2) / 2);
  std::vector<int> values;
  for (int pid = 0; pid < p; ++pid) values.push_back(100 * me + pid);
  const auto swapped = all.all_to_all(values);
  for (int pid = 0; pid < p; ++pid) EXPECT_EQ(swapped[static_cast<std::size_t>(pid)], 100 * pid + me);
}

TEST(CollectivesTest, OperationsNeedNotCommute) {
  World world;
  Collectives<std::string> all(world);
  std::string whole;
  for (int pid = 0; pid < world.nprocs(); ++pid) whole += name(pid);
  EXPECT_EQ(all.reduce(name(world.pid()), std::plus<>()), whole);
  EXPECT_EQ(all.scan(name(world.pid()), std::plus<>()),
            whole.substr(0, static_cast<std::size_t>(world.pid()) + 1));
  EXPECT_EQ(all.all_gather(name(world.pid())).size(), whole.size());
}

TEST(CollectivesTest, RootThatDoesNotExistIsAnAgreedError) {
  std::vector<double> data(3);
  {
    World world;
    EXPECT_THROW(broadcast(world, std::span<double>(data), world.nprocs()), Error);
  }
  World world;
  Collectives<int> all(world);
  EXPECT_THROW(all.gather(1, -1), Error);
}

TEST(CollectivesTest, TwoPhaseBroadcastOfALongVector) {
  World world;
  for (const std::size_t size : {0U, 1U, 3U, 1000U, 300000U}) {
    std::vector<double> data(size);
    const int root = world.nprocs() - 1;
    if (world.pid() == root)
      for (std::size_t i = 0; i < size; ++i) data[i] = static_cast<double>(i) + 0.5;
    broadcast(world, std::span<double>(data), root);
    for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(data[i], static_cast<double>(i) + 0.5);
  }
}

}  // namespace
