#include "bsp2/geometry/support/quad.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

using Bits = Float128Bits::Bits;

Bits bits_of(Float128 x) { return std::bit_cast<Bits>(x); }

/// Beside what the compiler's library makes of it, bit for bit; what is no number is only that.
void expect_same_long_double(Float128 x) {
  const auto expected = static_cast<long double>(x);
  const long double made = to_long_double(x);
  if (std::isnan(expected)) {
    EXPECT_TRUE(std::isnan(made));
    return;
  }
  EXPECT_EQ(made, expected) << static_cast<double>(x);
  EXPECT_EQ(std::signbit(made), std::signbit(expected)) << static_cast<double>(x);
}

TEST(Float128, IsMadeFromDoublesOfEveryKind) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  const auto check = [](double x) {
    EXPECT_TRUE(bits_of(to_quad(x)) == bits_of(static_cast<Float128>(x))) << x;
  };
  for (int round = 0; round < samples::rounds(100000); ++round) {
    const auto x = std::bit_cast<double>(random());
    if (!std::isnan(x)) check(x);
  }
  using Limits = std::numeric_limits<double>;
  for (const double x : {0.0, 1.0, Limits::max(), Limits::min(), Limits::denorm_min(),
                         std::nextafter(Limits::min(), 0.0), Limits::infinity()})
    for (const double sign : {1.0, -1.0}) check(sign * x);
}

TEST(Float128, IsRoundedToLongDoubleAsTheLibraryDoes) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int round = 0; round < samples::rounds(200000); ++round) {
    Bits bits = Bits{random()} << 64 | random();
    switch (round % 4) {
      case 1:
        bits = bits >> 49 << 49;
        break;  // nothing to round
      case 2:
        bits = (bits >> 49 << 49) | Bits{1} << 48;
        break;  // half-way
      case 3:
        bits |= ((Bits{1} << 63) - 1) << 49;
        break;  // a carry through the whole fraction, or none
    }
    expect_same_long_double(std::bit_cast<Float128>(bits));
  }
  for (const double x : {0.0, 1.0, 1e308, 5e-324, std::numeric_limits<double>::infinity()})
    for (const double sign : {1.0, -1.0}) expect_same_long_double(static_cast<Float128>(sign * x));
  // Near the limits of the exponent, which both formats have in common.
  for (const int field : {0, 1, 2, 0x7ffd, 0x7ffe, 0x7fff})
    for (int round = 0; round < samples::rounds(100); ++round) {
      const Bits fraction = (Bits{random()} << 64 | random()) >> 16;
      expect_same_long_double(std::bit_cast<Float128>(Bits{static_cast<unsigned>(field)} << 112 | fraction));
      expect_same_long_double(
          std::bit_cast<Float128>(Bits{static_cast<unsigned>(field)} << 112 | ((Bits{1} << 112) - 1)));
    }
}

TEST(Float128, KnowsZeroAndOne) {
  EXPECT_TRUE(is_zero(0));
  EXPECT_TRUE(is_zero(-static_cast<Float128>(0.0)));
  EXPECT_FALSE(is_zero(static_cast<Float128>(5e-324)));
  EXPECT_TRUE(is_one(1));
  EXPECT_FALSE(is_one(-1));
  EXPECT_FALSE(is_one(1 + static_cast<Float128>(0x1p-112)));
}

}  // namespace
}  // namespace bsp2::geometry
