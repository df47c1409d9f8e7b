// What is made of plane solids, and what needs its operands evaluated first: against values worked out by
// hand, values that OpenSCAD 2021.01 gives, and properties of random input.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "constructs/outline.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::dataflow {
namespace {

using model::Expression;
using Plane = std::vector<std::array<double, 2>>;

template <int D>
double content(const Expression& e) {
  const auto network = compile<D>(e, {});
  return evaluate_all(network, 0, {}).evaluation.totals.in.value().volume();
}

double content(const Expression& e) { return e.dimension() == 2 ? content<2>(e) : content<3>(e); }

Expression read(const std::string& text) { return model::parse_csg(text, "test.csg").expression; }

double content(const std::string& text) { return content(read(text)); }

// --- plane solids ---

TEST(PlaneSolids, HaveTheAreasOfTheirFormulas) {
  EXPECT_DOUBLE_EQ(content("square(size = [3, 4], center = true);"), 12);
  EXPECT_DOUBLE_EQ(content("square(3);"), 9);
  EXPECT_NEAR(content("circle($fn = 7, r = 2);"), 3.5 * 4 * std::sin(2 * std::numbers::pi / 7), 1e-14);
  EXPECT_NEAR(content("circle(d = 2);"), 2.5 * std::sin(2 * std::numbers::pi / 5), 1e-14);
  EXPECT_DOUBLE_EQ(content("polygon(points = [[0, 0], [4, 0], [4, 3]], paths = undef);"), 6);
  EXPECT_DOUBLE_EQ(content("polygon(points = [[0,0],[4,0],[4,4],[0,4],[2,2],[6,2],[6,6],[2,6]], paths = "
                           "[[0,1,2,3],[4,5,6,7]]);"),
                   24);
  EXPECT_DOUBLE_EQ(content("polygon(points = [[0,0],[2,2],[2,0],[0,2]]);"), 2) << "crosses itself";
  EXPECT_DOUBLE_EQ(content("polygon(points = [[0,0],[9,0],[9,9],[0,9],[1,1],[1,8],[8,8],[8,1]], paths = "
                           "[[0,1,2,3],[4,5,6,7]]);"),
                   81 - 49);
  EXPECT_DOUBLE_EQ(content("difference() { square(10); multmatrix([[1,0,0,2],[0,1,0,2],[0,0,1,7],[0,0,0,1]]) "
                           "{ square(3); } }"),
                   91);
  EXPECT_DOUBLE_EQ(content("polygon(points = [[4,1],[4,2],[3,0],[4,3],[3,5],[0,5],[0,2],[1,2],[5,2]], paths "
                           "= [[4,8,8,5,8,2,7],[4,1,8,7,1,0,6,5]]);"),
                   59 / 6.0)
      << "a path that goes over its own points along a line";
  EXPECT_EQ(content("circle(r = -1);"), 0);
  EXPECT_EQ(content("polygon(points = [[0, 0], [1, 1], [2, 2]]);"), 0);
  EXPECT_DOUBLE_EQ(content("multmatrix([[2,0,0,0],[0,2,0,0],[0,0,0,0],[0,0,0,1]]) { square(1); }"), 4)
      << "z plays no part";
}

TEST(PlaneSolids, TheFirstGeometryDecidesTheDimension) {
  const auto dimension = [](const std::string& text) { return read(text).dimension(); };
  EXPECT_DOUBLE_EQ(content("group() { cube(2); square(1); }"), 8);
  EXPECT_DOUBLE_EQ(content("group() { square(3); cube(1); }"), 9);
  EXPECT_EQ(dimension("group() { group(); square(3); cube(1); }"), 2);
  EXPECT_EQ(content("union() { circle(r = 0); cube(1); }"), 0);
  EXPECT_EQ(content("intersection() { square(3); group(); }"), 0);
  EXPECT_EQ(content("difference() { group(); cube(1); }"), 0);
  EXPECT_DOUBLE_EQ(content("linear_extrude(height = 2) { cube(1); square(3); }"), 18);
  const auto warnings = model::parse_csg("cube(1);\n hull() { square(1); cube(2); }", "test.csg").warnings;
  ASSERT_EQ(warnings.size(), 2U);
  EXPECT_NE(warnings[0].find("test.csg:2:2: 'hull' is 2-dimensional here"), std::string::npos) << warnings[0];
}

/// Area inside an odd number of paths: between two heights at which anything happens, all widths are linear.
double even_odd_area(const Plane& points, const std::vector<std::vector<std::uint32_t>>& paths) {
  std::vector<std::array<std::array<double, 2>, 2>> edges;
  for (const auto& path : paths)
    for (std::size_t i = 0; i < path.size(); ++i)
      edges.push_back({points[path[i]], points[path[(i + 1) % path.size()]]});
  std::vector<double> heights;
  for (const auto& p : points) heights.push_back(p[1]);
  for (const auto& [a, b] : edges)
    for (const auto& [c, d] : edges) {
      const double ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - c[0], vy = d[1] - c[1],
                   det = ux * vy - uy * vx;
      if (det == 0) continue;
      const double t = ((c[0] - a[0]) * vy - (c[1] - a[1]) * vx) / det;
      if (t > 0 && t < 1) heights.push_back(a[1] + t * uy);
    }
  std::sort(heights.begin(), heights.end());
  double area = 0;
  for (std::size_t i = 1; i < heights.size(); ++i) {
    const double y = (heights[i - 1] + heights[i]) / 2;
    std::vector<double> x;
    for (const auto& [a, b] : edges)
      if ((a[1] > y) != (b[1] > y)) x.push_back(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
    std::sort(x.begin(), x.end());
    for (std::size_t k = 0; k + 1 < x.size(); k += 2)
      area += (x[k + 1] - x[k]) * (heights[i] - heights[i - 1]);
  }
  return area;
}

struct RandomPolygon {
  Plane points;
  std::vector<std::vector<std::uint32_t>> paths;
};

/// Paths through points of a coarse grid (touching, crossing, repeated, collinear) or anywhere.
RandomPolygon random_polygon(Random& random) {
  RandomPolygon polygon;
  const bool grid = chance(random, 0.6);
  const int count = pick(random, 3, 9);
  for (int i = 0; i < count; ++i) {
    const double x = uniform(random, 0, 6), y = uniform(random, 0, 6);
    polygon.points.push_back(grid ? std::array{std::floor(x), std::floor(y)} : std::array{x, y});
  }
  for (int k = pick(random, 1, 3); k > 0; --k) {
    auto& path = polygon.paths.emplace_back();
    for (int i = pick(random, 3, 8); i > 0; --i)
      path.push_back(static_cast<std::uint32_t>(pick(random, 0, count - 1)));
  }
  return polygon;
}

TEST(PlaneSolids, PolygonsFollowTheEvenOddRule) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(2000); ++round) {
    const RandomPolygon polygon = random_polygon(random);
    const Expression solid = model::polygon(polygon.points, polygon.paths);
    ASSERT_NEAR(content<2>(solid), even_odd_area(polygon.points, polygon.paths), 1e-9) << "round " << round;
  }
}

