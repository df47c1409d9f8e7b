// put, get, hpput and hpget of the typed interface, of all sizes, on both kinds of memory.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <complex>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include "bsp2/bsplib/memory.hpp"
#include "neighbours.hpp"

namespace {

using namespace bsp2::bsplib;

struct Point {
  double x, y;
  std::int32_t id;
  bool operator==(const Point&) const = default;
};

/// A message of this size takes another path through the layer: slot, staging, message, direct.
class Access : public testing::TestWithParam<std::tuple<std::size_t, std::size_t>> {
 protected:
  std::size_t size() const { return std::get<0>(GetParam()); }
  World world{MPI_COMM_WORLD, WorldOptions{.staging_bytes = std::get<1>(GetParam())}};

  std::vector<std::uint32_t> values(int pid) const {
    std::vector<std::uint32_t> v(size());
    std::iota(v.begin(), v.end(), 1000000U * static_cast<std::uint32_t>(pid + 1));
    return v;
  }
};

TEST_P(Access, PutArrivesAndReadsItsSourceAtTheCall) {
  std::vector<std::uint32_t> target(size() + 2, 7);
  Registered<std::uint32_t> shared(world, target);
  world.sync();
  auto source = values(world.pid());
  shared.put(next(world), source, 1);
  source.assign(size(), 0);
  world.sync();
  auto expected = values(previous(world));
  expected.insert(expected.begin(), 7);
  expected.push_back(7);
  EXPECT_EQ(target, expected);
}

TEST_P(Access, UnbufferedPutArrivesInMemoryOfTheProgramAndOfTheLayer) {
  std::vector<std::uint32_t> target(size());
  Registered<std::uint32_t> registered(world, target);
  Array<std::uint32_t> array(world, size());
  world.sync();
  const auto source = values(world.pid());
  registered.hpput(next(world), source, 0);
  array.hpput(next(world), source, 0);
  world.sync();
  EXPECT_EQ(target, values(previous(world)));
  EXPECT_TRUE(std::equal(array.begin(), array.end(), target.begin(), target.end()));
}

TEST_P(Access, LoopsOfAllKindsOverNeighboursMix) {
  std::vector<std::uint32_t> to_put(size()), to_hpput(size()), read = values(world.pid());
  std::vector<std::uint32_t> got(size()), hpgot(size());
  Registered<std::uint32_t> put(world, to_put), hpput(world, to_hpput), source(world, read);
  world.sync();
  const auto mine = values(world.pid());
  for (std::size_t i = 0; i < size(); ++i) {
    if (i % 1000 == 999) continue;  // a gap now and then
    put.put(next(world), mine[i], i);
    hpput.hpput(next(world), std::span(mine).subspan(i, 1), i);
    source.get(next(world), i, got[i]);
    source.hpget(next(world), i, std::span(hpgot).subspan(i, 1));
  }
  world.sync();
  const auto previous_values = values(previous(world)), next_values = values(next(world));
  for (std::size_t i = 0; i < size(); ++i) {
    const bool gap = i % 1000 == 999;
    const std::uint32_t from_previous = gap ? 0 : previous_values[i], from_next = gap ? 0 : next_values[i];
    ASSERT_EQ(to_put[i], from_previous) << i;
    ASSERT_EQ(to_hpput[i], from_previous) << i;
    ASSERT_EQ(got[i], from_next) << i;
    ASSERT_EQ(hpgot[i], from_next) << i;
  }
}

/// Runs grow as long as the memory: they change their way through the layer while they do.
TEST_P(Access, LoopsWithoutGapsArrive) {
  std::vector<std::uint32_t> to_put(size()), to_hpput(size()), read = values(world.pid());
  std::vector<std::uint32_t> got(size()), hpgot(size());
  Registered<std::uint32_t> put(world, to_put), hpput(world, to_hpput), source(world, read);
  Array<std::uint32_t> array(world, size());
  world.sync();
  const auto mine = values(world.pid());
  for (std::size_t i = 0; i < size(); ++i) put.put(next(world), mine[i], i);
  for (std::size_t i = 0; i < size(); ++i) hpput.hpput(next(world), std::span(mine).subspan(i, 1), i);
  for (std::size_t i = 0; i < size(); ++i) array.hpput(next(world), std::span(mine).subspan(i, 1), i);
  for (std::size_t i = 0; i < size(); ++i) source.get(next(world), i, got[i]);
  for (std::size_t i = 0; i < size(); ++i) source.hpget(next(world), i, std::span(hpgot).subspan(i, 1));
  world.sync();
  EXPECT_EQ(to_put, values(previous(world)));
  EXPECT_EQ(to_hpput, values(previous(world)));
  EXPECT_TRUE(std::equal(array.begin(), array.end(), to_put.begin(), to_put.end()));
  EXPECT_EQ(got, values(next(world)));
  EXPECT_EQ(hpgot, values(next(world)));
}

TEST_P(Access, GetsReadBeforePutsWrite) {
  Array<std::uint32_t> array(world, size());
  const auto mine = values(world.pid());
  std::copy(mine.begin(), mine.end(), array.begin());
  std::vector<std::uint32_t> got(size()), fresh(size(), 5);
  array.get(next(world), 0, got);
  array.put(next(world), fresh, 0);
  world.sync();
  EXPECT_EQ(got, values(next(world)));
  EXPECT_TRUE(std::equal(array.begin(), array.end(), fresh.begin(), fresh.end()));
}

TEST_P(Access, UnbufferedGetArrives) {
  auto mine = values(world.pid());
  Registered<std::uint32_t> shared(world, mine);
  world.sync();
  std::vector<std::uint32_t> got(size());
  shared.hpget(previous(world), 0, got);
  world.sync();
  EXPECT_EQ(got, values(previous(world)));
}

/// The others read while the owner is in its sync: what it writes right after is not seen.
TEST_P(Access, UnbufferedGetsReadTheLayersMemoryInTime) {
  Array<std::uint32_t> array(world, size());
  std::vector<std::uint32_t> got(size()), expected(size());
  for (std::uint32_t round = 0; round < 10; ++round) {
    std::fill(array.begin(), array.end(), 100 * round + static_cast<std::uint32_t>(world.pid()));
    // In one access, or in several that do not continue each other.
    const std::size_t piece = round % 2 == 0 ? size() : 2000;
    for (std::size_t end = size(); end > 0; end -= std::min(piece, end)) {
      const std::size_t begin = end - std::min(piece, end);
      array.hpget(previous(world), begin, std::span(got).subspan(begin, end - begin));
    }
    world.sync();
    std::fill(array.begin(), array.end(), 77777);
    std::fill(expected.begin(), expected.end(), 100 * round + static_cast<std::uint32_t>(previous(world)));
    ASSERT_EQ(got, expected);
    world.sync();
  }
}

/// All ranks put to overlapping places of rank 0: the result is as if they had done so one after the other.
TEST_P(Access, OverlappingPutsHaveTheResultOfTheirOrder) {
  const auto p = static_cast<std::size_t>(world.nprocs());
  const std::size_t half = (size() + 1) / 2;
  Array<std::uint32_t> array(world, size() + p * half);
  array.put(0, values(world.pid()), static_cast<std::size_t>(world.pid()) * half);
  world.sync();
  if (world.pid() != 0) return;
  std::vector<std::uint32_t> expected(array.size());
  for (std::size_t pid = 0; pid < p; ++pid) {
    const auto v = values(static_cast<int>(pid));
    std::copy(v.begin(), v.end(), expected.begin() + static_cast<std::ptrdiff_t>(pid * half));
  }
  EXPECT_TRUE(std::equal(array.begin(), array.end(), expected.begin(), expected.end()));
}

constexpr std::size_t staging = std::size_t{4} << 20;
INSTANTIATE_TEST_SUITE_P(Sizes, Access,
                         testing::Combine(testing::Values(1, 20, 1000, 5000, 40000, 600000),
                                          testing::Values(std::size_t{0}, std::size_t{65536}, staging)));

TEST(ArrayTest, TakesAnyTriviallyCopyableType) {
  World world;
  Array<Point> points(world, 2);
  Array<std::complex<double>> numbers(world, 1);
  points.put(next(world), Point{1.0, 2.0, world.pid()}, 1);
  numbers.put(next(world), {0.5, static_cast<double>(world.pid())}, 0);
  world.sync();
  EXPECT_EQ(points[1], (Point{1.0, 2.0, previous(world)}));
  EXPECT_EQ(points[0], (Point{0.0, 0.0, 0}));
  EXPECT_EQ(numbers[0].imag(), previous(world));
}

struct alignas(64) Line {
  double x[8];
};

TEST(ArrayTest, MemoryIsAlignedWhateverTheSizes) {
  for (const std::size_t bytes : {std::size_t{0}, staging}) {
    World world(MPI_COMM_WORLD, WorldOptions{.staging_bytes = bytes});
    Array<char> odd(world, 101 + 7 * static_cast<std::size_t>(world.pid()));
    Array<Line> lines(world, 2);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(odd.begin()) % World::memory_alignment, 0U);
    EXPECT_EQ(reinterpret_cast<std::uintptr_t>(lines.begin()) % alignof(Line), 0U);
    const std::vector<Line> sent(2, Line{{1.0 + world.pid()}});
    const std::vector<char> text(101, 'x');
    lines.hpput(next(world), sent, 0);
    odd.hpput(next(world), text, 0);
    world.sync();
    EXPECT_EQ(lines[1].x[0], 1.0 + previous(world));
    EXPECT_TRUE(std::equal(text.begin(), text.end(), odd.begin()));
  }
}

