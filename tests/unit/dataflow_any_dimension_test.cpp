// The constructs of any dimension: volumes by formula, and points asked of an oracle.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bsp2/dataflow/convex_producer.hpp"
#include "bsp2/dataflow/measure.hpp"
#include "bsp2/dataflow/round_producer.hpp"
#include "bsp2/geometry/error.hpp"
#include "bsp2/model/bounds.hpp"
#include "bsp2/model/csg.hpp"
#include "dataflow_oracle.hpp"
#include "producer_stream.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Label;
using model::Expression;
constexpr double pi = std::numbers::pi;

struct Interval {
  double in = 0, fuzzy = 0;
};

template <int D>
Interval volume_in(const Expression& e, const EvaluateOptions& how) {
  const auto totals = measure<D>(e, how);
  return {totals.in.value().volume(), totals.fuzzy.value().volume()};
}

Interval volume_interval(const Expression& e, double tolerance = 0) {
  EvaluateOptions how;
  if (tolerance > 0) how.tolerance = tolerance;
  switch (e.dimension()) {
    case 1: return volume_in<1>(e, how);
    case 2: return volume_in<2>(e, how);
    case 3: return volume_in<3>(e, how);
    case 4: return volume_in<4>(e, how);
    case 5: return volume_in<5>(e, how);
    default: return volume_in<6>(e, how);
  }
}

double volume_of(const Expression& e) {
  const Interval interval = volume_interval(e);
  EXPECT_EQ(interval.fuzzy, 0);
  return interval.in;
}

void expect_contains(const Interval& interval, double truth, double share) {
  EXPECT_LE(interval.in, truth * (1 + 1e-9));
  EXPECT_GE(interval.in + interval.fuzzy, truth * (1 - 1e-9));
  EXPECT_LT(interval.fuzzy, share * truth);
}

double ball_volume(int d) { return std::pow(pi, d / 2.0) / std::tgamma(d / 2.0 + 1); }

double determinant(std::vector<double> m) {
  const auto n = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(m.size()))));
  double result = 1;
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k; i < n; ++i)
      if (std::fabs(m[i * n + k]) > std::fabs(m[pivot * n + k])) pivot = i;
    if (m[pivot * n + k] == 0) return 0;
    if (pivot != k) result = -result;
    for (std::size_t j = 0; j < n; ++j) std::swap(m[k * n + j], m[pivot * n + j]);
    result *= m[k * n + k];
    for (std::size_t i = k + 1; i < n; ++i)
      for (std::size_t j = n; j-- > k;) m[i * n + j] -= m[i * n + k] / m[k * n + k] * m[k * n + j];
  }
  return result;
}

/// The linear part of a (d+1) x (d+1) matrix.
std::vector<double> linear_part(const std::vector<double>& m, int d) {
  std::vector<double> linear;
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) linear.push_back(m[static_cast<std::size_t>(i * (d + 1) + j)]);
  return linear;
}

struct Seeded {
  std::uint64_t seed = new_seed();
  Random random{seed};
  testing::ScopedTrace trace{__FILE__, __LINE__, testing::Message() << "BSP2_SEED=" << seed};
};

std::vector<double> random_lengths(Random& random, int d) {
  std::vector<double> lengths;
  for (int i = 0; i < d; ++i) lengths.push_back(uniform(random, 0.5, 2));
  return lengths;
}

Expression random_polytope(Random& random, int d, int extra) {
  std::vector<double> points;
  for (int i = 0; i < (d + 1 + extra) * d; ++i) points.push_back(uniform(random, -1, 1));
  return model::convex_hull(d, points);
}

