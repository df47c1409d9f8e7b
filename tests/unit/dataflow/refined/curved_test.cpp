// Round solids: intervals that hold the truth, and streams that refine.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "dataflow/intervals.hpp"
#include "dataflow/oracle.hpp"
#include "dataflow/producer_stream.hpp"
#include "producers/round_producer.hpp"
#include "producers/torus_producer.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Label;

double ball_volume(int d) { return std::pow(std::numbers::pi, d / 2.0) / std::tgamma(d / 2.0 + 1); }

/// At each level of the BSP tree the interval holds the truth, and lies in that of the level before.
template <int D>
void check_levels(const model::Expression& e, double truth, std::initializer_list<unsigned> levels,
                  double last_share = 1) {
  SCOPED_TRACE(testing::Message() << "D=" << D);
  VolumeInterval last{0, 1e300, 0};
  for (const unsigned level : levels) {
    const VolumeInterval now = volume_interval<D>(e, down_to(level));
    expect_contains(now, truth);
    EXPECT_GE(now.in, last.in - 1e-12 * truth);
    EXPECT_LE(now.high(), last.high() + 1e-12 * truth);
    last = now;
  }
  EXPECT_LT(last.fuzzy, truth * last_share);
}

TEST(Curved, BallsOfAnyDimensionLieInTheirIntervals) {
  check_levels<1>(model::ball(1, 1), 2, {0, 1, 2, 3});
  check_levels<2>(model::ball(2, 1), ball_volume(2), {0, 1, 4, 8, 12, 16, 20});
  check_levels<3>(model::ball(3, 1), ball_volume(3), {0, 1, 6, 10, 14, 18}, 0.6);
  check_levels<4>(model::ball(4, 1), ball_volume(4), {0, 1, 8, 14, 20}, 1.2);
#if BSP2_DIMENSIONS > 4
  // What is around a ball is most of its box: 32 and 64 against 5.3 and 5.2.
  check_levels<5>(model::ball(5, 1), ball_volume(5), {0, 10, 18}, 7);
  check_levels<6>(model::ball(6, 1), ball_volume(6), {0, 12, 18}, 16);
#endif
}

double paraboloid_volume(int d, double height, double radius) {
  return ball_volume(d - 1) * std::pow(radius, d - 1) * height * 2 / (d + 1);
}

TEST(Paraboloid, OfAnyDimensionLiesInItsIntervals) {
  check_levels<2>(model::paraboloid(2, 3, 2), paraboloid_volume(2, 3, 2), {0, 1, 4, 8, 12, 16}, 0.02);
  check_levels<3>(model::paraboloid(3, 3, 2), paraboloid_volume(3, 3, 2), {0, 1, 6, 10, 14, 18}, 0.5);
  check_levels<4>(model::paraboloid(4, 1, 1), paraboloid_volume(4, 1, 1), {0, 1, 8, 14, 18}, 1.5);
#if BSP2_DIMENSIONS > 4
  check_levels<5>(model::paraboloid(5, 1, 1), paraboloid_volume(5, 1, 1), {0, 10, 18}, 7);
  check_levels<6>(model::paraboloid(6, 1, 1), paraboloid_volume(6, 1, 1), {0, 12, 22}, 16);
#endif
}

/// FUZZY cells lie between chord and tangent, which are parallel: no more of them than so thick a layer on
/// the surface, and some at its rim, where boxes reach out of it.
TEST(Paraboloid, FuzzyCellsAreALayerOfTheToleranceOnItsSurface) {
  const double surface = std::numbers::pi / 6 * (std::pow(5, 1.5) - 1);
  for (const double thickness : {0.25, 0.0625, 0.015625, 0.00390625}) {
    const VolumeInterval now = volume_interval<3>(model::paraboloid(3, 1, 1), thinner_than(thickness));
    expect_contains(now, paraboloid_volume(3, 1, 1));
    EXPECT_LE(now.fuzzy, thickness * surface * (1 + 2 * std::sqrt(thickness))) << thickness;
  }
}

