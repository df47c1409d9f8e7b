#include "mesh/predicates.hpp"

#include <gtest/gtest.h>

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstdint>
#include <random>

#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

using Rational = boost::multiprecision::cpp_rational;

int exact_orientation(const Point2& a, const Point2& b, const Point2& c) {
  const Rational area = (Rational(b.u) - Rational(a.u)) * (Rational(c.v) - Rational(a.v)) -
                        (Rational(b.v) - Rational(a.v)) * (Rational(c.u) - Rational(a.u));
  return area.sign();
}

TEST(Predicates, OrientationIsExactNearLines) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  int zeros = 0, signs = 0;
  for (int round = 0; round < 20'000; ++round) {
    // Points on a line, as well as doubles can say it, moved by a few units in the last place; of all
    // magnitudes.
    const double scale = std::pow(10.0, static_cast<double>(random() % 40) - 20);
    const auto coordinate = [&] { return round % 2 ? std::round(unit(random) * 20) : unit(random) * scale; };
    Point2 a{coordinate(), coordinate()}, b{coordinate(), coordinate()};
    const double t = round % 4 < 2 ? static_cast<double>(random() % 5) / 4 : 3 * unit(random);
    Point2 c{a.u + t * (b.u - a.u), a.v + t * (b.v - a.v)};
    for (std::uint64_t step = random() % 3; step > 0; --step) c.u = std::nextafter(c.u, unit(random));
    for (std::uint64_t step = random() % 3; step > 0; --step) b.v = std::nextafter(b.v, unit(random));
    const int expected = exact_orientation(a, b, c);
    ++(expected == 0 ? zeros : signs);
    EXPECT_EQ(orientation(a, b, c), expected);
    EXPECT_EQ(orientation(b, c, a), expected);
    EXPECT_EQ(orientation(b, a, c), -expected);
  }
  EXPECT_GT(zeros, 100);
  EXPECT_GT(signs, 100);
}

TEST(Predicates, OrientationSurvivesUnderflowAndOverflow) {
  const double tiny = 1e-200, large = 1e200;
  EXPECT_EQ(orientation({0, 0}, {tiny, 0}, {0, tiny}), 1);
  EXPECT_EQ(orientation({0, 0}, {tiny, tiny}, {2 * tiny, 2 * tiny}), 0);
  EXPECT_EQ(orientation({0, 0}, {large, 0}, {0, large}), 1);
  EXPECT_EQ(orientation({0, 0}, {0, large}, {large, 0}), -1);
}

/// Points of a plane through random points, on grids of any size: beside the sum in integers where that fits.
TEST(Predicates, OrientationIsExactNearPlanes) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  int in_plane = 0;
  for (int round = 0; round < 20'000; ++round) {
    const int bits =
        2 + static_cast<int>(random() % 16);  // 2 to 17: differences below 2^19, so the sum fits in 64 bits
    const auto coordinate = [&] { return static_cast<std::int64_t>(random() % (1U << bits)); };
    std::array<std::array<std::int64_t, 3>, 4> p;
    for (auto& point : p)
      for (auto& x : point) x = coordinate();
    if (round % 2 == 0)
      for (std::size_t k = 0; k < 3; ++k) p[3][k] = p[1][k] + p[2][k] - p[0][k];  // a parallelogram
    if (round % 4 == 0) p[3][random() % 3] += static_cast<std::int64_t>(random() % 3) - 1;
    std::int64_t sum = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      sum += (p[0][k] - p[3][k]) *
             ((p[1][l] - p[3][l]) * (p[2][m] - p[3][m]) - (p[1][m] - p[3][m]) * (p[2][l] - p[3][l]));
    }
    const double unit = std::ldexp(1.0, static_cast<int>(random() % 400) - 200);
    std::array<Point3, 4> q;
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t k = 0; k < 3; ++k) q[i][k] = unit * static_cast<double>(p[i][k]);
    const int expected = sum > 0 ? -1 : sum < 0 ? 1 : 0;
    ASSERT_EQ(orientation(q[0], q[1], q[2], q[3]), expected) << "round " << round;
    in_plane += expected == 0;
  }
  EXPECT_GT(in_plane, 5000);
  // A difference that is too small beside the others for integers.
  const double tiny = 1e-200;
  EXPECT_EQ(orientation(Point3{0, 0, 0}, Point3{1e200, 0, 0}, Point3{0, 1, 0}, Point3{0, 0, tiny}), 1);
  EXPECT_EQ(orientation(Point3{0, 0, 0}, Point3{1e200, 0, 0}, Point3{0, 1e-200, 0}, Point3{0, 0, -1e-250}),
            -1);
  EXPECT_EQ(orientation(Point3{0, 0, 0}, Point3{1e200, 0, 0}, Point3{0, 1e-200, 0}, Point3{5, 7e-200, 0}), 0);
}

/// Quadrilaterals whose corners are rounded to doubles, in units far from each other along the axes: beside
/// rationals.
TEST(Predicates, OrientationIsExactOfAnyDoubles) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(-1, 1);
  int zeros = 0, signs = 0;
  for (int round = 0; round < samples::rounds(4000); ++round) {
    const int spread = round % 4 == 0 ? 900 : round % 4 == 1 ? 60 : 3;
    std::array<Point3, 4> p;
    for (auto& x : p[0]) x = unit(random);
    for (std::size_t i = 1; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) p[i][k] = round % 8 < 4 && k == 2 ? p[0][2] : unit(random);
    for (std::size_t k = 0; k < 3; ++k) p[3][k] = p[1][k] + p[2][k] - p[0][k];
    for (std::size_t k = 0; k < 3; ++k) {
      const double scale =
          std::ldexp(1.0, static_cast<int>(random() % static_cast<unsigned>(spread)) - spread / 2);
      for (auto& point : p) point[k] *= scale;
    }
    std::array<std::array<Rational, 3>, 3> e;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) e[i][k] = Rational(p[i][k]) - Rational(p[3][k]);
    const Rational determinant = e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) +
                                 e[0][1] * (e[1][2] * e[2][0] - e[1][0] * e[2][2]) +
                                 e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]);
    const int expected = -determinant.sign();
    ASSERT_EQ(orientation(p[0], p[1], p[2], p[3]), expected) << "round " << round;
    ++(expected == 0 ? zeros : signs);
  }
  EXPECT_GT(zeros, samples::rounds(1000));
  EXPECT_GT(signs, samples::rounds(500));
}

TEST(Predicates, InsideSegmentExcludesTheEnds) {
  const Point3 a{0, 0, 0}, b{3, 6, -9};
  EXPECT_TRUE(inside_segment(a, b, {1, 2, -3}));
  EXPECT_FALSE(inside_segment(a, b, a));
  EXPECT_FALSE(inside_segment(a, b, b));
  EXPECT_FALSE(inside_segment(a, b, {4, 8, -12}));
  EXPECT_FALSE(inside_segment(a, b, {-1, -2, 3}));
  EXPECT_FALSE(inside_segment(a, b, {1, 2, std::nextafter(-3.0, 0)}));
}

}  // namespace
}  // namespace bsp2::model