/// Labels of the cells of a construct, at points in them. @param inside the oracle.
template <int D, typename Inside>
void check_labels(const Expression& e, double tolerance, Random& random, Inside&& inside) {
  const Network<D> network = compile<D>(e, {});
  EvaluateOptions how = keep_everything();
  if (tolerance > 0) how.tolerance = tolerance;
  const auto result = evaluate_all(network, 0, how);
  std::size_t in = 0, out = 0;
  for (const auto& refinement : result.refinements)
    for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
      const Label label = refinement->cells.label[cell];
      if (label == Label::fuzzy) continue;
      const auto corners = refinement->cells.cell_points(cell);
      Point x(D, 0);
      Real sum = 0;
      for (std::size_t i = 0; i < corners.size(); i += D) {
        const Real weight = -std::log(uniform(random, 1e-3, 1));
        sum += weight;
        for (std::size_t k = 0; k < D; ++k) x[k] += weight * corners[i + k];
      }
      for (Real& c : x) c /= sum;
      const Where truth = inside(x, 1e-8L);
      ASSERT_TRUE(truth.doubtful || truth.inside == (label == Label::in))
          << "cell " << cell << " at level " << refinement->cells.level[cell] << ", volume " << refinement->cells.volume[cell] << ", at " << static_cast<double>(x[0]) << ", "
          << static_cast<double>(x[1]) << ", doubtful within 1e-6: " << inside(x, 1e-6L).doubtful << ", 1e-3: " << inside(x, 1e-3L).doubtful;
      ++(label == Label::in ? in : out);
    }
  EXPECT_GT(in, 0U);
  EXPECT_GT(out, 0U);
}

// --- primitives ------------------------------------------------------------------------------------------------------------------

TEST(AnyDimension, SimplicesHaveTheirVolume) {
  const Seeded s;
  Random random = s.random;
  for (int d = 1; d <= 6; ++d) {
    EXPECT_NEAR(volume_of(model::simplex(d, 2)), std::pow(2, d) / std::tgamma(d + 1), 1e-12 * std::pow(2, d)) << d;
    std::vector<double> corners, matrix;
    for (int i = 0; i < d * (d + 1); ++i) corners.push_back(uniform(random, -3, 3));
    for (int i = d; i < d * (d + 1); ++i) matrix.push_back(corners[static_cast<std::size_t>(i)] - corners[static_cast<std::size_t>(i % d)]);
    const double expected = std::fabs(determinant(matrix)) / std::tgamma(d + 1);
    EXPECT_NEAR(volume_of(model::simplex(d, corners)), expected, 1e-9 * expected + 1e-12) << d;
  }
}

TEST(AnyDimension, HullsOfPointsHaveTheContentOfTheirCells) {
  const Seeded s;
  Random random = s.random;
  for (int d = 4; d <= 5; ++d) {
    const Expression hull = random_polytope(random, d, d == 4 ? 12 : 4);
    const double content = std::get<model::Polytope>(std::get<model::Primitive>(hull.node().value)).content;
    EXPECT_NEAR(volume_of(hull), content, 1e-10 * content);
    const auto away = free_matrix(random, d, 1000);
    EXPECT_NEAR(volume_of(model::transform(away, hull)), content * std::fabs(determinant(linear_part(away, d))), 1e-6 * content);
  }
}

/// Inscribed, and nearer the finer they are.
TEST(AnyDimension, BallPolytopesTendToTheBall) {
  for (int d = 4; d <= 5; ++d) {
    double before = 0;
    for (const std::uint32_t sides : {4U, 8U}) {
      const double volume = std::get<model::Polytope>(std::get<model::Primitive>(model::ball_polytope(d, 1, sides).node().value)).content;
      EXPECT_LT(volume, ball_volume(d));
      EXPECT_GT(volume, before * 1.3);
      before = volume;
    }
    EXPECT_GT(before, 0.55 * ball_volume(d));
  }
}

/// ConvexProducer over a polytope, and RoundProducer over a product: each cell that is emitted refines the one it replaces.
TEST(AnyDimension, PolytopesEmitStreamsOfRefinements) {
  Seeded s;
  const auto check = [&]<int D>(std::integral_constant<int, D>, const Expression& e) {
    const Network<D> network = compile<D>(e, {});
    ASSERT_EQ(network.producers.size(), 1U);
    check_stream_of<D>(network, ConvexProducer<D>(network, network.producers[0]), 1000, truth_of(e), s.random);
  };
  check(std::integral_constant<int, 2>(), model::simplex(2, 1));
  check(std::integral_constant<int, 4>(), model::transform(free_matrix(s.random, 4, 3), model::simplex(4, 1)));
  check(std::integral_constant<int, 4>(), random_polytope(s.random, 4, 6));
  check(std::integral_constant<int, 5>(), random_polytope(s.random, 5, 1));
  check(std::integral_constant<int, 6>(), model::simplex(6, 2));
}

// --- products ----------------------------------------------------------------------------------------------------------------------

