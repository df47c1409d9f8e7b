// Worlds: sub-worlds, opened supersteps, lifetimes.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <boost/mpi/communicator.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/memory.hpp"
#include "neighbours.hpp"

namespace {

using namespace bsp2::bsplib;

TEST(WorldTest, TakesACommunicatorOfBoost) {
  const boost::mpi::communicator communicator;
  World world(communicator);
  EXPECT_EQ(world.pid(), communicator.rank());
  EXPECT_EQ(world.nprocs(), communicator.size());
  const double begin = world.time();
  EXPECT_GE(begin, 0.0);
  world.sync();
  EXPECT_EQ(world.superstep(), 1U);
  EXPECT_GE(world.time(), begin);
}

TEST(WorldTest, SeveralWorldsAreIndependent) {
  World a, b;
  Array<int> in_a(a, 1), in_b(b, 1);
  in_a.put(next(a), 1 + a.pid(), 0);
  in_b.put(next(b), 100 + b.pid(), 0);
  b.sync();
  EXPECT_EQ(in_a[0], 0);
  EXPECT_EQ(in_b[0], 100 + previous(b));
  a.sync();
  EXPECT_EQ(in_a[0], 1 + previous(a));
}

TEST(WorldTest, MovesAndClosesOnce) {
  World a;
  World b = std::move(a);
  b.sync();
  b.close();
  b.close();
  EXPECT_THROW(b.sync(), Error);
}

/// What belongs to a world does not care where the object is that the program has of it.
TEST(WorldTest, MovesWithWhatBelongsToIt) {
  std::vector<World> worlds;
  worlds.emplace_back();
  Array<int> array(worlds[0], 10);
  std::vector<int> memory(10);
  Registered<int> registered(worlds[0], memory);
  Queue<int> queue(worlds[0]);
  Collectives<int> all(worlds[0]);
  worlds[0].sync();
  for (int i = 0; i < 5; ++i) {  // of small and of large memory, a run among them
    array.put(next(worlds[0]), 10 * i, static_cast<std::size_t>(i));
    registered.put(next(worlds[0]), 20 * i, static_cast<std::size_t>(i));
    queue.send(next(worlds[0]), i);
    World elsewhere = std::move(worlds.back());
    EXPECT_THROW(worlds[0].sync(), Error) << "it is not here any more";
    worlds.clear();
    worlds.push_back(std::move(elsewhere));
  }
  {
    OpenSuperstep open = worlds[0].open();
    World elsewhere = std::move(worlds[0]);
    open.close();
    worlds[0] = std::move(elsewhere);
  }
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(array[static_cast<std::size_t>(i)], 10 * i);
    EXPECT_EQ(memory[static_cast<std::size_t>(i)], 20 * i);
  }
  EXPECT_EQ(queue.size(), 5U);
  EXPECT_EQ(all.reduce(1, std::plus<>()), worlds[0].nprocs());
}

TEST(WorldTest, EndsBeforeWhatBelongsToIt) {
  std::optional<Array<int>> array;
  std::optional<Queue<int>> queue;
  std::optional<Collectives<int>> all;
  {
    World world;
    all.emplace(world);
    array.emplace(world, 10);
    queue.emplace(world);
    array->put(next(world), 5, 0);
    queue->send(next(world), 1);
    world.sync();
    EXPECT_EQ(queue->size(), 1U);
  }
  EXPECT_EQ((*array)[0], 5) << "its memory is its own";
  (*array)[9] = 7;
  EXPECT_EQ(array->local().back(), 7);
  EXPECT_EQ(queue->size(), 0U);
  EXPECT_TRUE(queue->receive().empty());
  for (const auto& call : std::vector<std::function<void()>>{
           [&] { array->put(0, 1, 0); }, [&] { queue->send(0, 1); }, [&] { all->all_gather(1); }}) {
    try {
      call();
      ADD_FAILURE() << "the world has ended";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("The world has ended"), std::string::npos) << error.what();
    }
  }
}

TEST(WorldTest, AssignmentEndsTheWorldThatWasThere) {
  World a, b;
  Array<int> of_a(a, 1), of_b(b, 1);
  a = std::move(b);
  of_b.put(next(a), 7, 0);
  EXPECT_THROW(of_a.put(next(a), 7, 0), Error);
  a.sync();
  EXPECT_EQ(of_b[0], 7);
}

