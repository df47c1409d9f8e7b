// Agreed errors where there are several worlds: a rank fails in one of them while the others are in another,
// or make one. That none of them hangs is what the time limit of this test is for.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <optional>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "agreed.hpp"
#include "bsp2/bsplib/collectives.hpp"
#include "bsp2/bsplib/memory.hpp"

namespace {

using namespace bsp2::bsplib;

WorldOptions small() { return {.staging_bytes = 4096}; }

TEST_F(Agreed, OthersMakeAWorldOfTheirOwn) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) throw std::runtime_error("before the new world");
        World own;
        own.sync();
      },
      Errc::exception, culprit, "before the new world");
}

TEST_F(Agreed, OthersMakeAWorldOfTheirOwnAndNobodySupervises) {
  const std::string seen = message_of_left_world(culprit, [] {
    World world;
    world.sync();
    if (world.pid() == last(world)) throw std::runtime_error("unsupervised");
    World own;
    own.sync();
  });
  EXPECT_FALSE(seen.empty());
  World fresh;
  fresh.sync();
}

TEST_F(Agreed, OthersMakeAWorldOfAPart) {
  const int wrong = ranks() > 2 ? 2 : 1;
  expect_agreed(
      [&](World& world) {
        MPI_Comm comm = MPI_COMM_NULL;
        MPI_Comm_split(MPI_COMM_WORLD, ranks() > 2 ? world.pid() % 2 : 0, 0, &comm);
        World part = world.split(ranks() > 2 ? world.pid() % 2 : 0);
        if (world.pid() == wrong) throw std::runtime_error("before the new world of the part");
        World own(comm);
        own.sync();
        world.sync();
      },
      Errc::exception, wrong, "before the new world of the part");
}

TEST_F(Agreed, MakingAWorldMeetsASync) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          World own;
        } else {
          world.sync();
        }
      },
      Errc::mixed_collectives, culprit, "Rank " + std::to_string(culprit) + " called World while rank");
}

TEST_F(Agreed, MakingAWorldMeetsTheEnd) {
  expect_agreed(
      [](World& world) {
        if (world.pid() == last(world)) {
          world.close();
        } else {
          World own;
        }
        world.sync();
      },
      Errc::ended_early, culprit, "called");
}

TEST(AgreedAlways, WrongCallIsToldWhereAWorldIsMade) {
  expect_agreed(
      [](World& world) {
        Array<int> array(world, 1);
        if (world.pid() == last(world)) {
          EXPECT_THROW(array.put(0, 1, 1), Error);
        }
        World own;
      },
      Errc::out_of_range, ranks() - 1, "put: Writes 4 bytes beyond");
}

TEST(SeveralWorlds, MakingOneLeavesTheSuperstepOfAnotherAlone) {
  World world;
  std::vector<int> one(1), other(1);
  std::optional<Registered<int>> registered;
  if (world.pid() == 0) registered.emplace(world, one);
  { World own; }
  if (world.pid() != 0) registered.emplace(world, one);
  world.sync();
  const int next = (world.pid() + 1) % world.nprocs();
  registered->put(next, 1 + world.pid(), 0);
  { World third; }
  world.sync();
  EXPECT_EQ(one[0], 1 + (world.pid() + world.nprocs() - 1) % world.nprocs());
  registered->put(next, 7, 0);
  OpenSuperstep open = world.open();
  World fourth;  // completes it
  EXPECT_EQ(one[0], 7);
  EXPECT_TRUE(open.poll());
  EXPECT_NO_THROW(open.close());
}

/// A part that lives on where the culprit throws, and the others are in it.
TEST_F(Agreed, OthersAreInAPartThatOutlivesTheThrow) {
  std::optional<World> part;
  expect_agreed(
      [&](World& world) {
        part.emplace(world.split(0));
        part->sync();
        if (world.pid() == last(world)) throw std::runtime_error("the part lives");
        part->sync();
      },
      Errc::exception, culprit, "the part lives");
  EXPECT_TRUE(part->failed());
  try {
    part->sync();
    ADD_FAILURE() << "its world around has ended";
  } catch (const Error& error) {
    EXPECT_EQ(error.culprit(), culprit);
    EXPECT_NE(std::string(error.what()).find("the part lives"), std::string::npos) << error.what();
  }
}

