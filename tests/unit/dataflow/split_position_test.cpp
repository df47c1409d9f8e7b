// Where a row of stretches comes apart best, against all places one by one.

#include "bsp2/dataflow/evaluate/split_position.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

/// The share of the larger half of those that reach further than `slack` below a place, or above it.
double share_at(const std::vector<Interval>& stretches, double place, double slack) {
  std::size_t below = 0, above = 0;
  for (const Interval& stretch : stretches) {
    below += stretch.lower < place - slack ? 1 : 0;
    above += stretch.upper > place + slack ? 1 : 0;
  }
  return static_cast<double>(std::max(below, above)) / static_cast<double>(stretches.size());
}

std::vector<Interval> random_stretches(Random& random) {
  const int count = pick(random, 1, 300), kind = pick(random, 0, 5);
  const double origin = uniform(random, -1e3, 1e3), width = std::pow(10.0, uniform(random, -3, 3));
  std::vector<Interval> stretches;
  for (int i = 0; i < count; ++i) {
    double lower = uniform(random, 0, 1), length = uniform(random, 0, 0.2);
    if (kind == 1) lower = pick(random, 0, 9) / 10.0, length = 0.1;  // touching
    if (kind == 2) lower = 0, length = 1;                            // all of them everywhere
    if (kind == 3)
      lower = std::pow(2.0, uniform(random, -40, 0)), length = lower / 4;  // closer and closer together
    if (kind == 4) lower = length = 0;                                     // points
    if (kind == 5)
      lower = i == 0 ? 1 : 0.3 + uniform(random, 0, 1e-3), length = 1e-5;  // a cluster, and one far away
    stretches.push_back({origin + width * lower, origin + width * (lower + length)});
  }
  return stretches;
}

TEST(SplitPosition, IsAsGoodAsItSaysAndAsTheBestOfManyPlaces) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int poor = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    const auto stretches = random_stretches(random);
    const SplitPosition parting = best_split_position(stretches);
    double lower = stretches[0].lower, upper = stretches[0].upper;
    for (const Interval& stretch : stretches) {
      lower = std::min(lower, stretch.lower);
      upper = std::max(upper, stretch.upper);
    }
    const double slack = 1e-12 * (upper - lower + std::fabs(lower));
    ASSERT_GE(parting.place, lower);
    ASSERT_LE(parting.place, upper);
    ASSERT_LE(parting.share, 1);
    // One that ends within a rounding of the place may count on either side.
    ASSERT_GE(parting.share, share_at(stretches, parting.place, slack));
    ASSERT_LE(parting.share, share_at(stretches, parting.place, -slack));
    double even = 1;  // the best of the places, at least
    for (int k = 1; k < 64; ++k) {
      const double place = lower + (upper - lower) * k / 64;
      ASSERT_LE(parting.share, share_at(stretches, place, -slack)) << "place " << k;
      even = std::min(even, share_at(stretches, place, slack));
    }
    if (stretches.size() <= 64 || even <= 0.9 || !(upper > lower)) continue;
    std::vector<double> ends;
    for (const Interval& stretch : stretches) ends.insert(ends.end(), {stretch.lower, stretch.upper});
    std::sort(ends.begin(), ends.end());
    ASSERT_LE(parting.share, share_at(stretches, ends[stretches.size()], 0)) << "the median of the ends";
    ++poor;
  }
  EXPECT_GT(poor, 0);
}

TEST(SplitPosition, FindsWhatIsFarFromAClusterAndPartsTheCluster) {
  std::vector<Interval> stretches{{1e6, 1e6 + 1}};
  for (int i = 0; i < 1000; ++i) stretches.push_back({i * 1e-3, (i + 0.5) * 1e-3});
  const SplitPosition parting =
      best_split_position(stretches);  // no place of sixty-four even ones lies within the cluster
  EXPECT_LT(parting.share, 0.51);
  EXPECT_NEAR(parting.place, 0.5, 0.01);
}

}  // namespace
}  // namespace bsp2::dataflow
