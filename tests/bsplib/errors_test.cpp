// Agreed errors: whatever one rank does wrong, all ranks get the same Error from their next collective call.
// That none of them hangs is what the time limit of this test is for.
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/serialization/string.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "agreed.hpp"
#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/memory.hpp"

namespace {

using namespace bsp2::bsplib;

TEST(AgreedAlways, OutOfRangeAccessNamesCulpritAndSuperstep) {
  expect_agreed(
      [](World& world) {
        Array<int> array(world, 10);
        world.sync();
        world.sync();
        if (world.pid() == last(world)) array.put(0, 1, 10);
        world.sync();
      },
      Errc::out_of_range, ranks() - 1,
      "put: Writes 4 bytes beyond registered range of 40 bytes at rank 0: 4 bytes at offset 40 (rank " +
          std::to_string(ranks() - 1) + ", superstep 2)");
}

TEST(AgreedAlways, ErrorThatTheCulpritCaughtIsToldToTheOthersAllTheSame) {
  expect_agreed(
      [](World& world) {
        Array<int> array(world, 1);
        if (world.pid() == last(world)) {
          EXPECT_THROW(array.put(world.nprocs(), 1, 0), Error);
        }
        world.sync();
      },
      Errc::bad_argument, ranks() - 1, "does not exist");
}

TEST(AgreedAlways, ExceptionOfTheProgram) {
  expect_agreed(
      [](World& world) {
        world.sync();
        if (world.pid() == last(world)) throw std::runtime_error("the disk is full");
        for (;;) world.sync();
      },
      Errc::exception, ranks() - 1, "the disk is full (rank " + std::to_string(ranks() - 1) + ", superstep ");
}

TEST(AgreedAlways, LongTextArrivesWhole) {
  const std::string text(5000, 'x');
  expect_agreed([&](World& world) { world.fail(text); }, Errc::exception, 0, text);
}

TEST(AgreedAlways, RangeThatWrapsAround) {
  expect_agreed(
      [](World& world) {
        Array<char> array(world, 10);
        char c = 0;
        if (world.pid() == last(world)) world.put(0, &c, array.slot(), ~std::size_t{0}, 1);
        world.sync();
      },
      Errc::out_of_range, ranks() - 1, "beyond registered range");
}

TEST(AgreedAlways, IndexWhosePlaceInBytesWrapsAround) {
  for (const char* kind : {"put", "hpput", "get", "hpget"})
    expect_agreed(
        [&](World& world) {
          Array<double> array(world, 4);
          std::vector<double> one(1, 7.0);
          const std::size_t index = std::size_t{1} << 61U;  // times 8 is 0
          if (world.pid() == last(world)) {
            if (kind == std::string("put")) array.put(0, one[0], index);
            if (kind == std::string("hpput")) array.hpput(0, one, index);
            if (kind == std::string("get")) array.get(0, index, one[0]);
            if (kind == std::string("hpget")) array.hpget(0, index, one);
          }
          world.sync();
        },
        Errc::out_of_range, ranks() - 1,
        "index: Element 2305843009213693952 is beyond registered range of 4 elements at rank 0");
}

TEST(AgreedAlways, NegativeIndex) {
  expect_agreed(
      [](World& world) {
        Array<double> array(world, 4);
        if (world.pid() == last(world)) array.put(0, 7.0, static_cast<std::size_t>(-1));
        world.sync();
      },
      Errc::out_of_range, ranks() - 1, "Element 18446744073709551615 (or -1) is beyond");
}

TEST(AgreedAlways, PopOfARegistrationThatDoesNotExist) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) world.pop_slot(1000000);
        world.sync();
      },
      Errc::not_registered, ranks() - 1, "pop_reg: There is no registration 1000000");
}

TEST(AgreedAlways, FailInAnOpenSuperstep) {
  expect_agreed(
      [](World& world) {
        const std::vector<char> data(1000000, 'x');
        std::vector<char> target(data.size());
        Registered<char> shared(world, target);
        world.sync();
        shared.hpput((world.pid() + 1) % world.nprocs(), data, 0);
        OpenSuperstep open = world.open();
        if (world.pid() == last(world)) world.fail("while it is open");
        open.close();
        EXPECT_EQ(target, data) << "the superstep that was open is complete";
        world.sync();
      },
      Errc::exception, ranks() - 1, "while it is open");
}

