// Products, shadows, sections and projective images: volumes by formula, and points asked of an oracle.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/bounds.hpp"
#include "dataflow/any_dimension.hpp"

namespace bsp2::dataflow {
namespace {

// --- products ---

TEST(AnyDimension, VolumesOfProductsMultiply) {
  Seeded s;
  const auto solid = [&](int d) -> Expression {
    const auto box = model::cuboid(random_lengths(s.random, d));
    const auto other = model::transform(free_matrix(s.random, d, 0.3), chance(s.random, 0.5) || d > 3
                                                                           ? model::simplex(d, 1)
                                                                           : random_polytope(s.random, d, 2));
    switch (pick(s.random, 0, 3)) {
      case 0:
        return box;
      case 1:
        return model::unite({box, other});
      case 2:
        return model::subtract({box, other});
      default:
        return other;
    }
  };
  const std::pair<int, int> dimensions[] = {{1, 1}, {1, 2}, {2, 1}, {2, 2}, {3, 1}, {1, 3}, {3, 2}, {2, 3}};
  for (const auto& [d, e] : dimensions)
    for (int round = 0; d + e <= geometry::built_dimensions && round < (d + e < 5 ? 4 : 1); ++round) {
      const Expression a = solid(d), b = solid(e);
      const double expected = volume_of(a) * volume_of(b);
      EXPECT_NEAR(volume_of(model::product({a, b})), expected, 1e-9 * (1 + expected)) << d << " x " << e;
    }
  const Expression three[] = {solid(1), solid(2), solid(1)};
  EXPECT_NEAR(volume_of(model::product({three[0], three[1], three[2]})),
              volume_of(three[0]) * volume_of(three[1]) * volume_of(three[2]), 1e-8);
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
#if BSP2_DIMENSIONS > 4
  EXPECT_NEAR(volume_of(model::extrude(ell, {2, 3, 0.5})), 9, 1e-10);
#endif
  EXPECT_NEAR(volume_of(model::extrude(ell, {2, 3})), 18, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::circle(2, 6), {2})), 12 * std::sqrt(3.0), 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::circle(2, 6), {2, 2})), 24 * std::sqrt(3.0), 1e-9);
  EXPECT_NEAR(volume_of(model::extrude(model::polygon({{0, 0}, {3, 0}, {0, 1}}), {2, 2})), 6, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(model::cylinder(2, 1, 1, 4), {3})), 12, 1e-10);
  EXPECT_NEAR(volume_of(model::extrude(l_shape(1, 2, 1), {2}, true)), 8, 1e-10);  // a mesh that is not convex
  expect_contains(volume_interval(model::extrude(model::ball(3, 1), {2}), 0.2), 8 * pi / 3, 0.8);
  EXPECT_THROW(volume_of(model::extrude(model::complement(model::cuboid({1, 1})), {1})), Error);
}

TEST(AnyDimension, EmbeddedSolidsAreThin) {
  EXPECT_NEAR(volume_of(model::embed(model::simplex(2, 1), 4, 0.5)), 0.125, 1e-12);
  const model::Bounds bounds = model::bounds(model::embed(model::simplex(2, 1), 4, 0.5));
  EXPECT_NEAR(bounds.lower[3], -0.25, 1e-12);
  EXPECT_NEAR(bounds.upper[2], 0.25, 1e-12);
}

// --- shadows and sections ---

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
  for (int d = 2; d <= std::min(5, geometry::built_dimensions); ++d)
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
        for (const int i : axes)
          edge.push_back(matrix[static_cast<std::size_t>(i * (d + 1) + j)] *
                         lengths[static_cast<std::size_t>(j)]);
      }
      const double expected = zonotope_content(edges, axes.size());
      EXPECT_NEAR(volume_of(model::project(model::transform(matrix, model::cuboid(lengths)), axes)), expected,
                  1e-9 * expected)
          << d << " to " << k;
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
  for (int d = 3; d <= std::min(5, geometry::built_dimensions); ++d) {
    const auto matrix = free_matrix(s.random, d, 0);
    const auto ellipsoid = model::transform(matrix, model::ball(d, 1.5));
    std::vector<double> square;  // of the shadow on the first two axes
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        double sum = 0;
        for (int k = 0; k < d; ++k)
          sum += matrix[static_cast<std::size_t>(i * (d + 1) + k)] *
                 matrix[static_cast<std::size_t>(j * (d + 1) + k)];
        square.push_back(sum);
      }
    expect_contains(volume_interval(model::project(ellipsoid, {0, 1}), 0.01),
                    pi * 2.25 * std::sqrt(determinant(square)), 0.05);
  }
  const auto matrix = free_matrix(s.random, 4, 0.1);
  const auto ellipsoid = model::transform(matrix, model::ball(4, 1.5));
  check_labels<3>(model::section(ellipsoid, 2, 0.3), 0.1, s.random, [&](const Point& x, Real margin) {
    return where(ellipsoid, {x[0], x[1], 0.3, x[2]}, margin);
  });
}