TEST(Paraboloid, WhatConstructsMakeOfItLiesInItsInterval) {
  const auto dish = model::paraboloid(3, 2, 1);
  const double volume = paraboloid_volume(3, 2, 1);
  const auto check = [](const VolumeInterval& found, double truth) {
    expect_contains(found, truth);
    EXPECT_LT(found.fuzzy, 0.05 * truth);
  };
  expect_contains(volume_interval<3>(model::construct(model::Hull{}, {dish}), down_to(14)), volume);
  check(
      volume_interval<3>(
          model::construct(model::ProjectiveMap{{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0.5, 1}}, {dish}),
          thinner_than(0.01)),
      // In slices of the height z, whose image is 1 + z/2 times smaller, and as much nearer along z again.
      [] {
        double sum = 0;
        constexpr int steps = 200000;
        for (int i = 0; i < steps; ++i) {
          const double z = 2 * (i + 0.5) / steps, w = 1 + z / 2;
          sum += std::numbers::pi * z / 2 / (w * w * w * w) * 2 / steps;
        }
        return sum;
      }());
  check(volume_interval<3>(model::construct(model::MinkowskiSum{}, {dish, model::cuboid({1e-6, 1e-6, 1})}),
                           thinner_than(0.01)),
        volume + std::numbers::pi);
  check(volume_interval<2>(model::construct(model::Section{0, 0}, {dish}), thinner_than(0.001)),
        paraboloid_volume(2, 2, 1));
  check(volume_interval<2>(model::construct(model::Shadow{{0, 1}}, {dish}), thinner_than(0.001)),
        std::numbers::pi);
  check(
      volume_interval<3>(model::construct(model::Product{}, {model::paraboloid(2, 1, 1), model::cuboid({3})}),
                         thinner_than(0.01)),
      4);
}

/// The promise of docs/curved.md: at level l of the fan, layers are 1 - 1 / sqrt(1 + (d - 1) / 4^l) thick.
double layer(int d, int level) { return 1 - 1 / std::sqrt(1 + (d - 1) * std::pow(0.25, level)); }

/// @param part of the unit ball: one of so many that are alike. @param factor by which its layer gets thinner
/// with each level, at least.
template <int D>
void check_rate_of(const model::Expression& part, double parts, int first, int last, double factor) {
  SCOPED_TRACE(testing::Message() << "D=" << D);
  const double surface = D * ball_volume(D);
  double before = 0;
  for (int level = first; level <= last; ++level) {
    const double thickness = layer(D, level);
    const VolumeInterval now = volume_interval<D>(part, thinner_than(thickness * 1.0001));
    expect_contains(now, ball_volume(D) / parts);
    EXPECT_LE(now.fuzzy * parts, surface * thickness * std::pow(1 + thickness, D)) << "level " << level;
    if (level > first) {
      EXPECT_LT(now.fuzzy, before * factor) << "level " << level;
    }
    before = now.fuzzy;
  }
}

template <int D>
void check_rate(int first, int last) {
  check_rate_of<D>(model::ball(D, 1), 1, first, last, 0.36);
}

TEST(Curved, TheFuzzyLayerShrinksFourfoldALevel) {
  check_rate<2>(1, 8);
  check_rate<3>(1, 5);
  check_rate<4>(1, 2);
}

/// x1 >= x2 >= ... >= xD >= 0, as a simplex far larger than the ball. Images of it under signs and
/// permutations of the axes fill the space 2^D D! times over, and map the ball to itself: each holds the same
/// share of it.
template <int D>
model::Expression chamber() {
  std::vector<double> matrix((D + 1) * (D + 1), 0.0);
  for (int row = 0; row < D; ++row)
    for (int column = row; column < D; ++column)
      matrix[static_cast<std::size_t>(row * (D + 1) + column)] = 16;
  matrix.back() = 1;
  return model::transform(matrix, model::simplex(D, 1));
}

/// In one of the chambers, where few cells of many levels are.
template <int D>
void check_rate_in_chamber(int first, int last) {
  check_rate_of<D>(model::intersect({model::ball(D, 1), chamber<D>()}), std::pow(2, D) * std::tgamma(D + 1),
                   first, last, 0.32);
}

