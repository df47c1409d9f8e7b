// Splines and subdivision surfaces: FUZZY cells that hold sampled points, intervals that hold the truth, streams that refine.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>

#include "bsp2/dataflow/localizer.hpp"
#include "bsp2/dataflow/spline_producer.hpp"
#include "bsp2/geometry/error.hpp"
#include "bsp2/geometry/point_query.hpp"
#include "bsp2/model/csg.hpp"
#include "dataflow_oracle.hpp"
#include "intervals.hpp"
#include "producer_stream.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Label;
using model::Expression;
using model::SubdivisionSurface;
using Piece = model::Spline::Piece;
constexpr double pi = std::numbers::pi;

// --- splines by their basis functions, as an oracle ------------------------------------------------------------------

/// N_i of this degree at t, by the recursion of Cox and de Boor. The last span of the domain is closed.
double basis(const std::vector<double>& knots, std::size_t i, std::size_t degree, double t) {
  if (degree == 0) {
    const bool is_last = knots[i] < knots[i + 1] && knots[i + 1] == t && std::none_of(knots.begin(), knots.end(), [&](double k) { return k > t; });
    return (knots[i] <= t && t < knots[i + 1]) || is_last ? 1 : 0;
  }
  double sum = 0;
  if (knots[i + degree] > knots[i]) sum += (t - knots[i]) / (knots[i + degree] - knots[i]) * basis(knots, i, degree - 1, t);
  if (knots[i + degree + 1] > knots[i + 1]) sum += (knots[i + degree + 1] - t) / (knots[i + degree + 1] - knots[i + 1]) * basis(knots, i + 1, degree - 1, t);
  return sum;
}

template <int D>
std::array<double, D> value_at(const Piece& piece, const std::vector<double>& t) {
  std::array<double, D + 1> sum{};
  const std::size_t count = piece.points.size() / (D + 1);
  std::vector<std::vector<double>> weights;
  for (std::size_t j = 0; j < t.size(); ++j)
    for (std::size_t i = 0; i + piece.degrees[j] + 1 < piece.knots[j].size(); ++i) {
      if (i == 0) weights.emplace_back();
      weights[j].push_back(basis(piece.knots[j], i, piece.degrees[j], t[j]));
    }
  for (std::size_t p = 0; p < count; ++p) {
    double weight = piece.points[p * (D + 1) + D];
    for (std::size_t j = t.size(), rest = p; j-- > 0; rest /= weights[j].size()) weight *= weights[j][rest % weights[j].size()];
    for (std::size_t c = 0; c < D; ++c) sum[c] += weight * piece.points[p * (D + 1) + c];
    sum[D] += weight;
  }
  std::array<double, D> point;
  for (std::size_t c = 0; c < D; ++c) point[c] = sum[c] / sum[D];
  return point;
}

/// Random points of the piece, at random parameters and some at knots. Of solids, of the faces at the ends of parameters.
template <int D>
std::vector<std::array<double, D>> points_of(const Piece& piece, std::size_t count, Random& random) {
  std::vector<std::array<double, D>> points;
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> t;
    for (std::size_t j = 0; j < piece.degrees.size(); ++j) {
      const auto& knots = piece.knots[j];
      const std::size_t first = piece.degrees[j], last = knots.size() - piece.degrees[j] - 1;
      const bool is_end = piece.degrees.size() == D && j == i % D;
      t.push_back(is_end ? knots[chance(random, 0.5) ? first : last] : chance(random, 0.02) ? knots[static_cast<std::size_t>(pick(random, static_cast<int>(first), static_cast<int>(last)))]
                                                                                          : uniform(random, knots[first], knots[last]));
    }
    points.push_back(value_at<D>(piece, t));
  }
  return points;
}

// --- the checks --------------------------------------------------------------------------------------------------------