TEST(WorldTest, NumbersAreGivenBack) {
  World world;
  for (int i = 0; i < 300; ++i) {
    Array<int> array(world, 1);
    Queue<int> queue(world), other(world);
    Collectives<int> all(world);
    EXPECT_LT(array.slot(), 4U) << i;
    EXPECT_LT(queue.number(), 8U) << i;
    EXPECT_EQ(queue.size(), 0U) << "what was sent to the queue that had the number";
    EXPECT_EQ(all.reduce(1, std::plus<>()), world.nprocs());
    Queue<int> moved = std::move(queue);
    moved.send(next(world), i);
    if (i % 3 == 0) continue;  // the message is lost with its queue
    std::optional<Array<int>> second(std::in_place, world, 1);
    std::optional<Queue<int>> third(std::in_place, world);
    third->send(next(world), i);
    if (i % 3 == 1) {
      OpenSuperstep open = world.open();
      second.reset();  // counts for the superstep after the open one
      third.reset();
    } else {
      world.sync();
      EXPECT_EQ(third->size(), 1U);
    }
    EXPECT_EQ(moved.size(), 1U);
  }
}

TEST(Split, MakesWorldsOfEqualColor) {
  World world;
  World half = world.split(world.pid() % 2, -world.pid());
  const int size = (world.nprocs() + (world.pid() % 2 == 0 ? 1 : 0)) / 2;
  EXPECT_EQ(half.nprocs(), size);
  EXPECT_EQ(half.pid(), size - 1 - world.pid() / 2) << "descending keys reverse the order";
  Collectives<int> all(half);
  int expected = 0;
  for (int pid = world.pid() % 2; pid < world.nprocs(); pid += 2) expected += pid;
  EXPECT_EQ(all.reduce(world.pid(), std::plus<>()), expected);
  for (int i = 0; i < world.pid() % 2; ++i) half.sync();  // sub-worlds run at their own pace
  half.close();
  world.sync();
}

TEST(Open, CommunicationRunsWhileTheRankComputes) {
  World world;
  for (const std::size_t size : {1U, 3000U, 1000000U}) {
    Array<int> array(world, size);
    Registered<int> registered(world, array.local());
    const std::vector<int> data(size, world.pid());
    array.put(next(world), data, 0);
    double sum = 0.0;
    {
      OpenSuperstep open = world.open();
      for (int i = 0; i < 1000; ++i) {
        sum += i;
        open.poll();
      }
      EXPECT_THROW(world.sync(), Error) << "not while it is open";
      open.close();
    }
    EXPECT_EQ(sum, 499500.0);
    EXPECT_EQ(array[size - 1], previous(world));
  }
}

/// The open superstep comes first, with all its data, on ranks that opened it and on those that synchronize.
TEST(Open, EndsWithItsWorld) {
  for (const std::size_t staging : {std::size_t{0}, std::size_t{4} << 20}) {
    for (int way = 0; way < 3; ++way) {
      World other;
      std::optional<World> world(std::in_place, MPI_COMM_WORLD, WorldOptions{.staging_bytes = staging});
      Array<int> array(*world, 100000);
      const std::vector<int> data(100000, 1 + world->pid());
      const std::vector<int> expected(100000, 1 + previous(*world));
      array.put(next(*world), data, 0);
      std::unique_ptr<OpenSuperstep> open;
      if (world->pid() % 2 == 0) {
        open.reset(new OpenSuperstep(world->open()));
      } else {
        world->sync();
      }
      if (way == 0) world->close();
      if (way == 1) world.reset();
      if (way == 2) *world = std::move(other);
      EXPECT_TRUE(std::ranges::equal(array.local(), expected)) << staging << ' ' << way;
      if (!open) continue;
      EXPECT_TRUE(open->poll());
      EXPECT_NO_THROW(open->close());
    }
  }
}

/// A rank that opens its superstep meets ranks that just synchronize.
TEST(Open, MeetsSync) {
  World world;
  Array<int> array(world, 10);
  for (int round = 0; round < 10; ++round) {
    array.put(next(world), round + world.pid(), 3);
    if ((world.pid() + round) % 2 == 0) {
      OpenSuperstep open = world.open();
      open.poll();
    } else {
      world.sync();
    }
    EXPECT_EQ(array[3], round + previous(world));
  }
  EXPECT_EQ(world.superstep(), 10U);
}

TEST(Open, OtherThreadsComputeMeanwhile) {
  World world;
  Array<int> array(world, 500000);
  const std::vector<int> data(500000, 1 + world.pid());
  std::atomic<bool> stop = false;
  std::atomic<long> steps = 0;
  std::thread worker([&] {
    while (!stop) ++steps;
  });
  for (int round = 0; round < 5; ++round) {
    array.hpput(next(world), data, 0);
    OpenSuperstep open = world.open();
    while (!open.poll()) {
    }
    open.close();
  }
  stop = true;
  worker.join();
  EXPECT_EQ(array[499999], 1 + previous(world));
}

}  // namespace