TEST(Curved, TheFuzzyLayerShrinksFourfoldALevelInChambers) {
  check_rate_in_chamber<3>(1, 5);
  check_rate_in_chamber<4>(1, 4);
#if BSP2_DIMENSIONS > 4
  check_rate_in_chamber<5>(1, 3);
  check_rate_in_chamber<6>(1, 3);
#endif
}

TEST(Curved, CylindersAndConesLieInTheirIntervals) {
  const double pi = std::numbers::pi;
  check_levels<3>(model::round_cylinder(2, 2, {3}), 12 * pi, {0, 4, 8, 12, 16});
  check_levels<3>(model::cone(3, 2, 0), 4 * pi, {0, 4, 8, 12, 16});
  check_levels<3>(model::cone(3, 0, 2), 4 * pi, {0, 4, 8, 12, 16});
  check_levels<3>(model::cone(3, 2, 1), 7 * pi, {0, 4, 8, 12, 16});
  check_levels<4>(model::round_cylinder(3, 1, {2}), ball_volume(3) * 2, {0, 6, 12, 18});
  check_levels<4>(model::round_cylinder(2, 1, {2, 3}), pi * 6, {0, 6, 12, 18});
  check_levels<3>(model::round_cylinder(1, 1, {2, 3}), 12, {0, 6});
  for (const double tolerance : {0.1, 0.01, 0.001}) {
    const VolumeInterval cone = volume_interval<3>(model::cone(3, 2, 0), thinner_than(tolerance));
    expect_contains(cone, 4 * pi);
    EXPECT_LE(cone.fuzzy, 1.3 * tolerance * pi * 2 * std::sqrt(13.0));
  }
}

double determinant(std::vector<double> m, int d) {
  const auto at = [&](int i, int j) -> double& { return m[static_cast<std::size_t>(i * (d + 1) + j)]; };
  double result = 1;
  for (int k = 0; k < d; ++k) {
    int pivot = k;
    for (int i = k; i < d; ++i)
      if (std::fabs(at(i, k)) > std::fabs(at(pivot, k))) pivot = i;
    if (pivot != k) result = -result;
    for (int j = 0; j < d; ++j) std::swap(at(k, j), at(pivot, j));
    result *= at(k, k);
    for (int i = k + 1; i < d; ++i)
      for (int j = d - 1; j >= k; --j) at(i, j) -= at(i, k) / at(k, k) * at(k, j);
  }
  return std::fabs(result);
}

template <int D>
void check_ellipsoid(Random& random, unsigned level) {
  const auto matrix = free_matrix(random, D, 5);
  const VolumeInterval image =
      volume_interval<D>(model::transform(matrix, model::ball(D, 1.5)), down_to(level));
  const double truth = ball_volume(D) * std::pow(1.5, D) * determinant(matrix, D);
  expect_contains(image, truth);
  EXPECT_LT(image.fuzzy, truth * (D == 4 ? 4 : 0.5));
}

TEST(Curved, EllipsoidsAreEnclosedToo) {
  for (int round = 0; round < samples::rounds(5); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    check_ellipsoid<2>(random, 14);
    check_ellipsoid<3>(random, 20);
    check_ellipsoid<4>(random, 16);
  }
}

/// A small, flat, far one: coordinates lose up to 10 of 16 digits there, so tests in doubles cannot tell,
/// exact ones do.
TEST(Curved, SmallBallsFarAwayAreEnclosedToo) {
  for (const double size : {1e-3, 1e-6, 1e-8}) {
    SCOPED_TRACE(size);
    const std::vector<double> matrix{size, 0,          0,         1000, 0, size, 0, -700,
                                     0,    0.3 * size, size / 16, 300,  0, 0,    0, 1};
    const double truth = ball_volume(3) * size * size * size / 16;
    const VolumeInterval far = volume_interval<3>(model::transform(matrix, model::ball(3, 1)), down_to(16));
    EXPECT_LE(far.in,
              truth * (1 + 1e-9 / size * 1e-3));  // the volumes of the cells are rounded at this distance
    EXPECT_GE(far.high(), truth * (1 - 1e-9 / size * 1e-3));
    EXPECT_GT(far.in, 0.3 * truth);
    EXPECT_LT(far.fuzzy, truth);
  }
}