TEST(AnyDimension, VolumesOfProductsMultiply) {
  Seeded s;
  const auto solid = [&](int d) -> Expression {
    const auto box = model::cuboid(random_lengths(s.random, d));
    const auto other = model::transform(free_matrix(s.random, d, 0.3), chance(s.random, 0.5) || d > 3 ? model::simplex(d, 1) : random_polytope(s.random, d, 2));
    switch (pick(s.random, 0, 3)) {
      case 0: return box;
      case 1: return model::unite({box, other});
      case 2: return model::subtract({box, other});
      default: return other;
    }
  };
  const std::pair<int, int> dimensions[] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}, {3, 1}, {1, 3}, {3, 2}, {2, 3}};
  for (const auto& [d, e] : dimensions)
    for (int round = 0; round < (d + e < 5 ? 4 : 1); ++round) {
      const Expression a = solid(d), b = solid(e);
      const double expected = volume_of(a) * volume_of(b);
      EXPECT_NEAR(volume_of(model::product({a, b})), expected, 1e-9 * (1 + expected)) << d << " x " << e;
    }
  const Expression three[] = {solid(1), solid(2), solid(1)};
  EXPECT_NEAR(volume_of(model::product({three[0], three[1], three[2]})), volume_of(three[0]) * volume_of(three[1]) * volume_of(three[2]), 1e-8);
}

TEST(AnyDimension, ProductsAskBothOperands) {
  Seeded s;
  const auto a = model::transform(free_matrix(s.random, 2, 1), model::ball(2, 1));
  const auto b = model::subtract({model::cuboid({2, 2}), model::simplex(2, 1.5)});
  const auto both = [&](const Point& x, Real margin) {
    const Where first = where(a, {x[0], x[1]}, margin), second = where(b, {x[2], x[3]}, margin);
    return Where{first.inside && second.inside, first.doubtful || second.doubtful};
  };
  check_labels<4>(model::product({a, b}), 0.3, s.random, both);
}

TEST(AnyDimension, PrismsOfEveryPlaneAndSpaceSolid) {
  const auto ell = model::subtract({model::cuboid({2, 2}), model::cuboid({1, 1})});
  EXPECT_NEAR(volume_of(model::extrude(ell, {2, 3, 0.5})), 9, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::circle(2, 6), {2})), 12 * std::sqrt(3.0), 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::circle(2, 6), {2, 2})), 24 * std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(volume_of(model::extrude(model::polygon({{0, 0}, {3, 0}, {0, 1}}), {2, 2})), 6, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::cylinder(2, 1, 1, 4), {3})), 12, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(l_shape(1, 2, 1), {2}, true)), 8, 1e-10);  // a mesh that is not convex
  expect_contains(volume_interval(model::extrude(model::ball(3, 1), {2}), 0.2), 8 * pi / 3, 0.8);
  EXPECT_THROW(volume_of(model::extrude(model::torus(2, 1), {1})), Error);
  EXPECT_THROW(volume_of(model::extrude(model::cone(2, 1, 0), {1})), Error);
  EXPECT_THROW(volume_of(model::extrude(model::complement(model::cuboid({1, 1})), {1})), Error);
}

TEST(AnyDimension, EmbeddedSolidsAreThin) {
  EXPECT_NEAR(volume_of(model::embed(model::simplex(2, 1), 4, 0.5)), 0.125, 1e-12);
  const model::Bounds bounds = model::bounds(model::embed(model::simplex(2, 1), 4, 0.5));
  EXPECT_NEAR(bounds.lower[3], -0.25, 1e-12);
  EXPECT_NEAR(bounds.upper[2], 0.25, 1e-12);
}

// --- shadows and sections --------------------------------------------------------------------------------------------------------------

/// The shadow of a box is a zonotope: its content is the sum of |det| over all choices of its edges.
double zonotope_content(const std::vector<std::vector<double>>& edges, std::size_t k) {
  double sum = 0;
  for (unsigned set = 0; set < 1U << edges.size(); ++set) {
    if (static_cast<std::size_t>(__builtin_popcount(set)) != k) continue;
    std::vector<double> matrix;
    for (std::size_t i = 0; i < edges.size(); ++i)
      if ((set >> i & 1U) != 0) matrix.insert(matrix.end(), edges[i].begin(), edges[i].end());
    sum += std::fabs(determinant(matrix));
  }
  return sum;
}