/// Distances within a page where copies go in pieces, and those around them: nothing is lost between pieces.
TEST(ArrayTest, CopiesOfAllDistancesArrive) {
  constexpr std::size_t page = 4096, most = 70000;
  std::vector<char> memory(most + 2 * page);
  const std::size_t begin = page - reinterpret_cast<std::uintptr_t>(memory.data()) % page + 16;
  const std::span<char> local = std::span(memory).subspan(begin, most);
  for (const std::size_t bytes : {std::size_t{0}, staging}) {
    World world(MPI_COMM_WORLD, WorldOptions{.staging_bytes = bytes});
    Array<char> put(world, most + 2 * page), hpput(world, most + 2 * page);
    for (std::size_t at = 4010; at < 4085; at += 5) {
      const std::size_t size = std::array{2100U, 5000U, 70000U}[at / 5 % 3];
      const std::span<char> mine = local.first(size);
      const auto value = [&](int pid, std::size_t i) {
        return static_cast<char>(i + i / 1000 + at + 50U * static_cast<unsigned>(pid));
      };
      for (std::size_t i = 0; i < size; ++i) mine[i] = value(world.pid(), i);
      std::ranges::fill(put.local(), 'p');
      std::ranges::fill(hpput.local(), 'p');
      world.sync();
      put.put(next(world), mine, at);
      hpput.hpput(next(world), mine, at);
      world.sync();
      std::vector<char> expected(put.size(), 'p');
      for (std::size_t i = 0; i < size; ++i) expected[at + i] = value(previous(world), i);
      ASSERT_TRUE(std::ranges::equal(put.local(), expected)) << at << ' ' << bytes;
      ASSERT_TRUE(std::ranges::equal(hpput.local(), expected)) << at << ' ' << bytes;
      std::ranges::fill(mine, 'g');
      hpput.hpget(next(world), at, mine);
      world.sync();
      for (std::size_t i = 0; i < size; ++i) ASSERT_EQ(mine[i], value(world.pid(), i)) << at << ' ' << bytes;
    }
  }
}

