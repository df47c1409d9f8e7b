// Inputs that once went wrong (tests/cases, with cases.tsv), against what is right of each.

#include <gtest/gtest.h>

#include "models.hpp"

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
      const auto &a = result.boundary->points[t[0]], &b = result.boundary->points[t[1]], &c = result.boundary->points[t[2]];
      volume += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])) / 6;
    }
    EXPECT_NEAR(volume, result.report.in_volume, 1e-9 * volume) << file;
  }
}

TEST(Cases, NoNumberFillsTheMemory) {
  const auto report = report_of("tiny-angle.csg");
  EXPECT_EQ(report.in_cells, 0U);
  EXPECT_FALSE(report.warnings.empty());
}

}  // namespace
}  // namespace bsp2::models