TEST(AnyDimension, ShadowsOfBoxesAreExact) {
  Seeded s;
  for (int d = 2; d <= 5; ++d)
    for (int k = 1; k <= std::min(d, 3); ++k) {
      const auto lengths = random_lengths(s.random, d);
      const auto matrix = free_matrix(s.random, d, 2);
      std::vector<int> axes;
      for (int i = 0; i < k; ++i) axes.push_back((i * 2 + 1) % d);
      if (k == 3 && d == 3) axes = {2, 0, 1};
      std::sort(axes.begin(), axes.end());
      axes.erase(std::unique(axes.begin(), axes.end()), axes.end());
      if (static_cast<int>(axes.size()) != k) continue;
      std::vector<std::vector<double>> edges;
      for (int j = 0; j < d; ++j) {
        auto& edge = edges.emplace_back();
        for (const int i : axes) edge.push_back(matrix[static_cast<std::size_t>(i * (d + 1) + j)] * lengths[static_cast<std::size_t>(j)]);
      }
      const double expected = zonotope_content(edges, axes.size());
      EXPECT_NEAR(volume_of(model::project(model::transform(matrix, model::cuboid(lengths)), axes)), expected, 1e-9 * expected) << d << " to " << k;
    }
}

TEST(AnyDimension, ShadowsOfWhatIsHollow) {
  // A frame hides its hole from one side only; the shadow of an ell in space-time is its whole path.
  const auto frame = model::subtract({model::cuboid({3, 3, 1}, true), model::cuboid({1, 1, 2}, true)});
  EXPECT_NEAR(volume_of(model::project(frame, {0, 1})), 8, 1e-10);
  EXPECT_NEAR(volume_of(model::project(frame, {0, 2})), 3, 1e-10);
}

TEST(AnyDimension, ShadowsAndSectionsOfEllipsoids) {
  Seeded s;
  for (int d = 3; d <= 5; ++d) {
    const auto matrix = free_matrix(s.random, d, 0);
    const auto ellipsoid = model::transform(matrix, model::ball(d, 1.5));
    std::vector<double> square;  // of the shadow on the first two axes
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        double sum = 0;
        for (int k = 0; k < d; ++k) sum += matrix[static_cast<std::size_t>(i * (d + 1) + k)] * matrix[static_cast<std::size_t>(j * (d + 1) + k)];
        square.push_back(sum);
      }
    expect_contains(volume_interval(model::project(ellipsoid, {0, 1}), 0.01), pi * 2.25 * std::sqrt(determinant(square)), 0.05);
  }
  const auto matrix = free_matrix(s.random, 4, 0.1);
  const auto ellipsoid = model::transform(matrix, model::ball(4, 1.5));
  check_labels<3>(model::section(ellipsoid, 2, 0.3), 0.1, s.random, [&](const Point& x, Real margin) { return where(ellipsoid, {x[0], x[1], 0.3, x[2]}, margin); });
}

TEST(AnyDimension, SectionsOfCylinders) {
  Seeded s;
  // Across the axis, after a shear along it; and along the axis.
  const std::vector<double> shear{1, 0, 0.5, 1, 0, 1, 0, 0, 0, 0, 2, -1, 0, 0, 0, 1};
  const auto rod = model::transform(shear, model::round_cylinder(2, 1, {3}));
  expect_contains(volume_interval(model::section(rod, 2, 1), 0.01), pi, 0.05);
  check_labels<2>(model::section(rod, 2, 1), 0.05, s.random, [&](const Point& x, Real margin) { return where(rod, {x[0], x[1], 1}, margin); });
  EXPECT_NEAR(volume_of(model::section(model::round_cylinder(2, 1, {3}), 0, 0.6)), 1.6 * 3, 1e-10);
  expect_contains(volume_interval(model::section(model::cone(2, 1, 0), 2, 1), 0.01), pi / 4, 0.1);
  EXPECT_THROW(volume_of(model::section(rod, 0, 1)), Error);  // at an angle
  EXPECT_THROW(volume_of(model::section(model::torus(2, 1), 2, 0)), Error);
}