/// None of the points is in a cell that is IN or OUT. @return the interval of the volume.
template <int D>
Interval check_points(const Expression& e, const std::vector<std::array<double, D>>& points, const EvaluateOptions& given) {
  const Network<D> network = compile<D>(e, {});
  EvaluateOptions options = given;
  options.record_tree = true;
  auto [evaluation, refinements] = evaluate_all(network, 0, options);
  std::vector<Label> labels;
  for (const auto& refinement : refinements) labels.insert(labels.end(), refinement->cells.label.begin(), refinement->cells.label.end());
  evaluation.tree.root = evaluation.region_roots[0];
  const geometry::PointQuery<D> query(network.table, evaluation.tree, labels);
  std::size_t wrong = 0;
  for (const auto& point : points) wrong += query.ask(point).label != Label::fuzzy ? 1 : 0;
  EXPECT_EQ(wrong, 0U) << "of " << points.size() << " points";
  EXPECT_GT(points.size(), 99'999U);
  return {evaluation.totals.in.value().volume(), evaluation.totals.fuzzy.value().volume(), labels.size()};
}

template <int D>
Piece random_piece(Random& random, const std::vector<std::uint32_t>& degrees, const std::vector<std::size_t>& counts, bool rational) {
  Piece piece{degrees, {}, {}};
  std::size_t count = 1;
  for (std::size_t j = 0; j < degrees.size(); ++j) {
    count *= counts[j];
    auto& knots = piece.knots.emplace_back(model::clamped_knots(degrees[j], counts[j]));
    for (std::size_t i = degrees[j] + 1; i + degrees[j] + 1 < knots.size(); ++i) knots[i] += uniform(random, -0.4, 0.4);
  }
  for (std::size_t p = 0; p < count; ++p) {
    for (int c = 0; c < D; ++c) piece.points.push_back(uniform(random, -2, 2));
    piece.points.push_back(rational ? uniform(random, 0.2, 3) : 1);
  }
  return piece;
}

/// A net over a grid, moved about a little: an embedded surface or solid.
template <int D>
Piece waved_piece(Random& random, const std::vector<std::uint32_t>& degrees, const std::vector<std::size_t>& counts, bool rational) {
  Piece piece = random_piece<D>(random, degrees, counts, rational);
  for (std::size_t p = 0; p < piece.points.size() / (D + 1); ++p)
    for (std::size_t j = counts.size(), rest = p; j-- > 0; rest /= counts[j]) {
      double& x = piece.points[p * (D + 1) + j];
      x = static_cast<double>(rest % counts[j]) + 0.1 * x;
    }
  return piece;
}

class Seeded : public testing::Test {
 protected:
  std::uint64_t seed = new_seed();
  Random random{seed};
  testing::ScopedTrace trace{__FILE__, __LINE__, testing::Message() << "BSP2_SEED=" << seed};
};
using Splines = Seeded;
using Subdivision = Seeded;

TEST_F(Splines, HoldAllPointsOfCurves) {
  const Piece plane = random_piece<2>(random, {3}, {9}, false), space = random_piece<3>(random, {4}, {8}, true), flat = random_piece<2>(random, {2}, {6}, true);
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
  const Piece solid = waved_piece<3>(random, {2, 2, 2}, {3, 3, 3}, false), plate = waved_piece<2>(random, {3, 3}, {5, 4}, true);
  check_points<3>(model::spline(3, {solid}), points_of<3>(solid, 100'000, random), thinner_than(0.1));
  check_points<2>(model::spline(2, {plate}), points_of<2>(plate, 100'000, random), thinner_than(0.01));
}

TEST_F(Splines, HoldAllPointsInMoreDimensions) {
  const Piece curve = random_piece<4>(random, {3}, {4}, false), surface = waved_piece<4>(random, {2, 2}, {3, 3}, false);
  check_points<4>(model::spline(4, {curve}), points_of<4>(curve, 100'000, random), down_to(14));
  check_points<4>(model::spline(4, {surface}), points_of<4>(surface, 100'000, random), down_to(12));
}

// --- exact areas and volumes -------------------------------------------------------------------------------------------

/// The circle by nine points of degree 2 in the plane of two axes, as pairs and weights.
std::vector<std::array<double, 3>> circle_points() {
  const double h = std::sqrt(0.5);
  return {{1, 0, 1}, {1, 1, h}, {0, 1, 1}, {-1, 1, h}, {-1, 0, 1}, {-1, -1, h}, {0, -1, 1}, {1, -1, h}, {1, 0, 1}};
}
std::vector<double> circle_knots() { return {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}; }

Piece nurbs_circle(double radius) {
  Piece piece{{2}, {circle_knots()}, {}};
  for (const auto& [x, y, w] : circle_points()) piece.points.insert(piece.points.end(), {radius * x, radius * y, w});
  return piece;
}

/// A circle in the half-plane (rho, z) around (major, 0), or with major = 0 a half of it, turned around z.
Piece turned(const std::vector<std::array<double, 3>>& profile, std::vector<double> knots, double major, double minor) {
  Piece piece{{2, 2}, {circle_knots(), std::move(knots)}, {}};
  for (const auto& [x, y, w] : circle_points())
    for (const auto& [rho, z, v] : profile) piece.points.insert(piece.points.end(), {x * (major + minor * rho), y * (major + minor * rho), minor * z, w * v});
  return piece;
}
Piece nurbs_sphere(double radius) {
  const double h = std::sqrt(0.5);
  return turned({{0, -1, 1}, {1, -1, h}, {1, 0, 1}, {1, 1, h}, {0, 1, 1}}, {0, 0, 0, 1, 1, 2, 2, 2}, 0, radius);
}

TEST(Nurbs, CirclesHaveTheirExactArea) {
  const Expression circle = model::spline(2, {nurbs_circle(2)});
  double last = 1e300;
  for (const unsigned level : {4U, 8U, 12U, 16U}) {
    const Interval now = volume_interval<2>(circle, down_to(level));
    expect_contains(now, 4 * pi);
    EXPECT_LE(now.fuzzy, last * (1 + 1e-12));
    last = now.fuzzy;
  }
  for (const double tolerance : {0.1, 0.01, 0.001, 1e-4}) {
    const Interval now = volume_interval<2>(circle, thinner_than(tolerance));
    expect_contains(now, 4 * pi);
    EXPECT_LE(now.fuzzy, tolerance * 4 * pi * 1.2);
  }
}

TEST(Nurbs, SpheresHaveTheirExactVolume) {
  const Expression sphere = model::spline(3, {nurbs_sphere(1)});
  for (const unsigned level : {0U, 6U, 12U}) expect_contains(volume_interval<3>(sphere, down_to(level)), 4 * pi / 3);
  double last = 1e300;
  for (const double tolerance : {0.2, 0.1, 0.05}) {
    const Interval now = volume_interval<3>(sphere, thinner_than(tolerance));
    expect_contains(now, 4 * pi / 3);
    EXPECT_LE(now.fuzzy, tolerance * 4 * pi * 2.5);
    EXPECT_LT(now.fuzzy, last * 0.6);
    last = now.fuzzy;
  }
}

TEST_F(Splines, PlacedSolidsHaveTheirVolume) {
  const auto matrix = free_matrix(random, 3, 5);
  double determinant = 0;
  const auto at = [&](std::size_t i, std::size_t j) { return matrix[4 * i + j]; };
  for (std::size_t i = 0; i < 3; ++i) determinant += at(0, i) * (at(1, (i + 1) % 3) * at(2, (i + 2) % 3) - at(1, (i + 2) % 3) * at(2, (i + 1) % 3));
  expect_contains(volume_interval<3>(model::transform(matrix, model::spline(3, {nurbs_sphere(1)})), down_to(12)), 4 * pi / 3 * std::fabs(determinant));
  // Pappus; the tube is closed in both parameters, and there is a hole.
  const Expression torus = model::spline(3, {turned(circle_points(), circle_knots(), 2, 0.5)});
  const Interval now = volume_interval<3>(torus, thinner_than(0.1));
  expect_contains(now, 2 * pi * pi * 2 * 0.25);
  EXPECT_GT(now.in, pi);
  // Far from the origin coordinates are coarser. Six cuts are for the ends of the region.
  const std::vector<double> far{1e-3, 0, 0, 1e4, 0, 1e-3, 0, -2e4, 0, 0, 1e-3, 3e4, 0, 0, 0, 1};
  const Interval small = volume_interval<3>(model::transform(far, model::spline(3, {nurbs_sphere(1)})), down_to(15));
  EXPECT_LE(small.in, 4e-9 * pi / 3 * (1 + 1e-6));
  EXPECT_GE(small.high(), 4e-9 * pi / 3 * (1 - 1e-6));
  EXPECT_GT(small.in, 0);
}

/// Green's formula over Bezier spans, exactly: the area inside a closed polynomial curve, by Gauss points enough.
double area_inside(const Piece& curve) {
  constexpr double x[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  constexpr double w[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  double area = 0;
  const auto& knots = curve.knots[0];
  for (std::size_t s = curve.degrees[0]; s + curve.degrees[0] + 1 < knots.size(); ++s)
    for (const double sign : {1.0, -1.0})
      for (std::size_t i = 0; i < 4; ++i) {
        const double half = (knots[s + 1] - knots[s]) / 2, t = (knots[s] + knots[s + 1]) / 2 + sign * half * x[i], h = half * 1e-3;
        const auto p = value_at<2>(curve, {t}), a = value_at<2>(curve, {t - h}), b = value_at<2>(curve, {t + h}), c = value_at<2>(curve, {t - 2 * h}), d = value_at<2>(curve, {t + 2 * h});
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
    for (std::size_t i = 0; i < count + degree; ++i) curve.points.insert(curve.points.end(), {corners[i % count][0], corners[i % count][1], 1});
    for (std::size_t i = 0; i < count + 2 * degree + 1; ++i) curve.knots[0].push_back(static_cast<double>(i));
    const double area = area_inside(curve);
    for (const double tolerance : {0.1, 0.01, 0.001}) {
      const Interval now = volume_interval<2>(model::spline(2, {curve}), thinner_than(tolerance));
      EXPECT_LE(now.in, area * (1 + 1e-9));
      EXPECT_GE(now.high(), area * (1 - 1e-9));
      EXPECT_LT(now.fuzzy, 12 * tolerance);
    }
  }
}

/// Six Bezier squares, some of them seen from inside: turned so that they bound a cube. And a cube as the image of three parameters.
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
    for (const std::size_t p : {0U, 2U, 3U, 5U}) corners.insert(corners.end(), face.points.begin() + static_cast<std::ptrdiff_t>(4 * p), face.points.begin() + static_cast<std::ptrdiff_t>(4 * p + 4));
    face.points = corners;
  }
  const Interval cube = volume_interval<3>(model::spline(3, faces), thinner_than(0.05));
  expect_contains(cube, 8);
  EXPECT_LT(cube.fuzzy, 24 * 0.05);
  faces.pop_back();
  EXPECT_EQ(volume_interval<3>(model::spline(3, faces), down_to(9)).in, 0) << "an open box has no inside";
  const Expression solid = model::bezier(3, {1, 1, 1}, {0, 0, 0, 1, 0, 0, 1, 1, 0, 2, 0, 1, 0, 2, 1, 1, 3, 0, 0, 1, 3, 0, 1, 1, 3, 2, 0, 1, 3, 2, 1, 1});
  const Interval box = volume_interval<3>(solid, thinner_than(0.05));
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
    expect_contains(volume_interval<3>(model::symmetric_difference({octant, sphere}), down_to(level)), 8 + 6 * eighth);
  }
  // A thin surface takes nothing away, and adds nothing.
  const Expression sheet = model::bezier(3, {1, 1}, {-1, -1, 0.3, 1, -1, 3, 1, 1, 3, -1, 1.2, 1, 3, 3, 0.7, 1});
  const Interval less = volume_interval<3>(model::subtract({octant, sheet}), thinner_than(0.05));
  expect_contains(less, 8);
  EXPECT_GT(less.in, 7);
  expect_contains(volume_interval<3>(model::unite({octant, sheet}), thinner_than(0.1)), 8);
}

// --- subdivision -------------------------------------------------------------------------------------------------------

struct ControlNet {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::uint32_t>> faces;
  [[nodiscard]] Expression surface(SubdivisionSurface::Scheme scheme) const {
    SubdivisionSurface s{scheme, {}, faces};
    for (const auto& p : points) s.points.insert(s.points.end(), p.begin(), p.end());
    return model::subdivision_surface(3, std::move(s));
  }
};

std::array<double, 3> sum(std::initializer_list<std::pair<double, std::array<double, 3>>> terms) {
  std::array<double, 3> total{};
  for (const auto& [w, p] : terms)
    for (std::size_t i = 0; i < 3; ++i) total[i] += w * p[i];
  return total;
}

/// One step of either scheme over the whole mesh, and points of the limit, by the published masks: another way than the producer's.
class Subdivider {
 public:
  explicit Subdivider(ControlNet net) : net_(std::move(net)) { connect(); }

  void catmull_clark() {
    ControlNet fine;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const double n = static_cast<double>(faces_of_[v].size());
      std::array<double, 3> q{}, r{};
      for (const auto f : faces_of_[v]) q = sum({{1, q}, {1 / n, centre(f)}});
      for (const auto w : neighbours_[v]) r = sum({{1, r}, {0.5 / n, net_.points[v]}, {0.5 / n, net_.points[w]}});
      fine.points.push_back(sum({{1 / n, q}, {2 / n, r}, {(n - 3) / n, net_.points[v]}}));
    }
    for (std::size_t e = 0; e < edges_.size(); e += 2)
      fine.points.push_back(sum({{0.25, net_.points[edges_[e].ends.first]}, {0.25, net_.points[edges_[e].ends.second]}, {0.25, centre(edges_[e].face)}, {0.25, centre(edges_[e + 1].face)}}));
    for (std::size_t f = 0; f < net_.faces.size(); ++f) fine.points.push_back(centre(f));
    const auto base = static_cast<std::uint32_t>(net_.points.size()), faces = base + static_cast<std::uint32_t>(edges_.size() / 2);
    for (std::size_t f = 0; f < net_.faces.size(); ++f) {
      const auto& face = net_.faces[f];
      for (std::size_t i = 0; i < face.size(); ++i)
        fine.faces.push_back({face[i], base + number(face[i], face[(i + 1) % face.size()]), faces + static_cast<std::uint32_t>(f),
                              base + number(face[(i + face.size() - 1) % face.size()], face[i])});
    }
    net_ = std::move(fine);
    connect();
  }

  void loop() {
    ControlNet fine;
    for (std::size_t v = 0; v < net_.points.size(); ++v) fine.points.push_back(weighted(v, beta(neighbours_[v].size())));
    for (std::size_t e = 0; e < edges_.size(); e += 2)
      fine.points.push_back(sum({{0.375, net_.points[edges_[e].ends.first]}, {0.375, net_.points[edges_[e].ends.second]}, {0.125, net_.points[edges_[e].third]}, {0.125, net_.points[edges_[e + 1].third]}}));
    const auto base = static_cast<std::uint32_t>(net_.points.size());
    for (const auto& face : net_.faces) {
      const std::uint32_t a = base + number(face[0], face[1]), b = base + number(face[1], face[2]), c = base + number(face[2], face[0]);
      fine.faces.insert(fine.faces.end(), {{face[0], a, c}, {face[1], b, a}, {face[2], c, b}, {a, b, c}});
    }
    net_ = std::move(fine);
    connect();
  }

  [[nodiscard]] std::vector<std::array<double, 3>> catmull_clark_limits() const {
    std::vector<std::array<double, 3>> limits;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const double n = static_cast<double>(neighbours_[v].size()), w = 1 / (n * (n + 5));
      auto limit = sum({{n * n * w, net_.points[v]}});
      for (const auto e : neighbours_[v]) limit = sum({{1, limit}, {4 * w, net_.points[e]}});
      for (const auto f : faces_of_[v]) {
        const auto& face = net_.faces[f];
        const auto at = static_cast<std::size_t>(std::find(face.begin(), face.end(), v) - face.begin());
        limit = sum({{1, limit}, {w, net_.points[face[(at + 2) % 4]]}});
      }
      limits.push_back(limit);
    }
    return limits;
  }
  [[nodiscard]] std::vector<std::array<double, 3>> loop_limits() const {
    std::vector<std::array<double, 3>> limits;
    for (std::size_t v = 0; v < net_.points.size(); ++v) {
      const std::size_t n = neighbours_[v].size();
      limits.push_back(weighted(v, 1 / (3 / (8 * beta(n)) + static_cast<double>(n))));
    }
    return limits;
  }
  /// Six times the volume enclosed by the mesh of limit points, by tetrahedra.
  [[nodiscard]] double volume(const std::vector<std::array<double, 3>>& at) const {
    double six = 0;
    for (const auto& face : net_.faces)
      for (std::size_t i = 1; i + 1 < face.size(); ++i) {
        const auto &a = at[face[0]], &b = at[face[i]], &c = at[face[i + 1]];
        six += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
      }
    return std::fabs(six) / 6;
  }

 private:
  ControlNet net_;
  std::vector<std::vector<std::uint32_t>> neighbours_;
  std::vector<std::vector<std::size_t>> faces_of_;
  struct Side {
    std::pair<std::uint32_t, std::uint32_t> ends;
    std::size_t face;
    std::uint32_t third;  // corner of the face
  };
  std::vector<Side> edges_;  // sorted: each edge has two next to each other

  void connect() {
    neighbours_.assign(net_.points.size(), {});
    faces_of_.assign(net_.points.size(), {});
    edges_.clear();
    for (std::size_t f = 0; f < net_.faces.size(); ++f) {
      const auto& face = net_.faces[f];
      for (std::size_t i = 0; i < face.size(); ++i) {
        const std::uint32_t a = face[i], b = face[(i + 1) % face.size()], c = face[(i + 2) % face.size()];
        neighbours_[a].push_back(b);
        faces_of_[a].push_back(f);
        edges_.push_back({std::minmax(a, b), f, c});
      }
    }
    std::sort(edges_.begin(), edges_.end(), [](const Side& a, const Side& b) { return a.ends < b.ends; });
  }
  [[nodiscard]] std::uint32_t number(std::uint32_t a, std::uint32_t b) const {
    const std::pair<std::uint32_t, std::uint32_t> ends = std::minmax(a, b);
    const auto at = std::lower_bound(edges_.begin(), edges_.end(), ends, [](const Side& side, const std::pair<std::uint32_t, std::uint32_t>& e) { return side.ends < e; });
    return static_cast<std::uint32_t>(at - edges_.begin()) / 2;
  }
  [[nodiscard]] std::array<double, 3> centre(std::size_t f) const {
    std::array<double, 3> mean{};
    for (const auto v : net_.faces[f]) mean = sum({{1, mean}, {1.0 / static_cast<double>(net_.faces[f].size()), net_.points[v]}});
    return mean;
  }
  static double beta(std::size_t n) {
    const double c = 3.0 / 8 + std::cos(2 * pi / static_cast<double>(n)) / 4;
    return (5.0 / 8 - c * c) / static_cast<double>(n);
  }
  [[nodiscard]] std::array<double, 3> weighted(std::size_t v, double weight) const {
    auto point = sum({{1 - weight * static_cast<double>(neighbours_[v].size()), net_.points[v]}});
    for (const auto w : neighbours_[v]) point = sum({{1, point}, {weight, net_.points[w]}});
    return point;
  }
};

/// A house, of squares and pentagons, with corners of three and four edges; its corners moved about.
ControlNet house(Random& random) {
  ControlNet net{{{0, 0, 0}, {2, 0, 0}, {2, 0, 2}, {1, 0, 3}, {0, 0, 2}, {0, 3, 0}, {2, 3, 0}, {2, 3, 2}, {1, 3, 3}, {0, 3, 2}}, {{0, 1, 2, 3, 4}, {9, 8, 7, 6, 5}}};
  for (std::uint32_t i = 0; i < 5; ++i) net.faces.push_back({(i + 1) % 5, i, i + 5, (i + 1) % 5 + 5});
  for (auto& p : net.points)
    for (double& x : p) x += uniform(random, -0.2, 0.2);
  return net;
}

/// A double pyramid over a polygon of so many corners.
ControlNet double_pyramid(Random& random, std::uint32_t sides) {
  ControlNet net{{{0, 0, 1.5}, {0, 0, -1.5}}, {}};
  for (std::uint32_t i = 0; i < sides; ++i) {
    const double angle = 2 * pi * i / sides;
    net.points.push_back({std::cos(angle) + uniform(random, -0.1, 0.1), std::sin(angle), uniform(random, -0.2, 0.2)});
    net.faces.push_back({0, 2 + i, 2 + (i + 1) % sides});
    net.faces.push_back({1, 2 + (i + 1) % sides, 2 + i});
  }
  return net;
}

TEST_F(Subdivision, CatmullClarkSurfacesHoldTheirPointsAndBoundTheirVolume) {
  const ControlNet net = house(random);
  Subdivider fine(net);
  for (int step = 0; step < 7; ++step) fine.catmull_clark();
  const auto limits = fine.catmull_clark_limits();
  const Expression surface = net.surface(SubdivisionSurface::Scheme::catmull_clark);
  const double volume = fine.volume(limits);
  const Interval now = check_points<3>(surface, limits, thinner_than(0.2));
  EXPECT_LE(now.in, volume * (1 + 1e-3));  // the mesh of limit points is inside of what is convex, a little
  EXPECT_GE(now.high(), volume * (1 - 1e-3));
  EXPECT_GT(now.in, volume / 2);
}

TEST_F(Subdivision, LoopSurfacesHoldTheirPointsAndBoundTheirVolume) {
  const ControlNet net = double_pyramid(random, 7);
  Subdivider fine(net);
  for (int step = 0; step < 7; ++step) fine.loop();
  const auto limits = fine.loop_limits();
  const Expression surface = net.surface(SubdivisionSurface::Scheme::loop);
  const double volume = fine.volume(limits);
  const Interval now = check_points<3>(surface, limits, thinner_than(0.1));
  EXPECT_LE(now.in, volume * (1 + 1e-3));
  EXPECT_GE(now.high(), volume * (1 - 1e-3));
  EXPECT_GT(now.in, volume / 3);
}

// --- streams and determinism -------------------------------------------------------------------------------------------

TEST(SplineSolids, CellsDoNotDependOnThreadsAndOrder) {
  const Expression solid = model::subtract({model::spline(3, {nurbs_sphere(1)}), model::cuboid({1, 2, 3})});
  expect_same_digest<3>(solid, down_to(10), 0);
  expect_same_digest<3>(solid, thinner_than(0.2), 2);
}

/// `distance_inside`: of a point from the boundary, negative outside.
template <int D>
void check_stream(const Expression& e, unsigned deepest, const std::function<Real(const Point&)>& distance_inside, Random& random) {
  const Network<D> network = compile<D>(e, {});
  ASSERT_EQ(network.splines.size(), 1U);
  const auto truth = [&](const Point& x) {
    const Real inside = distance_inside(x);
    return Where{inside > 0, std::fabs(inside) < 1e-12L};
  };
  check_stream_of<D>(network, SplineProducer<D>(network, network.producers[0]), deepest, truth, random);
}

TEST(SplineProducer, EmitsAStreamOfRefinements) {
  Random random(new_seed());
  check_stream<2>(model::spline(2, {nurbs_circle(1)}), 14, [](const Point& x) { return 1 - std::hypot(x[0], x[1]); }, random);
  check_stream<3>(model::spline(3, {nurbs_sphere(1)}), 12, [](const Point& x) { return 1 - std::hypot(x[0], x[1], x[2]); }, random);
  check_stream<3>(model::spline(3, {random_piece<3>(random, {3}, {5}, true)}), 12, [](const Point&) { return Real{-1}; }, random);
}

TEST(SplineSolids, CsgHasNodesForThem) {
  const auto read = [](const char* text) { return model::parse_csg(text, "test.csg", {}).expression; };
  const Interval box = volume_interval<3>(read("bezier(points = [[[[0,0,0],[0,0,1]],[[0,2,0],[0,2,1]]],[[[3,0,0],[3,0,1]],[[3,2,0],[3,2,1]]]]);"), thinner_than(0.1));
  expect_contains(box, 6);
  const Interval disk = volume_interval<2>(read("nurbs(degree = 2, points = [[1,0],[1,1],[0,1],[-1,1],[-1,0],[-1,-1],[0,-1],[1,-1],[1,0]], knots = [0,0,0,1,1,2,2,3,3,4,4,4], "
                                                "weights = [1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1,0.70710678118654757,1]);"),
                                           thinner_than(0.01));
  expect_contains(disk, pi);
  EXPECT_GT(disk.in, 3);
  // Closed cubic B-splines of four points around a square: 1/6 of each neighbour and 2/3 of the middle one at the knots.
  EXPECT_GT(volume_interval<2>(read("bspline(points = [[0,0],[3,0],[3,3],[0,3]], closed = true);"), thinner_than(0.05)).in, 2);
  const Interval blob = volume_interval<3>(read("subdivision(points = [[0,0,0],[1,0,0],[1,1,0],[0,1,0],[0,0,1],[1,0,1],[1,1,1],[0,1,1]], "
                                                "faces = [[0,1,2,3],[7,6,5,4],[4,5,1,0],[5,6,2,1],[6,7,3,2],[7,4,0,3]]);"),
                                           thinner_than(0.1));
  EXPECT_GT(blob.in, 0.1);
  EXPECT_LT(blob.in, 0.6);
  const auto file = [](const char* name) { return model::read_csg(std::string(BSP2_SOURCE_DIR) + "/examples/expressions/" + name).expression; };
  expect_contains(volume_interval<3>(file("nurbs_solid.csg"), thinner_than(0.1)), 1.5 * pi);
  expect_contains(volume_interval<3>(file("subdivision.csg"), thinner_than(0.2)), 6 * 61.0 / 45 * 61 / 45);
  for (const char* text : {"bezier(points = [[0,0],[1]]);", "bspline(degree = 3, points = [[0,0],[1,1]]);", "bspline(points = [[0,0],[1,1],[2,0],[1,0]], knots = [1,2]);",
                           "bezier(point = [[0,0],[1,1]]);", "bezier(points = [[0,0],[1,1]], weights = [1,-1]);", "subdivision(points = [[0,0,0],[1,0,0],[0,1,0]], faces = [[0,1,2]]);"})
    EXPECT_THROW(static_cast<void>(read(text)), Error) << text;
}

/// The piece as a node of the text form.
template <int D>
std::string text_of(const Piece& piece) {
  std::ostringstream text;
  text.precision(17);
  std::vector<std::size_t> counts;
  for (std::size_t j = 0; j < piece.degrees.size(); ++j) counts.push_back(piece.knots[j].size() - piece.degrees[j] - 1);
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
  check_text<5>(random_piece<5>(random, {2}, {4}, false), random, 0.5);
}

TEST_F(Splines, OfTheTextHoldAllPointsOfSurfacesInFourDimensions) { check_text<4>(waved_piece<4>(random, {2, 2}, {4, 3}, true), random, 0.5); }

TEST_F(Splines, OfTheTextHoldAllPointsOfSolidsInFourDimensions) { check_text<4>(waved_piece<4>(random, {2, 1, 2}, {3, 2, 3}, false), random, 0.5); }

}  // namespace
}  // namespace bsp2::dataflow
