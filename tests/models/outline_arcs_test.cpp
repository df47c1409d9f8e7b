// Arcs in the outlines of plane models: areas against sums over the pieces of circles and lines that bound
// the solid, found by trying them all, and what is read from the files by a parser of our own.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/dataflow/constructs/part_outlines.hpp"
#include "bsp2/io/outputs/outline.hpp"
#include "models.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::models {
namespace {

using Point = std::array<double, 2>;
constexpr double pi = std::numbers::pi;

// --- solids, and their areas by trying all pieces of all curves ---

/// A disk, or a box turned around its centre.
struct Shape {
  bool is_disk;
  Point centre;
  double radius = 0;  // of a disk
  Point half{};       // of a box
  double turn = 0;    // of a box
  [[nodiscard]] Point own(const Point& p) const {
    const double x = p[0] - centre[0], y = p[1] - centre[1], c = std::cos(turn), s = std::sin(turn);
    return {c * x + s * y, c * y - s * x};
  }
  [[nodiscard]] bool has(const Point& p) const {
    const Point q = own(p);
    return is_disk ? q[0] * q[0] + q[1] * q[1] < radius * radius
                   : std::fabs(q[0]) < half[0] && std::fabs(q[1]) < half[1];
  }
  [[nodiscard]] Expression expression() const {
    const double c = std::cos(turn), s = std::sin(turn);
    return model::transform(
        std::vector<double>{c, -s, centre[0], s, c, centre[1], 0, 0, 1},
        is_disk ? model::ball(2, radius) : model::cuboid({2 * half[0], 2 * half[1]}, true));
  }
};

/// A piece of the boundary of a shape, by a parameter from 0 to 1.
struct Curve {
  Point from, to;  // of a line
  const Shape* disk = nullptr;
  [[nodiscard]] Point at(double t) const {
    if (disk == nullptr) return {from[0] + t * (to[0] - from[0]), from[1] + t * (to[1] - from[1])};
    return {disk->centre[0] + disk->radius * std::cos(2 * pi * t),
            disk->centre[1] + disk->radius * std::sin(2 * pi * t)};
  }
  [[nodiscard]] Point way(double t) const {
    Point d = disk == nullptr ? Point{to[0] - from[0], to[1] - from[1]}
                              : Point{-std::sin(2 * pi * t), std::cos(2 * pi * t)};
    const double length = std::hypot(d[0], d[1]);
    return {d[0] / length, d[1] / length};
  }
  [[nodiscard]] bool has(const Point& p) const {
    constexpr double rounding = 1e-9;
    if (disk != nullptr)
      return std::fabs(std::hypot(p[0] - disk->centre[0], p[1] - disk->centre[1]) - disk->radius) < rounding;
    const Point d = way(0), q{p[0] - from[0], p[1] - from[1]};
    const double along = q[0] * d[0] + q[1] * d[1], length = std::hypot(to[0] - from[0], to[1] - from[1]);
    return std::fabs(q[0] * d[1] - q[1] * d[0]) < rounding && along > 0 && along < length;
  }
  /// Half the integral of x dy - y dx.
  [[nodiscard]] double area(double a, double b) const {
    const Point p = at(a), q = at(b);
    const double chord = (p[0] * q[1] - p[1] * q[0]) / 2;
    if (disk == nullptr) return chord;
    const double angle = 2 * pi * (b - a);
    return chord + disk->radius * disk->radius * (angle - std::sin(angle)) / 2;
  }
};

std::vector<Curve> curves_of(const std::vector<Shape>& shapes) {
  std::vector<Curve> curves;
  for (const Shape& shape : shapes) {
    if (shape.is_disk) {
      curves.push_back({{}, {}, &shape});
      continue;
    }
    std::array<Point, 4> corners;
    const double c = std::cos(shape.turn), s = std::sin(shape.turn);
    for (std::size_t i = 0; i < 4; ++i) {
      const double x = i == 1 || i == 2 ? shape.half[0] : -shape.half[0],
                   y = i >= 2 ? shape.half[1] : -shape.half[1];
      corners[i] = {shape.centre[0] + c * x - s * y, shape.centre[1] + s * x + c * y};
    }
    for (std::size_t i = 0; i < 4; ++i) curves.push_back({corners[i], corners[(i + 1) % 4]});
  }
  return curves;
}

/// The parameters of a curve at which it meets another one.
std::vector<double> places(const Curve& curve, const Curve& other) {
  std::vector<double> found;
  const auto add = [&](const Point& p) {
    double t;
    if (curve.disk != nullptr) {
      t = std::atan2(p[1] - curve.disk->centre[1], p[0] - curve.disk->centre[0]) / (2 * pi);
      t -= std::floor(t);
    } else {
      const Point d{curve.to[0] - curve.from[0], curve.to[1] - curve.from[1]};
      t = ((p[0] - curve.from[0]) * d[0] + (p[1] - curve.from[1]) * d[1]) / (d[0] * d[0] + d[1] * d[1]);
    }
    if (t > 0 && t < 1) found.push_back(t);
  };
  const auto on_line = [&](const Curve& line, const Shape& disk) {
    const Point d = line.way(0);
    const double x = line.from[0] - disk.centre[0], y = line.from[1] - disk.centre[1],
                 b = x * d[0] + y * d[1], root = b * b - (x * x + y * y - disk.radius * disk.radius);
    for (const double sign : {-1.0, 1.0}) {
      const double s = -b + sign * std::sqrt(std::max(root, 0.0));
      add({line.from[0] + s * d[0], line.from[1] + s * d[1]});
    }
  };
  if (curve.disk == nullptr && other.disk == nullptr) {
    const Point d = curve.way(0), e = other.way(0);
    const double cross = d[0] * e[1] - d[1] * e[0], x = other.from[0] - curve.from[0],
                 y = other.from[1] - curve.from[1];
    if (std::fabs(cross) > 1e-12) {
      const double s = (x * e[1] - y * e[0]) / cross;
      add({curve.from[0] + s * d[0], curve.from[1] + s * d[1]});
    } else {  // on one line, perhaps
      add(other.from), add(other.to);
    }
  } else if (curve.disk == nullptr || other.disk == nullptr) {
    curve.disk == nullptr ? on_line(curve, *other.disk) : on_line(other, *curve.disk);
  } else {
    const Shape &a = *curve.disk, &b = *other.disk;
    const double x = b.centre[0] - a.centre[0], y = b.centre[1] - a.centre[1], apart = std::hypot(x, y);
    if (!(apart > 0)) return found;
    const double along = (apart * apart + a.radius * a.radius - b.radius * b.radius) / (2 * apart),
                 beside = std::sqrt(std::max(a.radius * a.radius - along * along, 0.0));
    for (const double s : {-beside, beside})
      add({a.centre[0] + (along * x - s * y) / apart, a.centre[1] + (along * y + s * x) / apart});
  }
  return found;
}

/// The area of what `is_in` says: of each curve the pieces on one side of which alone it is. A piece of
/// several curves counts once.
double area_by_pieces(const std::vector<Curve>& curves, const std::function<bool(const Point&)>& is_in) {
  constexpr double beside = 1e-8;
  double area = 0;
  for (const Curve& curve : curves) {
    std::vector<double> ends{0, 1};
    for (const Curve& other : curves)
      if (&other != &curve) {
        const auto found = places(curve, other);
        ends.insert(ends.end(), found.begin(), found.end());
      }
    std::sort(ends.begin(), ends.end());
    for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
      const double middle = (ends[i] + ends[i + 1]) / 2;
      const Point p = curve.at(middle), d = curve.way(middle);
      if (std::any_of(&curves[0], &curve, [&](const Curve& known) { return known.has(p); })) continue;
      const bool left = is_in({p[0] - beside * d[1], p[1] + beside * d[0]}),
                 right = is_in({p[0] + beside * d[1], p[1] - beside * d[0]});
      if (left != right) area += (left ? 1 : -1) * curve.area(ends[i], ends[i + 1]);
    }
  }
  return area;
}

