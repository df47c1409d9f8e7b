// Roofs: against formulas, against a wavefront that Clipper moves step by step, and against distances from
// the outline.

#include <gtest/gtest.h>

#include <algorithm>
#include <clipper.hpp>
#include <cmath>
#include <numbers>
#include <sstream>

#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "constructs/outline.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using model::Expression;
using Plane = std::vector<std::array<double, 2>>;

template <int D>
double content(const Expression& e) {
  return evaluate_all(compile<D>(e, {}), 0, {}).evaluation.totals.in.value().volume();
}

double roof_volume(const std::string& plane, const std::string& arguments = "method = \"straight\"") {
  return content<3>(model::parse_csg("roof(" + arguments + ") {" + plane + "}", "test.csg").expression);
}

Expression straight_roof(const Expression& plane) {
  return model::construct(model::Roof{.method = model::Roof::Method::straight}, {plane});
}

constexpr double unit = 0x1p-30;  // of Clipper's integers

double area(const ClipperLib::Paths& paths) {
  double sum = 0;
  for (const auto& path : paths) sum += ClipperLib::Area(path);
  return sum * unit * unit;
}

/// The integral over the height of the areas inside a wavefront that moves in small steps, each of which
/// keeps sharp corners.
double wavefront_volume(const Outline& outline, double step) {
  ClipperLib::Paths front;
  for (const auto& path : outline) {
    auto& scaled = front.emplace_back();
    for (const auto& p : path) scaled.emplace_back(std::llround(p[0] / unit), std::llround(p[1] / unit));
  }
  const auto moved = [&](double by) {
    ClipperLib::ClipperOffset clipper(1e6);
    clipper.AddPaths(front, ClipperLib::jtMiter, ClipperLib::etClosedPolygon);
    ClipperLib::Paths result;
    clipper.Execute(result, -by / unit);
    return result;
  };
  double volume = 0;
  while (!front.empty()) {
    volume += step * area(moved(step / 2));
    front = moved(step);
  }
  return volume;
}

TEST(Roof, HasTheVolumeOfItsFormula) {
  EXPECT_NEAR(roof_volume("square(4);"), 64.0 / 6, 1e-12);
  EXPECT_NEAR(roof_volume("square(4);", ""), 64.0 / 6, 1e-12) << "both methods are alike for convex outlines";
  EXPECT_NEAR(roof_volume("square([5, 2]);"), 5 - 8.0 / 12, 1e-12);
  EXPECT_NEAR(roof_volume("circle(r = 3, $fn = 7);"),
              3.5 * 9 * std::sin(2 * std::numbers::pi / 7) * std::cos(std::numbers::pi / 7), 1e-11)
      << "a pyramid";
  const std::string ell = "polygon([[0,0],[4,0],[4,2],[2,2],[2,4],[0,4]]);";
  EXPECT_NEAR(roof_volume(ell), 12 - 8 + 4.0 / 3, 1e-12);
  // The frame between squares of 6 and 2: its wavefront is the frame between 6 - 2 t and 2 + 2 t.
  EXPECT_NEAR(roof_volume("difference() { square(6, center = true); square(2, center = true); }"), 16, 1e-12);
  // A plus of five unit squares: all its reflex corners meet in the middle.
  EXPECT_NEAR(roof_volume("square([3, 1], center = true); square([1, 3], center = true);"),
              5 * 0.5 - 12 * 0.125 + 4 / 24.0, 1e-12);
  EXPECT_EQ(roof_volume("square(0);"), 0);
}

TEST(Roof, IsNamedByItsMethod) {
  const auto model = model::parse_csg("roof(method = \"flat\") { square(1); }", "test.csg");
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_NE(model.warnings[0].find("test.csg:1:1: roof has no method 'flat'"), std::string::npos)
      << model.warnings[0];
  EXPECT_EQ(model.expression.dimension(), 3);
}

void expect_wavefront(const Expression& plane, double step) {
  const double volume = content<3>(straight_roof(plane));
  EXPECT_NEAR(volume, wavefront_volume(outline_of(plane, {}), step), 2e-3 * volume + 1e-4);
}