TEST_F(Agreed, OthersAreInAPartOfAPartThatOutlivesTheThrow) {
  std::optional<World> part, inner;
  expect_agreed(
      [&](World& world) {
        part.emplace(world.split(0, -world.pid()));
        inner.emplace(part->split(0, world.pid() % 2));
        if (world.pid() == last(world)) throw std::runtime_error("the parts live");
        Collectives<int> all(*inner);
        all.all_gather(1);
      },
      Errc::exception, culprit, "the parts live");
  EXPECT_TRUE(inner->failed());
}

TEST_F(Agreed, OthersAreInAPartThatOutlivesTheWorldAround) {
  std::optional<World> part;
  const std::string seen = message_of_left_world(culprit, [&] {
    World world;
    part.emplace(world.split(0));
    if (world.pid() == last(world)) throw std::runtime_error("unsupervised");
    part->sync();
  });
  EXPECT_FALSE(seen.empty());
  EXPECT_TRUE(part->failed());
  World fresh;
  fresh.sync();
}

TEST_F(Agreed, OthersAreInAnotherWorldThatOutlivesTheThrow) {
  World other;
  expect_agreed(
      [&](World& world) {
        if (world.pid() == last(world)) throw std::runtime_error("in the other world they wait");
        Array<int> array(other, 100);
        other.sync();
      },
      Errc::exception, culprit, "in the other world they wait");
  EXPECT_TRUE(other.failed()) << "there they heard it";
}

TEST(SeveralWorlds, OlderOneOutlivesTheErrorOfAnother) {
  World older;
  std::optional<World> younger;
  expect_agreed(
      [&](World& world) {
        younger.emplace();
        younger->sync();
        if (world.pid() == last(world)) throw std::runtime_error("only here");
        world.sync();
      },
      Errc::exception, ranks() - 1, "only here");
  Collectives<int> all(older);
  EXPECT_EQ(all.reduce(1, std::plus<>()), ranks());
  EXPECT_TRUE(younger->failed()) << "it was made within";
  EXPECT_THROW(younger->sync(), Error);
}

/// The culprit fails in a part, and waits there for the others, which are in the world around already.
TEST_F(Agreed, OthersAreAroundThePartInWhichTheCulpritFails) {
  expect_agreed(
      [](World& world) {
        World part = world.split(0, -world.pid());
        if (world.pid() == last(world)) part.fail("in the part");
        world.sync();
      },
      Errc::exception, culprit, "in the part");
}

/// Gets, so that the superstep that the culprit has opened needs the others, who opened it, too, and wait for
/// it elsewhere.
TEST_F(Agreed, OthersAreInAPartWhileASuperstepIsOpen) {
  for (const bool throws : {false, true})
    expect_agreed(
        [&](World& world) {
          World part = world.split(0);
          Array<int> array(world, 100000);
          std::vector<int> target(100000), landed(100000);
          Registered<int> registered(world, landed);
          world.sync();
          const int next = (world.pid() + 1) % world.nprocs();
          array.get(next, 0, target);
          registered.hpput(next, array.local(), 0);
          OpenSuperstep open = world.open();
          if (world.pid() == last(world)) {
            if (throws) throw std::runtime_error("while it is open");
            world.fail("while it is open");
          }
          part.sync();
        },
        Errc::exception, culprit, "while it is open");
}

