// The kernel's fractions against integers of any size.

#include "bsp2/geometry/exact/fraction.hpp"

#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>

#include "geometry/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

using mp::cpp_int;

/// A fraction and what it is made of, in units of 2^-192.
struct Sample {
  Fraction fraction;
  cpp_int units;
};

/// The value in units, from nothing but signs: a fraction is known by what it is at least.
cpp_int units_of(Fraction x) {
  const bool negative = x.is_negative();
  if (negative) x = -x;
  cpp_int units = 0;
  for (int bit = Fraction::bits - 2; bit >= 0; --bit) {
    const Fraction power = Fraction::scaled(ExactInteger<3>(1), bit - Fraction::bits);
    Fraction rest = x;
    rest -= power;
    if (rest.is_negative()) continue;
    x = rest;
    units += cpp_int(1) << bit;
  }
  EXPECT_TRUE(x.is_zero());
  return negative ? cpp_int(-units) : units;
}

/// Below `limit` in size; many with long runs of equal bits.
ExactInteger<3> random_integer(Random& random, int bits) {
  ExactInteger<3> value = 0;
  for (int length = 0; length < bits;) {
    const int run = std::min(pick(random, 1, 70), bits - length);
    value <<= run;
    if (pick(random, 0, 2) == 0)
      value |= (ExactInteger<3>(1) << run) - 1;
    else if (pick(random, 0, 1) == 0)
      value |= ExactInteger<3>(random()) & ((ExactInteger<3>(1) << run) - 1);
    length += run;
  }
  return pick(random, 0, 1) == 0 ? ExactInteger<3>(-value) : value;
}

Sample random_sample(Random& random) {
  const int bits = pick(random, 1, 600), below = pick(random, 1, 4) == 1 ? pick(random, 2, 190) : 2;
  const ExactInteger<3> value = random_integer(random, bits);
  const long exponent = -bits - below;
  cpp_int units(mp::abs(value));
  const long shift = Fraction::bits + exponent;
  units = shift >= 0 ? cpp_int(units << shift) : cpp_int(units >> -shift);  // towards 0
  return {Fraction::scaled(value, exponent), value.sign() < 0 ? cpp_int(-units) : units};
}

TEST(Fractions, AreMultipliedUpToAHalfOfEitherSign) {
  std::vector<ExactInteger<3>> sizes{0, 1, 2};
  for (const unsigned bit : {63U, 64U, 65U, 127U, 128U, 129U, 190U})
    for (const int more : {-1, 0, 1}) sizes.push_back((ExactInteger<3>(1) << bit) + more);
  sizes.push_back((ExactInteger<3>(1) << 191) - 1);
  std::vector<Sample> samples{{Fraction::scaled(ExactInteger<3>(-1), -1), cpp_int(-1) << 191}};  // -1/2
  for (const auto& size : sizes)
    for (const int sign : {1, -1})
      samples.push_back(
          {Fraction::scaled(ExactInteger<3>(sign * size), -Fraction::bits), sign * cpp_int(size)});
  for (const Sample& a : samples)
    for (const Sample& b : samples) {
      const cpp_int error = cpp_int(units_of(a.fraction * b.fraction) << Fraction::bits) - a.units * b.units;
      ASSERT_LT(abs(error), cpp_int(6) << Fraction::bits) << a.units << " * " << b.units;
      ASSERT_TRUE((a.units != 0 && b.units != 0) || (a.fraction * b.fraction).is_zero());
    }
}

TEST(Fractions, AreIntegersOf192Bits) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(3000); ++round) {
    const Sample a = random_sample(random), b = random_sample(random);
    ASSERT_EQ(units_of(a.fraction), a.units);
    ASSERT_EQ(a.fraction.is_zero(), a.units == 0);
    ASSERT_EQ(a.fraction.is_negative(), a.units < 0);
    ASSERT_EQ(units_of(-a.fraction), cpp_int(-a.units));
    Fraction sum = a.fraction, difference = a.fraction;
    sum += b.fraction;
    difference -= b.fraction;
    ASSERT_EQ(units_of(sum), cpp_int(a.units + b.units));
    ASSERT_EQ(units_of(difference), cpp_int(a.units - b.units));
    const cpp_int error = cpp_int(units_of(a.fraction * b.fraction) << Fraction::bits) - a.units * b.units;
    ASSERT_LT(abs(error), cpp_int(6) << Fraction::bits);
    const int exponent = pick(random, 129, 192);
    ASSERT_EQ(a.fraction.is_at_least(exponent), abs(a.units) >= cpp_int(1) << (Fraction::bits - exponent));
  }
}

/// What splitter.cpp says of the errors of minors.
TEST(Fractions, MinorsHaveTheErrorsThatThePredicateAllowsFor) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(3000); ++round) {
    constexpr int bits = 300;
    std::array<std::array<Fraction, 4>, 3> rows;
    std::array<std::array<ExactInteger<3>, 4>, 3> exact;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 4; ++j) {
        exact[i][j] = random_integer(random, bits - pick(random, 0, 2));
        rows[i][j] = Fraction::scaled(exact[i][j], -bits - 3);
      }
    const auto point = meeting_point<3>(rows);
    const auto truth = meeting_point<3>(exact);
    for (int j = 0; j < 4; ++j) {  // units are 2^-192, and of the exact ones 2^-(3 bits + 9)
      const cpp_int scaled = cpp_int(units_of(point[j])) << (3 * bits + 9 - Fraction::bits);
      ASSERT_LE(abs(cpp_int(scaled - cpp_int(truth[j]))), cpp_int(72) << (3 * bits + 9 - Fraction::bits));
    }
  }
}

}  // namespace
}  // namespace bsp2::geometry