TEST(AnyDimension, SectionsOfCylinders) {
  Seeded s;
  // Across the axis, after a shear along it; and along the axis.
  const std::vector<double> shear{1, 0, 0.5, 1, 0, 1, 0, 0, 0, 0, 2, -1, 0, 0, 0, 1};
  const auto rod = model::transform(shear, model::round_cylinder(2, 1, {3}));
  expect_contains(volume_interval(model::section(rod, 2, 1), 0.01), pi, 0.05);
  check_labels<2>(model::section(rod, 2, 1), 0.05, s.random, [&](const Point& x, Real margin) {
    return where(rod, {x[0], x[1], 1}, margin);
  });
  EXPECT_NEAR(volume_of(model::section(model::round_cylinder(2, 1, {3}), 0, 0.6)), 1.6 * 3, 1e-10);
  expect_contains(volume_interval(model::section(model::cone(2, 1, 0), 2, 1), 0.01), pi / 4, 0.1);
}

TEST(AnyDimension, SectionsOfPolytopesAndBooleans) {
  Seeded s;
  for (int d = 2; d <= std::min(5, geometry::built_dimensions); ++d)
    EXPECT_NEAR(volume_of(model::section(model::simplex(d, 2), d - 1, 0.5)),
                std::pow(1.5, d - 1) / std::tgamma(d), 1e-10)
        << d;
  const auto solid = model::subtract(
      {model::transform(free_matrix(s.random, 4, 0.1), model::cuboid({2, 2, 2, 2}, true)),
       random_polytope(s.random, 4, 3), model::complement(model::cuboid({3, 3, 3, 3}, true))});
  check_labels<3>(model::section(solid, 0, 0.1), 0, s.random, [&](const Point& x, Real margin) {
    return where(solid, {0.1, x[0], x[1], x[2]}, margin);
  });
  EXPECT_NEAR(volume_of(model::section(l_shape(1, 2, 1), 2, 0.5)), 4, 1e-10);
}

/// Of hulls of many points only the edges are cut: as large as the hull of all segments from one side to the
/// other.
TEST(AnyDimension, SectionsOfHullsOfManyPoints) {
  Seeded s;
  for (const auto& [d, count] : {std::pair<std::size_t, std::size_t>(3, 700), {4, 500}}) {
    std::vector<double> points;
    for (std::size_t p = 0; p < count; ++p) {
      std::vector<double> x;
      double square = 0;
      for (std::size_t k = 0; k < d; ++k) {
        x.push_back(uniform(s.random, -1, 1));
        square += x[k] * x[k];
      }
      for (const double at : x) points.push_back(at / std::sqrt(square));
    }
    const double at = 0.1;
    const std::size_t axis = 1;
    std::vector<double> cut;
    for (std::size_t p = 0; p < count; ++p)
      for (std::size_t q = 0; q < count; ++q) {
        const double low = points[p * d + axis] - at, high = points[q * d + axis] - at;
        if (!(low <= 0 && high > 0)) continue;
        for (std::size_t k = 0; k < d; ++k)
          if (k != axis)
            cut.push_back(points[p * d + k] + low / (low - high) * (points[q * d + k] - points[p * d + k]));
      }
    const int dimension = static_cast<int>(d);
    const double truth = volume_of(model::convex_hull(dimension - 1, cut));
    EXPECT_NEAR(volume_of(model::section(model::convex_hull(dimension, points), static_cast<int>(axis), at)),
                truth, 1e-9 * truth)
        << d;
  }
}

