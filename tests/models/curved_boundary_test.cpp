// Boundaries of round solids that share planes, as a user asks for them.

#include <gtest/gtest.h>

#include <numbers>

#include "models.hpp"

namespace bsp2::models {
namespace {

supersteps::RunOptions options_for(const std::string& name) {
  supersteps::RunOptions options;
  options.model = cases() / name;
  options.threads = 2;
  options.boundary = true;
  return options;
}

void expect_closed(const supersteps::RunResult& result) {
  ASSERT_TRUE(result.report.boundary && result.boundary);
  EXPECT_TRUE(result.report.boundary->closed);
  EXPECT_GT(result.report.boundary->triangles, 100U);
  EXPECT_NEAR(result.boundary->volume(), result.report.in_volume, 1e-11 * result.report.in_volume);
}

/// The volume that is meant is between that of the IN cells and that with the FUZZY ones.
void expect_volume(const supersteps::RunResult& result, double truth) {
  EXPECT_LE(result.report.in_volume, truth);
  EXPECT_GE(result.report.in_volume + result.report.fuzzy_volume, truth);
}

TEST(CurvedBoundary, OfTwoEqualBalls) {
  for (const double tolerance : {0.0, 0.25, 0.1}) {
    supersteps::RunOptions options = options_for("curved-two-equal-balls.csg");
    if (tolerance > 0) options.tolerance = tolerance;
    const auto result = supersteps::run(options);
    expect_closed(result);
    // Two balls of radius 3, 2 apart, less their common part, two caps of height 2.
    expect_volume(result, 2 * 36 * std::numbers::pi - 2 * std::numbers::pi * 4 * (9 - 2) / 3);
  }
}

TEST(CurvedBoundary, OfACrossOfPipes) {
  supersteps::RunOptions options = options_for("curved-pipe-cross.csg");
  options.curved = true;
  const auto result = supersteps::run(options);
  expect_closed(result);
  // Two bars of length 12 less what they have in common, 16 r^3 / 3; and bores likewise.
  const auto cross = [](double r) { return 2 * std::numbers::pi * r * r * 12 - 16 * r * r * r / 3; };
  expect_volume(result, cross(3) - cross(2));
}

TEST(CurvedBoundary, OfAHollowTorus) {
  const auto result = supersteps::run(options_for("curved-hollow-torus.csg"));
  expect_closed(result);
  expect_volume(result, 2 * std::numbers::pi * std::numbers::pi * 5 * (4 - 1.5 * 1.5));
}

TEST(CurvedBoundary, IsTheSameForAnyThreadsAndRegions) {
  supersteps::RunOptions options = options_for("curved-two-equal-balls.csg");
  options.tolerance = 0.25;
  options.regions = 1;
  const auto one = supersteps::run(options);
  for (const unsigned regions : {1U, 4U, 64U}) {
    options.regions = regions;
    options.threads = 3;
    const auto other = supersteps::run(options);
    expect_closed(other);
    EXPECT_EQ(other.boundary->points, one.boundary->points) << regions;
    EXPECT_EQ(other.boundary->triangles, one.boundary->triangles) << regions;
  }
}

}  // namespace
}  // namespace bsp2::models
