// Primitives in their own frames: exactly what they promise.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <numbers>

#include "geometry/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

using oracle::BigInteger;

TEST(CornerDirection, IsTheRoundedCosineAndSine) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(20000); ++round) {
    const auto count = static_cast<std::uint32_t>(round < samples::rounds(10000) ? pick(random, 3, 400)
                                                                                 : pick(random, 3, 1000000));
    const auto index = static_cast<std::uint32_t>(pick(random, 0, static_cast<int>(count) - 1));
    const auto [c, s] = corner_direction(index, count);
    const long double angle = 2 * std::numbers::pi_v<long double> * index / count;
    ASSERT_LE(std::fabs(c - std::ldexp(std::cos(angle), 53)), 0.51L) << index << " of " << count;
    ASSERT_LE(std::fabs(s - std::ldexp(std::sin(angle), 53)), 0.51L) << index << " of " << count;
    // Symmetric: mirrored and turned by quarters without any rounding of its own.
    ASSERT_EQ(corner_direction(index == 0 ? 0 : count - index, count), (std::array<std::int64_t, 2>{c, -s}));
    ASSERT_EQ(corner_direction(index + count, count), (std::array<std::int64_t, 2>{c, s}));
    if (count % 2 == 0) {
      ASSERT_EQ(corner_direction(index + count / 2, count), (std::array<std::int64_t, 2>{-c, -s}));
    }
    if (count % 4 == 0) {
      ASSERT_EQ(corner_direction(index + count / 4, count), (std::array<std::int64_t, 2>{-s, c}));
    }
    ASSERT_EQ(corner_direction(2 * index, 2 * count), (std::array<std::int64_t, 2>{c, s}));
  }
}

TEST(CornerDirection, IsExactWhereTheValuesAreRational) {
  constexpr std::int64_t one = std::int64_t{1} << 53;
  EXPECT_EQ(corner_direction(0, 12), (std::array<std::int64_t, 2>{one, 0}));
  EXPECT_EQ(corner_direction(3, 12), (std::array<std::int64_t, 2>{0, one}));
  EXPECT_EQ(corner_direction(6, 12), (std::array<std::int64_t, 2>{-one, 0}));
  EXPECT_EQ(corner_direction(9, 12), (std::array<std::int64_t, 2>{0, -one}));
  EXPECT_EQ(corner_direction(1, 12)[1], one / 2);
  EXPECT_EQ(corner_direction(2, 12)[0], one / 2);
  EXPECT_EQ(corner_direction(1, 3)[0], -one / 2);
  EXPECT_EQ(corner_direction(1, 8)[0], corner_direction(1, 8)[1]);
}

/// All corners, exactly: x and y in units of 2^-106, z in units of 2^-53.
std::vector<std::array<BigInteger, 3>> corners(std::uint32_t sides, const std::vector<double>& radius,
                                               const std::vector<double>& z) {
  std::vector<std::array<BigInteger, 3>> all;
  for (std::size_t i = 0; i < radius.size(); ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const auto [c, s] = corner_direction(j, sides);
      const std::int64_t r = std::llround(std::ldexp(radius[i], 53));
      all.push_back({BigInteger(r) * c, BigInteger(r) * s, BigInteger(std::llround(std::ldexp(z[i], 53)))});
      if (r == 0) break;  // an apex
    }
  return all;
}