TEST(AnyDimension, SectionsOfPolytopesAndBooleans) {
  Seeded s;
  for (int d = 2; d <= 5; ++d)
    EXPECT_NEAR(volume_of(model::section(model::simplex(d, 2), d - 1, 0.5)), std::pow(1.5, d - 1) / std::tgamma(d), 1e-10) << d;
  const auto solid = model::subtract({model::transform(free_matrix(s.random, 4, 0.1), model::cuboid({2, 2, 2, 2}, true)), random_polytope(s.random, 4, 3),
                                      model::complement(model::cuboid({3, 3, 3, 3}, true))});
  check_labels<3>(model::section(solid, 0, 0.1), 0, s.random, [&](const Point& x, Real margin) { return where(solid, {0.1, x[0], x[1], x[2]}, margin); });
  EXPECT_NEAR(volume_of(model::section(l_shape(1, 2, 1), 2, 0.5)), 4, 1e-10);
}

// --- projective maps -------------------------------------------------------------------------------------------------------------------------

TEST(AnyDimension, ProjectiveMapsTakePointsToTheirImages) {
  Seeded s;
  for (int round = 0; round < 4; ++round) {
    auto matrix = free_matrix(s.random, 3, 0.5);
    for (int j = 0; j < 3; ++j) matrix[static_cast<std::size_t>(12 + j)] = uniform(s.random, -0.15, 0.15);
    const auto solid = model::subtract({model::ball(3, 1.5), model::cuboid({2, 2, 2}), random_polytope(s.random, 3, 4)});
    // The inverse of a map is that of its (D+1) x (D+1) matrix: solve M (y, w) = (x, 1), as a linear map of four dimensions.
    const auto preimage_of = [&](const Point& x) {
      std::vector<double> wide(25);
      for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t j = 0; j < 4; ++j) wide[i * 5 + j] = matrix[i * 4 + j];
      const Point y = preimage(wide, {x[0], x[1], x[2], 1});
      return Point{y[0] / y[3], y[1] / y[3], y[2] / y[3]};
    };
    check_labels<3>(model::projective(matrix, solid), 0.1, s.random, [&](const Point& x, Real margin) { return where(solid, preimage_of(x), margin); });
  }
}

TEST(AnyDimension, ThePlaneAtInfinityMustNotMeetTheSolid) {
  const std::vector<double> perspective{1, 0, 0, 0, 1, 0, 0, 1, 1};  // y + 1 > 0
  EXPECT_NEAR(volume_of(model::projective(perspective, model::cuboid({1, 1}))), 0.5 * (1 + 0.5) * 0.5, 1e-12);
  const auto moved = model::transform(std::vector<double>{1, 0, 0, 0, 1, -1.5, 0, 0, 1}, model::cuboid({1, 1}));
  EXPECT_THROW(volume_of(model::projective(perspective, moved)), Error);
  EXPECT_THROW(volume_interval(model::projective(perspective, model::ball(2, 1.01)), 0.1), Error);
  // What reaches too far may be cut off first.
  EXPECT_NEAR(volume_of(model::projective(perspective, model::intersect({model::cuboid({4, 4}, true), model::cuboid({1, 1})}))), 0.375, 1e-12);
}

// --- sums ---------------------------------------------------------------------------------------------------------------------------------------

/// Elementary symmetric polynomials: content of the faces of a box, by dimension.
std::vector<double> elementary(const std::vector<double>& a) {
  std::vector<double> e(a.size() + 1);
  e[0] = 1;
  for (const double x : a)
    for (std::size_t k = a.size(); k > 0; --k) e[k] += x * e[k - 1];
  return e;
}

/// Steiner: the volume of A + r B is a polynomial in r, for a box A and a cross-polytope B sum e_(D-k)(a) (2 r)^k / k!.
TEST(AnyDimension, SumsHaveTheVolumesOfSteinersFormula) {
  Seeded s;
  for (int d = 1; d <= 5; ++d) {
    const auto lengths = random_lengths(s.random, d);
    const double r = uniform(s.random, 0.2, 1);
    std::vector<double> points;
    for (int i = 0; i < d; ++i)
      for (const double sign : {-1.0, 1.0})
        for (int j = 0; j < d; ++j) points.push_back(i == j ? sign * r : 0);
    const auto e = elementary(lengths);
    double expected = 0;
    for (int k = 0; k <= d; ++k) expected += e[static_cast<std::size_t>(d - k)] * std::pow(2 * r, k) / std::tgamma(k + 1);
    EXPECT_NEAR(volume_of(model::minkowski(model::cuboid(lengths), model::convex_hull(d, points))), expected, 1e-9 * expected) << d;
    double cube = 1;
    for (const double a : lengths) cube *= a + 2 * r;
    EXPECT_NEAR(volume_of(model::grow(model::cuboid(lengths), r)), cube, 1e-9 * cube) << d;
  }
}