TEST(AgreedAlways, LoopThatRunsTooFar) {
  for (const char* kind : {"put", "hpput", "get", "hpget"})
    expect_agreed(
        [&](World& world) {
          Array<int> array(world, 10);
          std::vector<int> mine(12);
          for (std::size_t i = 0; world.pid() == last(world) && i < mine.size(); ++i) {
            const std::span<int> one(&mine[i], 1);
            if (kind == std::string("put")) array.put(0, mine[i], i);
            if (kind == std::string("hpput")) array.hpput(0, one, i);
            if (kind == std::string("get")) array.get(0, i, one);
            if (kind == std::string("hpget")) array.hpget(0, i, one);
          }
          world.sync();
        },
        Errc::out_of_range, ranks() - 1, " 4 bytes beyond registered range of 40 bytes");
}

TEST(AgreedAlways, MemoryThatNoMachineHas) {
  expect_agreed(
      [](World& world) {
        Array<double> array(world, world.pid() == last(world) ? std::size_t{1} << 50U : 5);
        world.sync();
      },
      Errc::resource, ranks() - 1, "No memory for 9007199254740992 bytes");
}

TEST(SharedMemoryTest, StagingLargerThanTheMachineIsReplacedByMessages) {
  for (const std::size_t bytes : {std::size_t{1} << 45U, std::size_t{1} << 63U, ~std::size_t{0}}) {
    World world(MPI_COMM_WORLD, {.staging_bytes = bytes});
    const std::vector<char> data(100000, 'x');
    Array<char> array(world, data.size());
    array.put((world.pid() + 1) % world.nprocs(), data, 0);
    world.sync();
    EXPECT_TRUE(std::ranges::equal(array.local(), data));
  }
}

TEST_F(Agreed, SomeRanksRegister) {
  expect_agreed(
      [](World& world) {
        int x = 0;
        if (world.pid() != last(world)) world.push_reg(&x, sizeof x);
        world.sync();
      },
      Errc::registration_mismatch, culprit, "Not all ranks registered the same number");
}

TEST_F(Agreed, SomeRanksPop) {
  expect_agreed(
      [](World& world) {
        int x = 0;
        world.push_reg(&x, sizeof x);
        world.sync();
        if (world.pid() == last(world)) world.pop_reg(&x);
        world.sync();
      },
      Errc::registration_mismatch, culprit, "Not all ranks popped the same number");
}

TEST_F(Agreed, RanksPopDifferentMemory) {
  expect_agreed(
      [](World& world) {
        int x = 0, y = 0;
        world.push_reg(&x, sizeof x);
        world.push_reg(&y, sizeof y);
        world.sync();
        world.pop_reg(world.pid() == last(world) ? &x : &y);
        world.sync();
      },
      Errc::registration_mismatch, culprit, "did not pop the same memory registration");
}

TEST_F(Agreed, TagSizesDiffer) {
  expect_agreed(
      [](World& world) {
        world.set_tagsize(world.pid() == last(world) ? 8 : 4);
        world.sync();
      },
      Errc::tag_mismatch, culprit, "Not all ranks announced the same tag size");
}

TEST_F(Agreed, SomeRanksMakeAQueue) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) Queue<int> queue(world);
        world.sync();
      },
      Errc::mixed_collectives, culprit, "queues");
}

TEST_F(Agreed, SomeRanksCloseAQueue) {
  expect_agreed(
      [](World& world) {
        std::optional<Queue<int>> queue(std::in_place, world);
        world.sync();
        if (world.pid() == last(world)) queue.reset();
        world.sync();
      },
      Errc::mixed_collectives, culprit, "Not all ranks have the same number of queues");
}

TEST_F(Agreed, RanksCloseDifferentQueues) {
  expect_agreed(
      [](World& world) {
        std::optional<Queue<int>> one(std::in_place, world), other(std::in_place, world);
        world.sync();
        (world.pid() == last(world) ? one : other).reset();
        world.sync();
      },
      Errc::mixed_collectives, culprit, "gave them back alike");
}

TEST(AgreedAlways, QueueThatWasClosed) {
  expect_agreed(
      [](World& world) {
        const std::uint32_t queue = world.new_queue();
        world.close_queue(queue);
        if (world.pid() == last(world)) world.close_queue(queue);
        world.sync();
      },
      Errc::bad_argument, ranks() - 1, "close_queue: There is no such queue");
}

TEST_F(Agreed, SomeRanksEndEarly) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) world.close();
        world.sync();
      },
      Errc::ended_early, culprit, "left the world, while others synchronize");
}

TEST_F(Agreed, SomeRanksReturnFromTheProgram) {
  World world;
  std::optional<Error> error;
  try {
    supervise(world, [](World& w) {
      if (w.pid() != last(w)) w.sync();
    });
    world.close();
  } catch (const Error& e) {
    error = e;
  }
  ASSERT_TRUE(error.has_value());
  EXPECT_EQ(error->code(), Errc::ended_early);
  EXPECT_EQ(error->culprit(), culprit);
}