// --- projective maps ---

/// What a projective map of space takes to x: the inverse of the map is that of its 4 x 4 matrix M, so solve
/// M (y, w) = (x, 1), as a linear map of four dimensions.
Point projective_preimage(const std::vector<double>& matrix, const Point& x) {
  std::vector<double> wide(25);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) wide[i * 5 + j] = matrix[i * 4 + j];
  const Point y = inverse_image(wide, {x[0], x[1], x[2], 1});
  return {y[0] / y[3], y[1] / y[3], y[2] / y[3]};
}

TEST(AnyDimension, ProjectiveMapsTakePointsToTheirImages) {
  Seeded s;
  for (int round = 0; round < 4; ++round) {
    auto matrix = free_matrix(s.random, 3, 0.5);
    for (int j = 0; j < 3; ++j) matrix[static_cast<std::size_t>(12 + j)] = uniform(s.random, -0.15, 0.15);
    const auto solid =
        model::subtract({model::ball(3, 1.5), model::cuboid({2, 2, 2}), random_polytope(s.random, 3, 4)});
    check_labels<3>(model::projective(matrix, solid), 0.1, s.random, [&](const Point& x, Real margin) {
      return where(solid, projective_preimage(matrix, x), margin);
    });
  }
}

/// The images of balls are found without squares of coordinates, which would lose what is far away or thin.
TEST(AnyDimension, ImagesOfFarAndThinBallsAreEnclosedToo) {
  constexpr double far = 0x1p20, r = 0x1p-10;
  for (int d = 2; d <= 3; ++d) {
    const auto n = static_cast<std::size_t>(d + 1);
    std::vector<double> away(n * n), scale(n * n);
    for (std::size_t i = 0; i < n; ++i) away[i * (n + 1)] = scale[i * (n + 1)] = 1;
    for (std::size_t i = 0; i + 1 < n; ++i) away[i * n + n - 1] = far;
    scale.back() = 4;  // x / 4
    const double truth = ball_volume(d) * std::pow(r / 4, d);
    expect_contains(
        volume_interval(model::projective(scale, model::transform(away, model::ball(d, r))), r * 1e-3), truth,
        0.05);
    // Where the denominator changes along the ball: 1 + a (x - far) around the middle, whose image is an
    // ellipsoid around 0 after the shift.
    auto slope = away;
    for (std::size_t i = 0; i + 1 < n; ++i) slope[i * n + n - 1] = -far;
    constexpr double a = 256;
    slope[n * n - n] = a, slope.back() = 1 - a * far;
    const double across =
        1 -
        a * a * r * r;  // r^d / across^((d+1)/2): the axes are r / across and d - 1 times r / sqrt(across)
    expect_contains(
        volume_interval(model::projective(slope, model::transform(away, model::ball(d, r))), r * 1e-3),
        ball_volume(d) * std::pow(r, d) / std::pow(across, (d + 1) / 2.0), 0.05);
  }
  // An ellipse with axes 1 and 2^-30, turned; the third axis does not show.
  constexpr double thin = 0x1p-30;
  const std::vector<double> needle{0.6, -0.8 * thin, 0, 0, 0.8, 0.6 * thin, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  expect_contains(
      volume_interval(model::project(model::transform(needle, model::ball(3, 1)), {0, 1}), thin / 100),
      pi * thin * (0.36 + 0.64), 0.05);
}

/// What has no image that is known lies between polytopes, each primitive by itself: also where it is taken
/// away, or counts by turns.
TEST(AnyDimension, ProjectiveMapsEncloseCylindersConesAndTori) {
  const double a = 0.3, r = 1, h = 2;
  const std::vector<double> along{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, a, 1};
  const double cylinder =
      pi * r * r * (1 - std::pow(1 + a * h, -3)) / (3 * a);  // the Jacobian is (a z + 1)^-4
  expect_contains(volume_interval(model::projective(along, model::round_cylinder(2, r, {h}))), cylinder,
                  0.01);
  const double box = 16 * (1 - std::pow(1 + a * h, -3)) / (3 * a);
  const auto around = model::transform(std::vector<double>{1, 0, 0, -2, 0, 1, 0, -2, 0, 0, 1, 0, 0, 0, 0, 1},
                                       model::cuboid({4, 4, h}));
  expect_contains(
      volume_interval(model::projective(along, model::subtract({around, model::round_cylinder(2, r, {h})}))),
      box - cylinder, 0.01);
  expect_contains(volume_interval(model::projective(
                      along, model::symmetric_difference(
                                 {model::round_cylinder(2, 2 * r, {h}), model::round_cylinder(2, r, {h})}))),
                  3 * cylinder, 0.01);
  // What reaches beyond the plane at infinity may be cut off first.
  const std::vector<double> down{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -20, 0, 0, 0, 1};
  const auto rod = model::transform(down, model::round_cylinder(2, r, {30}));
  EXPECT_THROW(volume_interval(model::projective(along, rod)), Error);
  expect_contains(volume_interval(model::projective(along, model::intersect({rod, around}))), cylinder, 0.01);

  Seeded s;
  for (int round = 0; round < 3; ++round) {
    auto matrix = free_matrix(s.random, 3, 0.5);
    for (int j = 0; j < 3; ++j) matrix[static_cast<std::size_t>(12 + j)] = uniform(s.random, -0.08, 0.08);
    const auto placed = [&](const Expression& e) {
      return model::transform(free_matrix(s.random, 3, 0.3), e);
    };
    const auto solid =
        model::subtract({model::symmetric_difference({placed(model::torus(1.5, 0.6, 12)),
                                                      placed(model::cone(2, 1, 0.2, 16)), model::ball(3, 1)}),
                         placed(model::round_cylinder(2, 0.4, {1}))});
    check_labels<3>(model::projective(matrix, solid), 0.2, s.random, [&](const Point& x, Real margin) {
      return where(solid, projective_preimage(matrix, x), margin);
    });
  }
}

/// Tori whose hole is a point, or hardly more. Under z / (1 + a z) the integral of sin^2 / (1 + a r cos)^4 is
/// pi/2 (1 - a^2 r^2)^(-5/2).
TEST(AnyDimension, ToriWithoutAHoleAreEnclosedInConstructs) {
  const double a = 0.1;
  const std::vector<double> along{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, a, 1};
  for (const double r : {1.0, 0.9995, 0.9}) {
    const auto torus = model::torus(1, r);
    expect_contains(volume_interval(model::projective(along, torus)),
                    2 * pi * pi * r * r * std::pow(1 - a * a * r * r, -2.5), 0.02);
    expect_contains(volume_interval(model::project(torus, {0, 2})), 4 * r + pi * r * r,
                    0.01);  // a rectangle between two halves of a disk
  }
}

/// A matrix that is that of an affine map, or a multiple of one, makes no polytopes of what is round.
TEST(AnyDimension, ProjectiveMapsThatAreAffineKeepTheRound) {
  const std::vector<double> matrix{1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2};
  const auto finer = [&](double tolerance) {
    return volume_interval(model::projective(matrix, model::torus(2, 1)), tolerance);
  };
  expect_contains(finer(0.1), pi * pi, 0.2);
  EXPECT_LT(finer(0.02).fuzzy, 0.4 * finer(0.1).fuzzy);
}

TEST(AnyDimension, ThePlaneAtInfinityMustNotMeetTheSolid) {
  const std::vector<double> perspective{1, 0, 0, 0, 1, 0, 0, 1, 1};  // y + 1 > 0
  EXPECT_NEAR(volume_of(model::projective(perspective, model::cuboid({1, 1}))), 0.5 * (1 + 0.5) * 0.5, 1e-12);
  const auto moved =
      model::transform(std::vector<double>{1, 0, 0, 0, 1, -1.5, 0, 0, 1}, model::cuboid({1, 1}));
  EXPECT_THROW(volume_of(model::projective(perspective, moved)), Error);
  EXPECT_THROW(volume_interval(model::projective(perspective, model::ball(2, 1.01)), 0.1), Error);
  // What reaches too far may be cut off first.
  EXPECT_NEAR(volume_of(model::projective(
                  perspective, model::intersect({model::cuboid({4, 4}, true), model::cuboid({1, 1})}))),
              0.375, 1e-12);
}

}  // namespace
}  // namespace bsp2::dataflow
