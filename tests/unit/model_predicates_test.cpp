#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <random>

#include "predicates.hpp"

namespace bsp2::model {
namespace {

using Rational = boost::multiprecision::cpp_rational;

int exact_orientation(const Point2& a, const Point2& b, const Point2& c) {
  const Rational area = (Rational(b.u) - Rational(a.u)) * (Rational(c.v) - Rational(a.v)) -
                        (Rational(b.v) - Rational(a.v)) * (Rational(c.u) - Rational(a.u));
  return area.sign();
}

TEST(Predicates, OrientationIsExactNearLines) {
  const unsigned seed = std::random_device{}();
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
