// Pictures: how faces bend, where lines are drawn, and what becomes of the pixels.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <sstream>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/supersteps/loop/run.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "pixels/png.hpp"
#include "render/round_faces.hpp"
#include "supersteps/images.hpp"
#include "support/seeds.hpp"

namespace bsp2::supersteps {
namespace {

using Pixels = std::vector<std::uint32_t>;

Pixels pixels_of(const std::string& png) { return decode(png).pixels; }

RunResult evaluated(const std::string& model, bool curved = false) {
  RunOptions options;
  options.model = "model.csg";
  options.text = std::make_shared<const std::string>(model);
  options.curved = curved;
  return run(options);
}

/// Rotation about a random axis by a random angle, in rows, and a shift.
struct Motion {
  std::array<Vector, 3> rows;
  Vector shift;
  explicit Motion(std::mt19937& random) {
    std::normal_distribution<double> normal;
    const Vector x = normalized({normal(random), normal(random), normal(random)});
    const Vector other = normalized({normal(random), normal(random), normal(random)});
    const Vector y =
        normalized(difference(other, {dot(other, x) * x[0], dot(other, x) * x[1], dot(other, x) * x[2]}));
    rows = {x, y, Vector{x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]}};
    shift = {normal(random), normal(random), normal(random)};
  }
  [[nodiscard]] std::string text() const {
    std::ostringstream out;
    out.precision(17);
    out << "multmatrix([";
    for (std::size_t i = 0; i < 3; ++i)
      out << '[' << rows[i][0] << ',' << rows[i][1] << ',' << rows[i][2] << ',' << shift[i] << "],";
    out << "[0,0,0,1]])";
    return out.str();
  }
  /// Of a point of the model.
  [[nodiscard]] Vector undone(const Vector& p) const {
    const Vector q = difference(p, shift);
    Vector result{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; i < 3; ++i) result[k] += rows[i][k] * q[i];
    return result;
  }
};

/// Calls visit(round place, point, normal) for points of facets of round primitives: their corners' middles.
template <typename Visit>
void for_each_round_point(const RunResult& result, Visit visit) {
  for (const auto& batch : result.mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell)
      for (std::size_t f = batch->facet_offset[cell]; f < batch->facet_offset[cell + 1]; ++f) {
        const std::int32_t plane = batch->facet_hyperplane[f];
        const RoundPlace place =
            result.round_faces->of(static_cast<geometry::HyperplaneId>(plane < 0 ? ~plane : plane));
        if (place.body < 0) continue;
        std::vector<Vector> polygon;
        for (const std::uint16_t v : batch->vertices_of_facet(f)) {
          const double* p = batch->cell_points(cell).data() + 3 * v;
          polygon.push_back({p[0], p[1], p[2]});
        }
        const Vector normal = normalized(normal_of(polygon));
        for (const double share : {0.1, 0.5, 0.8}) {
          Vector point{};
          for (std::size_t k = 0; k < 3; ++k)
            point[k] = share * polygon[0][k] + (1 - share) * (polygon[1][k] + polygon[2][k]) / 2;
          visit(place, point, normal);
        }
      }
}

/// On the sides of a cylinder, wherever it is and however it is cut, the normal is the one of the round one.
TEST(Lighting, FacetsOfACylinderAreBentAroundItsAxis) {
  const unsigned seed = samples::new_seed();
  std::mt19937 random(seed);
  std::size_t points = 0, all_sides = 0;
  for (int round = 0; round < 8; ++round) {
    const Motion motion(random);
    const bool is_hole = round % 2 == 1;
    const auto sides = 13 + random() % 50;
    const std::string cylinder =
        motion.text() + " cylinder($fn=" + std::to_string(sides) + ",h=2,r1=1,r2=1);";
    const RunResult result = evaluated(is_hole ? "difference() { cube(size=9,center=true); " + cylinder + "}"
                                               : "union() { cube(size=0.3); " + cylinder + "}");
    ASSERT_NE(result.round_faces, nullptr);
    for_each_round_point(result, [&](const RoundPlace& place, const Vector& point, const Vector& normal) {
      const Vector bent = result.round_faces->normal(place, point, normal), q = motion.undone(point);
      const double radius = std::hypot(q[0], q[1]);
      if (q[2] < 1e-9 || q[2] > 2 - 1e-9 || radius < std::cos(std::numbers::pi / 12)) return;  // a cap
      if (radius > 1 + 1e-9) return;  // cells end in its plane elsewhere, too
      Vector radial{};
      for (std::size_t i = 0; i < 3; ++i)
        radial[i] = (motion.rows[i][0] * q[0] + motion.rows[i][1] * q[1]) / radius;
      EXPECT_NEAR(std::fabs(dot(bent, radial)), 1, 1e-9) << "seed " << seed;
      EXPECT_GT(dot(bent, normal), 0.96) << "seed " << seed;
      ++points;
    });
    all_sides += sides;
  }
  // How many are on the cylinder, and not where cells end in the planes of its sides elsewhere, hangs on the
  // cells.
  EXPECT_GT(points, all_sides / 2) << "seed " << seed;
}

/// Along a ball of facets normals go on from one band to the next, and are near those of the round one.
TEST(Lighting, FacetsOfABallAreBentAlongAndAround) {
  const RunResult result = evaluated("sphere($fn=60,r=2);");
  std::size_t points = 0;
  for_each_round_point(result, [&](const RoundPlace& place, const Vector& point, const Vector& normal) {
    const Vector bent = result.round_faces->normal(place, point, normal);
    EXPECT_GT(dot(bent, normalized(point)), std::cos(1.5 * std::numbers::pi / 180));
    ++points;
  });
  EXPECT_GT(points, 1000U);
}

TEST(Lighting, FewSidesAreNoneOfSomethingRound) {
  EXPECT_EQ(evaluated("cylinder($fn=12,h=2,r1=1,r2=1);").round_faces, nullptr);
  EXPECT_EQ(evaluated("cube(size=2);").round_faces, nullptr);
}

/// The skin of a curved solid hides what is behind it, and is lit like the surface.
TEST(Lighting, SkinsAreDrawnAsTheSurfaceThatTheyEnclose) {
  const RunResult ball = evaluated("sphere($fn=0,$fa=12,$fs=2,r=2);", true);
  ASSERT_GT(ball.report.fuzzy_cells, 0U);
  Ranks alone;
  PictureOptions options{.width = 120, .height = 120};
  const Pixels seen = pixels_of(render(alone, ball, options));
  // Neighbours differ little, but where the ball ends.
  int steps = 0;
  for (std::size_t y = 30; y < 90; ++y)
    for (std::size_t x = 30; x < 90; ++x)
      steps += std::abs(static_cast<int>(seen[120 * y + x] & 0xff) -
                        static_cast<int>(seen[120 * y + x + 1] & 0xff)) > 6;
  EXPECT_LT(steps, 20);
  options.shade = Shade::label;
  EXPECT_NE(pixels_of(render(alone, ball, options)), seen);
}

int differing(const Pixels& a, const Pixels& b) {
  int count = 0;
  for (std::size_t i = 0; i < a.size(); ++i) count += a[i] != b[i];
  return count;
}

TEST(Lighting, EdgesOfTheSolidDoNotDependOnItsCells) {
  const auto [whole, leaf] = box_of_cells(1);
  const auto [cells, tree] = box_of_cells(500);
  PictureOptions options{.width = 200, .height = 200};
  const Pixels plain = pixels_of(render(whole, leaf, options));
  options.edges = Edges::feature;
  const Pixels expected = pixels_of(render(whole, leaf, options)),
               seen = pixels_of(render(cells, tree, options));
  EXPECT_LT(differing(seen, expected), 60);
  const int lines = differing(expected, plain);
  EXPECT_GT(lines, 600);  // nine edges, of about 90 pixels each
  EXPECT_LT(lines, 4000);
  options.edges = Edges::cells;
  EXPECT_GT(differing(pixels_of(render(cells, tree, options)), plain), 2 * lines);
}

/// The lines of a drawing: one path, which lets some of what is below through.
std::vector<std::array<Point2, 2>> lines_of(const std::string& svg) {
  std::vector<std::array<Point2, 2>> lines;
  auto at = svg.find("stroke-opacity:0.75");
  if (at == std::string::npos) at = svg.find("stroke-opacity=\"0.75\"");
  if (at == std::string::npos) return lines;
  const auto begin = svg.find(" d=\"", at) + 4;
  std::istringstream path(svg.substr(begin, svg.find('"', begin) - begin));
  Point2 before{}, here{};
  for (char letter = 0; path >> letter >> here[0] >> here[1]; before = here)
    if (letter == 'L') lines.push_back({before, here});
  return lines;
}

double length_of(const std::vector<std::array<Point2, 2>>& lines) {
  double length = 0;
  for (const auto& [a, b] : lines) length += std::hypot(b[0] - a[0], b[1] - a[1]);
  return length;
}

/// Whether lines are, within two pixels, just where pictures of pixels have theirs, which are found
/// otherwise.
void expect_lines_of_pixels(const RunResult& result, PictureOptions options) {
  Ranks alone;
  options.edges = Edges::none;
  const Pixels plain = pixels_of(render(alone, result, options));
  options.edges = Edges::feature;
  const Pixels lined = pixels_of(render(alone, result, options));
  options.format = PictureFormat::svg;
  const auto lines = lines_of(render(alone, result, options));
  ASSERT_FALSE(lines.empty());
  const int width = options.width, height = options.height;
  std::vector<bool> has_line(plain.size());
  const auto any_near = [&](int x, int y, const auto& is_there) {
    for (int v = std::max(0, y - 2); v <= std::min(height - 1, y + 2); ++v)
      for (int u = std::max(0, x - 2); u <= std::min(width - 1, x + 2); ++u)
        if (is_there(static_cast<std::size_t>(v * width + u))) return true;
    return false;
  };
  int far_lines = 0, far_pixels = 0, places = 0, pixels = 0;
  for (const auto& [a, b] : lines)
    for (double t = 0; t <= 1; t += 0.5 / (1 + std::hypot(b[0] - a[0], b[1] - a[1]))) {
      const int x = static_cast<int>(a[0] + t * (b[0] - a[0])),
                y = static_cast<int>(a[1] + t * (b[1] - a[1]));
      has_line[static_cast<std::size_t>(y * width + x)] = true;
      ++places;
      far_lines += !any_near(x, y, [&](std::size_t i) { return plain[i] != lined[i]; });
    }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (const auto i = static_cast<std::size_t>(y * width + x); plain[i] != lined[i]) {
        ++pixels;
        far_pixels += !any_near(x, y, [&](std::size_t k) { return has_line[k]; });
      }
  EXPECT_GT(places, 1000);
  EXPECT_LT(far_lines, 0.01 * places);
  EXPECT_LT(far_pixels, 0.01 * pixels);
}

TEST(Lighting, EdgesOfDrawingsAreThoseOfPictures) {
  const RunResult result = evaluated(
      "difference() { union() { cube(size=[9,6,4]); multmatrix([[1,0,0,4],[0,1,0,3],[0,0,1,3],[0,0,0,1]]) "
      "cylinder($fn=48,h=5,r1=2,r2=1); multmatrix([[0.8,-0.6,0,2],[0.6,0.8,0,-2],[0,0,1,1],[0,0,0,1]]) "
      "cube(size=[3,3,2]); } multmatrix([[1,0,0,7],[0,1,0,3],[0,0,1,-1],[0,0,0,1]]) "
      "cylinder($fn=40,h=9,r1=1.5,r2=1.5); }");
  PictureOptions options{.width = 300, .height = 300};
  expect_lines_of_pixels(result, options);
  options.eye = {{14, -17, 11}};
  expect_lines_of_pixels(result, options);
  options.section = {1, 2.5, true};
  expect_lines_of_pixels(result, options);
}

TEST(Lighting, EdgesOfDrawingsDoNotDependOnCells) {
  const auto [whole, leaf] = box_of_cells(1);
  const auto [cells, tree] = box_of_cells(500);
  PictureOptions options{.format = PictureFormat::svg, .width = 200, .height = 200, .edges = Edges::feature};
  const auto expected = lines_of(render(whole, leaf, options)),
             lines = lines_of(render(cells, tree, options));
  EXPECT_EQ(expected.size(), 9U);
  EXPECT_LT(lines.size(), 40U);  // corners in the middle of an edge are rounded
  EXPECT_NEAR(length_of(lines), length_of(expected), 0.5);
}

TEST(Lighting, WithoutBackgroundNothingIsBesideTheSolid) {
  const auto [whole, leaf] = box_of_cells(1);
  PictureOptions options{.width = 80, .height = 80};
  const Pixels filled = pixels_of(render(whole, leaf, options));
  options.transparent = true;
  const Pixels seen = pixels_of(render(whole, leaf, options));
  EXPECT_EQ(seen[0], 0U);
  int partly = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (seen[i] >> 24 == 0xff) {
      EXPECT_EQ(seen[i] & 0xffffff, filled[i] & 0xffffff);
    }
    partly += seen[i] >> 24 != 0xff && seen[i] != 0;
  }
  EXPECT_GT(partly, 50);
}