TEST(PlaneSolids, OutlinesAreClosedAndHaveTheSolidOnTheirLeft) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    std::vector<Expression> operands;
    for (int k = pick(random, 1, 4); k > 0; --k) {
      const RandomPolygon polygon = random_polygon(random);
      operands.push_back(
          model::transform(chance(random, 0.5) ? grid_matrix(random, 2, 2) : free_matrix(random, 2, 2),
                           model::polygon(polygon.points, polygon.paths)));
    }
    const Expression solid = chance(random, 0.5) ? model::unite(operands) : model::subtract(operands);
    const Outline outline = outline_of(solid, {});
    double area = 0;
    Plane points;
    std::vector<std::vector<std::uint32_t>> paths;
    for (const auto& path : outline) {
      area += signed_area(path);
      auto& cycle = paths.emplace_back();
      for (const auto& p : path) {
        cycle.push_back(static_cast<std::uint32_t>(points.size()));
        points.push_back(p);
      }
    }
    const double expected = content<2>(solid);
    ASSERT_NEAR(area, expected, 1e-8) << "round " << round;
    if (!points.empty()) {
      ASSERT_NEAR(content<2>(model::polygon(points, paths)), expected, 1e-8) << "round " << round;
    }
  }
}

TEST(Text, HasTheMeasuresOfOpenScad) {
  // An em is 100/72 of the size. In Liberation Sans "H" is 1409/2048 em high, 'I' a bar of 190/2048 em.
  const auto totals = [](const std::string& text) {
    return evaluate_all(compile<2>(read(text), {}), 0, {}).evaluation.totals;
  };
  const auto model = model::parse_csg("text(text = \"I\", size = 10);", "test.csg");
  if (!model.warnings.empty()) GTEST_SKIP() << "Liberation Sans is not installed";
  const auto bar = totals("text(text = \"I\", size = 10);");
  EXPECT_NEAR(bar.upper[1] - bar.lower[1], 1409 / 2048.0 * 1000 / 72, 2e-3);
  EXPECT_NEAR(bar.in.value().volume(), (bar.upper[0] - bar.lower[0]) * (bar.upper[1] - bar.lower[1]), 1e-9);
  const auto centred = totals("text(text = \"I\", size = 10, valign = \"center\", halign = \"center\");");
  EXPECT_NEAR(centred.lower[1], -1409 / 2048.0 * 1000 / 72 / 2, 0.2);
  EXPECT_NEAR(content("text(text = \"II\");"), 2 * content("text(text = \"I\");"), 1e-9);
  EXPECT_NEAR(content("text(text = \"I\", size = 20);"), 4 * content("text(text = \"I\");"), 1e-9);
  EXPECT_NEAR(content("text(text = \"O\", $fn = 200);"), content("text(text = \"O\", $fn = 400);"), 1e-2);
  EXPECT_EQ(content("text(text = \"\");"), 0);
  EXPECT_EQ(content("text(text = \"x\", size = 0);"), 0);
  EXPECT_NEAR(content("text(text = \"I\", size = -10);"), content("text(text = \"I\");"), 1e-9)
      << "seen from behind, as OpenSCAD has it";
}