/// One rank fails in a part instead of opening a superstep there, another around it, and the superstep that
/// it has opened outlives the throw. The text of the first is too long for the headers, so whoever hears of
/// it tells it on.
TEST_F(Agreed, TwoFailWhileASuperstepOfAPartIsOpen) {
  const int thrower = ranks() > 3 ? 1 : 0;  // one that passes texts on
  for (const std::size_t length : {200, 200000}) {
    std::optional<World> part;
    std::unique_ptr<OpenSuperstep> open;
    std::optional<Error> error;
    World world;
    try {
      supervise(world, [&](World& around) {
        part.emplace(around.split(0));
        if (around.pid() == last(around)) part->fail(std::string(length, 'x'));
        open.reset(new OpenSuperstep(part->open()));
        if (around.pid() == thrower) throw std::runtime_error("around the part");
        open->close();
      });
    } catch (const Error& e) {
      error = e;
    }
    ASSERT_TRUE(error.has_value()) << "rank " << world.pid() << " got no error";
    EXPECT_EQ(error->code(), Errc::exception) << error->what();
    EXPECT_TRUE(error->culprit() == thrower || error->culprit() == last(world)) << error->what();
    World fresh;
    Collectives<std::string> all(fresh);
    for (const std::string& other : all.all_gather(error->what())) EXPECT_EQ(other, error->what());
  }
}

/// The culprit catches the error of a part; the other ranks of the part carry it to the world around.
TEST_F(Agreed, CulpritThatCatchesTheErrorOfAPartIsNamedByItsNumberAround) {
  const int wrong = ranks() > 2 ? ranks() - 1 : 1;  // with 3 and 4 ranks the last one of a part of two
  const int color = ranks() > 2 ? wrong % 2 : 0;
  const auto program = [&](World& world) {
    World part =
        world.split(ranks() > 2 ? world.pid() % 2 : 0, -world.pid());  // numbered from its highest rank on
    Array<int> array(part, 1);
    try {
      if (world.pid() == wrong) array.put(0, 1, 5);
      part.sync();
    } catch (const Error&) {
      if (world.pid() != wrong) throw;
    }
    if (world.pid() == wrong) {
      EXPECT_THROW(part.sync(), Error);
    }
    for (int i = 0; world.pid() % 2 != color && i < 2; ++i) part.sync();
    world.sync();
  };
  std::string ranks_there = "0", ranks_here = std::to_string(wrong);
  for (int rank = wrong - 1, i = 1; rank >= 0; --rank) {
    if (ranks() > 2 && rank % 2 != color) continue;
    ranks_there += ", " + std::to_string(i++);
    ranks_here += ", " + std::to_string(rank);
  }
  expect_agreed(program, Errc::out_of_range, wrong,
                "put: Writes 20 bytes beyond registered range of 4 bytes at rank 0: 4 bytes at offset 20 "
                "[numbered as in a world "
                "whose ranks " +
                    ranks_there + " are " + ranks_here + " here] (rank " + std::to_string(wrong) +
                    ", superstep 0)");
}

/// The error that all agreed on in a part, without anybody's exception.
TEST_F(Agreed, CulpritOfAMismatchInAPart) {
  const int wrong = ranks() - 1;
  expect_agreed(
      [&](World& world) {
        World part = world.split(0, -world.pid());
        try {
          part.set_tagsize(world.pid() == wrong ? 8 : 4);
          part.sync();
        } catch (const Error& error) {
          // Of two ranks the lower one is believed, which is the higher one around.
          EXPECT_EQ(error.culprit(), ranks() == 2 ? 1 : 0);
          if (world.pid() == (ranks() == 2 ? 0 : wrong)) world.sync();
          throw;
        }
      },
      Errc::tag_mismatch, ranks() == 2 ? 0 : wrong, "Not all ranks announced the same tag size");
}

TEST(SeveralWorlds, WorldThatWasMovedFromNamesThisRank) {
  World world;
  World elsewhere = std::move(world);
  World assigned;
  assigned = std::move(elsewhere);
  for (World* gone : {&world, &elsewhere}) {  // NOLINT(bugprone-use-after-move): what is left of them
    try {
      gone->sync();
      ADD_FAILURE() << "it is not here any more";
    } catch (const Error& error) {
      EXPECT_EQ(error.culprit(), assigned.pid()) << error.what();
      EXPECT_TRUE(error.own());
    }
  }
}

/// A program over worlds that it makes, splits and ends, drawn from a seed: the same on all ranks. Some of
/// the worlds outlive it. One or two ranks throw somewhere in it.
class RandomWorlds {
 public:
  RandomWorlds(std::uint64_t seed, World& world) : random_(seed), world_(world), me_(world.pid()) {
    worlds_.push_back(&world);
    const int p = world.nprocs();
    for (int i = 0, n = draw(1, 2); i < n; ++i) culprits_.push_back({draw(0, p - 1), draw(0, 14)});
  }