TEST_F(Agreed, RanksCallDifferentCollectives) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          Array<int> array(world, 100);
        } else {
          world.sync();
        }
      },
      Errc::mixed_collectives, culprit, "called allocate");
}

TEST_F(Agreed, SomeRanksSplit) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          World part = world.split(0);
        } else {
          Array<int> array(world, 100);
        }
      },
      Errc::mixed_collectives, culprit, "called split");
}

TEST_F(Agreed, FailureReachesRanksInAnOpenSuperstep) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) throw std::runtime_error("out of luck");
        OpenSuperstep open = world.open();
        for (int i = 0; i < 10; ++i) open.poll();
        open.close();
      },
      Errc::exception, culprit, "out of luck");
}

TEST_F(Agreed, ExceptionInAnOpenSuperstepIsTold) {
  expect_agreed(
      [](World& world) {
        OpenSuperstep open = world.open();
        if (world.pid() == last(world)) throw std::runtime_error("between open and close");
        open.close();
        world.sync();
      },
      Errc::exception, culprit, "between open and close");
}

TEST_F(Agreed, FailureInASubWorldEndsTheWhole) {
  expect_agreed(
      [](World& world) {
        World part = world.split(world.pid() % 2);
        Array<int> array(part, 1);
        part.sync();
        if (world.pid() == last(world)) throw std::runtime_error("only in a part");
        part.sync();
        part.sync();
        world.sync();
      },
      Errc::exception, culprit,
      "exception: only in a part (rank " + std::to_string(culprit) + ", superstep 0)");
}

TEST_F(Agreed, FailureInASubWorldKeepsItsCodeAndNamesItsCulpritHere) {
  const int wrong = ranks() == 2 ? 0 : 2;  // in a world of two parts rank 1 of part 0
  expect_agreed(
      [&](World& world) {
        World part = world.split(world.pid() % 2);
        Array<int> array(part, 1);
        part.sync();
        if (world.pid() == wrong) array.put(0, 1, 5);
        for (int i = 0; i < 2; ++i) part.sync();
        world.sync();
      },
      Errc::out_of_range, wrong,
      std::string("put: Writes 20 bytes beyond registered range of 4 bytes at rank 0: 4 bytes at offset 20") +
          (ranks() == 2 ? "" : " [numbered as in a world whose ranks 0, 1 are 0, 2 here]") + " (rank " +
          std::to_string(wrong) + ", superstep 0)");
}

TEST_F(Agreed, ErrorHasOnePlaceOnly) {
  expect_agreed(
      [](World& world) {
        OpenSuperstep open = world.open();
        if (world.pid() == last(world)) world.push_reg(nullptr, 0);
        open.close();
        world.sync();
      },
      Errc::misuse, culprit,
      "push_reg: Not allowed while a superstep is open (rank " + std::to_string(culprit) + ", superstep 1)");
}

TEST_F(Agreed, CollectivesWithDifferentRoots) {
  const std::string text = "Rank " + std::to_string(ranks() > 2 ? 0 : 1) + " called ";
  expect_agreed(
      [](World& world) {
        Collectives<int> all(world);
        all.gather(1, world.pid() == 0 ? 0 : 1);
      },
      Errc::mixed_collectives, ranks() > 2 ? 0 : 1, text + "gather with root");
  expect_agreed(
      [](World& world) {
        Collectives<int> all(world);
        all.broadcast(1, world.pid() == 0 ? 0 : 1);
      },
      Errc::mixed_collectives, ranks() > 2 ? 0 : 1, text + "broadcast with root");
  std::vector<double> data(10);
  expect_agreed([&](World& world) { broadcast(world, std::span(data), world.pid() == 0 ? 0 : 1); },
                Errc::mixed_collectives, ranks() > 2 ? 0 : 1, text + "broadcast with root");
}