// --- imports ---

class Import : public ::testing::Test {
 protected:
  bsp2::samples::TemporaryFolder folder_;
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.path() / name) << text;
  }
  double imported(const std::string& text) {
    return content(model::parse_csg(text, (folder_.path() / "test.csg").string()).expression);
  }
};

TEST_F(Import, ReadsMeshes) {
  const std::string corner =
      "solid t\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 2 0\nvertex 2 0 0\nendloop\nendfacet\n"
      "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 2 0 0\nvertex 0 0 2\nendloop\nendfacet\n"
      "facet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 0 0 2\nvertex 0 2 0\nendloop\nendfacet\n";
  const std::string last =
      "facet normal 0 0 0\nouter loop\nvertex 2 0 0\nvertex 0 2 0\nvertex 0 0 2\nendloop\nendfacet\n";
  write("closed.stl", corner + last + "endsolid t\n");
  write("open.stl", corner + "endsolid t\n");
  write("cube.off",
        "OFF\n8 6 12\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 "
        "4\n4 1 2 6 5\n4 2 3 7 6\n4 3 0 4 7\n");
  EXPECT_NEAR(imported("import(file = \"closed.stl\");"), 8.0 / 6, 1e-12);
  EXPECT_NEAR(imported("import(file = \"cube.off\");"), 1, 1e-12);
  EXPECT_NEAR(imported("import(file = \"open.stl\");"), 8.0 / 6, 1e-12)
      << "with a cap where a face is missing";
  EXPECT_THROW(imported("import(file = \"missing.stl\");"), Error);
  EXPECT_THROW(imported("import(file = \"test.xyz\");"), Error);
}

/// The builder reads the same files, and tells its caller what had to be repaired.
TEST_F(Import, ReadsMeshesForTheBuilder) {
  write("tetrahedron.obj", "v 0 0 0\nv 2 0 0\nv 0 2 0\nv 0 0 2\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  write("open.off", "OFF\n4 3 0\n0 0 0\n2 0 0\n0 2 0\n0 0 2\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  std::vector<std::string> said;
  const auto read = [&](const char* name) {
    return model::imported(folder_.path() / name, [&](const std::string& text) { said.push_back(text); });
  };
  EXPECT_NEAR(content(read("tetrahedron.obj")), 8.0 / 6, 1e-12);
  EXPECT_TRUE(said.empty());
  const Expression corner = model::imported(folder_.path() / "tetrahedron.obj");
  EXPECT_NEAR(content(model::subtract({corner, model::cuboid({2, 2, 1})})), 1.0 / 6, 1e-12);
  EXPECT_NEAR(content(read("open.off")), 8.0 / 6, 1e-12);
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said[0].find("open.off"), std::string::npos);
  EXPECT_THROW(read("missing.stl"), Error);
  EXPECT_THROW(read("test.xyz"), Error);
}

TEST_F(Import, ReadsHeights) {
  write("a.dat", "# heights\n0 1\n1 2\n");
  EXPECT_NEAR(imported("surface(file = \"a.dat\");"), 2, 1e-12);
  write("b.dat",
        "5 5 5\n5 9 5\n5 5 5\n");  // four cells of mean 6, each a quarter of its corners' mean and of itself
  EXPECT_NEAR(imported("surface(file = \"b.dat\", center = true);"), 4 * 6, 1e-12);
  write("e.dat", "0 1\n \f\v\n1 2\n");  // a line without a height
  EXPECT_NEAR(imported("surface(file = \"e.dat\");"), 2, 1e-12);
  write("c.dat", "1 2 3\n");
  EXPECT_EQ(imported("surface(file = \"c.dat\");"), 0);
  write("d.dat", "1 x\n");
  EXPECT_THROW(imported("surface(file = \"d.dat\");"), Error);
  EXPECT_THROW(imported("surface(file = \"a.png\");"), Error);
}

