// Sums that do not depend on their order, and the memory of cells.

#include "bsp2/geometry/cells/measures.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <thread>

#include "bsp2/geometry/cells/block.hpp"
#include "geometry/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

TEST(MomentSum, DependsNeitherOnOrderNorOnGrouping) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(50); ++round) {
    const double radius = std::pow(10.0, uniform(random, -10, 10));
    std::vector<Moments<3>> all(500);
    std::array<long double, Moments<3>::size> expected{};
    for (Moments<3>& m : all)
      for (int i = 0; i < Moments<3>::size; ++i) {
        const int degree = i == 0 ? 0 : i <= 3 ? 1 : 2;
        m.integral[i] = uniform(random, i == 0 ? 0 : -1, 1) * std::pow(radius, 3 + degree) *
                        std::pow(10.0, -pick(random, 3, 14));
        expected[i] += m.integral[i];
      }
    MomentSum<3> plain(radius);
    for (const Moments<3>& m : all) plain.add(m);
    for (int i = 0; i < Moments<3>::size; ++i) {
      const int degree = i == 0 ? 0 : i <= 3 ? 1 : 2;
      ASSERT_NEAR(plain.value().integral[i], static_cast<double>(expected[i]),
                  1e-15 * std::pow(radius, 3 + degree));
    }
    for (int again = 0; again < 5; ++again) {
      std::shuffle(all.begin(), all.end(), random);
      std::vector<MomentSum<3>> groups(static_cast<std::size_t>(pick(random, 1, 7)), MomentSum<3>(radius));
      for (const Moments<3>& m : all)
        groups[static_cast<std::size_t>(pick(random, 0, static_cast<int>(groups.size()) - 1))].add(m);
      MomentSum<3> total(radius);
      for (const auto& group : groups) total += group;
      ASSERT_EQ(total.value().integral, plain.value().integral);
    }
  }
}

/// value * 2^-exponent as an integer, halves to the even one.
mp::cpp_int rounded(double value, int exponent) {
  int power = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(value, &power), 53));
  const int shift = power - 53 - exponent;
  if (shift >= 0) return mp::cpp_int(mantissa) << shift;
  const mp::cpp_int unit = mp::cpp_int(1) << -shift, size = std::abs(mantissa);
  mp::cpp_int whole = size / unit;
  const mp::cpp_int twice = 2 * (size - whole * unit);
  if (twice > unit || (twice == unit && whole % 2 != 0)) ++whole;
  return mantissa < 0 ? -whole : whole;
}

/// Whole units and halves of them, far below one, of any size up to 2^96, subnormal numbers, and zeros.
double any_summand(Random& random, int unit) {
  switch (pick(random, 0, 5)) {
    case 0:
      return std::ldexp(pick(random, -40, 40), unit - 1 - pick(random, 0, 2));
    case 1:
      return pick(random, 0, 1) == 0 ? 0.0 : -0.0;
    case 2:
      return std::ldexp(uniform(random, -1, 1), std::min(pick(random, -1074, -1020), unit + 96));
    default:
      return std::ldexp(uniform(random, -1, 1), pick(random, unit - 4, unit + 96));
  }
}

template <int D>
void expect_rounded_sums(MomentSum<D> sum, Random& random) {
  constexpr std::size_t size = Moments<D>::size;
  const auto exponent = sum.state().exponent;
  std::array<mp::cpp_int, size> expected{};
  for (int round = 0; round < samples::rounds(5000); ++round) {
    Moments<D> moments;
    for (std::size_t i = 0; i < size; ++i) {
      const int unit = exponent[i == 0 ? 0 : i <= static_cast<std::size_t>(D) ? 1 : 2];
      moments.integral[i] = any_summand(random, unit);
      expected[i] += rounded(moments.integral[i], unit);
    }
    sum.add(moments);
    const auto words = sum.state().words;
    for (std::size_t i = 0; i < size; ++i) {
      const mp::cpp_int found =
          (mp::cpp_int(static_cast<std::int64_t>(words[2 * i + 1])) << 64) + words[2 * i];
      ASSERT_EQ(found, expected[i]) << "moment " << i << ", round " << round;
    }
  }
}

TEST(MomentSum, AddsEachSummandRoundedToTheNearestUnit) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  expect_rounded_sums(MomentSum<1>(1), random);
  expect_rounded_sums(MomentSum<3>(1e10, 1e-3), random);
  expect_rounded_sums(MomentSum<built_dimensions>(1e-40, 1e-40),
                      random);  // whose units no double is as small as
}

TEST(Moments, IndexIsTheUpperTriangleByRows) {
  int next = 0;
  for (int i = 0; i <= 3; ++i)
    for (int j = i; j <= 3; ++j) {
      EXPECT_EQ(Moments<3>::index(i, j), next);
      EXPECT_EQ(Moments<3>::index(j, i), next++);
    }
  EXPECT_EQ(next, Moments<3>::size);
}

TEST(Block, IsOwnMemoryWhateverComesAndGoes) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  struct Filled {
    Block block;
    unsigned char value;
  };
  std::vector<Filled> live;
  const auto check = [](Filled& f) {
    const auto* bytes = f.block.at<unsigned char>(0);
    return std::all_of(bytes, bytes + f.block.size(), [&](unsigned char b) { return b == f.value; });
  };
  for (int step = 0; step < 20000; ++step) {
    if (live.empty() || (live.size() < 900 && pick(random, 0, 1) == 0)) {
      const auto size =
          static_cast<std::size_t>(pick(random, 0, 9) == 0 ? pick(random, 1, 100000) : pick(random, 1, 2000));
      Filled f{Block(size), static_cast<unsigned char>(step)};
      ASSERT_EQ(f.block.size(), size);
      ASSERT_EQ(reinterpret_cast<std::uintptr_t>(f.block.at<char>(0)) % 8, 0U);
      std::memset(f.block.at<char>(0), f.value, size);
      live.push_back(std::move(f));
    } else {
      const auto at = static_cast<std::size_t>(pick(random, 0, static_cast<int>(live.size()) - 1));
      ASSERT_TRUE(check(live[at]));
      std::swap(live[at], live.back());
      live.pop_back();
    }
  }
  for (Filled& f : live) ASSERT_TRUE(check(f));
}

TEST(Block, MayBeReleasedOnAnotherThread) {
  std::vector<Block> handed(2000);
  for (int round = 0; round < samples::rounds(5); ++round) {
    std::thread maker([&] {
      for (std::size_t i = 0; i < handed.size(); ++i) {
        handed[i] = Block(64 + i);
        std::memset(handed[i].at<char>(0), 1, handed[i].size());
      }
    });
    maker.join();
    std::thread dropper([&] {
      for (Block& block : handed) block = Block();
    });
    dropper.join();
  }
}

TEST(Block, OutlivesItsThreadsCache) {
  // Made before the thread's first block, and so before its cache, it is destroyed after it.
  std::thread([] {
    thread_local Block kept;
    kept = Block(100);
    EXPECT_EQ(kept.size(), 100U);
  }).join();
}

TEST(Block, MovesLeaveNothingBehind) {
  Block a(300);
  *a.at<int>(0) = 7;
  Block b = std::move(a);
  EXPECT_EQ(*b.at<int>(0), 7);
  EXPECT_EQ(a.size(), 0U);  // NOLINT(bugprone-use-after-move): that is the question
  Block c(10);
  c = std::move(b);
  EXPECT_EQ(*c.at<int>(0), 7);
  EXPECT_EQ(c.size(), 300U);
}

}  // namespace
}  // namespace bsp2::geometry
