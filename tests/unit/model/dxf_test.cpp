// DXF drawings: areas by formula, and random drawings beside what they are made of.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <ctime>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/model/expression/csg.hpp"
#include "model/drawing_helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

constexpr double pi = std::numbers::pi;

/// A value of a DXF file with all its digits.
std::string digits(double x) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", x);
  return text;
}

/// Pairs of group codes and values.
class Pairs {
 public:
  Pairs& operator()(int code, const std::string& value) {
    text_ += std::to_string(code) + "\n" + value + "\n";
    return *this;
  }
  Pairs& operator()(int code, const char* value) { return (*this)(code, std::string(value)); }
  Pairs& operator()(int code, double value) { return (*this)(code, digits(value)); }
  Pairs& operator()(int code, int value) { return (*this)(code, std::to_string(value)); }
  Pairs& point(int code, double x, double y) { return (*this)(code, x)(code + 10, y); }
  Pairs& entity(const std::string& type, const std::string& layer = "0") {
    return (*this)(0, type)(8, layer);
  }
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
};

/// A whole file. @param blocks of BLOCK ... ENDBLK.
std::string file_of(const std::string& entities, const std::string& blocks = "",
                    const std::string& after = "") {
  return "0\nSECTION\n2\nBLOCKS\n" + blocks + "0\nENDSEC\n0\nSECTION\n2\nENTITIES\n" + entities +
         "0\nENDSEC\n" + after + "0\nEOF\n";
}

std::string block(const std::string& name, const std::string& entities, double x = 0, double y = 0) {
  return Pairs().entity("BLOCK")(2, name).point(10, x, y).text() + entities + "0\nENDBLK\n";
}

class DxfDrawing : public ::testing::Test {
 protected:
  DrawingFile file_{"drawing.dxf"};

  PlaneDrawing read(const std::string& text, const Resolution& resolution = {}, const std::string& layer = "",
                    const DrawingFrame& frame = {}) {
    file_.write(text);
    return import_dxf(file_.path(), layer, frame, resolution, file_.remarks());
  }
  double area(const std::string& text, const Resolution& resolution = {}) {
    return area_of(read(text, resolution));
  }
  std::string fault(const std::string& text, const Resolution& resolution = {}) {
    try {
      read(text, resolution);
    } catch (const Error& error) {
      return file_.without_path(error.what());
    }
    return "";
  }
};

std::string light_polyline(const std::vector<std::array<double, 3>>& corners, bool is_closed = true) {
  Pairs pairs;
  pairs.entity("LWPOLYLINE")(90, static_cast<int>(corners.size()))(70, is_closed ? 1 : 0);
  for (const auto& [x, y, bulge] : corners) {
    pairs.point(10, x, y);
    if (bulge != 0) pairs(42, bulge);
  }
  return pairs.text();
}

std::string old_polyline(const std::vector<std::array<double, 3>>& corners, bool is_closed = true) {
  Pairs pairs;
  pairs.entity("POLYLINE")(66, 1).point(10, 0, 0)(70, is_closed ? 1 : 0);
  for (const auto& [x, y, bulge] : corners) {
    pairs.entity("VERTEX").point(10, x, y);
    if (bulge != 0) pairs(42, bulge);
  }
  return pairs.text() + "0\nSEQEND\n8\n0\n";
}

/// What an arc of this angle adds to the area beside its chord, as so many chords of a circle.
double segment(double radius, double angle, double chords) {
  return radius * radius / 2 * (chords * std::sin(angle / chords) - std::sin(angle));
}

/// What stands in other sections is no part of the last entity, whatever it is.
TEST_F(DxfDrawing, EntitiesEndWithTheirSection) {
  const std::vector<std::string> entities{
      light_polyline({{0, 0, 0}, {50, 0, 0}, {50, 50, 0}}),
      old_polyline({{0, 0, 0}, {50, 0, 0}, {50, 50, 1}}),
      Pairs().entity("CIRCLE").point(10, 3, 4)(40, 20.0).text(),
      Pairs().entity("ARC").point(10, 3, 4)(40, 20.0)(50, 10.0)(51, 200.0).text(),
      Pairs().entity("ELLIPSE").point(10, 3, 4).point(11, 30, 0)(40, 0.5)(41, 0.0)(42, 6.0).text(),
      Pairs().entity("SOLID").point(10, 0, 0).point(11, 10, 0).point(12, 0, 10).text(),
      Pairs().entity("INSERT")(2, "B").point(10, 1, 2).text(),
      Pairs().entity("SPLINE")(71, 1).text() + "40\n0\n40\n0\n40\n1\n40\n2\n40\n2\n" +
          Pairs().point(10, 0, 0).point(10, 9, 0).point(10, 9, 9).text()};
  const std::string blocks = block("B", light_polyline({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}}));
  std::string objects = "0\nSECTION\n2\nOBJECTS\n0\nDICTIONARY\n0\nPLOTSETTINGS\n";
  for (int code = 10; code < 80; ++code) objects += std::to_string(code) + "\n7\n";
  objects += "0\nENDSEC\n";
  for (const std::string& entity : entities) {
    const double alone = area(file_of(entity, blocks));
    EXPECT_GT(alone, 1) << entity;
    EXPECT_EQ(area(file_of(entity, blocks, objects)), alone) << entity;
    EXPECT_EQ(area(objects + file_of(entity, blocks)), alone) << "nor what stands before it: " << entity;
    EXPECT_TRUE(file_.warnings.empty()) << file_.warnings[0];
  }
}