/// Pictures of 2 x 2 pixels: one of 16 bits a pixel in grey, one in colours. Volumes as OpenSCAD 2021.01
/// gives them.
TEST_F(Import, ReadsPictures) {
  const std::string_view grey(
      "\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x02\x00\x00\x00\x02\x10"
      "\x00\x00\x00\x00\x07\x4d\x8e"
      "\xbb\x00\x00\x00\x12\x49\x44\x41\x54\x78\xda\x63\x60\x98\xf9\x9f\x91\xa1\xe1\x9f\x03\x03\x00\x11\x4b"
      "\x03\x58\x3e\x2d\x39\x1a\x00"
      "\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82",
      75);
  const std::string_view colours(
      "\x89\x50\x4e\x47\x0d\x0a\x1a\x0a\x00\x00\x00\x0d\x49\x48\x44\x52\x00\x00\x00\x02\x00\x00\x00\x02\x08"
      "\x02\x00\x00\x00\xfd\xd4\x9a"
      "\x73\x00\x00\x00\x15\x49\x44\x41\x54\x78\xda\x63\xe0\x12\x91\x3b\x91\x62\xc4\xf0\x9f\x01\x08\xfe\x03"
      "\x00\x16\xa7\x03\x99\x14\x5a"
      "\x10\x2c\x00\x00\x00\x00\x49\x45\x4e\x44\xae\x42\x60\x82",
      78);
  write("grey.png", std::string(grey));
  write("colours.png", std::string(colours));
  EXPECT_NEAR(imported("surface(file = \"grey.png\");"), 44.82352, 1e-4);
  EXPECT_NEAR(imported("surface(file = \"grey.png\", invert = true);"), 57.17663, 1e-3);
  EXPECT_NEAR(imported("surface(file = \"colours.png\");"), 20.47747, 1e-4);
  write("colours.png", std::string(colours.substr(0, 60)));
  EXPECT_THROW(imported("surface(file = \"colours.png\");"), Error) << "cut off";
  write("short.dat", "1 2 3\n5 6\n");
  EXPECT_NEAR(imported("surface(file = \"short.dat\");"), 6.25, 1e-12)
      << "what is missing is 0 high, but does not lower the floor";
}

TEST_F(Import, ReadsDrawings) {
  const auto line = [](const std::string& layer, double x0, double y0, double x1, double y1) {
    std::ostringstream text;
    text << "0\nLINE\n8\n"
         << layer << "\n10\n"
         << x0 << "\n20\n"
         << y0 << "\n11\n"
         << x1 << "\n21\n"
         << y1 << "\n";
    return text.str();
  };
  write("a.dxf", "0\nSECTION\n2\nENTITIES\n" + line("square", 0, 0, 4, 0) + line("square", 4, 4, 4, 0) +
                     line("square", 4, 4, 0, 4) + line("square", 0, 4, 0, 0) +
                     "0\nCIRCLE\n8\nhole\n10\n2\n20\n2\n40\n1\n" + line("open", 10, 0, 13, 0) +
                     line("open", 13, 0, 13, 4) + "0\nENDSEC\n0\nEOF\n");
  EXPECT_NEAR(imported("import(file = \"a.dxf\", layer = \"square\");"), 16, 1e-12);
  EXPECT_NEAR(imported("import(file = \"a.dxf\", layer = \"hole\", $fn = 4);"), 2, 1e-12);
  EXPECT_NEAR(imported("import(file = \"a.dxf\", layer = \"open\");"), 6, 1e-12)
      << "closed by a straight line";
  EXPECT_NEAR(imported("import(file = \"a.dxf\", $fn = 4);"), 16 - 2 + 6, 1e-12);
  EXPECT_NEAR(imported("linear_extrude(height = 2, file = \"a.dxf\", layer = \"square\", origin = [1, 1]);"),
              32, 1e-12);
  EXPECT_EQ(imported("import(file = \"a.dxf\", layer = \"none\");"), 0);
  write("bad.dxf", "<svg>\n</svg>\n");
  EXPECT_THROW(imported("import(file = \"bad.dxf\");"), Error);
}