TEST(Lighting, LegendsAndAxesAreWrittenBesideTheSolid) {
  RunResult result = evaluated(
      "part(\"left\") cube(size=1); part(\"right\") multmatrix([[1,0,0,2],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) "
      "cube(size=1);");
  Ranks alone;
  PictureOptions options{.width = 300, .height = 300, .shade = Shade::part};
  const Pixels plain = pixels_of(render(alone, result, options));
  options.legend = true;
  const Pixels named = pixels_of(render(alone, result, options));
  options.axes = true;
  const Pixels all = pixels_of(render(alone, result, options));
  EXPECT_GT(differing(named, plain), 100);
  EXPECT_GT(differing(all, named), 100);
  // The colours of the legend are among those of the solid's parts under full light.
  EXPECT_NE(named[300 * 14 + 14], plain[0]);
}

/// Any pixels, as libpng reads them; what is translucent may be rounded.
TEST(Png, KeepsPixels) {
  const unsigned seed = samples::new_seed();
  std::mt19937 random(seed);
  for (const bool has_opacity : {false, true}) {
    const int width = 37, height = 23;
    Pixels pixels(static_cast<std::size_t>(width * height));
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      if (i > 0 && random() % 3 != 0) {
        pixels[i] = pixels[i - 1];
        continue;
      }
      const std::uint32_t opacity = has_opacity ? random() % 256 : 255;
      pixels[i] = opacity << 24;
      for (unsigned shift : {0U, 8U, 16U})
        pixels[i] |= static_cast<std::uint32_t>(random() % (opacity + 1)) << shift;
    }
    const Pixels read = pixels_of(png_file(pixels, width, height, has_opacity));
    ASSERT_EQ(read.size(), pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i)
      for (unsigned shift : {0U, 8U, 16U, 24U})
        EXPECT_NEAR(static_cast<int>(read[i] >> shift & 0xff), static_cast<int>(pixels[i] >> shift & 0xff),
                    has_opacity && shift < 24 ? 1 : 0)
            << "seed " << seed;
  }
}

}  // namespace
}  // namespace bsp2::supersteps
