#include "bsp2/geometry/support/parallel.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/support/threads.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

TEST(ForEachRange, CoversEveryNumberOnce) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const std::size_t count = random() % 300, grain = 1 + random() % 40;
    std::vector<int> seen(count);  // each touched by one thread only
    std::atomic<bool> too_long = false;
    for_each_range(count, grain, random() % 5, [&](std::size_t first, std::size_t end) {
      if (end - first > grain || first >= end) too_long = true;
      for (std::size_t i = first; i < end; ++i) ++seen[i];
    });
    EXPECT_FALSE(too_long);
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<std::ptrdiff_t>(count))
        << "grain " << grain;
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

TEST(OrderedPipeline, UsesEachItemOnceInOrderAndHoldsFew) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const std::size_t count = random() % 100;
    const unsigned threads = random() % 5;
    std::atomic<std::size_t> made = 0;
    std::size_t used = 0, most_held = 0;
    const auto make = [&](std::size_t i, std::size_t& item) {
      item = 3 * i + 1;
      ++made;
    };
    OrderedPipeline<std::size_t>::run(count, threads, make, [&](std::size_t item) {
      EXPECT_EQ(item, 3 * used + 1);
      most_held = std::max(most_held, made - used);
      ++used;
    });
    EXPECT_EQ(used, count);
    EXPECT_EQ(made, count);
    EXPECT_LE(most_held, std::max(1U, 2 * threads));
  }
}

TEST(OrderedPipeline, PassesOnWhatIsThrownWhereverThatIs) {
  for (const unsigned threads : {1U, 2U, 4U})
    for (std::size_t bad = 0; bad < 30; ++bad) {
      const auto throw_at = [&](std::size_t i) {
        if (i == bad) throw std::runtime_error("bad");
      };
      const auto make = [](std::size_t i, std::size_t& item) { item = i; };
      const auto bad_make = [&](std::size_t i, std::size_t& item) {
        throw_at(i);
        item = i;
      };
      EXPECT_THROW(OrderedPipeline<std::size_t>::run(30, threads, bad_make, [](std::size_t) {}),
                   std::runtime_error)
          << bad;
      EXPECT_THROW(OrderedPipeline<std::size_t>::run(30, threads, make, throw_at), std::runtime_error) << bad;
    }
}

#if !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)  // which need more address space than is left here

/// Room for one stack more, not for two.
void leave_room_for_one_thread() {
  constexpr std::size_t stack = std::size_t{64} << 20;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, stack);
  pthread_setattr_default_np(&attributes);
  std::size_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  const rlim_t most = pages * static_cast<std::size_t>(sysconf(_SC_PAGESIZE)) + stack + stack / 2;
  const rlimit limit{most, most};
  setrlimit(RLIMIT_AS, &limit);
  alarm(20);  // a test that waits for ever ends, too
}

/// 0 if a failing start is passed on, after one thread has begun.
template <typename Run>
[[noreturn]] void exit_after(const Run& run) {
  leave_room_for_one_thread();
  try {
    run();
  } catch (const std::system_error&) {
    std::exit(0);
  }
  std::exit(1);
}

TEST(OrderedPipeline, EndsWhereASecondThreadCannotBeStarted) {
  const auto run = [] {
    OrderedPipeline<std::size_t>::run(
        1000, 4, [](std::size_t i, std::size_t& item) { item = i; }, [](std::size_t) {});
  };
  EXPECT_EXIT(exit_after(run), testing::ExitedWithCode(0), "");
}

TEST(ForEachRange, EndsWhereASecondThreadCannotBeStarted) {
  EXPECT_EXIT(exit_after([] { for_each_range(1000, 1, 4, [](std::size_t, std::size_t) {}); }),
              testing::ExitedWithCode(0), "");
}

#endif

cpu_set_t allowed_processors() {
  cpu_set_t allowed;
  EXPECT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  return allowed;
}

TEST(Threads, MayGoWhereverTheProcessMayOnceTheyHaveBegun) {
  const cpu_set_t allowed = allowed_processors();
  for (const auto where : {Threads::Begin::here, Threads::Begin::elsewhere}) {
    std::atomic<int> ran = 0;
    Threads threads;
    for (int i = 0; i < 8; ++i)
      threads.start(
          [&] {
            const cpu_set_t own = allowed_processors();
            EXPECT_TRUE(CPU_EQUAL(&own, &allowed));
            ++ran;
          },
          where, i % 2 == 0 ? 0 : std::size_t{1} << 20);
    threads.join();
    EXPECT_EQ(ran, 8);
  }
}