TEST_F(Import, ReadsVectorGraphics) {
  const auto svg = [](const std::string& shapes) {
    return "<svg xmlns='http://www.w3.org/2000/svg' width='20mm' height='10mm' viewBox='0 0 40 20'>" +
           shapes + "</svg>";
  };
  const auto area = [&](const std::string& shapes, const std::string& more = "") {
    write("a.svg", svg(shapes));
    return imported("import(file = \"a.svg\"" + more + ");");
  };
  EXPECT_NEAR(area("<rect x='1' y='1' width='4' height='2'/>"), 2, 1e-12) << "half a millimetre a unit";
  EXPECT_NEAR(area("<g transform='scale(2) translate(1, 1)'><rect width='4' height='2'/></g>"), 8, 1e-12);
  EXPECT_NEAR(area("<path d='M0 0h4v4H0zm1,1 2 0 0 2-2 0z'/>"), 3, 1e-12) << "a hole";
  EXPECT_NEAR(area("<polygon points='0,0 4,0 4,4'/><circle cx='10' cy='10' r='2'/>", ", $fn = 4"),
              2 + 20 * model::sine(9), 1e-12)
      << "40 sides, whatever $fn is";
  EXPECT_NEAR(area("<path d='M0 0 C 0 4 4 4 4 0 z'/>"), 9.6 / 4, 2e-2) << "the integral of y dx";
  EXPECT_NEAR(area("<path d='M-4 0 A 4 4 0 0 1 4 0 z'/>"), 28 * std::sin(std::numbers::pi / 14), 1e-9)
      << "14 chords of half a circle of radius 2";
  EXPECT_NEAR(area("<path d='M0 0 4 0 4 4'/>"), 2.25, 1e-12) << "a line 1 wide";
  write("bad.svg", "no drawing");
  EXPECT_THROW(imported("import(file = \"bad.svg\");"), Error);
  write("a.svg", svg("<rect x='0' y='0' width='40' height='2'/>"));
  const auto totals =
      evaluate_all(
          compile<2>(
              model::parse_csg("import(file = \"a.svg\");", (folder_.path() / "t.csg").string()).expression,
              {}),
          0, {})
          .evaluation.totals;
  EXPECT_NEAR(totals.lower[1], 9, 1e-12) << "y upwards from the lower edge";
  EXPECT_NEAR(totals.upper[0], 20, 1e-12);
}

// --- extrusions ---

TEST(LinearExtrude, StraightIsAreaTimesHeight) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const RandomPolygon polygon = random_polygon(random);
    const Expression solid =
        model::subtract({model::polygon(polygon.points, polygon.paths),
                         model::transform(free_matrix(random, 2, 2), model::circle(1, 7))});
    model::LinearExtrusion extrusion;
    extrusion.direction = {uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, 0.1, 5)};
    extrusion.center = chance(random, 0.5);
    EXPECT_NEAR(content<3>(model::construct(extrusion, {solid})), content<2>(solid) * extrusion.direction[2],
                1e-9);
  }
}

TEST(LinearExtrude, TaperedIsAFrustum) {
  // Height / 3 (A + sqrt(A B) + B), of any plane solid.
  const double area = content("difference() { square(4, center = true); circle($fn = 6, r = 1); }");
  for (const double s : {0.0, 0.25, 3.0}) {
    const std::string text = "linear_extrude(height = 6, scale = " + std::to_string(s) +
                             ") { difference() { square(4, center = true); circle($fn = 6, r = 1); } }";
    EXPECT_NEAR(content(text), 6 * area / 3 * (1 + s + s * s), 1e-9) << s;
  }
  EXPECT_NEAR(content("linear_extrude(height = 6, scale = [0, 1], slices = 1) { square(2, center = true); }"),
              12, 1e-9)
      << "a wedge";
}

TEST(LinearExtrude, TwistedSidesAreCutAlongTheShorterDiagonal) {
  EXPECT_NEAR(content("linear_extrude(height = 10, twist = 90) { square(2); }"), 42.9966, 1e-3)
      << "as OpenSCAD 2021.01";
  // The mirror image of a twist is the twist the other way round of the mirror image.
  EXPECT_NEAR(content("linear_extrude(height = 5, twist = -70, slices = 7) { square([3, 1]); }"),
              content("linear_extrude(height = 5, twist = 70, slices = 7) { "
                      "multmatrix([[-1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { square([3, 1]); } }"),
              1e-9);
  // Twice as many slices come twice as near to area times height.
  const auto excess = [](int slices) {
    return content("linear_extrude(height = 5, twist = 70, slices = " + std::to_string(slices) +
                   ") { square([3, 1]); }") -
           15;
  };
  EXPECT_NEAR(excess(20) / excess(40), 2, 0.05);
}

