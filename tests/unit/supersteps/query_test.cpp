// Points against the triangles of the boundary: two ways to the same surface.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "bsp2/supersteps/loop/run.hpp"
#include "render/camera.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::supersteps {
namespace {

namespace fs = std::filesystem;

Vector operator-(const Vector& a, const Vector& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
double length(const Vector& a) { return std::sqrt(dot(a, a)); }
Vector cross(const Vector& a, const Vector& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

double distance_to_segment(const Vector& p, const Vector& a, const Vector& b) {
  const Vector along = b - a, to = p - a;
  const double t = std::clamp(dot(along, to) / dot(along, along), 0.0, 1.0);
  return length(p - Vector{a[0] + t * along[0], a[1] + t * along[1], a[2] + t * along[2]});
}

double distance_to_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  const Vector normal = cross(b - a, c - a);
  const auto inside = [&](const Vector& u, const Vector& v) { return dot(cross(v - u, p - u), normal) >= 0; };
  if (length(normal) > 0 && inside(a, b) && inside(b, c) && inside(c, a))
    return std::fabs(dot(p - a, normal)) / length(normal);
  return std::min({distance_to_segment(p, a, b), distance_to_segment(p, b, c), distance_to_segment(p, c, a)});
}

/// The angle under which a triangle is seen, with its sign (Van Oosterom and Strackee).
double solid_angle(const Vector& a, const Vector& b, const Vector& c) {
  const double la = length(a), lb = length(b), lc = length(c);
  return 2 * std::atan2(dot(a, cross(b, c)), la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb);
}

void compare_with_the_boundary(const fs::path& model, unsigned seed) {
  SCOPED_TRACE(::testing::Message() << model << ", seed " << seed);
  RunOptions options;
  options.model = model;
  options.threads = 2;
  options.boundary = true;
  const RunResult first = run(options);
  const RunReport& size = first.report;
  std::mt19937 random(seed);
  for (int i = 0; i < 15; ++i) {  // the middles of some cells, then points anywhere
    const auto& batch = *first.mesh.batches[random() % first.mesh.batches.size()];
    const std::size_t cell = random() % batch.size(), count = batch.point_count(cell);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0;
      for (std::size_t v = 0; v < count; ++v) sum += batch.cell_points(cell)[3 * v + axis];
      options.points.push_back(sum / static_cast<double>(count));
    }
  }
  for (int i = 15; i < 60; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double room = 0.3 * (size.upper[axis] - size.lower[axis]);
      options.points.push_back(
          std::uniform_real_distribution<double>(size.lower[axis] - room, size.upper[axis] + room)(random));
    }
  const RunResult result = run(options);
  ASSERT_EQ(result.answers.size(), 60U);
  int inside = 0;
  for (std::size_t i = 0; i < 60; ++i) {
    const Vector p{options.points[3 * i], options.points[3 * i + 1], options.points[3 * i + 2]};
    const Answer& answer = result.answers[i];
    double expected = std::numeric_limits<double>::infinity(), angle = 0;
    for (const auto& [a, b, c] : result.boundary->triangles) {
      const auto& points = result.boundary->points;
      expected = std::min(expected, distance_to_triangle(p, points[a], points[b], points[c]));
      angle += solid_angle(points[a] - p, points[b] - p, points[c] - p);
    }
    if (expected > 1e-7) {  // nearer to the surface the sum of angles cannot tell
      EXPECT_EQ(answer.label == geometry::Label::in, angle > 2 * std::numbers::pi)
          << p[0] << ' ' << p[1] << ' ' << p[2] << ", distance " << expected << ", angle " << angle;
    }
    EXPECT_NEAR(answer.distance, expected, 1e-9 * (1 + expected));
    EXPECT_NEAR(length(Vector{answer.nearest[0], answer.nearest[1], answer.nearest[2]} - p), answer.distance,
                1e-9 * (1 + expected));
    EXPECT_EQ(answer.part, answer.label == geometry::Label::in ? 0 : geometry::no_part);
    EXPECT_TRUE(answer.primitive < 0 || answer.label == geometry::Label::in);
    inside += answer.label == geometry::Label::in ? 1 : 0;
  }
  EXPECT_GT(inside, 0);
  EXPECT_LT(inside, 60);
}

TEST(Query, AgreesWithTheTrianglesOfTheBoundary) {
  const unsigned seed = samples::new_seed();
  for (const char* name : {"mechanical_piece", "menger_sponge"})
    compare_with_the_boundary(fs::path(BSP2_SOURCE_DIR) / "examples" / (std::string(name) + ".csg"), seed);
}

TEST(Query, AgreesWithTheBoundaryOfARandomModel) {
  const unsigned seed = samples::new_seed();
  std::mt19937 random(seed);
  const samples::TemporaryFolder folder;
  const fs::path model = folder.path() / "model.csg";
  std::ofstream text(model);
  const auto number = [&](double low, double high) {
    return std::to_string(std::uniform_real_distribution<double>(low, high)(random));
  };
  for (int i = 0; i < 20; ++i) {
    const std::string c = number(0.2, 0.9), s = number(0.2, 0.9);  // turned and sheared
    text << "multmatrix([[" << c << ",-" << s << ",0," << number(0, 5) << "],[" << s << "," << c << ",0.1,"
         << number(0, 5) << "],[0,0,1," << number(0, 5) << "],[0,0,0,1]])"
         << " difference() { cube(size=[2,1.5,1]); sphere($fn=7,r=" << number(0.5, 1.4) << "); }\n";
  }
  text.close();
  compare_with_the_boundary(model, seed);
}

/// Undecided cells make the distance smaller, never larger.
TEST(Query, FuzzyCellsOnlyShortenDistances) {
  RunOptions options;
  options.model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  options.collect_cells = true;
  const RunReport size = run(options).report;
  std::mt19937 random(5);
  for (int i = 0; i < 200; ++i)
    for (int axis = 0; axis < 3; ++axis)
      options.points.push_back(
          std::uniform_real_distribution<double>(size.lower[axis], size.upper[axis])(random));
  const auto exact = run(options).answers;
  options.level = 14;
  const auto coarse = run(options).answers;
  int fuzzy = 0;
  for (std::size_t i = 0; i < exact.size(); ++i) {
    EXPECT_LE(coarse[i].distance, exact[i].distance * (1 + 1e-12));
    if (coarse[i].label == geometry::Label::fuzzy)
      ++fuzzy;
    else
      EXPECT_EQ(coarse[i].label, exact[i].label);
  }
  EXPECT_GT(fuzzy, 0);
  EXPECT_LT(fuzzy, 200);
}

/// Red, then blue within green: the outermost colour counts.
TEST(Colours, ReachThePrimitivesOfARun) {
  const samples::TemporaryFolder folder;
  RunOptions options;
  options.model = folder.path() / "model.csg";
  options.collect_cells = true;
  std::ofstream(options.model)
      << "color([1,0,0,1]) cube(size=[1,1,1]);\n"
         "color([0,1,0,0.5]) group() { multmatrix([[1,0,0,2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
         "color([0,0,1,1]) cube(size=[1,1,1]); }\n"
         "multmatrix([[1,0,0,4],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) color([-1,-1,-1,1]) cube(size=[1,1,1]);\n";
  const auto colours = run(options).colour_of_primitive;
  ASSERT_EQ(colours.size(), 3U);
  EXPECT_EQ(colours[0], (Rgba{255, 0, 0, 255}));
  EXPECT_EQ(colours[1], (Rgba{0, 255, 0, 128}));
  EXPECT_FALSE(colours[2]);
  options.model = fs::path(BSP2_SOURCE_DIR) / "examples" / "mechanical_piece.csg";
  EXPECT_TRUE(run(options).colour_of_primitive.empty());
}

}  // namespace
}  // namespace bsp2::supersteps