TEST_F(DxfDrawing, WhatFollowsTheEndIsNotRead) {
  const std::string triangle = light_polyline({{0, 0, 0}, {50, 0, 0}, {50, 50, 0}});
  for (const char* rest :
       {"\n", "\n\n", "\n\n\n", "made by hand\non a day\n", "\x1a", "0\nSECTION\n2\nENTITIES\n"})
    EXPECT_NEAR(area(file_of(triangle) + rest), 1250, 1e-9) << rest;
}

/// Cases that were wrong.
TEST_F(DxfDrawing, Cases) {
  const auto case_area = [](const std::string& name, const Resolution& resolution) {
    return area_of(import_dxf(std::string(BSP2_SOURCE_DIR "/tests/cases/") + name, "", {}, resolution));
  };
  EXPECT_NEAR(case_area("dxf-polyline-then-objects.dxf", {}), 1250, 1e-9);
  EXPECT_NEAR(case_area("dxf-insert-scaled.dxf", {}), 0.5, 1e-9);
  EXPECT_NEAR(case_area("dxf-old-polyline.dxf", {}), 50, 1e-12);
  EXPECT_NEAR(case_area("dxf-bulge.dxf", {}), 176 + 2 * segment(4, pi, 7), 0.05)
      << "13 sides of a circle are 7 of a half";
  EXPECT_NEAR(case_area("dxf-bulge.dxf", {.fn = 1000}), 176 + 16 * pi, 0.05);
}

/// Polygons with arcs for sides, of both kinds of polylines, at random.
TEST_F(DxfDrawing, BulgesAreArcs) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int round = 0; round < samples::rounds(100); ++round) {
    const int sides = 3 + static_cast<int>(random() % 6), fn = 8 + static_cast<int>(random() % 100);
    std::vector<std::array<double, 3>> corners;
    double expected = 0, length = 0;
    std::vector<PlanePoint> polygon;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * pi * (i + number(-0.2, 0.2)) / sides, radius = number(80, 120);
      polygon.push_back({radius * std::cos(angle), radius * std::sin(angle)});
      corners.push_back({polygon[i][0], polygon[i][1], random() % 3 == 0 ? 0 : number(-0.15, 0.6)});
    }
    expected = twice_area(polygon) / 2;
    for (int i = 0; i < sides; ++i) {
      const PlanePoint &p = polygon[i], &q = polygon[(i + 1) % sides];
      const double chord = std::hypot(q[0] - p[0], q[1] - p[1]), bulge = corners[i][2],
                   angle = 4 * std::atan(std::fabs(bulge));
      length += chord * 2;
      if (bulge == 0) continue;
      const double part = segment(chord / 2 / std::sin(angle / 2), angle,
                                  std::max(std::ceil(fn * angle / (2 * pi) - 1e-3), 1.0));
      expected += bulge > 0 ? part : -part;
    }
    const double grid = length * 0x1p-10;
    EXPECT_NEAR(area(file_of(light_polyline(corners)), {.fn = static_cast<double>(fn)}), expected, grid);
    const PlaneDrawing light = read(file_of(light_polyline(corners)), {.fn = static_cast<double>(fn)});
    const PlaneDrawing old = read(file_of(old_polyline(corners)), {.fn = static_cast<double>(fn)});
    EXPECT_EQ(light.points, old.points);
    std::reverse(corners.begin(), corners.end());  // the other way round: bulges belong to the corner that
                                                   // they begin at, and change their signs
    std::vector<std::array<double, 3>> back;
    for (int i = 0; i < sides; ++i)
      back.push_back({corners[i][0], corners[i][1], -corners[(i + 1) % sides][2]});
    EXPECT_NEAR(area(file_of(old_polyline(back)), {.fn = static_cast<double>(fn)}), expected, grid);
  }
  // Two half circles.
  EXPECT_NEAR(area(file_of(light_polyline({{0, 0, 1}, {10, 0, 1}})), {.fn = 400}), 25 * pi, 0.05);
  // Nearly all of a circle, and nothing of one.
  EXPECT_NEAR(area(file_of(light_polyline({{0, 0, 1e3}, {0.1, 0, 0}})), {.fn = 1000}), 625 * pi, 5);
  for (const double bulge : {1e-300, 1e300, -1e-17})
    EXPECT_LE(area(file_of(light_polyline({{0, 0, bulge}, {1, 0, 0}, {1, 1, 0}}))), 0.51) << bulge;
}

/// An open path is closed by a line, with what its arcs enclose.
TEST_F(DxfDrawing, OpenPolylinesAreClosedByALine) {
  EXPECT_NEAR(area(file_of(light_polyline({{0, 0, 1}, {10, 0, 0}}, false)), {.fn = 100}), segment(5, pi, 50),
              0.05);
  EXPECT_NEAR(area(file_of(old_polyline({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, false))), 50, 1e-9);
  ASSERT_EQ(file_.notes.size(), 1U);
  EXPECT_EQ(file_.notes[0], "1 path of FILE is open, and closed by a straight line; it begins at (0, 0)");
  area(file_of(light_polyline({{1, 2, 0}, {9, 2, 0}}, false)));
  ASSERT_EQ(file_.notes.size(), 1U);
  EXPECT_EQ(file_.notes[0], "1 line of FILE bounds nothing");
  area(file_of(light_polyline({{0, 0, 0}, {10, 0, 0}, {10, 10, 0}}, true)));
  EXPECT_TRUE(file_.notes.empty());
}

TEST_F(DxfDrawing, PolylinesHaveOnlyTheCornersOfTheirCurve) {
  // Spline-fitted: the control points of the frame (16) stand beside the corners of the curve (8).
  Pairs pairs;
  pairs.entity("POLYLINE")(66, 1)(70, 1 + 4);
  const std::vector<std::array<double, 3>> corners{{0, 0, 16}, {0, 0, 8}, {4, 0, 8},  {99, 0, 16},
                                                   {4, 4, 8},  {0, 4, 8}, {0, 99, 16}};
  for (const auto& [x, y, flag] : corners) pairs.entity("VERTEX").point(10, x, y)(70, static_cast<int>(flag));
  EXPECT_NEAR(area(file_of(pairs.text() + "0\nSEQEND\n")), 16, 1e-9);
  // A mesh of faces is no outline.
  EXPECT_EQ(area(file_of(
                Pairs().entity("POLYLINE")(70, 64).entity("VERTEX").point(10, 9, 9).entity("SEQEND").text())),
            0);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0],
            "1 thing in FILE is not read: 1 POLYLINE that is a mesh. The result lacks it; convert it to "
            "lines, arcs or splines in the "
            "program that made the file, or delete it there");
}

