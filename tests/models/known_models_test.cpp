// Models whose volume is known.

#include <gtest/gtest.h>

#include <numbers>

#include "models.hpp"

namespace bsp2::models {
namespace {

TEST(KnownModel, SpheresAreThoseOfOpenScad) {  // known to six digits
  EXPECT_NEAR(evaluate(model::sphere(1, 8)).volume(), 3.22904, 1e-5);
  EXPECT_NEAR(evaluate(model::sphere(1, 5)).volume(), 2.40228, 1e-5);
}

TEST(KnownModel, MengerSponges) {
  double volume = 1;
  for (int level = 1; level <= 2; ++level) {
    volume *= 20;
    EXPECT_NEAR(evaluate(menger(level)).volume(), volume, 1e-14 * volume) << "level " << level;
    EXPECT_NEAR(evaluate(menger(level), 0).volume(), volume, 1e-14 * volume) << "level " << level;
  }
}

TEST(KnownModel, TheShippedTower) {
  const auto report = run_file(std::filesystem::path(BSP2_SOURCE_DIR) / "examples" / "leaning_tower.csg");
  EXPECT_EQ(report.primitives, 2609U);
  EXPECT_EQ(report.fuzzy_cells, 0U);
  EXPECT_NEAR(report.in_volume, 4992.14352895, 1e-9 * 4992.14352895);
}

TEST(KnownModel, TheShippedConstructs) {
  const auto examples = std::filesystem::path(BSP2_SOURCE_DIR) / "examples";
  EXPECT_NEAR(run_file(examples / "constructs.csg").in_volume, 80, 1e-9);
  const auto plane = run_file(examples / "plane.csg");
  EXPECT_EQ(plane.dimension, 2);
  EXPECT_NEAR(plane.in_volume, 169, 1e-9);
}

TEST(KnownModel, TheNapkinRingHasTheVolumeOfItsHeight) {
  supersteps::RunOptions options;
  options.model = std::filesystem::path(BSP2_SOURCE_DIR) / "examples" / "napkin_ring.csg";
  options.curved = true;
  options.tolerance = 0.05;
  options.boundary = true;
  const auto result = supersteps::run(options);
  const double truth = 36 * std::numbers::pi;
  EXPECT_LE(result.report.in_volume, truth);
  EXPECT_GE(result.report.in_volume + result.report.fuzzy_volume, truth);
  EXPECT_LT(result.report.fuzzy_volume, 0.15 * truth);
  EXPECT_LE(result.report.inertia_least.at(0).at(0), truth);
  EXPECT_GE(result.report.inertia_most.at(0).at(0), truth);
  ASSERT_TRUE(result.boundary);
  EXPECT_TRUE(result.boundary->is_closed());
  // Without a tolerance, a sensible one is chosen.
  options.tolerance.reset();
  options.boundary = false;
  options.collect_cells = false;
  const auto report = supersteps::run(options).report;
  ASSERT_TRUE(report.tolerance);
  EXPECT_LE(report.in_volume, truth);
  EXPECT_GE(report.in_volume + report.fuzzy_volume, truth);
  EXPECT_LT(report.fuzzy_volume, 0.05 * truth);
}

TEST(KnownModel, ShippedExamplesHaveNoFuzzyCell) {
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(BSP2_SOURCE_DIR) / "examples")) {
    if (entry.path().extension() != ".csg") continue;
    const auto one = run_file(entry.path(), 1), four = run_file(entry.path(), 4);
    EXPECT_GT(one.in_volume, 0) << entry.path();
    EXPECT_EQ(one.fuzzy_cells, 0U) << entry.path();
    EXPECT_EQ(one.digest, four.digest) << entry.path();
  }
}

}  // namespace
}  // namespace bsp2::models
