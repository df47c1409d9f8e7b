// The sheet around the views: scales, places, hatching, and what does not fit.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "bsp2/error.hpp"
#include "sheets/annotations.hpp"
#include "sheets/hatching.hpp"
#include "sheets/layout.hpp"
#include "support/rounds.hpp"

namespace bsp2::drawing {
namespace {

using Loops = std::vector<std::vector<Point2>>;

/// Stars within stars: each a hole of the one around it.
Loops random_stars(std::mt19937& random) {
  std::uniform_real_distribution<double> shrink(0.7, 1), turn(0, 1);
  Loops loops;
  for (double radius = 100; radius > 20; radius *= 0.6) {
    auto& loop = loops.emplace_back();
    const int corners = 5 + static_cast<int>(random() % 20);
    for (int i = 0; i < corners; ++i) {
      const double angle = 2 * std::numbers::pi * (i + 0.5 * turn(random)) / corners,
                   r = radius * shrink(random);
      loop.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
  }
  return loops;
}

double area_of(const std::vector<Point2>& loop) {
  double twice = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    const Point2 &p = loop[i], &q = loop[(i + 1) % loop.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return std::fabs(twice) / 2;
}

bool is_inside(const Loops& loops, const Point2& p) {
  bool inside = false;
  for (const auto& loop : loops)
    for (std::size_t i = 0; i < loop.size(); ++i) {
      const Point2 &a = loop[i], &b = loop[(i + 1) % loop.size()];
      if ((a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        inside = !inside;
    }
  return inside;
}

TEST(Hatching, LiesInTheAreaAndFillsIt) {
  for (unsigned seed = 1; seed <= samples::rounds(20U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const Loops loops = random_stars(random);
    double area = 0;
    for (std::size_t i = 0; i < loops.size(); ++i) area += (i % 2 == 0 ? 1 : -1) * area_of(loops[i]);
    for (const std::size_t part : {0, 1, 2}) {
      const double distance = part / 2 == 0 ? 2.5 : 3.5;
      double length = 0;
      for (const auto& [from, to] : hatching(loops, part)) {
        EXPECT_NEAR(std::fabs(from[0] - to[0]), std::fabs(from[1] - to[1]), 1e-9);
        EXPECT_EQ((from[0] - to[0]) * (from[1] - to[1]) > 0, part % 2 == 0);
        EXPECT_TRUE(is_inside(loops, {(from[0] + to[0]) / 2, (from[1] + to[1]) / 2}));
        length += std::hypot(to[0] - from[0], to[1] - from[1]);
      }
      EXPECT_NEAR(length * distance, area, 0.05 * area);
    }
  }
}

std::vector<Point3> box(double x, double y, double z) {
  std::vector<Point3> points;
  for (int i = 0; i < 8; ++i) points.push_back({(i & 1) * x, (i >> 1 & 1) * y, (i >> 2) * z});
  return points;
}

TEST(Layout, PlacesViewsApartInsideTheFrameAndInLine) {
  for (unsigned seed = 1; seed <= samples::rounds(200U); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> size(-2, 4);
    DrawingOptions options;
    options.views.assign(all_views.begin(), all_views.end());
    std::shuffle(options.views.begin(), options.views.end(), random);
    options.views.resize(1 + random() % options.views.size());
    options.projection = random() % 2 == 0 ? Projection::first : Projection::third;
    options.size = sheet_size(std::array{"A0", "A1", "A2"}[random() % 3]).value();
    if (random() % 2 == 0) options.sections.push_back({"A", random() % 3, 0.1, random() % 2 == 0});
    const Layout layout = layout_of(
        box(std::pow(10, size(random)), std::pow(10, size(random)), std::pow(10, size(random))), options);
    std::map<ViewKind, std::array<Point2, 2>> of_kind;
    std::vector<std::array<Point2, 2>> boxes;
    for (const PlacedView& view : layout.views) {
      const Point2 upper{view.origin[0] + layout.scale * (view.upper[0] - view.lower[0]),
                         view.origin[1] + layout.scale * (view.upper[1] - view.lower[1])};
      EXPECT_GT(view.origin[0], binding_margin);
      EXPECT_GT(view.origin[1], margin + block_height);
      EXPECT_LT(upper[0], options.size.width - margin);
      EXPECT_LT(upper[1], options.size.height - margin);
      for (const auto& [low, high] : boxes)
        EXPECT_TRUE(low[0] > upper[0] || high[0] < view.origin[0] || low[1] > upper[1] ||
                    high[1] < view.origin[1]);
      boxes.push_back({view.origin, upper});
      if (view.section == nullptr) of_kind[view.kind] = boxes.back();
    }
    if (of_kind.count(ViewKind::front) == 0) continue;
    const auto& front = of_kind[ViewKind::front];
    const double side = options.projection == Projection::third ? 1 : -1;
    if (of_kind.count(ViewKind::top) != 0) {
      EXPECT_NEAR(of_kind[ViewKind::top][0][0], front[0][0], 1e-9);
      EXPECT_GT(side * (of_kind[ViewKind::top][0][1] - front[0][1]), 0);
    }
    if (of_kind.count(ViewKind::right) != 0) {
      EXPECT_NEAR(of_kind[ViewKind::right][0][1], front[0][1], 1e-9);
      EXPECT_GT(side * (of_kind[ViewKind::right][0][0] - front[0][0]), 0);
    }
  }
}

TEST(Layout, RefusesWhatDoesNotFitAndSaysWhatDoes) {
  DrawingOptions options;
  options.scale = 1;
  try {
    layout_of(box(1000, 20, 20), options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("1:10 is the largest usual scale"), std::string::npos)
        << error.what();
  }
}

TEST(Annotations, WriteNumbersAsDraughtsmenDo) {
  EXPECT_EQ(dimension_text(40), "40");
  EXPECT_EQ(dimension_text(0.5), "0.5");
  EXPECT_EQ(dimension_text(12.3456), "12.346");
  EXPECT_EQ(dimension_text(0.0012345), "0.00123");
  EXPECT_EQ(dimension_text(0.0149), "0.0149");
  EXPECT_EQ(dimension_text(5e39), "5e+39");
  EXPECT_EQ(scale_text(0.5), "1:2");
  EXPECT_EQ(scale_text(20), "20:1");
}

}  // namespace
}  // namespace bsp2::drawing