  void run() {
    std::deque<World> local;
    for (int i = 0; i < 15; ++i) step(local, 0);
    world_.sync();  // ranks that did not need the others so far hear of them here
    throw std::runtime_error("nobody threw before the end");
  }

  bool is_culprit(int rank) const {
    return std::ranges::any_of(culprits_, [&](const Culprit& culprit) { return culprit.rank == rank; });
  }

 private:
  struct Culprit {
    int rank, step;
  };

  int draw(int from, int to) { return std::uniform_int_distribution(from, to)(random_); }

  void add(std::deque<World>& to, World world) {
    to.push_back(std::move(world));
    worlds_.push_back(&to.back());
  }

  void step(std::deque<World>& local, int depth) {
    for (const Culprit& culprit : culprits_)
      if (culprit.rank == me_ && culprit.step == steps_)
        throw std::runtime_error("thrown at step " + std::to_string(steps_));
    ++steps_;
    const std::size_t chosen = static_cast<std::size_t>(draw(0, static_cast<int>(worlds_.size()) - 1));
    World& world = *worlds_[chosen];
    auto& home = draw(0, 1) == 0 ? local : outliving_;
    const int next = (world.pid() + 1) % world.nprocs();
    switch (draw(0, 7)) {
      case 0:
        return world.sync();
      case 1:
        return add(home, World(MPI_COMM_WORLD, small()));
      case 2: {
        const int colors = draw(1, 2), backwards = draw(0, 1);
        return add(home, world.split(world.pid() % colors, backwards * -world.pid()));
      }
      case 3: {
        Array<int> array(world, 3000);
        array.put(next, me_, 5);
        return world.sync();
      }
      case 4: {
        Collectives<int> all(world);
        all.all_gather(me_);
        return;
      }
      case 5: {
        Array<int> array(world, 3000);
        std::vector<int> target(3000);
        array.get(next, 0, target);
        if (depth > 0) return world.sync();
        OpenSuperstep open = world.open();
        worlds_.erase(worlds_.begin() + static_cast<std::ptrdiff_t>(chosen));  // busy
        if (!worlds_.empty()) step(local, depth + 1);
        worlds_.push_back(&world);
        return open.close();
      }
      case 6: {
        if (depth > 2) return world.sync();
        return supervise(world, [&](World&) {
          std::deque<World> inner;
          step(inner, depth + 1);
          for (World& gone : inner) std::erase(worlds_, &gone);
        });
      }
      default:
        return world.sync();
    }
  }

  std::mt19937_64 random_;
  World& world_;
  int me_, steps_ = 0;
  std::vector<Culprit> culprits_;
  std::vector<World*> worlds_;
  std::deque<World> outliving_;
};

/// On each number of ranks others, so that there are more than a thousand in all.
constexpr std::uint64_t seeds = 300;

TEST(SeveralWorlds, RandomProgramsEndWithOneErrorOnAllRanks) {
  const std::uint64_t first = 1 + seeds * static_cast<std::uint64_t>(ranks() - 1);
  for (std::uint64_t seed = first; seed < first + seeds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::string seen;
    int culprit = -1;
    World world(MPI_COMM_WORLD, small());
    RandomWorlds program(seed, world);
    try {
      supervise(world, [&](World&) { program.run(); });
    } catch (const Error& error) {
      seen = error.what();
      culprit = error.culprit();
      EXPECT_EQ(error.code(), Errc::exception) << error.what();
    }
    EXPECT_TRUE(world.failed());
    EXPECT_TRUE(program.is_culprit(culprit) || seen.find("nobody threw") != std::string::npos) << seen;
    EXPECT_TRUE(seen.find("thr") != std::string::npos ||
                seen.find("left its world by an exception") != std::string::npos)
        << seen;
    World fresh(MPI_COMM_WORLD, small());
    Collectives<std::string> all(fresh);
    for (const std::string& other : all.all_gather(seen)) ASSERT_EQ(other, seen);
  }
}

}  // namespace