// --- reading the files ---

/// Half the integral of x dy - y dx along an arc that turns by `angle` to the left, or a line.
double area_of_piece(const Point& p, const Point& q, double angle) {
  const double chord = (p[0] * q[1] - p[1] * q[0]) / 2;
  if (angle == 0) return chord;
  const double radius = std::hypot(q[0] - p[0], q[1] - p[1]) / 2 / std::fabs(std::sin(angle / 2));
  return chord + radius * radius * (angle - std::sin(angle)) / 2;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

struct Read {
  double area = 0;
  std::size_t arcs = 0;
};

/// Paths of M, L, A and z, with the commands of lines left out where they go on. By the definition of the
/// flags: y is down, so sweep 1 turns to the right as seen here.
Read read_svg(const std::string& text) {
  Read read;
  for (std::size_t at = text.find(" d=\""); at != std::string::npos; at = text.find(" d=\"", at + 1)) {
    std::string data = text.substr(at + 4, text.find('"', at + 4) - at - 4);
    std::string spaced;
    for (const char c : data)
      spaced += std::isalpha(c) != 0 && c != 'e' ? std::string(" ") + c + ' ' : std::string(1, c);
    std::istringstream words(spaced);
    Point begin{}, here{};
    char command = 'M';
    std::string word;
    while (words >> word) {
      if (std::isalpha(word[0]) != 0) {
        command = word[0];
        if (command == 'z') read.area += area_of_piece(here, begin, 0), here = begin;
        if (command == 'z' || !(words >> word)) continue;
      }
      double rx = 0, ry = 0, turn = 0, large = 0, sweep = 0, y = 0;
      if (command == 'A') {
        rx = std::stod(word);
        words >> ry >> turn >> large >> sweep >> word;
        EXPECT_EQ(rx, ry);
        EXPECT_EQ(large, 0);
      }
      words >> y;
      const Point next{std::stod(word), -y};
      if (command == 'M') {
        begin = here = next;
        continue;
      }
      double angle = 0;
      if (command == 'A') {
        const double half = std::hypot(next[0] - here[0], next[1] - here[1]) / 2;
        EXPECT_LE(half, rx * (1 + 1e-9));
        angle = 2 * std::asin(std::min(1.0, half / rx)) * (sweep == 0 ? 1 : -1);
        ++read.arcs;
      }
      read.area += area_of_piece(here, next, angle);
      here = next;
    }
  }
  return read;
}

/// LWPOLYLINE with bulges, and CIRCLE, of which the file does not tell whether they are holes: `is_hole`
/// does.
Read read_dxf(const std::string& text, const std::function<bool(const Point&, double)>& is_hole) {
  Read read;
  std::istringstream lines(text);
  std::string code, value, kind;
  std::vector<Point> points;
  std::vector<double> bulges;
  double radius = 0;
  const auto finish = [&] {
    if (kind == "CIRCLE")
      read.area += (is_hole(points[0], radius) ? -1 : 1) * pi * radius * radius, ++read.arcs;
    if (kind != "LWPOLYLINE") return;
    for (std::size_t i = 0; i < points.size(); ++i) {
      read.area += area_of_piece(points[i], points[(i + 1) % points.size()], 4 * std::atan(bulges[i]));
      read.arcs += bulges[i] != 0 ? 1 : 0;
    }
  };
  while (std::getline(lines, code) && std::getline(lines, value)) {
    const int number = std::stoi(code);
    if (number == 0) {
      finish();
      kind = value, points.clear(), bulges.clear();
    }
    if (kind != "CIRCLE" && kind != "LWPOLYLINE") continue;
    if (number == 10) points.push_back({std::stod(value), 0}), bulges.push_back(0);
    if (number == 20) points.back()[1] = std::stod(value);
    if (number == 40) radius = std::stod(value);
    if (number == 42) bulges.back() = std::stod(value);
  }
  return read;
}

struct Written {
  double in, fuzzy;
  std::uint32_t arcs = 0, polygons = 0;
  Read svg, dxf;
};

class OutlineArcs : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder_;

  Written written(const Expression& solid, double tolerance) {
    const auto network = dataflow::compile<2>(solid, {});
    dataflow::EvaluateOptions options;
    options.tolerance = tolerance;
    const auto evaluated = dataflow::evaluate_all(network, 0, options);
    std::vector<std::shared_ptr<const geometry::CellBatch>> batches;
    for (const auto& refinement : evaluated.refinements) batches.emplace_back(refinement, &refinement->cells);
    const auto outlines = dataflow::part_outlines(network, batches);
    Written written{evaluated.evaluation.totals.in.value().volume(),
                    evaluated.evaluation.totals.fuzzy.value().volume()};
    for (const auto& outline : outlines) written.arcs += outline.arcs, written.polygons += outline.polygons;
    if (outlines.empty()) return written;
    static_cast<void>(io::write_outline(folder_.path() / "o.svg", outlines));
    static_cast<void>(io::write_outline(folder_.path() / "o.dxf", outlines));
    written.svg = read_svg(text_of(folder_.path() / "o.svg"));
    const auto is_hole = [&](const Point& centre, double radius) {
      for (const auto& outline : outlines)
        for (const auto& path : outline.paths)
          if (path.corners.size() == 2 && path.bulges[0] < 0 &&
              std::hypot(path.corners[0][0] - centre[0] + radius, path.corners[0][1] - centre[1]) < 1e-9)
            return true;
      return false;
    };
    written.dxf = read_dxf(text_of(folder_.path() / "o.dxf"), is_hole);
    return written;
  }
  void expect_exact(const Expression& solid, double area, std::uint32_t arcs, double tolerance = 1.0 / 64) {
    const Written w = written(solid, tolerance);
    EXPECT_EQ(w.polygons, 0U);
    EXPECT_EQ(w.arcs, arcs);
    EXPECT_NEAR(w.svg.area, area, 1e-9 * area);
    EXPECT_NEAR(w.dxf.area, area, 1e-9 * area);
  }
};

