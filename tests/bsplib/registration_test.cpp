// When registrations take effect, and in which order.
#include <gtest/gtest.h>

#include <array>
#include <optional>

#include "bsp2/bsplib/memory.hpp"
#include "neighbours.hpp"

namespace {

using namespace bsp2::bsplib;

TEST(Registration, TakesEffectAtTheNextSync) {
  World world;
  std::array<int, 4> memory{};
  const auto slot = world.push_reg(memory.data(), sizeof memory);
  EXPECT_EQ(world.size_of(slot, world.pid()), 0U);
  world.sync();
  EXPECT_EQ(world.size_of(slot, world.pid()), sizeof memory);
  EXPECT_EQ(world.slot_of(memory.data()), slot);
  world.pop_reg(memory.data());
  EXPECT_EQ(world.slot_of(memory.data()), slot) << "a removal takes effect at the sync, too";
  world.sync();
  EXPECT_THROW(world.slot_of(memory.data()), Error);
  EXPECT_THROW(world.sync(), Error) << "and the others have to know";
}

TEST(Registration, TheNewestOfAnAddressCounts) {
  World world;
  std::array<int, 4> memory{};
  const auto first = world.push_reg(memory.data(), sizeof memory);
  const auto second = world.push_reg(memory.data(), 4);
  world.sync();
  EXPECT_EQ(world.slot_of(memory.data()), second);
  world.pop_reg(memory.data());
  world.sync();
  EXPECT_EQ(world.slot_of(memory.data()), first);
}

TEST(Registration, PushAndPopInOneSuperstepCancel) {
  World world;
  int x = 0;
  world.push_reg(&x, sizeof x);
  world.pop_reg(&x);
  world.sync();
  EXPECT_THROW(world.slot_of(&x), Error);
  EXPECT_THROW(world.sync(), Error);
}

TEST(Registration, NullPopFollowsTheRanksThatNameTheMemory) {
  World world;
  int x = 0, y = 0;
  const bool absent = world.pid() == 0 && world.nprocs() > 1;
  world.push_reg(absent ? nullptr : &x, sizeof x);
  world.push_reg(&y, sizeof y);
  world.sync();
  world.pop_reg(absent ? nullptr : &x);
  world.sync();
  world.put(next(world), &x, world.slot_of(&y), 0, sizeof x);
  world.sync();
}

TEST(Registration, EndsWithItsObject) {
  World world;
  std::array<int, 2> memory{};
  {
    Registered<int> shared(world, memory);
    world.sync();
    shared.put(next(world), world.pid() + 1, 0);
  }
  world.sync();
  EXPECT_EQ(memory[0], (world.pid() + world.nprocs() - 1) % world.nprocs() + 1);
  EXPECT_THROW(world.slot_of(memory.data()), Error);
  EXPECT_THROW(world.sync(), Error);
}

TEST(Registration, ManyComeAndGo) {
  World world;
  std::array<int, 100> x{};
  for (int round = 0; round < 20; ++round) {
    for (auto& element : x) world.push_reg(&element, sizeof element);
    world.sync();
    for (std::size_t i = 0; i < x.size(); ++i) {
      const int value = round + static_cast<int>(i);
      world.put(next(world), &value, world.slot_of(&x[i]), 0, sizeof value);
    }
    for (std::size_t i = x.size(); i-- > 0;) world.pop_reg(&x[i]);
    world.sync();
    for (std::size_t i = 0; i < x.size(); ++i) ASSERT_EQ(x[i], round + static_cast<int>(i));
  }
}

}  // namespace
