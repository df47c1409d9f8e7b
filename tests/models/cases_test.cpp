// Inputs that once went wrong (tests/cases, with cases.tsv), against what is right of each.

#include <gtest/gtest.h>

#include <ctime>
#include <fstream>
#include <random>

#include "models.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

supersteps::RunReport report_of(const std::string& file, bool boundary = false) {
  supersteps::RunOptions options;
  options.model = cases() / file;
  options.threads = 2;
  options.boundary = options.collect_cells = boundary;
  return supersteps::run(options).report;
}

TEST(Cases, DrawingsHaveTheirAreas) {
  EXPECT_NEAR(report_of("dxf-polyline-then-objects.csg").in_volume, 1250, 1e-9 * 1250);
  EXPECT_NEAR(report_of("dxf-insert-scaled.csg").in_volume, 0.5, 1e-9);
  EXPECT_NEAR(report_of("dxf-old-polyline.csg").in_volume, 50, 1e-9);
  // Half circles as polygons of few sides.
  const double bulged = report_of("dxf-bulge.csg").in_volume, round = 176 + std::numbers::pi * 16;
  EXPECT_LT(bulged, round);
  EXPECT_NEAR(bulged, round, 0.05 * std::numbers::pi * 16);
}

TEST(Cases, MeshesAreReadAndRepaired) {
  const auto counted = report_of("stl-count-0.csg");
  EXPECT_NEAR(counted.in_volume, 64, 1e-6);
  ASSERT_EQ(counted.warnings.size(), 1U);
  EXPECT_NE(counted.warnings[0].find("the header says 0 facets"), std::string::npos) << counted.warnings[0];
  const auto sphere = report_of("sphere-jitter-hole.csg", true);
  EXPECT_LE(sphere.in_cells, 500U);
  ASSERT_TRUE(sphere.boundary);
  EXPECT_TRUE(sphere.boundary->closed);
  EXPECT_NEAR(sphere.boundary->area, 1003.4, 0.01 * 1003.4);
}

TEST(Cases, RoundSolidsHaveAClosedBoundary) {
  for (const char* file : {"curved-two-equal-balls.csg", "curved-hollow-torus.csg"}) {
    supersteps::RunOptions options;
    options.model = cases() / file;
    options.threads = 2;
    options.tolerance = 0.25;
    options.boundary = true;
    const auto result = supersteps::run(options);
    ASSERT_TRUE(result.boundary) << file;
    EXPECT_TRUE(result.boundary->is_closed()) << file;
    double volume = 0;
    for (const auto& t : result.boundary->triangles) {
      const auto &a = result.boundary->points[t[0]], &b = result.boundary->points[t[1]],
                 &c = result.boundary->points[t[2]];
      volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0])) /
                6;
    }
    EXPECT_NEAR(volume, result.report.in_volume, 1e-9 * volume) << file;
  }
}

TEST(Cases, NoNumberFillsTheMemory) {
  const auto report = report_of("tiny-angle.csg");
  EXPECT_EQ(report.in_cells, 0U);
  EXPECT_FALSE(report.warnings.empty());
}

/// Of the processor, so that a busy machine makes no difference.
template <typename Work>
double seconds_of(Work&& work) {
  const std::clock_t start = std::clock();
  work();
  return static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

/// What this machine, in this build, takes for a landscape of noise of so many pixels.
double seconds_of_noise(int width, int height) {
  const samples::TemporaryFolder folder;
  std::mt19937 random(1);
  std::ofstream heights(folder.path() / "noise.dat");
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      heights << std::uniform_real_distribution<>(0, 100)(random) << (x + 1 < width ? " " : "\n");
  heights.close();
  std::ofstream(folder.path() / "noise.csg") << "multmatrix([[0.5,0,0,0],[0,0.5,0,0],[0,0,0.05,0],[0,0,0,1]])"
                                                "{surface(file=\"noise.dat\",center=true);}";
  return seconds_of([&] { run_file(folder.path() / "noise.csg"); });
}

TEST(Cases, DamagedMeshesTakeNoTime) {
  if (samples::is_sanitized) GTEST_SKIP() << "times are those of other builds";
  const double noise = seconds_of_noise(70, 52);
  EXPECT_LT(seconds_of([] {
              const auto report = report_of("stl-damaged-slow.csg");
              EXPECT_EQ(report.warnings.size(), 1U);
              EXPECT_NEAR(report.in_volume, 4040, 1e-6);
            }),
            8 * noise)
      << "as long is right, and 23 times was wrong; noise: " << noise << " s";
}

/// Whole grey values have many facets in one plane; noise of as many pixels has none.
TEST(Cases, LandscapesOfWholeGreysAreAsFastAsNoise) {
  if (samples::is_sanitized) GTEST_SKIP() << "times are those of other builds";
  const double noise = seconds_of_noise(140, 105);  // as the picture
  EXPECT_LT(seconds_of([] { report_of("surface-slow.csg"); }), 3 * noise)
      << "1.5 times is right, and 4 times was wrong; noise: " << noise << " s";
}

TEST(Cases, PartsHaveTheirVolumes) {
  supersteps::RunOptions options;
  options.model = cases() / "drilled-plate.csg";
  options.threads = 2;
  const auto result = supersteps::run(options);
  ASSERT_EQ(result.report.named_parts.size(), 2U);
  EXPECT_EQ(result.report.named_parts[0].name, "steel");
  EXPECT_EQ(result.report.named_parts[1].name, "copper");
  // Each a plate with four holes, prisms over polygons of 32 corners.
  const double plate = 20 * (50 * 60 - 4 * 16 * 25 * std::sin(std::numbers::pi / 16));
  std::map<std::int32_t, double> volumes;
  for (const auto& batch : result.mesh.batches)
    for (std::size_t i = 0; i < batch->size(); ++i) volumes[batch->part[i]] += batch->volume[i];
  ASSERT_EQ(volumes.size(), 2U);
  for (const auto& part : result.report.named_parts)
    EXPECT_NEAR(volumes[part.part], plate, 1e-9 * plate) << part.name;
}

/// What a solver sees as the skin of a mesh that fits has the area of the solid's own.
TEST(Cases, TheSkinHasTheRightArea) {
  const auto report = report_of("nonconforming.csg", true);
  ASSERT_TRUE(report.boundary);
  EXPECT_TRUE(report.boundary->closed);
  EXPECT_NEAR(report.boundary->area, 376.6, 0.05);
}

}  // namespace
}  // namespace bsp2::models