/// The integral of 2 pi r over the area, with the perimeter of a polygon of n sides in the place of the
/// circle's.
double faceted_pappus(const Plane& path, double segments, double step) {
  double moment = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const auto &p = path[i], &q = path[(i + 1) % path.size()];
    moment += (p[0] + q[0]) * (p[0] * q[1] - q[0] * p[1]) / 6;
  }
  return segments * std::sin(step) * std::fabs(moment);
}

TEST(RotateExtrude, HasTheVolumeOfPappusForItsFacets) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    // A star around a point off the axis: simple, rarely convex.
    Plane path;
    const int n = pick(random, 3, 9);
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n, r = uniform(random, 0.5, 3);
      path.push_back({3 + r * std::cos(angle), r * std::sin(angle)});
    }
    if (chance(random, 0.3))
      for (auto& p : path) p[0] = -p[0];
    model::RotateExtrusion extrusion;
    extrusion.resolution.fn = pick(random, 3, 12);
    extrusion.start = uniform(random, -180, 180);
    extrusion.angle = chance(random, 0.3) ? 360 : uniform(random, -359, 359);
    const double segments =
        std::max(1.0, std::trunc(extrusion.resolution.fn * std::fabs(extrusion.angle) / 360));
    const double step = std::fabs(extrusion.angle) / segments * std::numbers::pi / 180;
    if (step >= 3.1) continue;  // one segment of about half a turn or more
    const Expression solid = model::construct(extrusion, {model::polygon(path)});
    ASSERT_NEAR(content<3>(solid), faceted_pappus(path, segments, step), 1e-9) << "round " << round;
  }
}

TEST(RotateExtrude, AProfileAcrossTheAxisIsEmptyWithAWarning) {
  const auto network = compile<3>(read("rotate_extrude() { square(2, center = true); }"), {});
  EXPECT_TRUE(network.program.empty());
  ASSERT_EQ(network.warnings.size(), 1U);
  EXPECT_NE(network.warnings[0].find("one side of the axis"), std::string::npos);
}

TEST(RotateExtrude, AFullTurnBeginsAtMinusX) {
  const auto bounds = [](const std::string& text) {
    const auto totals = evaluate_all(compile<3>(read(text), {}), 0, {}).evaluation.totals;
    return std::pair{totals.lower[0], totals.upper[0]};
  };
  const auto [low, high] = bounds("rotate_extrude($fn = 3) { square(2); }");
  EXPECT_NEAR(low, -2, 1e-12);
  EXPECT_NEAR(high, 1, 1e-12);
  const auto [low0, high0] = bounds("rotate_extrude($fn = 3, angle = 360, start = 0) { square(2); }");
  EXPECT_NEAR(low0, -1, 1e-12);
  EXPECT_NEAR(high0, 2, 1e-12);
}

// --- offset, resize, projection, fill ---

TEST(Offset, AgreesWithOpenScadAndWithSteiner) {
  EXPECT_NEAR(content("offset(r = 1, $fn = 16) { square(2); }"), 15.0615, 1e-4);
  EXPECT_NEAR(content("offset(delta = 1) { square(2); }"), 16, 1e-9);
  EXPECT_NEAR(content("offset() { square(2); }"), 14, 1e-9);
  EXPECT_NEAR(content("offset(chamfer = true) { square(2); }"), 14, 1e-9);
  EXPECT_NEAR(content("offset(delta = 1, chamfer = true) { square(2); }"), 15.3137, 1e-4);
  EXPECT_NEAR(content("offset(r = -0.5) { square([4, 3]); }"), 6, 1e-9);
  EXPECT_EQ(content("offset(r = -2) { square([4, 3]); }"), 0);
  // Area of a convex polygon with rounded corners: A + P r + pi r^2, the arc's polygon from inside.
  EXPECT_NEAR(content("offset(r = 2, $fn = 2000) { polygon(points = [[0,0],[3,0],[0,4]]); }"),
              6 + 12 * 2 + std::numbers::pi * 4, 1e-3);
  EXPECT_NEAR(content("offset(delta = -1) { difference() { square(10); "
                      "multmatrix([[1,0,0,4],[0,1,0,4],[0,0,1,0],[0,0,0,1]]) { square(2); } } }"),
              64 - 16, 1e-9)
      << "holes grow";
}

TEST(Resize, ScalesAboutTheOrigin) {
  EXPECT_DOUBLE_EQ(content("resize(newsize = [4, 0, 0], auto = [0, 0, 0]) { cube([2, 3, 5]); }"), 60);
  EXPECT_DOUBLE_EQ(content("resize(newsize = [4, 0, 0], auto = [1, 1, 1]) { cube([2, 3, 5]); }"), 240);
  EXPECT_DOUBLE_EQ(content("resize(newsize = [4, 0, 0], auto = [0, 1, 0]) { cube([2, 3, 5]); }"), 120);
  EXPECT_DOUBLE_EQ(content("resize(newsize = [6, 6, 9]) { square([2, 3]); }"), 36);
}