TEST(Curved, ToriLieInTheirIntervalsByPappus) {
  const double pi = std::numbers::pi;
  for (const auto& [major, minor] : {std::pair(2.0, 1.0), std::pair(1.0, 1.0), std::pair(5.0, 0.25)}) {
    SCOPED_TRACE(testing::Message() << major << " " << minor);
    const double truth = 2 * pi * pi * major * minor * minor;
    check_levels<3>(model::torus(major, minor), truth, {0, 1, 5, 10, 15}, 8);
    double before = truth;
    for (const double tolerance : {0.2, 0.05}) {
      const VolumeInterval now =
          volume_interval<3>(model::torus(major, minor), thinner_than(tolerance * minor));
      expect_contains(now, truth);
      EXPECT_LT(now.fuzzy, 1.2 * tolerance * minor * 4 * pi * pi * major * minor);
      EXPECT_LT(now.fuzzy, before * 0.6);
      before = now.fuzzy;
    }
  }
  Random random(new_seed());
  const auto matrix = free_matrix(random, 3, 5);
  expect_contains(volume_interval<3>(model::transform(matrix, model::torus(2, 1)), thinner_than(0.1)),
                  4 * pi * pi * determinant(matrix, 3));
  expect_contains(
      volume_interval<3>(model::subtract({model::torus(2, 1), model::cuboid({3, 3, 1})}), thinner_than(0.05)),
      4 * pi * pi * 7 / 8);
}

/// Second moments about the origin: of the ball r^(d+2) V_d / (d + 2), moved by a vector m: plus m_i m_j V_d.
TEST(Curved, MomentsLieInTheirIntervals) {
  const std::array<double, 3> m{0.3, -2, 0.1};
  const std::vector<double> matrix{1, 0, 0, m[0], 0, 1, 0, m[1], 0, 0, 1, m[2], 0, 0, 0, 1};
  const Network<3> network = compile<3>(model::transform(matrix, model::ball(3, 1)), {});
  const double volume = ball_volume(3);
  double width = 1e300;
  for (const double tolerance : {0.3, 0.1, 0.01}) {
    const auto totals = evaluate(network, partition(network, 0).regions, thinner_than(tolerance), {}).totals;
    const auto in = totals.in.value(), fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
    double widest = 0;
    for (int i = 0; i <= 3; ++i)
      for (int j = i; j <= 3; ++j) {
        const double truth = (i == 0 ? 1 : m[static_cast<std::size_t>(i - 1)]) *
                                 (j == 0 ? 1 : m[static_cast<std::size_t>(j - 1)]) * volume +
                             (i == j && i > 0 ? volume / 5 : 0);
        const auto at = static_cast<std::size_t>(geometry::Moments<3>::index(i, j));
        const double least = in.integral[at] + below.integral[at],
                     most = in.integral[at] + fuzzy.integral[at] - below.integral[at];
        EXPECT_LE(least, truth + 1e-12) << i << j;
        EXPECT_GE(most, truth - 1e-12) << i << j;
        widest = std::max(widest, most - least);
      }
    EXPECT_LT(widest, width / 2);
    width = widest;
  }
}