/// With finer and finer polytopes in the place of the ball: V + S r + (pi / 4) B r^2 + 4/3 pi r^3 from below, B the length of all edges.
TEST(AnyDimension, GrowingTendsToSteinersFormulaOfTheBall) {
  const double a = 1, b = 2, c = 3, r = 0.5;
  const double steiner = a * b * c + 2 * (a * b + b * c + c * a) * r + pi * (a + b + c) * r * r + 4 * pi / 3 * r * r * r;
  double missing = steiner;
  for (const std::uint32_t sides : {8U, 16U, 32U}) {
    const double now = steiner - volume_of(model::grow_round(model::cuboid({a, b, c}), r, sides));
    EXPECT_GT(now, 0);
    EXPECT_LT(now, missing / 2.5);
    missing = now;
  }
  EXPECT_LT(missing, 0.02 * steiner);
}

TEST(AnyDimension, ShrinkingUndoesGrowingOfConvexSolids) {
  Seeded s;
  for (int d = 1; d <= 4; ++d) {
    const auto lengths = random_lengths(s.random, d);
    const auto grown = model::grow(model::cuboid(lengths), 0.2);
    const double expected = volume_of(model::cuboid(lengths));
    EXPECT_NEAR(volume_of(model::grow(grown, -0.2)), expected, 1e-9 * expected) << d;
  }
  const auto frame = model::subtract({model::cuboid({4, 4}, true), model::cuboid({2, 2}, true)});
  EXPECT_NEAR(volume_of(model::grow(frame, -0.25)), 3.5 * 3.5 - 2.5 * 2.5, 1e-10);
  EXPECT_NEAR(volume_of(model::grow(frame, 0.25)), 4.5 * 4.5 - 1.5 * 1.5, 1e-10);
  EXPECT_EQ(volume_of(model::grow(frame, -0.75)), 0);
}

TEST(AnyDimension, SweptBallsStayRound) {
  Seeded s;
  for (int d = 2; d <= 4; ++d) {
    std::vector<double> from, to;
    double square = 0;
    for (int i = 0; i < d; ++i) {
      from.push_back(uniform(s.random, -1, 1));
      to.push_back(uniform(s.random, -1, 1));
      square += (to.back() - from.back()) * (to.back() - from.back());
    }
    const double r = 0.5, truth = ball_volume(d) * std::pow(r, d) + ball_volume(d - 1) * std::pow(r, d - 1) * std::sqrt(square);
    expect_contains(volume_interval(model::sweep(model::ball(d, r), {from, to}), d == 4 ? 0.1 : 0.02), truth, d == 4 ? 0.9 : 0.2);
  }
  // In the frame of the ball, a point is in the sweep if it is near to the segment.
  const auto matrix = free_matrix(s.random, 3, 1);
  const auto swept = model::sweep(model::transform(matrix, model::ball(3, 0.7)), {{0, 0, 0}, {1, 1, 2}});
  check_labels<3>(swept, 0.1, s.random, [&](const Point& x, Real margin) {
    const Point y = preimage(matrix, x), z = preimage(matrix, {x[0] - 1, x[1] - 1, x[2] - 2});
    Point v(3);
    Real along = 0, length = 0, distance = 0;
    for (std::size_t i = 0; i < 3; ++i) {
      v[i] = y[i] - z[i];  // the segment, from 0
      along += v[i] * y[i];
      length += v[i] * v[i];
    }
    const Real t = std::clamp(along / length, Real{0}, Real{1});
    for (std::size_t i = 0; i < 3; ++i) distance += (y[i] - t * v[i]) * (y[i] - t * v[i]);
    distance = std::sqrt(distance) - 0.7L;
    return Where{distance < 0, std::fabs(distance) < margin};
  });
}

TEST(AnyDimension, SweptPolytopesAreHulls) {
  // A box along a vector v: its volume and, for each axis, the face across it times |v_i|.
  Seeded s;
  for (int d = 2; d <= 5; ++d) {
    const auto a = random_lengths(s.random, d);
    std::vector<double> from(static_cast<std::size_t>(d)), v;
    double volume = 1, expected = 0;
    for (const double x : a) {
      volume *= x;
      v.push_back(uniform(s.random, -2, 2));
    }
    expected = volume;
    for (std::size_t i = 0; i < a.size(); ++i) expected += volume / a[i] * std::fabs(v[i]);
    EXPECT_NEAR(volume_of(model::sweep(model::cuboid(a), {from, v})), expected, 1e-9 * expected) << d;
  }
}