Expression disk(double x, double y, double radius) { return Shape{true, {x, y}, radius}.expression(); }
Expression box(double x, double y, double width, double height) {
  return Shape{false, {x + width / 2, y + height / 2}, 0, {width / 2, height / 2}}.expression();
}

TEST_F(OutlineArcs, HaveTheAreasOfFormulas) {
  expect_exact(disk(1, 2, 5), 25 * pi, 1);
  expect_exact(model::subtract({disk(0, 0, 5), disk(0, 0, 3)}), 16 * pi, 2);
  expect_exact(model::subtract({box(0, 0, 40, 20), disk(10, 10, 5), disk(30, 10, 2.5)}), 800 - 31.25 * pi, 2);
  // A slot, whose lines touch its circles.
  expect_exact(model::unite({disk(0, 0, 3), disk(10, 0, 3), box(0, -3, 10, 6)}), 60 + 9 * pi, 2);
  // A plate with round corners.
  expect_exact(model::unite({box(2, 0, 36, 20), box(0, 2, 40, 16), disk(2, 2, 2), disk(38, 2, 2),
                             disk(2, 18, 2), disk(38, 18, 2)}),
               800 - 16 + 4 * pi, 4);
  const double lens = 2 * (25 * std::acos(0.6) - 12);  // of circles of radius 5, 6 apart
  expect_exact(model::unite({disk(0, 0, 5), disk(6, 0, 5)}), 50 * pi - lens, 2);
  expect_exact(model::intersect({disk(0, 0, 5), disk(6, 0, 5)}), lens, 2);
  expect_exact(model::subtract({disk(0, 0, 5), disk(6, 0, 5)}), 25 * pi - lens, 2);
  // Cut by a line, and by one beyond which next to nothing is left.
  const auto segment = [](double at) { return 25 * std::acos(at / 5) - at * std::sqrt(25 - at * at); };
  expect_exact(model::subtract({disk(0, 0, 5), box(3, -9, 9, 18)}), 25 * pi - segment(3), 1);
  expect_exact(model::intersect({disk(0, 0, 5), box(4.5, -9, 9, 18)}), segment(4.5), 1);
}

