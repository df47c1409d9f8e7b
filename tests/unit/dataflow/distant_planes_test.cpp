// Balls on a grid: facets of one are in planes of others, but for the last bits.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "bsp2/model/builder/builder.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

std::array<double, 16> moved(const std::array<double, 3>& by) {
  return {1, 0, 0, by[0], 0, 1, 0, by[1], 0, 0, 1, by[2], 0, 0, 0, 1};
}

/// @param first where the first one is. @param step from one to the next.
model::Expression balls_on_grid(int side, double radius, std::uint32_t sides, double first, double step) {
  std::vector<model::Expression> balls;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z)
        balls.push_back(model::transform(moved({first + x * step, first + y * step, first + z * step}),
                                         model::sphere(radius, sides)));
  return model::unite(balls);
}

CompileOptions exactly() {
  CompileOptions options;
  options.coincidence = 0;
  return options;
}

/// Nothing of one is moved for the sake of others, so all is as if nothing had been merged.
TEST(DistantPlanes, StayWhatTheyAre) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(8); ++round) {
    const double radius = uniform(random, 0.1, 3), step = 2 * radius * uniform(random, 1.01, 1.5);
    const auto sides = static_cast<std::uint32_t>(2 * pick(random, 8, 20));
    const auto model = balls_on_grid(3, radius, sides, uniform(random, -9, 9), step);
    const Network<3> merged = compile<3>(model, {}), apart = compile<3>(model, exactly());
    EXPECT_EQ(merged.table.size(), apart.table.size()) << sides << " sides";
    const auto in = evaluate_all(merged, 0, {}).evaluation.totals.in.value();
    EXPECT_NEAR(in.volume(),
                27 * evaluate_all(compile<3>(model::sphere(radius, sides), {}), 0, {})
                         .evaluation.totals.in.value()
                         .volume(),
                1e-9 * in.volume());
  }
}

/// Two balls beside each other along one of their facets have its plane in common, but for rounding: that is
/// one hyperplane where they are near each other.
TEST(DistantPlanes, AreMergedWhereSolidsAreNear) {
  constexpr std::uint32_t sides = 32;
  for (const bool is_near : {true, false}) {
    const double normal = 3.5 * 2 * std::numbers::pi / sides, distance = is_near ? 1 : 4;
    const auto ball = model::sphere(1, sides);
    const auto beside = moved({-distance * std::sin(normal), distance * std::cos(normal), 0});
    const auto two = model::unite({ball, model::transform(beside, ball)});
    const std::size_t merged = compile<3>(two, {}).table.size(),
                      apart = compile<3>(two, exactly()).table.size();
    if (is_near)
      EXPECT_LT(merged, apart);
    else
      EXPECT_EQ(merged, apart);
  }
}

/// A disc that is thinner than the tolerance is left out, whose plane a box elsewhere has or not.
TEST(DistantPlanes, DoNotGiveThinSolidsTwoSides) {
  const auto disc = [](double at) {
    return model::transform(moved({9, 0, at}), model::cylinder(1e-12, 1, 1, 64));
  };
  const auto box = model::cuboid({1, 1, 0.3});
  for (const double at : {0.1 * 3, 0.7}) {
    const Network<3> network = compile<3>(model::unite({box, disc(at)}), {});
    EXPECT_EQ(network.warnings.size(), 1U);
    EXPECT_EQ(network.producers[0].is_empty() + network.producers[1].is_empty(), 1);
  }
}

}  // namespace
}  // namespace bsp2::dataflow