// --- splines ---

/// The basis functions as Cox and de Boor define them.
double basis(const std::vector<double>& knots, std::size_t i, int degree, double u) {
  if (degree == 0) return knots[i] <= u && u < knots[i + 1] ? 1 : 0;
  const auto p = static_cast<std::size_t>(degree);
  const double left = knots[i + p] - knots[i], right = knots[i + p + 1] - knots[i + 1];
  double sum = 0;
  if (left > 0) sum += (u - knots[i]) / left * basis(knots, i, degree - 1, u);
  if (right > 0) sum += (knots[i + p + 1] - u) / right * basis(knots, i + 1, degree - 1, u);
  return sum;
}

struct SplineEntity {
  int degree;
  std::vector<double> knots, weights;
  std::vector<PlanePoint> points;

  [[nodiscard]] PlanePoint at(double u) const {
    PlanePoint sum{};
    double weight = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double w = basis(knots, i, degree, u) * weights[i];
      weight += w;
      for (std::size_t k = 0; k < 2; ++k) sum[k] += w * points[i][k];
    }
    return {sum[0] / weight, sum[1] / weight};
  }
  [[nodiscard]] std::vector<PlanePoint> dense(int count) const {
    std::vector<PlanePoint> all;
    const double low = knots[static_cast<std::size_t>(degree)], high = knots[points.size()];
    std::vector<double> places{std::nextafter(high, low)};
    for (int i = 0; i < count; ++i) places.push_back(low + (high - low) * i / count);
    for (const double knot : knots)  // where there may be corners
      if (low <= knot && knot < high) places.push_back(knot);
    std::sort(places.begin(), places.end());
    for (const double u : places) all.push_back(at(u));
    return all;
  }
  [[nodiscard]] std::string text(int flags) const {
    Pairs pairs;
    pairs.entity("SPLINE")(70, flags)(71, degree)(72, 1'000'000'000)(73, 1'000'000'000);
    for (const double knot : knots) pairs(40, knot);
    for (std::size_t i = 0; i < points.size(); ++i) {
      if ((flags & 4) != 0) pairs(41, weights[i]);
      pairs.point(10, points[i][0], points[i][1])(30, 0.0);
    }
    return pairs.text();
  }
};

double distance(const PlanePoint& p, const PlanePoint& q) { return std::hypot(p[0] - q[0], p[1] - q[1]); }

/// The distance of a point from a closed path.
double distance_to_path(const PlanePoint& p, const std::vector<PlanePoint>& path) {
  double least = 1e300;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const PlanePoint &a = path[i], &b = path[(i + 1) % path.size()];
    const double x = b[0] - a[0], y = b[1] - a[1], l = x * x + y * y;
    const double t = l > 0 ? std::clamp(((p[0] - a[0]) * x + (p[1] - a[1]) * y) / l, 0.0, 1.0) : 0;
    least = std::min(least, distance(p, {a[0] + t * x, a[1] + t * y}));
  }
  return least;
}

/// Control points around a circle, so that the curve does not cross itself: clamped, or closed with knots
/// that go on.
SplineEntity random_spline(std::mt19937& random, bool is_closed) {
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  SplineEntity spline{1 + static_cast<int>(random() % 5), {}, {}, {}};
  const auto p = static_cast<std::size_t>(spline.degree), n = p + 2 + random() % 8;
  for (std::size_t i = 0; i < n; ++i) {
    const double angle = 2 * pi * static_cast<double>(i) / static_cast<double>(n), radius = number(70, 130);
    spline.points.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    spline.weights.push_back(random() % 2 == 0 ? 1 : number(0.5, 2));
  }
  if (is_closed) {
    for (std::size_t i = 0; i < p; ++i)
      spline.points.push_back(spline.points[i]), spline.weights.push_back(spline.weights[i]);
    for (std::size_t i = 0; i < n + 2 * p + 1; ++i) spline.knots.push_back(static_cast<double>(i));
    return spline;
  }
  spline.knots.assign(p + 1, 0);
  double u = 0;
  while (spline.knots.size() < n) {
    u += number(0.3, 2);
    for (std::size_t times = 1 + (random() % 4 == 0 ? random() % p : 0); times > 0 && spline.knots.size() < n;
         --times)
      spline.knots.push_back(u);
  }
  spline.knots.insert(spline.knots.end(), p + 1, u + 1);
  return spline;
}