TEST(Projection, IsTheShadowOrTheSection) {
  EXPECT_NEAR(content("projection(cut = false) { cube([2, 3, 5]); "
                      "multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,9],[0,0,0,1]]) { cube(3); } }"),
              6 + 9 - 2, 1e-12);
  EXPECT_NEAR(content("projection(cut = true) { cube([2, 3, 5], center = true); }"), 6, 1e-12);
  EXPECT_NEAR(content("projection(cut = true) { cube([2, 3, 5]); }"), 6, 1e-12) << "a face at z = 0 counts";
  EXPECT_EQ(
      content(
          "projection(cut = true) { multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,9],[0,0,0,1]]) { cube(3); } }"),
      0);
  EXPECT_NEAR(content("projection(cut = true) { cylinder($fn = 4, h = 2, r1 = 2, r2 = 0, center = true); }"),
              2, 1e-12);
  EXPECT_NEAR(content("projection(cut = true) { difference() { cube(4, center = true); cylinder($fn = 4, h = "
                      "9, r1 = 1, r2 = 1, center = true); } }"),
              14, 1e-12);
}

TEST(Fill, ClosesHoles) {
  EXPECT_DOUBLE_EQ(content("fill() { difference() { square(10); "
                           "multmatrix([[1,0,0,4],[0,1,0,4],[0,0,1,0],[0,0,0,1]]) { square(2); } } }"),
                   100);
}

// --- hulls and sums ---

const model::TriangleMesh& mesh_of(const Expression& e) {
  return std::get<model::TriangleMesh>(std::get<model::Primitive>(e.node().value));
}

Real determinant(const std::array<double, 3>& a, const std::array<double, 3>& b,
                 const std::array<double, 3>& c, const std::array<double, 3>& d) {
  std::array<std::array<Real, 3>, 3> m;
  for (int i = 0; i < 3; ++i)
    m[0][i] = static_cast<Real>(b[i]) - a[i], m[1][i] = static_cast<Real>(c[i]) - a[i],
    m[2][i] = static_cast<Real>(d[i]) - a[i];
  return dot(m[0], cross(m[1], m[2]));
}

TEST(ConvexHull, IsClosedConvexAndContainsAllPoints) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    std::vector<std::array<double, 3>> points;
    const int style = pick(random, 0, 2);
    for (int i = pick(random, 4, 60); i > 0; --i) {
      std::array<double, 3> p;
      for (double& x : p) x = style == 0 ? pick(random, 0, 3) : uniform(random, -1, 1);
      if (style == 2) {
        const double length = std::hypot(p[0], p[1], p[2]);
        for (double& x : p) x /= length;
      }
      points.push_back(p);
    }
    const Expression hull = model::convex_hull(points);
    if (!std::holds_alternative<model::Primitive>(hull.node().value)) continue;  // flat
    const auto& mesh = mesh_of(hull);
    // The points move by less than 2^-53 onto the hull's grid, others may lie outside by 2^-46.
    const Real tolerance = style == 0 ? 0 : 1e-13L;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    Real volume = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      for (const auto& p : points)
        ASSERT_LE(determinant(mesh.points[a], mesh.points[b], mesh.points[c], p), tolerance)
            << "round " << round;
      volume += determinant({0, 0, 0}, mesh.points[a], mesh.points[b], mesh.points[c]) / 6;
      ++edges[{a, b}], ++edges[{b, c}], ++edges[{c, a}];
    }
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1);
      ASSERT_TRUE(edges.contains({edge.second, edge.first}));
    }
    for (const auto& corner : mesh.points)
      ASSERT_TRUE(std::any_of(points.begin(), points.end(), [&](const auto& p) {
        return std::hypot(p[0] - corner[0], p[1] - corner[1], p[2] - corner[2]) < 1e-15;
      }));
    if (round % 4 == 0) {
      ASSERT_NEAR(content<3>(hull), static_cast<double>(volume), 1e-9) << "round " << round;
    }
  }
}