TEST(AnyDimension, HullsInAnyDimension) {
  for (int d = 1; d <= 5; ++d) {  // a simplex and its mirror image: the cross-polytope
    std::vector<double> mirror = identity_matrix(d);
    for (int i = 0; i < d; ++i) mirror[static_cast<std::size_t>(i * (d + 2))] = -1;
    const auto both = model::unite({model::simplex(d, 1), model::transform(mirror, model::simplex(d, 1))});
    EXPECT_NEAR(volume_of(model::construct(model::Hull{}, {both})), std::pow(2, d) / std::tgamma(d + 1), 1e-10) << d;
  }
}

// --- measures ----------------------------------------------------------------------------------------------------------------------------------------

template <int D>
void check_moments(const Expression& e, double tolerance, const std::vector<std::pair<std::pair<int, int>, double>>& truths, double share) {
  EvaluateOptions how;
  how.tolerance = tolerance;
  const auto totals = measure<D>(e, how);
  const auto in = totals.in.value(), fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
  for (const auto& [entry, truth] : truths) {
    const auto at = static_cast<std::size_t>(geometry::Moments<D>::index(entry.first, entry.second));
    const double least = in.integral[at] + below.integral[at], most = in.integral[at] + fuzzy.integral[at] - below.integral[at];
    EXPECT_LE(least, truth + 1e-12) << D << ": " << entry.first << entry.second;
    EXPECT_GE(most, truth - 1e-12) << D << ": " << entry.first << entry.second;
    EXPECT_LT(most - least, share * ball_volume(D)) << D << ": " << entry.first << entry.second;
  }
}

/// Of the ball V_D r^(D+2) / (D + 2); of a cone and a torus by integration across their axis.
TEST(AnyDimension, MomentsOfRoundSolidsLieInTheirIntervals) {
  check_moments<2>(model::ball(2, 1), 0.01, {{{0, 0}, pi}, {{0, 1}, 0}, {{1, 1}, pi / 4}, {{1, 2}, 0}}, 0.05);
  check_moments<4>(model::ball(4, 1), 0.3, {{{0, 0}, ball_volume(4)}, {{0, 1}, 0}, {{1, 1}, ball_volume(4) / 6}, {{1, 2}, 0}}, 2);
  check_moments<5>(model::ball(5, 1), 0.6, {{{0, 0}, ball_volume(5)}, {{3, 3}, ball_volume(5) / 7}}, 8);
  // Apex down, r = z on [0, 1]: V = pi/3, z: pi/4, z^2: pi/5, x^2: pi/20.
  check_moments<3>(model::cone(1, 0, 1), 0.02, {{{0, 0}, pi / 3}, {{0, 3}, pi / 4}, {{3, 3}, pi / 5}, {{1, 1}, pi / 20}, {{1, 3}, 0}}, 0.05);
  // V = 2 pi^2 R r^2; z^2: V r^2 / 4; x^2: V (4 R^2 + 3 r^2) / 8.
  const double v = 2 * pi * pi * 2 * 0.25;
  check_moments<3>(model::torus(2, 0.5), 0.05, {{{0, 0}, v}, {{3, 3}, v * 0.25 / 4}, {{1, 1}, v * (16 + 0.75) / 8}, {{1, 2}, 0}}, 5);
}

/// The layer between chords and tangents at level l of the fan is 1 - 1 / sqrt(1 + (D - 1) / 4^l) thick: it shrinks fourfold in the limit.
TEST(AnyDimension, BallsOfHighDimensionShrinkAsPromised) {
  const auto layer = [](int d, int level) { return 1 - 1 / std::sqrt(1 + (d - 1) * std::pow(0.25, level)); };
  for (const auto& [d, levels] : {std::pair(2, 6), std::pair(3, 3), std::pair(4, 1), std::pair(5, 1), std::pair(6, 0)})
    for (int level = 0; level <= levels; ++level) {
      const double thickness = layer(d, level), surface = d * ball_volume(d);
      const Interval now = volume_interval(model::ball(d, 1), thickness * 1.0001);
      EXPECT_LE(now.in, ball_volume(d));
      EXPECT_GE(now.in + now.fuzzy, ball_volume(d));
      EXPECT_LE(now.fuzzy, surface * thickness * std::pow(1 + thickness, d)) << d << " " << level;
    }
}