TEST(Curved, BooleansWithPolyhedraKeepTheInterval) {
  const double pi = std::numbers::pi;
  const auto ball = model::ball(3, 2);
  const auto octant = model::cuboid({5, 5, 5});
  const double eighth = ball_volume(3);
  for (const unsigned level : {6U, 12U, 16U}) {
    expect_contains(volume_interval<3>(model::intersect({ball, octant}), down_to(level)), eighth);
    expect_contains(volume_interval<3>(model::subtract({ball, octant}), down_to(level)), 7 * eighth);
    expect_contains(volume_interval<3>(model::subtract({octant, ball}), down_to(level)), 125 - eighth);
    expect_contains(volume_interval<3>(model::unite({octant, ball}), down_to(level)), 125 + 7 * eighth);
    expect_contains(volume_interval<3>(model::symmetric_difference({octant, ball}), down_to(level)),
                    125 + 6 * eighth);
  }
  for (const double tolerance : {0.3, 0.1, 0.03}) {  // thin cells that a polyhedron and a round solid share
    expect_contains(volume_interval<3>(model::intersect({ball, octant}), thinner_than(tolerance)), eighth);
    expect_contains(volume_interval<3>(model::subtract({ball, octant}), thinner_than(tolerance)), 7 * eighth);
    expect_contains(volume_interval<3>(model::unite({octant, ball}), thinner_than(tolerance)),
                    125 + 7 * eighth);
  }
  Random random(new_seed());
  for (int round = 0; round < samples::rounds(5);
       ++round) {  // in truth half the ball each, whatever the plane
    auto turn = free_matrix(random, 3, 0);
    const auto half = model::transform(
        turn, model::transform(std::vector<double>{20, 0, 0, 0, 0, 20, 0, -10, 0, 0, 20, -10, 0, 0, 0, 1},
                               model::cuboid({1, 1, 1})));
    expect_contains(volume_interval<3>(model::intersect({ball, half}), thinner_than(0.1)), 4 * eighth);
    expect_contains(volume_interval<3>(model::subtract({ball, half}), thinner_than(0.1)), 4 * eighth);
  }
  // Steinmetz: two cylinders across each other.
  const std::vector<double> upright{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -2, 0, 0, 0, 1},
      lying{0, 0, 1, -2, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 0, 1};
  const auto rod = model::round_cylinder(2, 1, {4});
  const auto a = model::transform(upright, rod), b = model::transform(lying, rod);
  for (const double tolerance : {0.1, 0.01}) {
    const VolumeInterval both = volume_interval<3>(model::intersect({a, b}), thinner_than(tolerance));
    expect_contains(both, 16.0 / 3);
    EXPECT_LT(both.fuzzy, 18 * tolerance);
    expect_contains(volume_interval<3>(model::unite({a, b}), thinner_than(tolerance)), 8 * pi - 16.0 / 3);
  }
}

/// What ends by itself is decided to its end, however thin the cells are.
TEST(Curved, ToleranceLeavesNoPolyhedronUndecided) {
  const auto apart =
      model::unite({model::ball(3, 1),
                    model::transform(std::vector<double>{1, 0, 0, 3, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                     model::sphere(1, 24))});
  const Network<3> network = compile<3>(apart, {});
  const auto result = evaluate_all(network, 0, thinner_than(0.5));
  for (const auto& refinement : result.refinements)
    for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
      if (refinement->cells.label[cell] != Label::fuzzy) continue;
      const auto points = refinement->cells.cell_points(cell);
      for (std::size_t i = 0; i < points.size(); i += 3) EXPECT_LT(points[i], 2);
    }
}

/// The planes that cut one hole out run beside those of others and of the plate: cells between them are thin
/// from the beginning, but are cut on until they are near what is round.
TEST(Curved, ThinCellsDoNotReachFarBeyondTheSurface) {
  constexpr double tolerance = 0.1;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(8); ++round) {
    std::vector<std::array<double, 3>> circles{{0, 0, 10}};
    std::vector<model::Expression> operands{model::cone(4, 10, 10)};
    for (int hole = 0; hole < 6; ++hole) {
      const double radius = 0.5 + uniform(random, 0, 1);
      circles.push_back({uniform(random, -6, 6), uniform(random, -6, 6), radius});
      operands.push_back(model::transform(std::vector<double>{1, 0, 0, circles.back()[0], 0, 1, 0,
                                                              circles.back()[1], 0, 0, 1, -1, 0, 0, 0, 1},
                                          model::cone(6, radius, radius)));
    }
    const Network<3> network = compile<3>(model::subtract(std::move(operands)), {});
    for (const auto& refinement : evaluate_all(network, 0, thinner_than(tolerance)).refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
        if (refinement->cells.label[cell] != Label::fuzzy) continue;
        const auto points = refinement->cells.cell_points(cell);
        for (std::size_t i = 0; i < points.size(); i += 3) {
          double nearest = 1e9;
          for (const auto& [x, y, r] : circles)
            nearest = std::min(nearest, std::fabs(std::hypot(points[i] - x, points[i + 1] - y) - r));
          EXPECT_LT(nearest, 3 * tolerance);
        }
      }
  }
}