/// Coarse cells leave specks of the solid within the skins.
TEST_F(OutlineArcs, OfAPlateWithManyHolesAreItsCircles) {
  std::vector<Expression> operands{box(0, 0, 110, 60)};
  double area = 6600;
  for (int i = 0; i < 50; ++i) {
    const double radius = 2 + 0.05 * ((7 * i) % 31);
    const int x = i % 10, y = i / 10;
    operands.push_back(disk(10 + 10.123 * x, 10 + 10.321 * y, radius));
    area -= pi * radius * radius;
  }
  for (const double tolerance : {0.5, 0.25, 0.125})
    expect_exact(model::subtract(operands), area, 50, tolerance);
}

TEST_F(OutlineArcs, AreSharedByAHoleAndThePinInIt) {
  const Written w =
      written(model::unite({model::part("plate", model::subtract({box(-10, -10, 20, 20), disk(1, 2, 5)})),
                            model::part("pin", disk(1, 2, 5)),
                            model::part("half", model::intersect({disk(30, 0, 5), box(30, -9, 9, 18)})),
                            model::part("other", disk(30, 0, 5))}),
              1.0 / 64);
  EXPECT_EQ(w.polygons, 0U);
  EXPECT_EQ(w.arcs, 4U);
  EXPECT_NEAR(w.svg.area, 400 + 25 * pi, 1e-9);
}