TEST_F(DxfDrawing, SplinesAreWhatTheirBasisFunctionsSay) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const bool is_closed = random() % 2 == 0;
    const SplineEntity spline = random_spline(random, is_closed);
    const std::vector<PlanePoint> dense = spline.dense(4000);
    const double expected = std::fabs(twice_area(dense)) / 2;
    const PlaneDrawing drawing = read(file_of(spline.text(4 | (is_closed ? 1 : 0))), {.fn = 720});
    ASSERT_EQ(drawing.paths.size(), 1U) << spline.text(4);
    EXPECT_NEAR(area_of(drawing), expected, 5e-4 * expected) << spline.text(4);
    const std::vector<PlanePoint> path =
        paths_of(drawing)[0];  // far fewer points than the dense ones, of which some are looked at
    for (std::size_t i = 0; i < path.size(); i += 1 + path.size() / 40)
      EXPECT_LT(distance_to_path(path[i], dense), 0.01);
    EXPECT_LT(drawing.points.size(), 4000U) << "as many as the turn takes";
  }
}

/// A circle of four quarters, of degree 2 and of weights, is one of $fn sides.
TEST_F(DxfDrawing, ARationalSplineIsACircle) {
  const double s = std::sqrt(0.5);
  const SplineEntity circle{
      2,
      {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4},
      {1, s, 1, s, 1, s, 1, s, 1},
      {{10, 0}, {10, 10}, {0, 10}, {-10, 10}, {-10, 0}, {-10, -10}, {0, -10}, {10, -10}, {10, 0}}};
  for (const int fn : {8, 36, 100, 360}) {
    const PlaneDrawing drawing = read(file_of(circle.text(4)), {.fn = static_cast<double>(fn)});
    EXPECT_EQ(drawing.points.size(), static_cast<std::size_t>(fn));
    EXPECT_NEAR(area_of(drawing), fn / 2.0 * 100 * std::sin(2 * pi / fn), 0.1);
  }
  const PlaneDrawing by_default = read(file_of(circle.text(4)));
  EXPECT_EQ(by_default.points.size(), 32U) << "30 sides by $fa, in quarters";
}

/// Without control points it goes through its fit points.
TEST_F(DxfDrawing, SplinesGoThroughTheirFitPoints) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(30); ++round) {
    const bool is_closed = round % 2 == 0;
    const int n = 8 + static_cast<int>(random() % 30);
    std::vector<PlanePoint> through;
    Pairs pairs;
    pairs.entity("SPLINE")(70, is_closed ? 1 : 0)(71, 3)(72, 0)(73, 0)(74, n);
    const double turn = std::uniform_real_distribution<double>(0, 6)(random);
    for (int i = 0; i < n; ++i) {
      const double angle = turn + 2 * pi * i / n;
      through.push_back({100 * std::cos(angle), 100 * std::sin(angle)});
      pairs.point(11, through.back()[0], through.back()[1])(31, 0.0);
    }
    const PlaneDrawing drawing = read(file_of(pairs.text()), {.fn = 720});
    ASSERT_EQ(drawing.paths.size(), 1U);
    const auto path = paths_of(drawing)[0];
    for (const PlanePoint& p : through) EXPECT_LT(distance_to_path(p, path), 2e-3);
    if (!is_closed) continue;
    for (const PlanePoint& p : path)
      EXPECT_NEAR(std::hypot(p[0], p[1]), 100, 0.01 + 5e4 / std::pow(n, 4))
          << n << " points are nearly on a circle";
  }
  // Two points are a line, whatever its ends say; the tangents bend it.
  EXPECT_EQ(area(file_of(Pairs().entity("SPLINE")(71, 3).point(11, 0, 0).point(11, 10, 0).text())), 0);
  const double bent = area(file_of(Pairs()
                                       .entity("SPLINE")(71, 3)
                                       .point(12, 0, 1)
                                       .point(13, 0, -1)
                                       .point(11, 0, 0)
                                       .point(11, 10, 0)
                                       .text()),
                           {.fn = 200});
  EXPECT_NEAR(bent, 20, 0.05)
      << "Hermite's cubic: the integral of y = 10 s (1 - s) along x = 10 (3 - 2 s) s^2";
}

TEST_F(DxfDrawing, DamagedSplinesAreErrors) {
  const SplineEntity sound{2, {0, 0, 0, 1, 1, 1}, {1, 1, 1}, {{0, 0}, {5, 9}, {9, 0}}};
  EXPECT_EQ(fault(file_of(sound.text(4))), "");
  SplineEntity odd = sound;
  odd.knots.pop_back();
  EXPECT_EQ(fault(file_of(odd.text(4))), "import: FILE: SPLINE has 5 knots where it takes 6");
  odd = sound, odd.knots[3] = -1;
  EXPECT_EQ(fault(file_of(odd.text(4))), "import: FILE: SPLINE has a knot that is less than the one before");
  odd = sound, odd.weights[1] = 0;
  EXPECT_EQ(fault(file_of(odd.text(4))), "import: FILE: SPLINE has a weight that is not positive");
  odd = sound, odd.degree = 1'000'000'000;
  EXPECT_EQ(fault(file_of(odd.text(4))), "import: FILE: SPLINE has the degree 1000; 1 to 25 are read");
  EXPECT_EQ(fault(file_of(sound.text(4)), {.fn = 1e9}),
            "import: a spline of a drawing gets more than 200000 sides ($fn, $fa, $fs)");
  EXPECT_EQ(fault(file_of(Pairs().entity("LINE").point(10, 1, 2)(11, "1,5")(21, 4.0).text())),
            "import: FILE:20: '1,5' is no finite number, as the value of group code 11 of LINE");
}

// --- blocks ---

/// x -> a x + b y + e, y -> c x + d y + f.
struct Affine {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  [[nodiscard]] PlanePoint operator()(const PlanePoint& p) const {
    return {a * p[0] + b * p[1] + e, c * p[0] + d * p[1] + f};
  }
  [[nodiscard]] Affine after(const Affine& m) const {
    const PlanePoint to = (*this)({m.e, m.f});
    return {a * m.a + b * m.c, a * m.b + b * m.d, c * m.a + d * m.c, c * m.b + d * m.d, to[0], to[1]};
  }
};

