// The hyperplanes of round solids: what lies on which side of them, by long double arithmetic on random
// points.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bsp2/geometry/families/round_family.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

using Random = std::mt19937_64;

template <int D>
long double value(const std::array<long double, D + 1>& covector, const std::array<long double, D>& x) {
  long double sum = covector[D];
  for (int i = 0; i < D; ++i) sum += covector[i] * x[i];
  return sum;
}

template <int D>
typename RoundFamily<D>::Wedge random_wedge(const RoundFamily<D>& family, Random& random) {
  typename RoundFamily<D>::Wedge wedge;
  wedge.face = static_cast<std::uint32_t>(random() % static_cast<unsigned>(2 * family.axes()));
  wedge.level = static_cast<std::uint32_t>(random() % (family.levels() + 1));
  for (int j = 0; j + 1 < family.axes(); ++j)
    wedge.at[static_cast<std::size_t>(j)] = static_cast<std::uint32_t>(random() & ((1U << wedge.level) - 1));
  return wedge;
}

/// A random point of the wedge, on the unit sphere of the round axes.
template <int D>
std::array<long double, D> direction_in(const RoundFamily<D>& family,
                                        const typename RoundFamily<D>::Wedge& wedge, Random& random) {
  std::uniform_real_distribution<long double> share(0, 1);
  std::array<long double, D> x{};
  const long double n = std::ldexp(1.0L, static_cast<int>(wedge.level));
  x[wedge.axis()] = wedge.sign();
  for (int j = 0; j + 1 < family.axes(); ++j)
    x[family.axis_at(wedge, j)] = 2 * (wedge.at[static_cast<std::size_t>(j)] + share(random)) / n - 1;
  long double square = 0;
  for (const long double c : x) square += c * c;
  for (long double& c : x) c /= std::sqrt(square);
  return x;
}

template <int D>
void check_family(int axes, std::uint64_t seed) {
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed << " D=" << D << " axes=" << axes);
  Random random(seed);
  const RoundFamily<D> family(axes, 1, 1, 1U << 24);
  ASSERT_GE(family.levels(), D <= 3 ? 7U : 1U);
  ASSERT_LE(family.count(), 1U << 24);
  for (int round = 0; round < samples::rounds(300); ++round) {
    const auto wedge = random_wedge<D>(family, random);
    const auto tangent = family.rounded(family.tangent(wedge)), chord = family.rounded(family.chord(wedge));
    ASSERT_LT(family.chord(wedge), family.count());
    // The tangent touches: the sphere comes within the rounding of it, and not beyond.
    long double normal = 0;
    for (int i = 0; i < D; ++i) normal += tangent[i] * tangent[i];
    normal = std::sqrt(normal);
    EXPECT_LE(1, -tangent[D] / normal * (1 + 0x1p-60L));
    EXPECT_NEAR(static_cast<double>(-tangent[D] / normal), 1, 0x1p-38);
    // So thick is the layer at most.
    const long double n = std::ldexp(1.0L, static_cast<int>(wedge.level));
    EXPECT_GE(-chord[D] / normal, 1 / std::sqrt(1 + (axes - 1) / (n * n)) - 0x1p-38L);
    for (int sample = 0; sample < 20; ++sample) {
      const auto x = direction_in<D>(family, wedge, random);
      EXPECT_LE(value<D>(tangent, x), 0);
      EXPECT_GE(value<D>(chord, x), 0) << "a point of the sphere is before the chord of its wedge";
      for (int j = 0; j + 1 < axes; ++j) {
        for (const int side : {-1, 1}) {
          const auto bound = family.bound(wedge, j, side);
          const long double v = value<D>(family.rounded(bound.number), x) * (bound.flipped ? -1 : 1);
          EXPECT_LE(side * v, 0x1p-30L * n);
        }
        if (wedge.level == family.levels()) continue;
        const auto halving = family.halving(wedge, j);
        const long double at = x[family.axis_at(wedge, j)] / std::fabs(x[wedge.axis()]),
                          middle =
                              (2 * static_cast<long double>(wedge.at[static_cast<std::size_t>(j)]) + 1) / n -
                              1;
        const long double v = value<D>(family.rounded(halving.number), x) * (halving.flipped ? -1 : 1);
        if (std::fabs(at - middle) > 0x1p-40L) {
          EXPECT_EQ(v > 0, at > middle);
        }
      }
    }
    // Exact and rounded coefficients are the same hyperplane.
    for (const std::uint32_t number :
         {family.tangent(wedge), family.chord(wedge), family.bound(wedge, 0, 1).number}) {
      const auto exact = family.exact(number);
      const auto rounded = family.rounded(number);
      for (int i = 0; i <= D; ++i)
        EXPECT_EQ(static_cast<long double>(static_cast<std::int64_t>(exact[i])), rounded[i]);
    }
  }
}

TEST(RoundFamily, EnclosesTheSphereInEveryWedge) {
  const std::uint64_t seed = samples::new_seed();
  check_family<2>(2, seed);
  check_family<3>(3, seed);
  check_family<3>(2, seed);
  check_family<4>(4, seed);
#if BSP2_DIMENSIONS > 4
  check_family<5>(3, seed);
  check_family<6>(6, seed);
#endif
}

TEST(RoundFamily, GivesEveryHyperplaneOneNumber) {
  const RoundFamily<3> family(3, 1, 1, 4000);
  std::vector<std::array<LocalInteger, 4>> seen;
  for (std::uint32_t number = 0; number < family.count(); ++number) seen.push_back(family.exact(number));
  std::size_t tangents = 0;
  for (std::uint32_t face = 0; face < 6; ++face)
    for (std::uint32_t level = 0; level <= family.levels(); ++level)
      for (std::uint32_t at = 0; at < 1U << (2 * level); ++at) {
        const RoundFamily<3>::Wedge wedge{face, level, {at & ((1U << level) - 1), at >> level}};
        const auto& tangent = seen.at(family.tangent(wedge));
        const auto d = family.direction(wedge);
        for (int i = 0; i < 3; ++i)
          EXPECT_EQ(static_cast<double>(static_cast<std::int64_t>(tangent[i])), std::ldexp(d[i], 40));
        ++tangents;
      }
  EXPECT_EQ(tangents, 6U * ((std::size_t{1} << (2 * (family.levels() + 1))) - 1) / 3);
}

TEST(RoundFamily, TaperedPlanesMeetInTheApex) {
  const RoundFamily<3> cone(2, 1, 0, 100000);
  Random random(7);
  for (int round = 0; round < samples::rounds(50); ++round) {
    const auto wedge = random_wedge<3>(cone, random);
    for (const std::uint32_t number : {cone.tangent(wedge), cone.chord(wedge)}) {
      const auto plane = cone.exact(number);
      EXPECT_TRUE((plane[2] + plane[3]).is_zero());
    }
  }
}

}  // namespace
}  // namespace bsp2::geometry
