// Splines: FUZZY cells that hold sampled points, intervals that hold the truth.

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>

#include "bsp2/dataflow/regions/measure.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "dataflow/refined/spline_samples.hpp"

namespace bsp2::dataflow {
namespace {

using Splines = Seeded;

TEST_F(Splines, HoldAllPointsOfCurves) {
  const Piece plane = random_piece<2>(random, {3}, {9}, false),
              space = random_piece<3>(random, {4}, {8}, true), flat = random_piece<2>(random, {2}, {6}, true);
  check_points<2>(model::spline(2, {plane}), points_of<2>(plane, 100'000, random), thinner_than(0.01));
  check_points<2>(model::spline(2, {flat}), points_of<2>(flat, 100'000, random), down_to(14));
  check_points<3>(model::spline(3, {space}), points_of<3>(space, 100'000, random), thinner_than(0.05));
}

TEST_F(Splines, HoldAllPointsOfSurfaces) {
  const Piece bspline = waved_piece<3>(random, {3, 2}, {5, 5}, false);
  check_points<3>(model::spline(3, {bspline}), points_of<3>(bspline, 100'000, random), thinner_than(0.1));
}

TEST_F(Splines, HoldAllPointsOfRationalSurfaces) {
  const Piece nurbs = waved_piece<3>(random, {2, 3}, {4, 4}, true);
  check_points<3>(model::spline(3, {nurbs}), points_of<3>(nurbs, 100'000, random), thinner_than(0.1));
}

TEST_F(Splines, HoldAllPointsOfSolidsBoundaries) {
  const Piece solid = waved_piece<3>(random, {2, 2, 2}, {3, 3, 3}, false),
              plate = waved_piece<2>(random, {3, 3}, {5, 4}, true);
  check_points<3>(model::spline(3, {solid}), points_of<3>(solid, 100'000, random), thinner_than(0.1));
  check_points<2>(model::spline(2, {plate}), points_of<2>(plate, 100'000, random), thinner_than(0.01));
}

TEST_F(Splines, HoldAllPointsInMoreDimensions) {
  const Piece curve = random_piece<4>(random, {3}, {4}, false),
              surface = waved_piece<4>(random, {2, 2}, {3, 3}, false);
  check_points<4>(model::spline(4, {curve}), points_of<4>(curve, 100'000, random), down_to(14));
  check_points<4>(model::spline(4, {surface}), points_of<4>(surface, 100'000, random), down_to(12));
}

// --- exact areas and volumes ---

TEST(Nurbs, CirclesHaveTheirExactArea) {
  const Expression circle = model::spline(2, {nurbs_circle(2)});
  double last = 1e300;
  for (const unsigned level : {4U, 8U, 12U, 16U}) {
    const VolumeInterval now = volume_interval<2>(circle, down_to(level));
    expect_contains(now, 4 * pi);
    EXPECT_LE(now.fuzzy, last * (1 + 1e-12));
    last = now.fuzzy;
  }
  for (const double tolerance : {0.1, 0.01, 0.001, 1e-4}) {
    const VolumeInterval now = volume_interval<2>(circle, thinner_than(tolerance));
    expect_contains(now, 4 * pi);
    EXPECT_LE(now.fuzzy, tolerance * 4 * pi * 1.2);
  }
}

TEST(Nurbs, SpheresHaveTheirExactVolume) {
  const Expression sphere = model::spline(3, {nurbs_sphere(1)});
  for (const unsigned level : {0U, 6U, 12U})
    expect_contains(volume_interval<3>(sphere, down_to(level)), 4 * pi / 3);
  double last = 1e300;
  for (const double tolerance : {0.2, 0.1, 0.05}) {
    const VolumeInterval now = volume_interval<3>(sphere, thinner_than(tolerance));
    expect_contains(now, 4 * pi / 3);
    EXPECT_LE(now.fuzzy, tolerance * 4 * pi * 2.5);
    EXPECT_LT(now.fuzzy, last * 0.6);
    last = now.fuzzy;
  }
}

/// Of the disk: x^2 pi r^4 / 4; the interval shrinks with the shell, whose area is at most about the
/// tolerance times the length of the curve.
TEST(Nurbs, MomentsOfCirclesShrinkWithTheirShell) {
  double before = 1e300;
  for (const double tolerance : {0.16, 0.01, 0.01 / 16}) {
    const auto totals = measure<2>(model::spline(2, {nurbs_circle(2)}), thinner_than(tolerance));
    const auto in = totals.in.value(), fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
    double widest = 0;
    for (int i = 0; i <= 2; ++i)
      for (int j = i; j <= 2; ++j) {
        const auto at = static_cast<std::size_t>(geometry::Moments<2>::index(i, j));
        const double truth = i == j ? 4 * pi : 0;  // pi r^2 and pi r^4 / 4 are the same for r = 2
        EXPECT_LE(in.integral[at] + below.integral[at], truth + 1e-12) << i << j;
        EXPECT_GE(in.integral[at] + fuzzy.integral[at] - below.integral[at], truth - 1e-12) << i << j;
        widest = std::max(widest, fuzzy.integral[at] - 2 * below.integral[at]);
      }
    EXPECT_LT(widest, before / 8);
    before = widest;
  }
}

TEST_F(Splines, PlacedSolidsHaveTheirVolume) {
  const auto matrix = free_matrix(random, 3, 5);
  double determinant = 0;
  const auto at = [&](std::size_t i, std::size_t j) { return matrix[4 * i + j]; };
  for (std::size_t i = 0; i < 3; ++i)
    determinant +=
        at(0, i) * (at(1, (i + 1) % 3) * at(2, (i + 2) % 3) - at(1, (i + 2) % 3) * at(2, (i + 1) % 3));
  expect_contains(
      volume_interval<3>(model::transform(matrix, model::spline(3, {nurbs_sphere(1)})), down_to(12)),
      4 * pi / 3 * std::fabs(determinant));
  // Pappus; the tube is closed in both parameters, and there is a hole.
  const Expression torus = model::spline(3, {turned(circle_points(), circle_knots(), 2, 0.5)});
  const VolumeInterval now = volume_interval<3>(torus, thinner_than(0.1));
  expect_contains(now, 2 * pi * pi * 2 * 0.25);
  EXPECT_GT(now.in, pi);
  // Far from the origin coordinates are coarser. Six cuts are for the ends of the region.
  const std::vector<double> far{1e-3, 0, 0, 1e4, 0, 1e-3, 0, -2e4, 0, 0, 1e-3, 3e4, 0, 0, 0, 1};
  const VolumeInterval small =
      volume_interval<3>(model::transform(far, model::spline(3, {nurbs_sphere(1)})), down_to(15));
  EXPECT_LE(small.in, 4e-9 * pi / 3 * (1 + 1e-6));
  EXPECT_GE(small.high(), 4e-9 * pi / 3 * (1 - 1e-6));
  EXPECT_GT(small.in, 0);
}

/// Green's formula over Bezier spans, exactly: the area inside a closed polynomial curve, by Gauss points
/// enough.
double area_inside(const Piece& curve) {
  constexpr double x[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr double w[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  double area = 0;
  const auto& knots = curve.knots[0];
  for (std::size_t s = curve.degrees[0]; s + curve.degrees[0] + 1 < knots.size(); ++s)
    for (const double sign : {1.0, -1.0})
      for (std::size_t i = 0; i < 4; ++i) {
        const double half = (knots[s + 1] - knots[s]) / 2,
                     t = (knots[s] + knots[s + 1]) / 2 + sign * half * x[i], h = half * 1e-3;
        const auto p = value_at<2>(curve, {t}), a = value_at<2>(curve, {t - h}),
                   b = value_at<2>(curve, {t + h}), c = value_at<2>(curve, {t - 2 * h}),
                   d = value_at<2>(curve, {t + 2 * h});
        // The derivative of a quartic by four points is exact.
        const auto slope = [&](std::size_t j) { return (8 * (b[j] - a[j]) - (d[j] - c[j])) / (12 * h); };
        area += w[i] * half * (p[0] * slope(1) - p[1] * slope(0)) / 2;
      }
  return area;
}

TEST_F(Splines, ClosedCurvesBoundTheirArea) {
  for (const std::uint32_t degree : {2U, 3U}) {
    Piece curve{{degree}, {{}}, {}};
    const std::size_t count = 7;
    std::vector<std::array<double, 2>> corners;
    for (std::size_t i = 0; i < count; ++i) {
      const double angle = 2 * pi * static_cast<double>(i) / count, r = uniform(random, 0.6, 1.5);
      corners.push_back({r * std::cos(angle), r * std::sin(angle)});
    }
    for (std::size_t i = 0; i < count + degree; ++i)
      curve.points.insert(curve.points.end(), {corners[i % count][0], corners[i % count][1], 1});
    for (std::size_t i = 0; i < count + 2 * degree + 1; ++i) curve.knots[0].push_back(static_cast<double>(i));
    const double area = area_inside(curve);
    for (const double tolerance : {0.1, 0.01, 0.001}) {
      const VolumeInterval now = volume_interval<2>(model::spline(2, {curve}), thinner_than(tolerance));
      EXPECT_LE(now.in, area * (1 + 1e-9));
      EXPECT_GE(now.high(), area * (1 - 1e-9));
      EXPECT_LT(now.fuzzy, 12 * tolerance);
    }
  }
}

/// Six Bezier squares, some of them seen from inside: turned so that they bound a cube. And a cube as the
/// image of three parameters.
TEST(SplineSolids, PiecesThatFitTogetherBoundASolid) {
  std::vector<Piece> faces;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      Piece face{{1, 2}, {model::clamped_knots(1, 2), model::clamped_knots(2, 3)}, {}};
      for (const double u : {-1.0, 1.0})
        for (const double v : {-1.0, 0.0, 1.0}) {
          std::array<double, 3> p{};
          p[axis] = side, p[(axis + 1) % 3] = u, p[(axis + 2) % 3] = v;
          face.points.insert(face.points.end(), {p[0], p[1], p[2], 1});
        }
      faces.push_back(face);
    }
  // Edges along which the degrees differ do not fit.
  EXPECT_EQ(volume_interval<3>(model::spline(3, faces), down_to(9)).in, 0);
  for (Piece& face : faces) {
    face.degrees = {1, 1};
    face.knots[1] = model::clamped_knots(1, 2);
    std::vector<double> corners;
    for (const std::size_t p : {0U, 2U, 3U, 5U})
      corners.insert(corners.end(), face.points.begin() + static_cast<std::ptrdiff_t>(4 * p),
                     face.points.begin() + static_cast<std::ptrdiff_t>(4 * p + 4));
    face.points = corners;
  }
  const VolumeInterval cube = volume_interval<3>(model::spline(3, faces), thinner_than(0.05));
  expect_contains(cube, 8);
  EXPECT_LT(cube.fuzzy, 24 * 0.05);
  faces.pop_back();
  EXPECT_EQ(volume_interval<3>(model::spline(3, faces), down_to(9)).in, 0) << "an open box has no inside";
  const Expression solid = model::bezier(3, {1, 1, 1}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 2, 0, 1, 0, 2, 1, 1,
                                                        3, 0, 0, 1, 3, 0, 1, 1, 3, 2, 0, 1, 3, 2, 1, 1});
  const VolumeInterval box = volume_interval<3>(solid, thinner_than(0.05));
  expect_contains(box, 6);
  EXPECT_LT(box.fuzzy, 22 * 0.05);
}

TEST(SplineSolids, BooleansKeepTheInterval) {
  const Expression sphere = model::spline(3, {nurbs_sphere(1)}), octant = model::cuboid({2, 2, 2});
  const double eighth = pi / 6;
  for (const unsigned level : {6U, 12U}) {
    expect_contains(volume_interval<3>(model::intersect({sphere, octant}), down_to(level)), eighth);
    expect_contains(volume_interval<3>(model::subtract({sphere, octant}), down_to(level)), 7 * eighth);
    expect_contains(volume_interval<3>(model::subtract({octant, sphere}), down_to(level)), 8 - eighth);
    expect_contains(volume_interval<3>(model::unite({octant, sphere}), down_to(level)), 8 + 7 * eighth);
    expect_contains(volume_interval<3>(model::symmetric_difference({octant, sphere}), down_to(level)),
                    8 + 6 * eighth);
  }
  // A thin surface takes nothing away, and adds nothing.
  const Expression sheet =
      model::bezier(3, {1, 1}, {-1, -1, 0.3, 1, -1, 3, 1, 1, 3, -1, 1.2, 1, 3, 3, 0.7, 1});
  const VolumeInterval less = volume_interval<3>(model::subtract({octant, sheet}), thinner_than(0.05));
  expect_contains(less, 8);
  EXPECT_GT(less.in, 7);
  expect_contains(volume_interval<3>(model::unite({octant, sheet}), thinner_than(0.1)), 8);
}

TEST(SplineSolids, CellsDoNotDependOnThreadsAndOrder) {
  const Expression solid = model::subtract({model::spline(3, {nurbs_sphere(1)}), model::cuboid({1, 2, 3})});
  expect_same_digest<3>(solid, down_to(10), 0);
  expect_same_digest<3>(solid, thinner_than(0.2), 2);
}

TEST(SplineSolids, CsgHasNodesForThem) {
  const auto read = [](const char* text) { return model::parse_csg(text, "test.csg", {}).expression; };
  const VolumeInterval box = volume_interval<3>(
      read("bezier(points = [[[[0,0,0],[0,0,1]],[[0,2,0],[0,2,1]]],[[[3,0,0],[3,0,1]],[[3,2,0],[3,2,1]]]]);"),
      thinner_than(0.1));
  expect_contains(box, 6);
  const VolumeInterval disk = volume_interval<2>(
      read("nurbs(degree = 2, points = [[1,0],[1,1],[0,1],[-1,1],[-1,0],[-1,-1],[0,-1],[1,-1],[1,0]], knots "
           "= [0,0,0,1,1,2,2,3,3,4,4,4], "
           "weights = "
           "[1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1]);"),
      thinner_than(0.01));
  expect_contains(disk, pi);
  EXPECT_GT(disk.in, 3);
  // Closed cubic B-splines of four points around a square: 1/6 of each neighbour and 2/3 of the middle one at
  // the knots.
  EXPECT_GT(volume_interval<2>(read("bspline(points = [[0,0],[3,0],[3,3],[0,3]], closed = true);"),
                               thinner_than(0.05))
                .in,
            2);
  const VolumeInterval blob = volume_interval<3>(
      read("subdivision(points = [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]], "
           "faces = [[0,1,2,3],[7,6,5,4],[4,5,1,0],[5,6,2,1],[6,7,3,2],[7,4,0,3]]);"),
      thinner_than(0.1));
  EXPECT_GT(blob.in, 0.1);
  EXPECT_LT(blob.in, 0.6);
  const auto file = [](const char* name) {
    return model::read_csg(std::string(BSP2_SOURCE_DIR) + "/examples/expressions/" + name).expression;
  };
  expect_contains(volume_interval<3>(file("nurbs_solid.csg"), thinner_than(0.1)), 1.5 * pi);
  expect_contains(volume_interval<3>(file("subdivision.csg"), thinner_than(0.2)), 6 * 61.0 / 45 * 61 / 45);
  for (const char* text :
       {"bezier(points = [[0,0],[1]]);", "bspline(degree = 3, points = [[0,0],[1,1]]);",
        "bspline(points = [[0,0],[1,1],[2,0],[1,0]], knots = [1,2]);", "bezier(point = [[0,0],[1,1]]);",
        "bezier(points = [[0,0],[1,1]], weights = [1,-1]);",
        "subdivision(points = [[0,0,0],[1,0,0],[0,1,0]], faces = [[0,1,2]]);"})
    EXPECT_THROW(static_cast<void>(read(text)), Error) << text;
}

/// A surface whose control points lie so far out that doubles know it less well than the model's hyperplanes
/// is refused; before it was halved for ever. As the whole model it is as large as the model, and anything
/// goes.
TEST_F(Splines, ThatReachTooFarAreRefused) {
  const auto bezier_to = [](const std::string& far) {
    return "bezier(points = [[[0,0,1.5],[0,1,0.5],[0,2,1.5]],[[1,0," + far +
           "],[1,1,0.5],[1,2,1.5]],[[2,0,0.5],[2,1,1.5],[2,2,0.5]]]);";
  };
  const auto solid_to = [](const std::string& far) {
    return "bezier(points = [[[[0,0,0],[0,0,1]],[[0,1,0],[0,1,1]]],[[[1,0,0],[1,0,1]],[[1,1,0],[" + far +
           ",1,1]]]]);";
  };
  const auto curve_to = [](const std::string& far) {
    return "bspline(points = [[0,0],[1,2],[2," + far + "],[3,0],[1,-1]], closed = true);";
  };
  const auto cage_to = [](const std::string& far) {
    return "subdivision(points = [[0,0,0],[1,0,0],[0,1,0],[0,0," + far +
           "]], faces = [[0,1,2],[0,3,1],[1,3,2],[2,3,0]]);";
  };
  const auto fault = [](const std::string& text) -> std::string {
    try {
      const Expression read = model::parse_csg(text, "test.csg", {}).expression;
      if (read.dimension() == 2)
        static_cast<void>(compile<2>(read, {}));
      else
        static_cast<void>(compile<3>(read, {}));
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  const auto check = [&](const auto& to, const std::string& small, bool is_curve = false) {
    for (const char* far : {is_curve ? "1e8" : "1e5", "1e7", "1e10", "-1e13", "1e15"})
      EXPECT_EQ(fault("intersection() { " + small + " " + to(far) + " }")
                    .find("the control points of a spline or subdivision surface reach"),
                0U)
          << to(far);
    EXPECT_EQ(fault("intersection() { " + small + " " + to(is_curve ? "1e5" : "2e3") + " }"), "");
    EXPECT_EQ(fault(to("1e13")), "") << "which is the whole model";
    EXPECT_EQ(
        fault("intersection() { " + small +
              " multmatrix([[1e-9,0,0,0],[0,1e-9,0,0],[0,0,1e-9,0],[0,0,0,1]]) { " + to("1e10") + " } }"),
        "")
        << "is made small";
  };
  // Bounds that touch in a point, or overlap by a rounding error, hold nothing.
  const auto moved = [](const std::string& x, const std::string& child) {
    return "multmatrix([[1,0,0," + x + "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { " + child + " }";
  };
  const std::string drop = "bspline(points = [[0,0],[1,2],[2,2],[3,0]], closed = true, degree = 1);",
                    above = "multmatrix([[1,0,0,-2],[0,1,0,2],[0,0,1,0],[0,0,0,1]]) { square(2); }";
  EXPECT_EQ(fault("intersection() { " + above + drop + " }"), "");
  EXPECT_EQ(fault("intersection() { " + moved("0.1", moved("0.2", above)) + moved("0.3", drop) + " }"), "");
  check(bezier_to, "cube(2);");
  check(solid_to, "cube(2);");
  check(curve_to, "square(2);", true);
  check(cage_to, "cube(2);");
  const auto of_section = [&](const std::string& far) {
    return "section(axis = 3, at = 0.25) { " + solid_to(far) + " }";
  };
  const auto of_product = [&](const std::string& far) { return "extrude(h = 1) { " + curve_to(far) + " }"; };
  for (const char* far : {"1e7", "1e13"}) {
    EXPECT_NE(fault("intersection() { square(2); " + of_section(far) + " }").find("reach"), std::string::npos)
        << far;
    EXPECT_NE(fault("intersection() { cube(2); " + of_product(far) + " }").find("reach"), std::string::npos)
        << far;
  }
  EXPECT_EQ(fault("intersection() { square(2); " + of_section("1e3") + " }"), "");
}

/// The piece as a node of the text form.
template <int D>
std::string text_of(const Piece& piece) {
  std::ostringstream text;
  text.precision(17);
  std::vector<std::size_t> counts;
  for (std::size_t j = 0; j < piece.degrees.size(); ++j)
    counts.push_back(piece.knots[j].size() - piece.degrees[j] - 1);
  const auto list = [&](const auto& values) {
    for (std::size_t i = 0; i < values.size(); ++i) text << (i == 0 ? "[" : ",") << values[i];
    text << "]";
  };
  // Each control point, in as many lists as there are parameters.
  const auto net = [&](const auto& write) {
    const std::size_t all = piece.points.size() / (D + 1);
    for (std::size_t p = 0; p < all; ++p) {
      std::size_t inner = 1;
      for (std::size_t j = counts.size(); j-- > 0;) text << (p % (inner *= counts[j]) == 0 ? "[" : "");
      write(piece.points.data() + p * (D + 1));
      inner = 1;
      for (std::size_t j = counts.size(); j-- > 0;) text << ((p + 1) % (inner *= counts[j]) == 0 ? "]" : "");
      text << (p + 1 < all ? "," : "");
    }
  };
  text << "nurbs(degree = ";
  list(piece.degrees);
  text << ", points = ";
  net([&](const double* point) { list(std::vector<double>(point, point + D)); });
  text << ", weights = ";
  net([&](const double* point) { text << point[D]; });
  text << ", knots = [";
  for (std::size_t j = 0; j < piece.knots.size(); ++j) {
    text << (j == 0 ? "" : ",");
    list(piece.knots[j]);
  }
  text << "]);";
  return text.str();
}

template <int D>
void check_text(const Piece& piece, Random& random, double tolerance) {
  const Expression read = model::parse_csg(text_of<D>(piece), "test.csg", {}).expression;
  ASSERT_EQ(read.dimension(), D);
  EXPECT_EQ(std::get<model::Spline>(std::get<model::Primitive>(read.node().value)).pieces.front(), piece);
  check_points<D>(read, points_of<D>(piece, 100'000, random), thinner_than(tolerance));
}

TEST_F(Splines, OfTheTextHoldAllPointsOfCurvesInFourAndFiveDimensions) {
  check_text<4>(random_piece<4>(random, {3}, {7}, true), random, 0.25);
#if BSP2_DIMENSIONS > 4
  check_text<5>(random_piece<5>(random, {2}, {4}, false), random, 0.5);
#endif
}

TEST_F(Splines, OfTheTextHoldAllPointsOfSurfacesInFourDimensions) {
  check_text<4>(waved_piece<4>(random, {2, 2}, {4, 3}, true), random, 0.5);
}

TEST_F(Splines, OfTheTextHoldAllPointsOfSolidsInFourDimensions) {
  check_text<4>(waved_piece<4>(random, {2, 1, 2}, {3, 2, 3}, false), random, 0.5);
}

}  // namespace
}  // namespace bsp2::dataflow