/// Blocks in blocks, each a polygon and what it inserts, with the polygons that come out written by hand.
class Blocks {
 public:
  explicit Blocks(unsigned seed) : random_(seed) {}

  /// A block of this depth, and its polygons in its own frame. @return its name.
  std::string make(int depth, std::vector<std::vector<PlanePoint>>& polygons) {
    const std::string name = "Block " + std::to_string(++count_);
    const double base_x = number(-5, 5), base_y = number(-5, 5);
    const int sides = 3 + static_cast<int>(random_() % 3);
    std::vector<std::array<double, 3>> corners;
    std::vector<PlanePoint> polygon;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * pi * i / sides + number(-0.3, 0.3);
      polygon.push_back({8 * std::cos(angle), 8 * std::sin(angle)});
      corners.push_back({polygon[i][0], polygon[i][1], 0});
    }
    polygons.push_back(polygon);
    std::string entities = random_() % 2 == 0 ? light_polyline(corners) : old_polyline(corners);
    for (int i = depth > 0 ? 1 + static_cast<int>(random_() % 2) : 0; i > 0; --i)
      entities += insert(depth - 1, polygons);
    for (auto& each : polygons)
      for (PlanePoint& p : each) p = {p[0] - base_x, p[1] - base_y};
    text += block(name, entities, base_x, base_y);
    return name;
  }

  /// An INSERT with all that it may have.
  std::string insert(int depth, std::vector<std::vector<PlanePoint>>& polygons) {
    std::vector<std::vector<PlanePoint>> inner;
    std::string name = make(depth, inner);
    if (random_() % 3 == 0)
      std::transform(name.begin(), name.end(), name.begin(),
                     [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    const double x = number(-99, 99), y = number(-99, 99), sx = number(0.5, 2) * sign(),
                 sy = number(0.5, 2) * sign(), turn = number(-400, 400);
    const int columns = 1 + static_cast<int>(random_() % 3), rows = 1 + static_cast<int>(random_() % 2);
    const double column = number(40, 80), row = number(40, 80);
    const bool is_mirrored = random_() % 3 == 0;
    Pairs pairs;
    pairs.entity("INSERT")(2, name).point(10, x, y)(41, sx)(42, sy)(43, 1.0)(50, turn)(70, columns)(71, rows)(
        44, column)(45, row);
    if (is_mirrored) pairs(210, 0.0)(220, 0.0)(230, -1.0);
    const double c = std::cos(turn * pi / 180), s = std::sin(turn * pi / 180);
    for (int i = 0; i < rows; ++i)
      for (int j = 0; j < columns; ++j) {
        const Affine turned{c, -s, s, c, x + c * j * column - s * i * row, y + s * j * column + c * i * row};
        Affine map = turned.after({sx, 0, 0, sy, 0, 0});
        if (is_mirrored) map = Affine{-1, 0, 0, 1, 0, 0}.after(map);
        for (const auto& polygon : inner) {
          auto& moved = polygons.emplace_back();
          for (const PlanePoint& p : polygon) moved.push_back(map(p));
        }
      }
    return pairs.text();
  }

  std::string text;

 private:
  std::mt19937 random_;
  int count_ = 0;
  double number(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double sign() { return random_() % 2 == 0 ? 1 : -1; }
};

TEST_F(DxfDrawing, BlocksAreInserted) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    Blocks blocks(seed + static_cast<unsigned>(round));
    std::vector<std::vector<PlanePoint>> polygons;
    const std::string entities = blocks.insert(static_cast<int>(round % 4), polygons);
    const PlaneDrawing drawing = read(file_of(entities, blocks.text));
    EXPECT_TRUE(file_.warnings.empty());
    std::vector<PlanePoint> expected;
    for (const auto& polygon : polygons) expected.insert(expected.end(), polygon.begin(), polygon.end());
    // Each corner is there, but for the grid; where corners of several polygons meet on it they are one.
    EXPECT_LE(drawing.points.size(), expected.size());
    EXPECT_GE(drawing.points.size() + 2, expected.size());
    for (const PlanePoint& p : expected) {
      const bool is_there = std::any_of(drawing.points.begin(), drawing.points.end(),
                                        [&](const PlanePoint& q) { return distance(p, q) < 3e-3; });
      EXPECT_TRUE(is_there) << p[0] << " " << p[1];
    }
    double area = 0, perimeter = 0;
    for (const auto& polygon : polygons) {
      area += std::fabs(twice_area(polygon)) / 2;
      for (std::size_t i = 0; i < polygon.size(); ++i)
        perimeter += distance(polygon[i], polygon[(i + 1) % polygon.size()]);
    }
    if (drawing.points.size() == expected.size()) {
      EXPECT_NEAR(area_of(drawing), area, perimeter * 2e-3);
    }
  }
}

/// Circles get their sides by the size that they are drawn in.
TEST_F(DxfDrawing, CurvesInBlocksAreAsRoundAsOthers) {
  const std::string circle = Pairs().entity("CIRCLE").point(10, 0, 0)(40, 1.0).text();
  const std::string blocks = block("B", circle);
  const auto inserted = [&](double sx, double sy) {
    return file_of(Pairs().entity("INSERT")(2, "B").point(10, 7, 7)(41, sx)(42, sy).text(), blocks);
  };
  EXPECT_EQ(read(inserted(10, 10)).points.size(), 30U);
  EXPECT_NEAR(area(inserted(10, 10)),
              area(file_of(Pairs().entity("CIRCLE").point(10, 0, 0)(40, 10.0).text())), 0.1);
  EXPECT_NEAR(area(inserted(20, -10), {.fn = 100}), 50 * 200 * std::sin(pi / 50), 0.2);
  EXPECT_NEAR(area(file_of(Pairs()
                               .entity("ELLIPSE")
                               .point(10, 1, 1)
                               .point(11, 12, 16)(40, 0.5)(41, 0.0)(42, 2 * pi)
                               .text()),
                   {.fn = 100}),
              50 * 200 * std::sin(pi / 50), 0.2);
}