/// Squares of a grid: corners meet at the same time, all the time.
TEST(Roof, FollowsTheWavefrontOfSquares) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    SCOPED_TRACE(round);
    std::vector<Expression> squares;
    std::ostringstream text;
    for (int x = 0; x < 5; ++x)
      for (int y = 0; y < 5; ++y) {
        if (!chance(random, 0.65)) continue;
        const double matrix[] = {1, 0, 1.0 * x, 0, 1, 1.0 * y, 0, 0, 1};
        squares.push_back(model::transform(matrix, model::cuboid({1, 1})));
        text << "[" << x << "," << y << "] ";
      }
    if (squares.empty()) continue;
    SCOPED_TRACE(text.str());
    ASSERT_NO_FATAL_FAILURE(expect_wavefront(model::unite(squares), 1.0 / 256));
    if (::testing::Test::HasFailure()) return;
  }
}

/// A star with corners anywhere, with a hole of the same kind.
Expression random_star(Random& random) {
  const auto ring = [&](double low, double high) {
    Plane points;
    const int n = pick(random, 3, 14);
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * (i + uniform(random, 0, 0.6)) / n,
                   radius = uniform(random, low, high);
      points.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    return model::polygon(points);
  };
  const Expression star = ring(4, 10);
  return chance(random, 0.5) ? star : model::subtract({star, ring(0.5, 1.9)});
}

TEST(Roof, FollowsTheWavefrontOfStars) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    SCOPED_TRACE(round);
    ASSERT_NO_FATAL_FAILURE(expect_wavefront(random_star(random), 1.0 / 64));
    if (::testing::Test::HasFailure()) return;
  }
}

/// All reflex corners of a regular star meet in its centre, where its points end: the roof is a pyramid.
TEST(Roof, OverARegularStarIsAPyramid) {
  for (const int points : {2, 3, 4, 5, 7, 12})
    for (const double inner : {0.3, 0.5, 0.7}) {
      Plane star;
      for (int i = 0; i < 2 * points; ++i) {
        const double angle = std::numbers::pi * i / points + 0.37, radius = i % 2 == 0 ? 10 : 10 * inner;
        star.push_back({radius * std::cos(angle), radius * std::sin(angle)});
      }
      const double height = std::fabs(star[0][0] * star[1][1] - star[0][1] * star[1][0]) /
                            std::hypot(star[1][0] - star[0][0], star[1][1] - star[0][1]);
      const double volume = std::fabs(signed_area(star)) * height / 3;
      EXPECT_NEAR(content<3>(straight_roof(model::polygon(star))), volume, 1e-9 * volume)
          << points << " points, inner radius " << inner;
    }
}

TEST(Roof, StandsOnItsPlaneSolid) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(10); ++round) {
    const Expression star = random_star(random);
    for (const auto method : {model::Roof::Method::straight, model::Roof::Method::voronoi}) {
      const Expression roof = model::construct(model::Roof{.method = method}, {star});
      EXPECT_NEAR(content<2>(model::construct(model::Projection{.cut = true}, {roof})), content<2>(star),
                  1e-7 * content<2>(star))
          << round;
    }
  }
}

/// Distances from the outline, summed over a fine grid.
TEST(Roof, OfVoronoiIsAsHighAsPointsAreFarFromTheOutline) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < 3; ++round) {
    const Expression star = random_star(random);
    const Outline outline = outline_of(star, {});
    const double step = 0.08;
    double sum = 0;
    for (double y = -10 + step / 2; y < 10; y += step)
      for (double x = -10 + step / 2; x < 10; x += step) {
        double nearest = 100;
        bool inside = false;
        for (const auto& path : outline)
          for (std::size_t i = 0; i < path.size(); ++i) {
            const auto &a = path[i], &b = path[(i + 1) % path.size()];
            const double ux = b[0] - a[0], uy = b[1] - a[1];
            const double t = std::clamp(((x - a[0]) * ux + (y - a[1]) * uy) / (ux * ux + uy * uy), 0.0, 1.0);
            nearest = std::min(nearest, std::hypot(x - a[0] - t * ux, y - a[1] - t * uy));
            if ((a[1] > y) != (b[1] > y) && x < a[0] + (y - a[1]) / uy * ux) inside = !inside;
          }
        if (inside) sum += nearest * step * step;
      }
    const Expression roof = model::construct(model::Roof{.resolution = {.fn = 48}}, {star});
    EXPECT_NEAR(content<3>(roof), sum, 5e-3 * sum) << round;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