/// Of one part, that bounds nothing.
TEST_F(OutlineArcs, AreNotWhereADiskFillsItsHole) {
  const Expression plate = box(-10, -10, 20, 20), disk_of = disk(1, 2, 5);
  expect_exact(model::unite({disk_of, model::subtract({plate, disk_of})}), 400, 0);
  expect_exact(model::unite({disk_of, model::subtract({plate, disk_of, disk(-6, -6, 2)})}), 400 - 4 * pi, 1);
}

TEST_F(OutlineArcs, EndInWhatIsStretchedToEllipses) {
  const Expression ellipse = model::transform(std::vector<double>{2, 0, 0, 0, 1, 0, 0, 0, 1}, disk(0, 0, 1));
  const Written alone = written(ellipse, 1.0 / 64),
                both = written(model::unite({ellipse, disk(9, 0, 2)}), 1.0 / 64);
  EXPECT_EQ(alone.arcs, 0U);
  EXPECT_EQ(alone.polygons, 1U);
  EXPECT_NEAR(alone.svg.area, alone.in, 1e-9);
  EXPECT_EQ(both.arcs, 1U);
  EXPECT_EQ(both.polygons, 1U);
  EXPECT_NEAR(both.svg.area, alone.in + 4 * pi, 0.05);
}

TEST_F(OutlineArcs, LeaveAPolygonWhereTwoHolesAlmostTouch) {
  // What is left between them is thinner than the tolerance, so that they are one hole in the cells.
  const Written w = written(model::subtract({box(0, 0, 20, 10), disk(5, 5, 3),
                                             disk(5 + 6.001 * std::cos(0.3), 5 + 6.001 * std::sin(0.3), 3)}),
                            1.0 / 16);
  EXPECT_GE(w.arcs, 2U);
  EXPECT_GE(w.polygons, 1U);
  EXPECT_GE(w.svg.area, w.in);
  EXPECT_LE(w.svg.area, w.in + w.fuzzy);
}