/// What is drawn in a plane that looks down is mirrored: x becomes -x.
TEST_F(DxfDrawing, PlanesThatLookDownAreMirrored) {
  const std::string down = Pairs()(210, 0.0)(220, 0.0)(230, -1.0).text();
  const std::vector<std::pair<std::string, std::string>> mirrored{
      {Pairs().entity("CIRCLE").point(10, 30, 4)(40, 20.0).text(),
       Pairs().entity("CIRCLE").point(10, -30, 4)(40, 20.0).text()},
      {Pairs().entity("ARC").point(10, 30, 4)(40, 20.0)(50, 0.0)(51, 90.0).text(),
       Pairs().entity("ARC").point(10, -30, 4)(40, 20.0)(50, 90.0)(51, 180.0).text()},
      {light_polyline({{1, 0, 0.5}, {9, 0, 0}, {9, 9, 0}}),
       light_polyline({{-1, 0, -0.5}, {-9, 0, 0}, {-9, 9, 0}})},
      {Pairs().entity("SOLID").point(10, 1, 0).point(11, 9, 0).point(12, 1, 3).point(13, 9, 5).text(),
       Pairs().entity("SOLID").point(10, -1, 0).point(11, -9, 0).point(12, -1, 3).point(13, -9, 5).text()},
      // The axes of an ellipse stand in the drawing itself; it only goes the other way round.
      {Pairs().entity("ELLIPSE").point(10, 1, 1).point(11, 30, 0)(40, 0.5)(41, 0.0)(42, 2.0).text(),
       Pairs()
           .entity("ELLIPSE")
           .point(10, 1, 1)
           .point(11, 30, 0)(40, 0.5)(41, 2 * pi - 2.0)(42, 2 * pi)
           .text()}};
  for (const auto& [entity, upright] : mirrored) {
    auto points = read(file_of(entity + down), {.fn = 36}).points,
         expected = read(file_of(upright), {.fn = 36}).points;
    ASSERT_EQ(points.size(), expected.size()) << entity;
    for (const PlanePoint& p : points)
      EXPECT_TRUE(std::any_of(expected.begin(), expected.end(),
                              [&](const PlanePoint& q) { return distance(p, q) < 2e-3; }))
          << entity << p[0] << " " << p[1];
  }
  // A plane on edge has no area, and one that leans is seen smaller.
  const double circle = area(file_of(Pairs().entity("CIRCLE").point(10, 0, 0)(40, 20.0).text()), {.fn = 36});
  EXPECT_NEAR(
      area(file_of(Pairs().entity("CIRCLE").point(10, 0, 0)(40, 20.0)(210, 1.0)(220, 0.0)(230, 0.0).text()),
           {.fn = 36}),
      0, 1e-6);
  EXPECT_NEAR(
      area(file_of(Pairs().entity("CIRCLE").point(10, 0, 0)(40, 20.0)(210, 0.0)(220, 0.6)(230, 0.8).text()),
           {.fn = 36}),
      0.8 * circle, 0.1);
}

TEST_F(DxfDrawing, SolidsHaveTheirLastCornersSwapped) {
  EXPECT_NEAR(
      area(file_of(
          Pairs().entity("SOLID").point(10, 0, 0).point(11, 4, 0).point(12, 0, 3).point(13, 4, 3).text())),
      12, 1e-9);
  EXPECT_NEAR(
      area(file_of(
          Pairs().entity("TRACE").point(10, 0, 0).point(11, 4, 0).point(12, 0, 3).point(13, 0, 3).text())),
      6, 1e-9);
  EXPECT_NEAR(area(file_of(Pairs().entity("SOLID").point(10, 0, 0).point(11, 4, 0).point(12, 0, 3).text())),
              6, 1e-9);
}

TEST_F(DxfDrawing, LayersAreThoseOfEntitiesAndInsertions) {
  const std::string square =
      "0\nSOLID\n8\nin\n" + Pairs().point(10, 0, 0).point(11, 2, 0).point(12, 0, 2).point(13, 2, 2).text();
  const std::string text = file_of(Pairs().entity("INSERT", "cut")(2, "B").text() +
                                       Pairs().entity("CIRCLE", "other").point(10, 50, 0)(40, 5.0).text() +
                                       Pairs().entity("TEXT", "other").text(),
                                   block("B", square));
  EXPECT_NEAR(area_of(read(text, {}, "cut")), 4, 1e-9);
  EXPECT_TRUE(file_.warnings.empty()) << "a text on another layer is not missed";
  EXPECT_EQ(area_of(read(text, {}, "in")), 0);
  EXPECT_GT(area_of(read(text, {}, "")), 60);
  EXPECT_EQ(file_.warnings.size(), 1U);
}

// --- what is told ---