/// Nor where a run goes on, though they have no address.
TEST(ArrayTest, EmptyAccessesDoNothing) {
  World world;
  Array<int> array(world, 20), source(world, 20);
  std::ranges::fill(source.local(), 7);
  world.sync();
  const std::vector<int> data(10, 5);
  std::vector<int> got(10);
  for (int i = 0; i < 3; ++i) {
    array.hpput(next(world), std::span(data).subspan(static_cast<std::size_t>(i), 1),
                static_cast<std::size_t>(i));
    array.hpput(next(world), std::span<const int>(), static_cast<std::size_t>(i) + 1);
    source.hpget(next(world), static_cast<std::size_t>(i),
                 std::span(got).subspan(static_cast<std::size_t>(i), 1));
    source.hpget(next(world), static_cast<std::size_t>(i) + 1, std::span<int>());
    source.get(next(world), static_cast<std::size_t>(i) + 1, std::span<int>());
  }
  world.sync();
  std::vector<int> expected(20);
  std::fill_n(expected.begin(), 3, 5);
  EXPECT_TRUE(std::ranges::equal(array.local(), expected));
  EXPECT_EQ(std::count(got.begin(), got.end(), 7), 3);
}

TEST(ArrayTest, PartsMayDifferInSizeAndMayBeEmpty) {
  World world;
  Array<int> array(world, static_cast<std::size_t>(world.pid()));
  for (int pid = 0; pid < world.nprocs(); ++pid) {
    EXPECT_EQ(array.size(pid), static_cast<std::size_t>(pid));
    if (pid > 0) array.put(pid, 10 * pid, static_cast<std::size_t>(pid) - 1);
  }
  world.sync();
  if (world.pid() > 0) {
    EXPECT_EQ(array[array.size() - 1], 10 * world.pid());
  }
}

TEST(ArrayTest, LivesUntilTheSyncAfterItsDestruction) {
  World world;
  std::vector<int> got(1000);
  {
    Array<int> array(world, got.size());
    std::fill(array.begin(), array.end(), world.pid());
    array.get(next(world), 0, got);
  }
  world.sync();
  EXPECT_EQ(got, std::vector<int>(1000, next(world)));
}

TEST(ArrayTest, ManySmallPutsMergeIntoFewMessages) {
  World world;
  Array<double> array(world, 1000);
  for (std::size_t i = 0; i < 1000; ++i) array.put(next(world), static_cast<double>(i), i);
  world.sync();
  for (std::size_t i = 0; i < 1000; ++i) ASSERT_EQ(array[i], static_cast<double>(i));
  EXPECT_EQ(world.costs().recent.back().messages_out, world.nprocs() > 1 ? 1U : 0U);
}

TEST(ArrayTest, MixedSizesInOneSuperstepKeepTheirOrder) {
  World world;
  Array<char> array(world, 200000);
  const std::vector<char> big(150000, 'b'), medium(30000, 'm'), small(100, 's');
  array.put(next(world), big, 0);
  array.put(next(world), small, 149950);  // over the end of the big one
  array.put(next(world), medium, 149980);
  array.put(next(world), small, 10);
  world.sync();
  EXPECT_EQ(array[0], 'b');
  EXPECT_EQ(array[10], 's');
  EXPECT_EQ(array[149949], 'b');
  EXPECT_EQ(array[149979], 's');
  EXPECT_EQ(array[149980], 'm');
  EXPECT_EQ(array[179979], 'm');
  EXPECT_EQ(array[179980], 0);
}

}  // namespace