using Places = std::vector<meshing::SizeField::Entry>;

/// The most that counts somewhere between these points, which may be too many places.
double largest_near(std::span<const double> points, const Places& places) {
  double reach = 0;
  for (std::size_t i = 3; i < points.size(); i += 3)
    reach = std::max(reach,
                     std::hypot(points[i] - points[0], points[i + 1] - points[1], points[i + 2] - points[2]));
  const auto away = [&](const meshing::Point& at) {
    return std::hypot(at[0] - points[0], at[1] - points[1], at[2] - points[2]);
  };
  double nearest = 1e9, largest = 0;
  for (const auto& [at, share] : places) nearest = std::min(nearest, away(at));
  for (const auto& [at, share] : places)
    if (away(at) <= nearest + 2 * reach) largest = std::max(largest, share);
  return largest;
}

/// The layer of a ball is as thin by place as the shares of the nearest places say.
TEST(Curved, ToleranceMayDependOnThePlace) {
  constexpr double tolerance = 0.05;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto coordinate = [&] { return uniform(random, -1, 1); };
  const auto ball = model::ball(3, 1);
  const Network<3> network = compile<3>(ball, {});
  const double coarse = volume_interval<3>(ball, thinner_than(tolerance)).fuzzy,
               fine = volume_interval<3>(ball, thinner_than(tolerance / 16)).fuzzy;
  for (int round = 0; round < samples::rounds(4); ++round) {
    Places places;
    for (int i = 0; i < 6; ++i)
      places.push_back(
          {{coordinate(), coordinate(), coordinate()}, std::exp2(-std::floor(uniform(random, 0, 5)))});
    EvaluateOptions options = thinner_than(tolerance);
    options.tolerance_shares = std::make_shared<const meshing::SizeField>(places);
    for (const auto& refinement : evaluate_all(network, 1, options).refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
        if (refinement->cells.label[cell] != Label::fuzzy) continue;
        const auto points = refinement->cells.cell_points(cell);
        double least = 2, most = 0;  // distances from the middle of the ball
        for (std::size_t i = 0; i < points.size(); i += 3) {
          const double r = std::hypot(points[i], points[i + 1], points[i + 2]);
          least = std::min(least, r);
          most = std::max(most, r);
        }
        EXPECT_LE(most - least, 3 * tolerance * largest_near(points, places));
      }
    const VolumeInterval between = volume_interval<3>(ball, options);
    expect_contains(between, ball_volume(3));
    EXPECT_LE(between.fuzzy, coarse * (1 + 1e-9));
    EXPECT_GE(between.fuzzy, fine * (1 - 1e-9));
    expect_same_digest<3>(ball, options, 2);
  }
}

TEST(Curved, CellsDoNotDependOnThreadsAndOrder) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto solid = model::subtract({model::transform(free_matrix(random, 3, 1), model::ball(3, 2)),
                                      model::cuboid({1, 2, 3}), model::cone(3, 1, 0)});
  expect_same_digest<3>(solid, down_to(12), 0);
  expect_same_digest<3>(solid, down_to(14), 3);
  expect_same_digest<3>(solid, thinner_than(0.05), 2);
  expect_same_digest<3>(model::subtract({model::torus(2, 0.7), solid}), down_to(14), 1);
  expect_same_digest<4>(model::subtract({model::ball(4, 1), model::cuboid({1, 1, 1, 1})}), down_to(12), 1);
  expect_same_digest<3>(model::subtract({model::paraboloid(3, 2, 2), solid}), down_to(14), 2);
}