TEST_F(DxfDrawing, WhatIsNotReadIsOneWarning) {
  const std::string square = light_polyline({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}});
  std::string odd;
  for (const char* type : {"HATCH", "TEXT", "MTEXT", "TEXT", "IMAGE", "DIMENSION", "HATCH", "TEXT"})
    odd += Pairs().entity(type).point(10, 5, 5).text();
  EXPECT_NEAR(area(file_of(square + odd)), 4, 1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0],
            "8 things in FILE are not read: 1 DIMENSION, 2 HATCH, 1 IMAGE, 1 MTEXT, 3 TEXT. The result lacks "
            "them; convert them to lines, "
            "arcs or splines in the program that made the file, or delete them there");
  // In a block each counts once, and only if the block is inserted.
  const std::string insert = Pairs().entity("INSERT")(2, "B").point(10, 0, 0)(70, 3)(44, 10.0).text();
  EXPECT_NEAR(area(file_of(insert, block("B", square + Pairs().entity("MTEXT").text()) + block("C", odd))),
              12, 1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0].find("1 thing in FILE is not read: 1 MTEXT. The result lacks it; convert it"),
            0U)
      << file_.warnings[0];
  area(file_of(Pairs().entity("INSERT")(2, "X").text()));
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].find("1 INSERT of a block 'X' that is not there."), std::string::npos)
      << file_.warnings[0];
  // Widths are no outlines.
  area(file_of(Pairs().entity("LWPOLYLINE")(43, 2.0).point(10, 0, 0).point(10, 1, 0).text()));
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].find("1 LWPOLYLINE (its width only)."), std::string::npos) << file_.warnings[0];
  // What is invisible is not there, nor windows of the paper; what is on paper is told of.
  EXPECT_NEAR(
      area(file_of(
          square +
          Pairs().entity("TEXT")(60, 1).entity("CIRCLE")(60, 1)(40, 9.0).entity("VIEWPORT")(67, 1).text())),
      4, 1e-9);
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_NEAR(area(file_of(square + Pairs().entity("CIRCLE")(67, 1).point(10, 50, 0)(40, 9.0).text())), 4,
              1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].find("1 CIRCLE in paper space."), std::string::npos) << file_.warnings[0];
  // Too far away for anybody.
  area(file_of(Pairs().entity("LINE").point(10, 1e13, 0).point(11, 0, 0).text()));
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].find("1 line with a coordinate beyond 1e12."), std::string::npos)
      << file_.warnings[0];
}

TEST_F(DxfDrawing, UnitsAreToldAndNothingIsScaled) {
  const auto in_units = [](const std::string& units) {
    return "0\nSECTION\n2\nHEADER\n9\n$ACADVER\n1\nAC1015\n9\n$INSUNITS\n70\n" + units +
           "\n9\n$OTHER\n70\n7\n0\nENDSEC\n" +
           file_of(Pairs()
                       .entity("SOLID")
                       .point(10, 0, 0)
                       .point(11, 4, 0)
                       .point(12, 0, 3)
                       .point(13, 4, 3)
                       .text());
  };
  EXPECT_NEAR(area(in_units("1")), 12, 1e-9);
  ASSERT_EQ(file_.notes.size(), 1U);
  EXPECT_EQ(file_.notes[0],
            "FILE is drawn in inches ($INSUNITS); nothing is scaled, one of them is one unit of the model; "
            "scale = 25.4 in the import makes "
            "millimetres of them");
  EXPECT_TRUE(file_.warnings.empty());
  area(in_units("4"));
  ASSERT_EQ(file_.notes.size(), 1U);
  EXPECT_EQ(
      file_.notes[0],
      "FILE is drawn in millimetres ($INSUNITS); nothing is scaled, one of them is one unit of the model");
  area(in_units("0"));
  EXPECT_TRUE(file_.notes.empty());
  EXPECT_NEAR(area_of(read(in_units("1"), {}, "", {.scale = 25.4})), 12 * 25.4 * 25.4, 0.5);
  ASSERT_EQ(file_.notes.size(), 1U);
  EXPECT_EQ(
      file_.notes[0],
      "FILE is drawn in inches ($INSUNITS); its lengths are multiplied by the scale of the import alone");
  area(in_units("999999999999999999"));
}

// --- what files may say ---