TEST(Threads, RunWhereOnlyOneProcessorIsLeft) {
  Threads outer;  // so that the others keep theirs
  outer.start(
      [] {
        const cpu_set_t allowed = allowed_processors();
        cpu_set_t one;
        CPU_ZERO(&one);
        for (std::size_t i = 0; i < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++i)
          if (CPU_ISSET(i, &allowed)) CPU_SET(i, &one);
        ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
        std::atomic<int> ran = 0;
        Threads threads;
        threads.start([&] { ++ran; }, Threads::Begin::here);
        threads.start([&] { ++ran; }, Threads::Begin::elsewhere);
        threads.join();
        EXPECT_EQ(ran, 2);
      },
      Threads::Begin::elsewhere);
  outer.join();
}

TEST(Threads, AreWaitedForAndTheFirstFailureIsPassedOn) {
  std::atomic<int> ended = 0;
  Threads threads;
  for (int i = 0; i < 4; ++i)
    threads.start(
        [&ended, i] {
          ++ended;
          if (i > 0) throw std::runtime_error(std::to_string(i));
        },
        Threads::Begin::elsewhere);
  try {
    threads.join();
    ADD_FAILURE() << "nothing was thrown";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "1");
  }
  EXPECT_EQ(ended, 4);
  {
    Threads left;
    left.start([&] { ++ended; }, Threads::Begin::here);
  }
  EXPECT_EQ(ended, 5);
}

TEST(Threads, TellWhenTheSystemHasNoRoomForAStack) {
  Threads threads;
  EXPECT_THROW(threads.start([] {}, Threads::Begin::elsewhere, std::size_t{1} << 48), std::system_error);
  threads.join();
}

/// Occurrences of boxes and of prisms with many sides under random maps. Half of the maps are translates of
/// earlier ones, or mirrored.
struct Occurrences {
  HyperplaneTable<3> table{{-4, -4, -4}, {4, 4, 4}, 8};
  struct Place {
    Matrix<3> matrix;
    std::uint32_t covector;
  };
  std::vector<Covector<3>> covectors = unit_box<3>().covectors;
  std::vector<Place> places;  // of each occurrence

  explicit Occurrences(std::mt19937& random) {
    const std::array<double, 2> radius{1, 0.5}, z{0, 1};
    const auto prism = lathe(600, radius, z).covectors;
    const std::array<std::uint32_t, 2> first{0, static_cast<std::uint32_t>(covectors.size())};
    covectors.insert(covectors.end(), prism.begin(), prism.end());
    const std::array<std::uint32_t, 2> count{first[1], static_cast<std::uint32_t>(prism.size())};
    table.add_covectors(covectors);
    std::uniform_real_distribution<double> unit(-1, 1);
    std::vector<Matrix<3>> matrices;
    for (int k = 0; k < 300; ++k) {
      Matrix<3> matrix;
      for (auto& row : matrix)
        for (auto& entry : row) entry = unit(random);
      if (k > 0 && random() % 2 == 0) {
        const Matrix<3>& earlier = matrices[random() % matrices.size()];
        for (int i = 0; i < 3; ++i) std::copy_n(earlier[i].begin(), 3, matrix[i].begin());
        if (random() % 4 == 0) std::swap(matrix[0], matrix[1]);
      }
      matrices.push_back(matrix);
      const std::uint32_t map = table.add_map(matrix);
      const std::size_t kind = random() % 8 == 0 ? 1 : 0, left_out = random() % 3;
      for (std::uint32_t i = left_out; i < count[kind]; ++i) {
        table.add_occurrence(map, first[kind] + i);
        places.push_back({matrix, first[kind] + i});
      }
    }
  }
};

TEST(Merge, RoundsOnAnyNumberOfThreadsAsEachOccurrenceIsAlone) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  Occurrences occurrences(random);
  for (const double tolerance : {0.0, 1e-12}) {
    HyperplaneTable<3> one = occurrences.table, threaded = occurrences.table;
    const auto codes = one.merge(tolerance, 1);
    ASSERT_EQ(threaded.merge(tolerance, 4), codes);
    ASSERT_EQ(codes.size(), occurrences.places.size());
    std::size_t own = 0;
    for (std::size_t i = 0; i < codes.size(); ++i) {
      HyperplaneTable<3> alone({-4, -4, -4}, {4, 4, 4}, 8);
      const auto& [matrix, covector] = occurrences.places[i];
      if (one.source(codes[i].id())->covector != covector) continue;  // another one represents it
      const std::uint32_t map = alone.add_map(matrix);
      alone.add_occurrence(map, alone.add_covectors(std::span(&occurrences.covectors[covector], 1)));
      alone.merge(tolerance);
      const Hyperplane<3> a = alone.rounded(0);
      for (const Hyperplane<3>& b : {one.rounded(codes[i].id()), threaded.rounded(codes[i].id())})
        ASSERT_TRUE(a.normal == b.normal && a.offset == b.offset && a.error == b.error) << "occurrence " << i;
      ++own;
    }
    EXPECT_GT(own, one.size() - 1);
    EXPECT_GT(one.size(), codes.size() / 2);
  }
}

}  // namespace
}  // namespace bsp2::geometry