void check_lathe(std::uint32_t sides, const std::vector<double>& radius, const std::vector<double>& z) {
  const Polytope<3> polytope = lathe(sides, radius, z);
  const auto points = corners(sides, radius, z);
  const bool pointed_low = radius.front() == 0, pointed_high = radius.back() == 0;
  ASSERT_EQ(polytope.covectors.size(), sides * (radius.size() - 1) + !pointed_low + !pointed_high);
  std::map<std::size_t, int> planes_of;   // number of planes through each corner
  std::map<std::size_t, int> corners_on;  // number of planes with so many corners
  for (const auto& covector : polytope.covectors) {
    std::size_t on = 0;
    for (std::size_t p = 0; p < points.size(); ++p) {
      const BigInteger value =
          BigInteger(covector.exact[0]) * points[p][0] + BigInteger(covector.exact[1]) * points[p][1] +
          ((BigInteger(covector.exact[2]) * points[p][2]) << 53) + (BigInteger(covector.exact[3]) << 106);
      ASSERT_LE(value.sign(), 0) << "a corner outside";
      if (!value.is_zero()) continue;
      ++on;
      ++planes_of[p];
    }
    ++corners_on[on];
    for (int i = 0; i <= 3; ++i) {
      const BigInteger exact(covector.exact[i]);
      const BigInteger rounded(covector.rounded[i]);
      ASSERT_LE(BigInteger(abs(exact - rounded)) << 63, abs(exact)) << "the rounded coefficient";
    }
  }
  const int quads =
      static_cast<int>(sides) * (static_cast<int>(radius.size()) - 1 - pointed_low - pointed_high);
  std::map<std::size_t, int> expected;
  if (quads > 0) expected[4] += quads;
  if (pointed_low) expected[3] += static_cast<int>(sides);
  if (pointed_high) expected[3] += static_cast<int>(sides);
  if (!pointed_low) ++expected[sides];
  if (!pointed_high) ++expected[sides];
  ASSERT_EQ(corners_on, expected) << "corners that are not exactly in their planes";
  ASSERT_EQ(planes_of.size(), points.size());
  for (const auto& p : points)
    for (int i = 0; i < 3; ++i) {
      const double x = std::ldexp(p[static_cast<std::size_t>(i)].convert_to<double>(), i < 2 ? -106 : -53);
      ASSERT_GE(x, polytope.lower[i] - 1e-18);
      ASSERT_LE(x, polytope.upper[i] + 1e-18);
    }
}

TEST(Lathe, HasExactlyPlanarSides) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    const auto sides = static_cast<std::uint32_t>(pick(random, 3, 40));
    check_lathe(sides, {1, 1}, {0, 1});
    check_lathe(sides, {1, uniform(random, 0.01, 0.99)}, {0, 1});
    check_lathe(sides, {0, 1}, {0, 1});
    check_lathe(sides, {1, 0}, {0, 1});
    check_lathe(sides, {uniform(random, 0.1, 0.6), 1, uniform(random, 0, 0.7)},
                {0, uniform(random, 0.2, 0.8), 1});
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(Lathe, SpheresAreConvexToTheLastBit) {
  for (std::uint32_t sides = 5; sides <= 24; sides += sides < 12 ? 1 : 4) {
    const std::uint32_t rings = (sides + 1) / 2;
    std::vector<double> radius, z;
    double widest = 0;
    for (std::uint32_t i = rings; i-- > 0;) {
      const double angle = std::numbers::pi * (i + 0.5) / rings;
      radius.push_back(std::sin(angle));
      z.push_back(std::cos(angle));
      widest = std::max(widest, radius.back());
    }
    const double low = z.front(), span = z.back() - low;
    for (double& r : radius) r /= widest;
    for (double& h : z) h = (h - low) / span;
    check_lathe(sides, radius, z);
    if (testing::Test::HasFatalFailure()) return;
  }
}

TEST(TriangleCovector, PassesThroughItsPointsAndFacesOutward) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::uniform_int_distribution<std::int64_t> coordinate(-(std::int64_t{1} << 53), std::int64_t{1} << 53);
  for (int round = 0; round < samples::rounds(3000); ++round) {
    std::array<std::array<std::int64_t, 3>, 4> p;
    for (auto& point : p)
      for (auto& x : point) x = coordinate(random) >> (round % 50);
    const auto plane = triangle_covector({p[0], p[1], p[2]});
    const auto at = [&](const std::array<std::int64_t, 3>& x) {  // in units of 2^-53
      BigInteger sum = BigInteger(plane.exact[3]) << 53;
      for (int i = 0; i < 3; ++i) sum += BigInteger(plane.exact[i]) * x[i];
      return sum;
    };
    for (int k = 0; k < 3; ++k) ASSERT_TRUE(at(p[k]).is_zero());
    // Its side agrees with the orientation of the tetrahedron.
    const auto d = [&](int k, int i) { return BigInteger(p[k][i]) - p[0][i]; };
    const BigInteger det = d(1, 0) * (d(2, 1) * d(3, 2) - d(2, 2) * d(3, 1)) -
                           d(1, 1) * (d(2, 0) * d(3, 2) - d(2, 2) * d(3, 0)) +
                           d(1, 2) * (d(2, 0) * d(3, 1) - d(2, 1) * d(3, 0));
    ASSERT_EQ(at(p[3]).sign(), det.sign());
  }
  const auto flat = triangle_covector({{{0, 0, 0}, {1, 2, 3}, {2, 4, 6}}});
  for (const auto& c : flat.exact) EXPECT_TRUE(c.is_zero());
}

}  // namespace
}  // namespace bsp2::geometry