TEST(ConvexHull, OfSolidsHasTheVolumeOfItsFormula) {
  EXPECT_NEAR(
      content("hull() { cube(2); multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { cube(2); } }"), 28,
      1e-12);
  EXPECT_NEAR(content("hull() { difference() { cube(4); cube(2); } }"), 64 - 8.0 / 6, 1e-9)
      << "only the corner is cut off";
  EXPECT_NEAR(content("hull() { color([1, 0, 0, 1]) multmatrix([[2,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { "
                      "group(); cube(2); } }"),
              16, 1e-12)
      << "is its own hull";
  EXPECT_NEAR(content("hull() { sphere(r = 1, $fn = 104); sphere(r = 1, $fn = 104); }"),
              content("sphere(r = 1, $fn = 104);"), 1e-12)
      << "of more triangles than half-spaces are listed";
  EXPECT_NEAR(
      content("hull() { square(1); multmatrix([[1,0,0,3],[0,1,0,4],[0,0,1,0],[0,0,0,1]]) { square(1); } }"),
      1 + 3 + 4, 1e-12);
  EXPECT_NEAR(content("hull() { cylinder($fn = 40, h = 1, r1 = 3, r2 = 3); cylinder($fn = 40, h = 9, r1 = "
                      "0.5, r2 = 0.25); cylinder($fn = 40, h = 2, r1 = 1, r2 = 1); }"),
              20 * std::sin(2 * std::numbers::pi / 40) * (9 + 8 / 3.0 * (9 + 3 * 0.25 + 0.0625)), 1e-9)
      << "a cone on a disk";
  EXPECT_EQ(content("hull();"), 0);
}

TEST(Minkowski, OfKnownSolids) {
  EXPECT_NEAR(content("minkowski() { cube([1, 2, 3]); cube([4, 5, 6]); }"), 5 * 7 * 9, 1e-12);
  EXPECT_NEAR(content("minkowski() { cube(1); cube(1); cube(1); group(); }"), 27, 1e-12);
  EXPECT_NEAR(content("minkowski() { difference() { square(3); "
                      "multmatrix([[1,0,0,1],[0,1,0,1],[0,0,1,0],[0,0,0,1]]) { square(3); } } square(1); }"),
              12, 1e-12)
      << "an L stays one";
  EXPECT_NEAR(
      content("minkowski() { difference() { cube(6); multmatrix([[1,0,0,2],[0,1,0,2],[0,0,1,-1],[0,0,0,1]]) "
              "{ cube([2, 2, 9]); } } cube(1); }"),
      7 * 7 * 7 - 7, 1e-9)
      << "the hole shrinks";
}

/// What is empty only when it is evaluated, in any place: by the rule that OpenSCAD 2021.01 has for what is
/// written as nothing.
TEST(Minkowski, PassesOverWhatTurnsOutEmpty) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const auto number = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  for (int round = 0; round < samples::rounds(60); ++round) {
    const int dimension = number(2, 3);
    const std::string box = dimension == 2 ? "square(" : "cube(";
    const std::vector<std::string> nothing{
        "intersection() { " + box + "1); multmatrix([[1,0,0,5],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) " + box +
            "1); }",
        "intersection() { " + box + "1); multmatrix([[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) " + box +
            "1); }",
        "difference() { " + box + "1); " + box + "3, center = true); }", box + "0);"};
    std::string children;
    const int count = number(1, 4);
    int side = 0, others = 0;
    bool is_first = false;
    for (int i = 0; i < count; ++i) {
      if (number(0, 1) == 0) {
        children += nothing[static_cast<std::size_t>(number(0, 3))];
        continue;
      }
      const int own = number(1, 3);
      children += box + std::to_string(own) + ");";
      side += own;
      is_first = is_first || i == 0;
      others += i > 0 ? 1 : 0;
    }
    const bool is_empty = dimension == 2 && count > 1 && (!is_first || others == 0);
    EXPECT_NEAR(content("minkowski() { " + children + " }"), is_empty ? 0 : std::pow(side, dimension), 1e-9)
        << children;
  }
}

TEST(Minkowski, OfAConvexPolygonAndABox) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(30); ++round) {
    Plane points;
    for (int i = 0; i < 12; ++i) points.push_back({uniform(random, -5, 5), uniform(random, -5, 5)});
    const Expression hull = model::convex_hull(points);
    const auto [left, right] = std::minmax_element(points.begin(), points.end());
    const auto by_y = [](const auto& a, const auto& b) { return a[1] < b[1]; };
    const auto [low, high] = std::minmax_element(points.begin(), points.end(), by_y);
    const double w = uniform(random, 0.1, 3), h = uniform(random, 0.1, 3);
    const double expected =
        content<2>(hull) + w * ((*high)[1] - (*low)[1]) + h * ((*right)[0] - (*left)[0]) + w * h;
    EXPECT_NEAR(content<2>(model::construct(model::MinkowskiSum{}, {hull, model::cuboid({w, h})})), expected,
                1e-10);
  }
}

}  // namespace
}  // namespace bsp2::dataflow