TEST(AnyDimension, TheComplementOfNothingIsEverything) {
  const auto all = model::complement(model::Expression(4));
  EXPECT_NEAR(volume_of(model::intersect({model::cuboid({1, 2, 1, 1}), all})), 2, 1e-12);
  EXPECT_NEAR(volume_of(model::section(model::intersect({model::cuboid({1, 2, 1, 1}), all}), 0, 0.5)), 2, 1e-12);
}

/// Several consumers of one evaluation see the same cells, each in the same batches; one of them is anybody's own.
TEST(AnyDimension, ConsumersOfTheirOwnSeeAllCells) {
  struct Sum : Consumer {
    double volume = 0;
    std::size_t cells = 0;
    void consume(const std::shared_ptr<const Refinement>& refinement) override {
      for (std::size_t i = 0; i < refinement->cells.size(); ++i)
        if (refinement->cells.label[i] == Label::in) volume += refinement->cells.volume[i], ++cells;
    }
  };
  const Network<4> network = compile<4>(model::subtract({model::cuboid({2, 2, 2, 2}), model::simplex(4, 1)}), {});
  Sum first, second;
  Keeper keeper;
  Consumer* const consumers[] = {&first, &keeper, &second};
  EvaluateOptions how;
  how.threads = 2;
  const auto evaluation = evaluate(network, partition(network, 0).regions, how, consumers);
  EXPECT_NEAR(first.volume, 16 - 1.0 / 24, 1e-12);
  EXPECT_EQ(first.volume, second.volume);
  EXPECT_EQ(first.cells, evaluation.totals.in_cells);
  std::size_t kept = 0;
  for (const auto& refinement : keeper.refinements) kept += refinement->cells.size();
  EXPECT_EQ(kept, evaluation.totals.in_cells + evaluation.totals.fuzzy_cells);
}

/// View-driven: with a budget of cells, what is near to the eye is refined more.
TEST(AnyDimension, TheViewIsRefinedWhereTheEyeIs) {
  const auto at = [](double x) { return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, model::ball(3, 1)); };
  const Network<3> network = compile<3>(model::unite({at(-8), at(8)}), {});
  const auto fuzzy_on = [&](double eye, int side) {
    EvaluateOptions how;
    how.order = Order::priority;
    how.eye = {eye, 0, 0};
    how.cells = 1500;
    how.tolerance = 0.001;
    Keeper keeper;
    Consumer* const consumers[] = {&keeper};
    evaluate(network, partition(network, 0).regions, how, consumers);
    double volume = 0;
    for (const auto& refinement : keeper.refinements)
      for (std::size_t i = 0; i < refinement->cells.size(); ++i)
        if (refinement->cells.label[i] == Label::fuzzy && refinement->cells.cell_points(i)[0] * side > 0) volume += refinement->cells.volume[i];
    return volume;
  };
  EXPECT_LT(fuzzy_on(10, 1), 0.8 * fuzzy_on(10, -1));
  EXPECT_LT(fuzzy_on(-10, -1), 0.8 * fuzzy_on(-10, 1));
}

TEST(AnyDimension, NamedPartsAreOnePart) {
  const auto model = model::unite({model::cuboid({1, 1, 1, 1}), model::part("rest", model::unite({model::simplex(4, 3), model::ball(4, 2)}))});
  const Network<4> network = compile<4>(model, {});
  ASSERT_EQ(network.part_names.size(), 1U);
  EXPECT_EQ(network.part_names[0], std::pair(1, std::string("rest")));
  EXPECT_EQ(network.producers[1].part, 1);
  EXPECT_EQ(network.producers[2].part, 1);
}

/// The errors of constructs have the place of the construct.
TEST(AnyDimension, ErrorsOfConstructsHaveTheirPlace) {
  const std::string text = "union() {\n  section(axis = 1, at = 0) torus();\n}";
  const auto model = model::parse_csg(text, "t.csg");
  CompileOptions options;
  options.place_of = [&](const model::Node& node) { return model::place_in(text, "t.csg", model.construct_offsets.at(&node)) + ": "; };
  try {
    compile<2>(model.expression, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("t.csg:2:3: section: that of a torus is not known"), 0U) << error.what();
  }
}

}  // namespace
}  // namespace bsp2::dataflow