TEST_F(DxfDrawing, WhatIsTooSmallForTheGridIsTold) {
  const std::string square = light_polyline({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const auto line = [](double length) {
    return Pairs().entity("LINE").point(10, 5, 5).point(11, 5 + length, 5).text();
  };
  const auto arc = [](double from, double to) {
    return Pairs().entity("ARC")(10, 7)(20, 7)(40, 1)(50, from)(51, to).text();
  };
  EXPECT_NEAR(area(file_of(square + line(1e-4) + line(2e-4) + arc(30, 30) +
                           Pairs().entity("CIRCLE")(10, 9)(20, 9)(40, 1e-5).text())),
              1, 1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0].find(
                "4 things in FILE are not read: 1 ARC of angle 0, 1 CIRCLE too small for the grid of 1/1024 "
                "on which drawings lie, "
                "2 LINE too small for the grid of 1/1024 on which drawings lie. The result lacks them"),
            0U)
      << file_.warnings[0];
  // A point that is drawn as a line lacks nothing; nor does a curve with a chord that is too short.
  area(file_of(square + line(0) + arc(30, 31) + line(0.01) +
               light_polyline({{2, 2, 0}, {3, 2, 0}, {3, 3, 0}, {3, 3.0001, 0}})));
  EXPECT_TRUE(file_.warnings.empty()) << file_.warnings[0];
  area(file_of(square + Pairs().entity("INSERT")(2, "B")(41, 1e-3)(42, 1e-3).text(), block("B", line(0.1))));
  ASSERT_EQ(file_.warnings.size(), 1U) << "small in the drawing, not in its block";
}

/// No number in a file decides how long it takes, or how much memory.
TEST_F(DxfDrawing, BombsAreRefusedAtOnce) {
  const std::clock_t start = std::clock();
  const std::string line = Pairs().entity("LINE").point(10, 0, 0).point(11, 1, 1).text();
  const auto insert = [](const std::string& name, double columns = 1, double rows = 1) {
    return Pairs().entity("INSERT")(2, name)(70, columns)(71, rows)(44, 3.0)(45, 3.0).text();
  };
  EXPECT_EQ(fault(file_of(insert("A"), block("A", insert("B")) + block("B", line + insert("a")))),
            "import: FILE: a block inserts itself: 'A', which inserts 'B', which inserts 'a'");
  EXPECT_EQ(fault(file_of(insert("A"), block("A", insert("A")))),
            "import: FILE: a block inserts itself: 'A', which inserts 'A'");
  EXPECT_EQ(fault(file_of(line, block("A", insert("A")))), "") << "nobody inserts it";
  std::string deep, wide;
  for (int i = 0; i < 1000; ++i)
    deep += block("D" + std::to_string(i), insert("D" + std::to_string(i + 1)) + line);
  EXPECT_EQ(fault(file_of(insert("D0"), deep)),
            "import: FILE: blocks are inserted in each other more than 100 deep");
  for (int i = 0; i < 50; ++i)
    wide += block("W" + std::to_string(i), insert("W" + std::to_string(i + 1), 10));
  EXPECT_NE(fault(file_of(insert("W0"), wide + block("W50", line)))
                .find("FILE is too large: blocks inserted again and again"),
            std::string::npos);
  if (samples::is_sanitized) return;  // what follows takes minutes there
  EXPECT_NE(
      fault(file_of(insert("B", 1e9, 1e9), block("B", Pairs().entity("TEXT").text()))).find("is too large"),
      std::string::npos);
  EXPECT_EQ(fault(file_of(insert("B", 1e9, 1e9), block("B", ""))), "");
  EXPECT_NE(fault(file_of(insert("B", 1e9, 1e9), block("B", line))).find("is too large"), std::string::npos);
  EXPECT_EQ(
      fault(file_of(insert("B", 1e9, 1e9), block("B", light_polyline({{0, 0, 1}, {10, 0, 1}}))), {.fn = 100}),
      "import: a DXF drawing of more than a million lines");
  for (const std::string& round :
       {Pairs().entity("CIRCLE")(40, 1e9).text(), light_polyline({{0, 0, 1}, {10, 0, 1}}),
        Pairs().entity("ELLIPSE").point(11, 30, 0)(40, 0.5).text()})
    EXPECT_EQ(fault(file_of(round), {.fn = 1e9}),
              "import: a circle, an arc or an ellipse of a DXF drawing gets more than 200000 sides ($fn, "
              "$fa, $fs)");
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 60) << "seconds of the processor";
}

/// A drawing with everything, damaged at random, is an error or another drawing; never anything else.
TEST_F(DxfDrawing, DamagedDrawingsAreErrorsOrDrawings) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::string entities;
  const SplineEntity spline = random_spline(random, false);
  Pairs fitted;
  fitted.entity("SPLINE")(70, 1)(71, 3);
  for (int i = 0; i < 5; ++i) fitted.point(11, std::cos(i) * 9, std::sin(i) * 9);
  for (const std::string& each :
       {light_polyline({{0, 0, 0.5}, {5, 0, 0}, {5, 5, -0.2}}),
        old_polyline({{0, 0, 0}, {5, 0, 1}, {5, 5, 0}}), spline.text(4), fitted.text(),
        Pairs().entity("CIRCLE").point(10, 3, 4)(40, 2.0)(210, 0.0)(220, 0.0)(230, -1.0).text(),
        Pairs().entity("ELLIPSE").point(10, 3, 4).point(11, 30, 0)(40, 0.5)(41, 0.0)(42, 6.0).text(),
        Pairs().entity("SOLID").point(10, 0, 0).point(11, 10, 0).point(12, 0, 10).text(),
        Pairs().entity("INSERT")(2, "B").point(10, 1, 2)(41, 2.0)(70, 2)(71, 2)(44, 9.0)(45, 9.0).text(),
        Pairs().entity("HATCH").text()})
    entities += each;
  const std::string sound = file_of(entities, block("C", light_polyline({{0, 0, 0}, {4, 0, 0}, {4, 4, 0}})) +
                                                  block("B", Pairs().entity("INSERT")(2, "C").text()));
  ASSERT_EQ(fault(sound), "");
  int errors = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    std::string damaged = sound;
    for (int i = static_cast<int>(random() % 4); i >= 0; --i) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0:
          damaged[at] = static_cast<char>(random());
          break;
        case 1:
          damaged[at] = static_cast<char>('0' + random() % 10);
          break;
        case 2:
          damaged.erase(at, 1 + random() % 20);
          break;
        default:
          damaged.insert(at, std::array{"1e308", "-", "\n", "999999999", "0\nINSERT\n2\nB\n"}[random() % 5]);
      }
    }
    errors += fault(damaged, {.fn = 12}).empty() ? 0 : 1;
  }
  EXPECT_GT(errors, samples::rounds(100));
  EXPECT_LT(errors, 1950);
}

TEST_F(DxfDrawing, BinaryFilesAreToldOf) {
  EXPECT_EQ(fault(std::string("AutoCAD Binary DXF\r\n\x1a\0xyz", 25)),
            "import: FILE is a binary DXF file; save it as a text (ASCII) DXF file");
  EXPECT_EQ(fault("\xEF\xBB\xBF" + file_of("")), "") << "a byte order mark";
}

}  // namespace
}  // namespace bsp2::model