template <int D>
void check_stream(const model::Expression& e, unsigned deepest, Random& random) {
  const Network<D> network = compile<D>(e, {});
  ASSERT_EQ(network.rounds.size(), 1U);
  std::visit(
      [&]<typename Solid>(const Solid& solid) {
        check_stream_of<D>(network, typename Solid::Process(network, network.producers[0], solid), deepest,
                           truth_of(e), random);
      },
      network.rounds[0]);
}

TEST(TorusProducer, EmitsAStreamOfRefinements) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  check_stream<3>(model::torus(2, 1), 16, random);
  check_stream<3>(model::transform(free_matrix(random, 3, 3), model::torus(1, 0.3)), 16, random);
}

TEST(RoundProducer, EmitsAStreamOfRefinements) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  check_stream<2>(model::ball(2, 1), 18, random);
  check_stream<2>(model::transform(free_matrix(random, 2, 3), model::ball(2, 1)), 18, random);
  check_stream<3>(model::ball(3, 2), 16, random);
  check_stream<3>(model::transform(free_matrix(random, 3, 3), model::round_cylinder(2, 1, {2})), 16, random);
  check_stream<3>(model::transform(free_matrix(random, 3, 3), model::cone(2, 1, 0)), 16, random);
  check_stream<4>(model::ball(4, 1), 14, random);
  check_stream<2>(model::transform(free_matrix(random, 2, 3), model::paraboloid(2, 1, 2)), 18, random);
  check_stream<3>(model::paraboloid(3, 1, 1), 16, random);
  check_stream<3>(model::transform(free_matrix(random, 3, 3), model::paraboloid(3, 2, 1)), 16, random);
  check_stream<4>(model::transform(free_matrix(random, 4, 3), model::paraboloid(4, 1, 1)), 14, random);
#if BSP2_DIMENSIONS > 4
  check_stream<5>(model::round_cylinder(3, 1, {1, 2}), 14, random);
#endif
}

TEST(Curved, CsgIsReadRoundOnDemand) {
  const double pi = std::numbers::pi;
  const auto read = [](const char* text) {
    return model::parse_csg(text, "test.csg", {.curved = true}).expression;
  };
  const auto check = [&](const char* text, double truth, double tolerance) {
    SCOPED_TRACE(text);
    const VolumeInterval now = volume_interval<3>(read(text), thinner_than(tolerance));
    expect_contains(now, truth);
    EXPECT_LT(now.fuzzy, 0.1 * truth);
  };
  check("difference() { sphere(r = 5); cylinder(h = 20, r = 4, center = true); }", 36 * pi, 0.02);
  check("cylinder(h = 3, r1 = 1, r2 = 2);", 7 * pi, 0.02);
  check("linear_extrude(height = 2) { difference() { circle(r = 2); circle(r = 1); } }", 6 * pi, 0.01);
  const VolumeInterval disk = volume_interval<2>(read("circle(d = 4, $fn = 100);"), thinner_than(1e-4));
  expect_contains(disk, 4 * pi);
  // Nuts stay nuts, and so does what constructs need corners of.
  const VolumeInterval nut = volume_interval<3>(read("cylinder(h = 2, r = 1, $fn = 6);"), {});
  EXPECT_NEAR(nut.in, 3 * std::sqrt(3.0), 1e-12);
  EXPECT_EQ(nut.fuzzy, 0);
  const VolumeInterval hull = volume_interval<3>(read("hull() { cylinder(h = 1, r = 1, $fn = 64); }"), {});
  EXPECT_NEAR(hull.in, 32 * std::sin(pi / 32), 1e-12);
  EXPECT_EQ(hull.fuzzy, 0);
  // Steiner: a disk and a ball.
  const double of_torus = volume_interval<3>(model::construct(model::Hull{}, {model::torus(20, 8)}), {}).in,
               whole = 2 * pi * 400 * 8 + pi * pi * 20 * 64 + 4 * pi / 3 * 512;
  EXPECT_LT(of_torus, whole);
  EXPECT_GT(of_torus, 0.97 * whole);
}

}  // namespace
}  // namespace bsp2::dataflow
