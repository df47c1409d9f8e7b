// The examples of the text form against their volumes, and what else docs/expressions.md promises.

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "models.hpp"

namespace bsp2::models {
namespace {

namespace fs = std::filesystem;
constexpr double pi = std::numbers::pi;

struct Example {
  const char* name;
  int dimension;
  double volume;
  double tolerance = 0;                    // of round solids; 0: it is made of polytopes
  double share = dimension > 3 ? 1 : 0.1;  // at most so much of the volume is FUZZY then
};

// The volumes are derived in the comments of the files.
const Example examples[] = {
    {"simplex", 4, 27.0 / 8},
    {"simplex_points", 3, 4},
    {"polytope", 4, 32.0 / 3},
    {"cuboid", 5, 120},
    {"ball", 4, pi* pi / 2, 0.25},
    {"d_cylinder", 4, 8 * pi / 3, 0.2},
    {"cone", 3, 7 * pi, 0.02},
    {"torus", 3, 6 * pi* pi, 0.05},
    {"paraboloid", 3, 9 * pi, 0.02},
    {"complement", 4, 47},
    {"symmetric_difference", 2, 6},
    {"multmatrix", 4, 6},
    {"product", 4, 3 * 1.7320508075688772},
    {"duocylinder", 4, pi* pi / 4, 0.1},
    {"product_cone", 4, 2 * pi / 3, 0.1},
    {"extrude", 4, 4.5},
    {"embed", 4, 0.5e-4},
    {"project", 2, 1.7320508075688772},
    {"project_ball", 2, 3 * pi, 0.001},
    {"section", 3, 4.0 / 3 * pi * 0.512, 0.01},
    {"section_torus", 2, 8 * pi / 3 + 4 * 1.7320508075688772, 0.005},
    {"projective", 3, 7.0 / 24},
    {"minkowski", 4, 24 + 50 + 17.5 + 10.0 / 6 + 1.0 / 24},
    {"grow", 4, 120},
    {"shrink", 3, 1.125},
    {"sweep", 3, pi / 6 + 0.75 * pi, 0.01},
    {"sweep_polyline", 2, 5},
    {"hull", 4, 2.0 / 3},
    {"bezier", 2, 3, 0.01},
    {"bezier_surface", 3, 8, 0.05},
    {"bezier_solid", 3, 3, 0.02},
    {"bspline", 2, 30, 0.01},
    {"nurbs", 2, 4 * pi, 0.01},
    {"nurbs_solid", 3, 1.5 * pi, 0.02},
    {"subdivision", 3, 6 * 61.0 / 45 * 61 / 45, 0.05, 0.4},
    {"part", 3, 4},
    {"measure", 3, 7},
    {"moving_part", 4, 48},
    {"moving_part_slice", 3, 8},
    {"moving_part_swept", 3, 28},
    {"moving_part_collision", 4, 1},
    {"configuration_space", 4, 36},
};

fs::path path_of(const std::string& name) {
  return fs::path(BSP2_SOURCE_DIR) / "examples" / "expressions" / (name + ".csg");
}

supersteps::RunReport run_example(const Example& example, unsigned threads) {
  supersteps::RunOptions options;
  options.model = path_of(example.name);
  options.threads = threads;
  options.collect_cells = false;
  if (example.tolerance > 0) options.tolerance = example.tolerance;
  return supersteps::run(options).report;
}

TEST(Expressions, EveryExampleHasItsVolume) {
  for (const Example& example : examples) {
    if (example.dimension > geometry::built_dimensions) continue;
    SCOPED_TRACE(example.name);
    const auto report = run_example(example, 1);
    EXPECT_EQ(report.dimension, example.dimension);
    EXPECT_TRUE(report.warnings.empty()) << report.warnings.front();
    if (example.tolerance == 0) {
      EXPECT_EQ(report.fuzzy_cells, 0U);
      EXPECT_NEAR(report.in_volume, example.volume, 1e-9 * example.volume);
      continue;
    }
    EXPECT_LE(report.in_volume, example.volume);
    EXPECT_GE(report.in_volume + report.fuzzy_volume, example.volume);
    EXPECT_LT(report.fuzzy_volume, example.share * example.volume);
    EXPECT_GT(report.fuzzy_volume, 0);
  }
}

TEST(Expressions, EveryFileIsInTheTable) {
  std::set<std::string> known, there;
  for (const Example& example : examples) known.insert(example.name);
  for (const auto& entry : fs::directory_iterator(path_of("x").parent_path()))
    there.insert(entry.path().stem());
  EXPECT_EQ(known, there);
}

TEST(Expressions, CellsDoNotDependOnThreads) {
  for (const Example& example : examples) {
    if (example.dimension > geometry::built_dimensions) continue;
    if (example.tolerance > 0 && example.dimension > 3) continue;  // these take long
    EXPECT_EQ(run_example(example, 1).digest, run_example(example, 3).digest) << example.name;
  }
}

TEST(Expressions, PartsAndMeasuresAreReported) {
  const auto parts = run_file(path_of("part"));
  ASSERT_EQ(parts.named_parts.size(), 2U);
  EXPECT_EQ(parts.named_parts[0].name, "shaft");
  EXPECT_EQ(parts.named_parts[0].part, 0);
  EXPECT_EQ(parts.named_parts[1].name, "head");
  EXPECT_EQ(parts.named_parts[1].part, 1);
  for (const auto& part : parts.named_parts) EXPECT_NEAR(part.volume, 2, 1e-12);
  const auto drilled = run_file(path_of("measure"));
  ASSERT_EQ(drilled.measures.size(), 2U);
  EXPECT_EQ(drilled.measures[0].name, "block");
  EXPECT_NEAR(drilled.measures[0].in_volume, 8, 1e-12);
  EXPECT_EQ(drilled.measures[1].name, "hole");
  EXPECT_NEAR(drilled.measures[1].in_volume, 1, 1e-12);
  EXPECT_NEAR(drilled.measures[1].inertia.at(1).at(1), 1.0 / 12, 1e-12);
}

TEST(Expressions, CellsOfANamedPartHaveItsNumber) {
  supersteps::RunOptions options;
  options.model = path_of("part");
  std::map<std::int32_t, double> volume;
  for (const auto& batch : supersteps::run(options).mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) volume[batch->part[cell]] += batch->volume[cell];
  ASSERT_EQ(volume.size(), 2U);
  EXPECT_NEAR(volume[0], 2, 1e-12);
  EXPECT_NEAR(volume[1], 2, 1e-12);
}

/// A measure of what is round is an interval, as good as the run.
TEST(Expressions, MeasuresOfRoundSolidsAreIntervals) {
  const fs::path file = fs::temp_directory_path() / ("bsp2_measure_" + std::to_string(::getpid()) + ".csg");
  std::ofstream(file) << "difference() { cuboid([4, 4, 4], center = true); measure(\"ball\") ball(r = 1); }";
  supersteps::RunOptions options;
  options.model = file;
  options.tolerance = 0.05;
  const auto report = supersteps::run(options).report;
  fs::remove(file);
  ASSERT_EQ(report.measures.size(), 1U);
  const auto& ball = report.measures[0];
  EXPECT_LT(ball.in_volume, 4 * pi / 3);
  EXPECT_GT(ball.in_volume + ball.fuzzy_volume, 4 * pi / 3);
  ASSERT_EQ(ball.inertia_least.size(), 4U);
  EXPECT_LT(ball.inertia_least[2][2], 4 * pi / 15);
  EXPECT_GT(ball.inertia_most[2][2], 4 * pi / 15);
  EXPECT_LT(ball.inertia_least[1][2], 0);
  EXPECT_GT(ball.inertia_most[1][2], 0);
  EXPECT_LE(report.in_volume, 64 - 4 * pi / 3);
}

}  // namespace
}  // namespace bsp2::models