TEST_F(Agreed, DifferentCollectives) {
  using All = Collectives<int>;
  const std::vector<std::pair<std::string, std::function<void(World&, All&)>>> calls{
      {"sync alone", [](World& world, All&) { world.sync(); }},
      {"broadcast with root 0", [](World&, All& all) { all.broadcast(1, 0); }},
      {"gather with root 0", [](World&, All& all) { all.gather(1, 0); }},
      {"all_gather", [](World&, All& all) { all.all_gather(1); }},
      {"reduce", [](World&, All& all) { all.reduce(1, std::plus<>()); }},
      {"scan", [](World&, All& all) { all.scan(1, std::plus<>()); }},
      {"all_to_all", [](World& world, All& all) {
         all.all_to_all(std::vector<int>(static_cast<std::size_t>(world.nprocs())));
       }}};
  for (std::size_t i = 0; i < calls.size(); ++i) {
    const std::size_t next = (i + 1) % calls.size();
    expect_agreed(
        [&](World& world) {
          All all(world);
          calls[world.pid() == last(world) ? next : i].second(world, all);
        },
        Errc::mixed_collectives, culprit, "Rank " + std::to_string(culprit) + " called " + calls[next].first);
  }
  expect_agreed(
      [](World& world) {
        All first(world), second(world);
        (world.pid() == last(world) ? second : first).all_gather(1);
      },
      Errc::mixed_collectives, culprit, "called all_gather (queue 2)");
}

TEST_F(Agreed, VectorsOfDifferentSizesAreNotBroadcast) {
  std::vector<double> data(ranks() == 1 ? 1 : 10);
  expect_agreed(
      [&](World& world) { broadcast(world, std::span(data).first(world.pid() == last(world) ? 9 : 10), 0); },
      Errc::exception, 0, "broadcast: rank " + std::to_string(culprit) + " has 9 elements, the root 10");
}

TEST_F(Agreed, QueuesAndArraysOfDifferentTypes) {
  const std::string text = "Not all ranks made their queues and arrays of the same types";
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          Queue<double> queue(world);
          world.sync();
        } else {
          Queue<std::string> queue(world);
          world.sync();
        }
      },
      Errc::mixed_collectives, culprit, text);
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          Array<double> array(world, 8);
        } else {
          Array<float> array(world, 16);
        }
      },
      Errc::mixed_collectives, culprit, text);
  expect_agreed(
      [](World& world) {
        std::vector<int> ints(8);
        std::vector<unsigned> naturals(8);
        if (world.pid() == last(world)) {
          Registered<int> shared(world, ints);
          world.sync();
        } else {
          Registered<unsigned> shared(world, naturals);
          world.sync();
        }
      },
      Errc::mixed_collectives, culprit, text);
}

/// The exception leaves a sub-world, too, and the others are not there but in the world around it.
TEST_F(Agreed, SubWorldIsLeftWhileTheOthersWaitInTheWholeWorld) {
  expect_agreed(
      [](World& world) {
        World part = world.split(0), independent;
        Array<int> array(part, 1);
        if (world.pid() == last(world)) throw std::runtime_error("not in the part");
        world.sync();
      },
      Errc::exception, culprit, "not in the part");
}

TEST_F(Agreed, WorldThatIsLeftTellsWhichCallWasWrong) {
  std::string seen;
  try {
    World world;
    Array<int> array(world, 10);
    if (world.pid() == last(world)) array.put(0, 1, 10);
    world.sync();
  } catch (const Error& error) {
    seen = error.what();
  }
  EXPECT_EQ(seen,
            "put: Writes 4 bytes beyond registered range of 40 bytes at rank 0: 4 bytes at offset 40 (rank " +
                std::to_string(culprit) + ", superstep 0)");
}

/// A world that is left by an exception nobody supervises: the others must not wait for it.
TEST_F(Agreed, WorldLeftByAnException) {
  const std::string seen = message_of_left_world(culprit, [] {
    World world;
    world.sync();
    if (world.pid() == last(world)) throw std::runtime_error("unsupervised");
    world.sync();
  });
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  EXPECT_NE(seen.find(rank == culprit ? "unsupervised" : "left its world by an exception"), std::string::npos)
      << seen;
}

/// The superstep that is open then is completed first: the others count on it.
TEST_F(Agreed, WorldLeftByAnExceptionWithAnOpenSuperstep) {
  std::unique_ptr<OpenSuperstep> open;
  std::vector<int> memory(30000);
  const std::string seen = message_of_left_world(culprit, [&] {
    World world;
    Registered<int> registered(world, memory);
    world.sync();
    registered.put(0, std::vector<int>(memory.size(), 5), 0);
    if (world.pid() == last(world)) {
      open.reset(new OpenSuperstep(world.open()));
      throw std::runtime_error("unsupervised");
    }
    world.sync();
    if (world.pid() == 0) {
      EXPECT_EQ(memory, std::vector<int>(memory.size(), 5));
    }
    world.sync();
  });
  EXPECT_NE(seen.find(open ? "unsupervised" : "left its world by an exception"), std::string::npos) << seen;
  if (open) {
    EXPECT_TRUE(open->poll());
    EXPECT_THROW(open->close(), Error);
  }
}

}  // namespace