/// Disks and boxes, some of them touching or with sides on one line.
std::vector<Shape> random_shapes(dataflow::Random& random) {
  std::vector<Shape> shapes;
  const bool is_on_grid = dataflow::pick(random, 0, 1) == 0;
  const auto number = [&](double low, double high) {
    const double x = dataflow::uniform(random, low, high);
    return is_on_grid ? std::round(2 * x) / 2 : x;
  };
  for (int i = dataflow::pick(random, 2, 6); i > 0; --i) {
    Shape shape{dataflow::pick(random, 0, 2) != 0, {number(-6, 6), number(-6, 6)}};
    shape.radius = number(1, 5);
    shape.half = {number(1, 6), number(1, 6)};
    if (!is_on_grid && !shape.is_disk) shape.turn = dataflow::uniform(random, 0, pi);
    shapes.push_back(shape);
  }
  return shapes;
}

/// (((a op b) op c) op d) ...
struct Chain {
  std::vector<int> operations;  // 0: union, 1: difference, 2: intersection, 3:
                                // symmetric difference
  [[nodiscard]] Expression expression(const std::vector<Shape>& shapes) const {
    Expression all = shapes[0].expression();
    for (std::size_t i = 1; i < shapes.size(); ++i) {
      const std::vector<Expression> both{all, shapes[i].expression()};
      all = operations[i] == 0   ? model::unite(both)
            : operations[i] == 1 ? model::subtract(both)
            : operations[i] == 2 ? model::intersect(both)
                                 : model::symmetric_difference(both);
    }
    return all;
  }
  [[nodiscard]] bool has(const std::vector<Shape>& shapes, const Point& p) const {
    bool is_in = shapes[0].has(p);
    for (std::size_t i = 1; i < shapes.size(); ++i) {
      const bool other = shapes[i].has(p);
      is_in = operations[i] == 0   ? is_in || other
              : operations[i] == 1 ? is_in && !other
              : operations[i] == 2 ? is_in && other
                                   : is_in != other;
    }
    return is_in;
  }
};

TEST_F(OutlineArcs, OfRandomSolidsHaveTheAreasOfThePiecesThatBoundThem) {
  std::size_t exact = 0, many = 0;
  const unsigned rounds = samples::rounds(200U);
  for (unsigned seed = 1; seed <= rounds; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    dataflow::Random random(seed);
    const std::vector<Shape> shapes = random_shapes(random);
    Chain chain;
    for (std::size_t i = 0; i < shapes.size(); ++i)
      chain.operations.push_back(dataflow::pick(random, 0, 7) % 4);
    std::vector<Curve> curves = curves_of(shapes);
    const double area = area_by_pieces(curves, [&](const Point& p) { return chain.has(shapes, p); });
    const Written w = written(chain.expression(shapes), seed % 2 == 0 ? 1.0 / 16 : 1.0 / 256);
    EXPECT_GE(w.svg.area, w.in - 1e-9);
    EXPECT_LE(w.svg.area, w.in + w.fuzzy + 1e-9);
    EXPECT_NEAR(w.dxf.area, w.svg.area, 1e-9);
    if (w.polygons == 0 &&
        std::fabs(w.svg.area - area) > 1e-7) {  // what is thinner than the tolerance is not there
      const Written finer = written(chain.expression(shapes), 1.0 / 16384);
      EXPECT_NEAR(finer.svg.area, area, finer.polygons == 0 ? 1e-7 : finer.fuzzy);
    }
    exact += std::fabs(w.svg.area - area) < 1e-7 ? 1 : 0;
    ++many;
  }
  EXPECT_GT(4 * exact, 3 * many);
}

}  // namespace
}  // namespace bsp2::models
