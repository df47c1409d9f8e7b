// Minkowski sums, growing and shrinking, sweeps and hulls: volumes by formula.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "dataflow/any_dimension.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

// --- sums ---

/// Elementary symmetric polynomials: content of the faces of a box, by dimension.
std::vector<double> elementary(const std::vector<double>& a) {
  std::vector<double> e(a.size() + 1);
  e[0] = 1;
  for (const double x : a)
    for (std::size_t k = a.size(); k > 0; --k) e[k] += x * e[k - 1];
  return e;
}

/// Steiner: the volume of A + r B is a polynomial in r, for a box A and a cross-polytope B sum e_(D-k)(a) (2
/// r)^k / k!.
TEST(AnyDimension, SumsHaveTheVolumesOfSteinersFormula) {
  Seeded s;
  for (int d = 1; d <= std::min(5, geometry::built_dimensions); ++d) {
    const auto lengths = random_lengths(s.random, d);
    const double r = uniform(s.random, 0.2, 1);
    std::vector<double> points;
    for (int i = 0; i < d; ++i)
      for (const double sign : {-1.0, 1.0})
        for (int j = 0; j < d; ++j) points.push_back(i == j ? sign * r : 0);
    const auto e = elementary(lengths);
    double expected = 0;
    for (int k = 0; k <= d; ++k)
      expected += e[static_cast<std::size_t>(d - k)] * std::pow(2 * r, k) / std::tgamma(k + 1);
    EXPECT_NEAR(volume_of(model::minkowski(model::cuboid(lengths), model::convex_hull(d, points))), expected,
                1e-9 * expected)
        << d;
    double cube = 1;
    for (const double a : lengths) cube *= a + 2 * r;
    EXPECT_NEAR(volume_of(model::grow(model::cuboid(lengths), r)), cube, 1e-9 * cube) << d;
  }
}

Expression hull(std::vector<Expression> operands) {
  return model::construct(model::Hull{}, {model::unite(std::move(operands))});
}

/// What four unit disks around (+-1/4, +-1/4) have in common: a unit disk, shrunk by 1/4 along the axes.
const double four_disks = 2 * (std::asin(std::sqrt(15.0) / 4) - std::asin(0.25)) - std::sqrt(15.0) / 4 + 0.25;

/// Where a construct needs corners, round solids are enclosed between polyhedra, and so is what comes out.
TEST(AnyDimension, ConstructsEncloseWhatTheyMakeOfRoundSolids) {
  const auto cube = model::cuboid({1, 1, 1});
  const auto shifted = [](const Expression& e, double z) {
    return model::transform(std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, z, 0, 0, 0, 1}, e);
  };
  expect_contains(volume_interval(model::minkowski(cube, model::ball(3, 1, 24))), 1 + 6 + 3 * pi + 4 * pi / 3,
                  0.06);
  expect_contains(volume_interval(model::minkowski(model::cuboid({1, 1}), model::ball(2, 1))), 1 + 4 + pi,
                  0.002);
  expect_contains(volume_interval(hull({model::ball(3, 1, 24), shifted(model::ball(3, 1, 24), 2)})),
                  4 * pi / 3 + 2 * pi, 0.06);  // a capsule
  expect_contains(volume_interval(model::grow(model::ball(2, 1), -0.25)), four_disks, 0.002);
  expect_contains(volume_interval(model::project(model::torus(2, 1, 24), {0, 1})), 8 * pi, 0.05);
  expect_contains(volume_interval(model::project(model::round_cylinder(2, 1, {2}), {0, 2})), 4, 0.001);
  expect_contains(volume_interval(model::sweep(model::torus(2, 1, 16), {{0, 0, 0}, {0, 0, 1}})),
                  4 * pi * pi + 8 * pi, 0.2);
}

/// By nothing at all: the solid itself, refined without end.
TEST(AnyDimension, GrowingByNothingLeavesRoundSolidsRound) {
  for (const auto ball : {model::Growth::Ball::cube, model::Growth::Ball::round}) {
    const auto grown = [&](const Expression& e) { return model::construct(model::Growth{0, ball, 16}, {e}); };
    expect_contains(volume_interval(grown(model::ball(3, 1)), 0.05), 4 * pi / 3, 0.2);
    expect_contains(volume_interval(grown(model::torus(2, 1)), 0.05), 4 * pi * pi, 0.2);
    expect_contains(volume_interval(grown(model::section(model::torus(2, 1), 2, 0)), 0.02), 8 * pi, 0.2);
    expect_contains(
        volume_interval(model::subtract({model::cuboid({4, 4, 4}, true), grown(model::ball(3, 1))}), 0.05),
        64 - 4 * pi / 3, 0.1);
  }
}

/// A convex solid is its own hull, and stays as round as it is.
TEST(AnyDimension, HullsOfRoundSolidsStayRound) {
  expect_contains(volume_interval(hull({model::ball(3, 1)}), 0.05), 4 * pi / 3, 0.2);
  expect_contains(volume_interval(hull({model::ball(4, 1)}), 0.2), ball_volume(4), 1);
  expect_contains(volume_interval(hull({model::round_cylinder(2, 1, {2})}), 0.05), 2 * pi, 0.2);
}

/// What encloses goes on through other constructs, and complements exchange the sides.
TEST(AnyDimension, WhatIsEnclosedStaysEnclosed) {
  const auto square = model::cuboid({1, 1});
  const auto round = model::minkowski(square, model::ball(2, 1));
  const double area = 5 + pi;
  expect_contains(volume_interval(model::minkowski(round, square)), 4 + 8 + pi, 0.002);
  expect_contains(volume_interval(model::extrude(round, {2})), 2 * area, 0.002);
  expect_contains(volume_interval(model::section(model::extrude(round, {2}), 2, 1)), area, 0.002);
  expect_contains(volume_interval(model::subtract({model::cuboid({10, 10}, true), round})), 100 - area,
                  0.001);
  expect_contains(volume_interval(hull({model::subtract({model::ball(2, 2), model::ball(2, 1)})})), 4 * pi,
                  0.01);
  expect_contains(
      volume_interval(model::minkowski(model::subtract({model::cuboid({6, 6}, true), model::ball(2, 2)}),
                                       model::cuboid({1, 1}, true))),
      49 - 4 * four_disks, 0.002);
}

/// Surely in one and surely not in the other, or perhaps so.
TEST(AnyDimension, SymmetricDifferencesOfRoundSolidsAreEnclosedToo) {
  const auto shifted = [](const Expression& e, double x) {
    return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, e);
  };
  const auto ball = model::ball(3, 1, 24);
  expect_contains(volume_interval(hull({model::symmetric_difference({ball, shifted(ball, 1)})})),
                  4 * pi / 3 + pi, 0.06);
  expect_contains(
      volume_interval(hull({model::symmetric_difference({ball, shifted(ball, 1), shifted(ball, 2)})})),
      4 * pi / 3 + 2 * pi, 0.06);
  expect_contains(
      volume_interval(model::project(
          model::symmetric_difference({model::round_cylinder(2, 2, {1}), model::round_cylinder(2, 1, {1})}),
          {0, 1})),
      3 * pi, 0.01);
  expect_contains(
      volume_interval(model::minkowski(model::symmetric_difference({model::ball(2, 2), model::ball(2, 1)}),
                                       model::cuboid({0.5, 0.5}, true))),
      4 * pi + 0.25 + 4 * 2 * 0.5 - four_disks, 0.01);
  // What was enclosed before is, too.
  const auto round = model::minkowski(model::cuboid({1, 1}, true), model::ball(2, 1));
  expect_contains(volume_interval(hull({model::symmetric_difference({round, model::ball(2, 1)})})), 5 + pi,
                  0.01);
  // A union of differences doubles with each operand.
  std::vector<Expression> many;
  for (int i = 0; i < 14; ++i) many.push_back(shifted(ball, i));
  EXPECT_THROW(volume_interval(hull({model::symmetric_difference(many)})), Error);

  Seeded s;
  const Real a = 0.25;
  const auto shell =
      model::minkowski(model::symmetric_difference({model::ball(3, 1, 16), model::ball(3, 0.6, 16)}),
                       model::cuboid({0.25, 0.25, 0.25}));
  check_labels<3>(shell, 0, s.random,
                  [&](const Point& x, Real margin) {  // the box x - [0, a]^3 meets the shell
                    Real nearest = 0, farthest = 0;
                    for (const Real c : x) {
                      nearest += std::pow(std::max({c - a, -c, Real{0}}), 2);
                      farthest += std::pow(std::max(std::fabs(c), std::fabs(c - a)), 2);
                    }
                    const Real depth = std::min(1 - std::sqrt(nearest), std::sqrt(farthest) - 0.6L);
                    return Where{depth > 0, std::fabs(depth) < margin};
                  });
}

/// Only corners that some direction has in common are added: what is left out was no corner of the sum.
TEST(AnyDimension, SumsOfManyCornersAreThoseOfAllPairs) {
  Seeded s;
  for (const bool on_sphere : {true, false}) {
    std::vector<double> a, b, all;
    for (int i = 0; i < (on_sphere ? 160 : 500); ++i)
      for (auto* points : {&a, &b}) {
        Point x{uniform(s.random, -1, 1), uniform(s.random, -1, 1), uniform(s.random, -1, 1)};
        const Real size = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
        for (const Real c : x)
          points->push_back(static_cast<double>(
              on_sphere ? c / size
                        : std::round(12 * c / size)));  // or near it on a grid, where much is coplanar
      }
    for (std::size_t i = 0; i < a.size(); i += 3)
      for (std::size_t j = 0; j < b.size(); ++j) all.push_back(a[i + j % 3] + b[j]);
    for (const auto* points : {&a, &b}) {
      const Expression alone = model::convex_hull(3, *points);
      EXPECT_GT(std::get<model::TriangleMesh>(std::get<model::Primitive>(alone.node().value)).points.size(),
                100U);  // few pairs are added all
    }
    const double expected = volume_of(model::convex_hull(3, all));
    EXPECT_NEAR(volume_of(model::minkowski(model::convex_hull(3, a), model::convex_hull(3, b))), expected,
                1e-12 * expected);
  }
}

/// A torus is 64 segments by itself. 2 pi^2 R r^2: a torus plus a ball is a thicker torus.
TEST(AnyDimension, SumsOfToriEnd) {
  expect_contains(volume_interval(model::minkowski(model::torus(2, 0.5, 16), model::ball(3, 0.25, 16))),
                  2 * pi * pi * 2 * 0.75 * 0.75, 0.4);
  std::vector<Expression> row;
  for (int i = 0; i < 10; ++i)
    row.push_back(model::transform(std::vector<double>{1, 0, 0, 2.0 * i, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                   model::cuboid({1, 1, 1})));
  const auto warnings = compile<3>(model::minkowski(model::torus(2, 0.5), model::unite(row)), {}).warnings;
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("640 pairs of convex parts are too many: circles get 48 corners"),
            std::string::npos)
      << warnings[0];
  EXPECT_TRUE(
      compile<3>(model::minkowski(model::torus(2, 0.5, 12), model::ball(3, 0.3, 12)), {}).warnings.empty());
}

/// Constructs that are not monotone take polyhedra, and say which.
TEST(AnyDimension, WarningsTellHowManyCornersCirclesHave) {
  const auto warning_of = [](const Expression& e) {
    const auto warnings = e.dimension() == 3 ? compile<3>(e, {}).warnings : compile<2>(e, {}).warnings;
    EXPECT_EQ(warnings.size(), 1U);
    return warnings.empty() ? std::string() : warnings[0];
  };
  const auto expect_corners = [&](const Expression& e, const std::string& text) {
    const std::string warning = warning_of(e);
    EXPECT_NE(warning.find("polyhedra in it" + text), std::string::npos) << warning;
  };
  const auto resized = [](const Expression& e) {
    return model::construct(model::Resize{{3, 3, 3}, {false, false, false}}, {e});
  };
  expect_corners(resized(model::ball(3, 1)), ", with 64 corners to a circle; $fn says how many");
  expect_corners(resized(model::round_cylinder(2, 1, {1})), ", with 128 corners");
  expect_corners(resized(model::unite({model::ball(3, 1), model::round_cylinder(2, 1, {1})})),
                 ", with 64 and 128 corners");
  expect_corners(resized(model::torus(2, 1, 20)), ", with 20 corners");
  expect_corners(model::construct(model::Offset{0.5}, {model::ball(2, 1)}), ", with 128 corners");
}

/// At points: what is IN is in the solid, what is OUT is not.
TEST(AnyDimension, EnclosedSumsAndHullsHaveTrueLabels) {
  Seeded s;
  const auto sum = model::minkowski(model::cuboid({1, 2, 1}), model::ball(3, 1, 16));
  check_labels<3>(sum, 0, s.random, [](const Point& x, Real margin) {
    Real square = 0;
    const Real size[] = {1, 2, 1};
    for (std::size_t i = 0; i < 3; ++i) square += std::pow(std::max({-x[i], x[i] - size[i], Real{0}}), 2);
    const Real distance = std::sqrt(square) - 1;
    return Where{distance < 0, std::fabs(distance) < margin};
  });
  const auto ring = model::minkowski(model::torus(2, 0.5, 12), model::cuboid({0.5, 0.5, 0.5}));
  EXPECT_GT(volume_interval(ring).in, pi * pi);  // more than the torus
}

/// With finer and finer polytopes in the place of the ball: V + S r + (pi / 4) B r^2 + 4/3 pi r^3 from below,
/// B the length of all edges.
TEST(AnyDimension, GrowingTendsToSteinersFormulaOfTheBall) {
  const double a = 1, b = 2, c = 3, r = 0.5;
  const double steiner =
      a * b * c + 2 * (a * b + b * c + c * a) * r + pi * (a + b + c) * r * r + 4 * pi / 3 * r * r * r;
  double missing = steiner;
  for (const std::uint32_t sides : {8U, 16U, 32U}) {
    const double now = steiner - volume_of(model::grow_round(model::cuboid({a, b, c}), r, sides));
    EXPECT_GT(now, 0);
    EXPECT_LT(now, missing / 2.5);
    missing = now;
  }
  EXPECT_LT(missing, 0.02 * steiner);
}

/// Also at the default resolution, which says five sides for a small distance: faces move by r, so it is
/// above the sum with the cross-polytope.
TEST(AnyDimension, GrowingMovesTheFacesOfBoxesByTheDistance) {
  for (const std::uint32_t sides : {5U}) {
    const double r = 0.25;
    const auto grown = model::grow_round(model::cuboid({1, 2, 1, 1}), r, sides);
    const auto e = elementary({1, 2, 1, 1});
    double cross = 0, ball = 0;
    for (int k = 0; k <= 4; ++k) {
      cross += e[static_cast<std::size_t>(4 - k)] * std::pow(2 * r, k) / std::tgamma(k + 1);
      ball += e[static_cast<std::size_t>(4 - k)] * ball_volume(k) * std::pow(r, k);
    }
    const double volume = volume_of(grown);
    EXPECT_GT(volume, cross);
    EXPECT_LT(volume, ball);
    for (int axis = 0; axis < 4; ++axis)
      EXPECT_NEAR(volume_of(model::project(grown, {axis})), (axis == 1 ? 2 : 1) + 2 * r, 1e-10);
  }
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

/// Of convex solids the half-spaces move; of any, what is near to the outside goes. Both leave the same.
TEST(AnyDimension, ConvexSolidsShrinkLikeAllOthers) {
  Seeded s;
  int left = 0;
  for (int round = 0; round < samples::all_rounds(6); ++round) {
    std::vector<double> points;
    for (int i = pick(s.random, 6, 9); i > 0; --i)
      for (int k = 0; k < 4; ++k) points.push_back(uniform(s.random, -1, 1));
    if (round == 0)  // a ball of radius 1/2 fits into the cross-polytope, so something is left
      for (std::size_t corner = 0; corner < 8; ++corner)
        for (std::size_t k = 0; k < 4; ++k) points.push_back(corner / 2 != k ? 0 : corner % 2 == 0 ? 1 : -1);
    const Expression solid = model::convex_hull(4, points);
    const double distance = uniform(s.random, 0.01, 0.2);
    const auto box = [](double size) { return model::cuboid({size, size, size, size}, true); };
    const Expression shrunken = model::grow(solid, -distance);
    const Expression near = model::minkowski(model::subtract({box(3), solid}), box(2 * distance));
    const double whole = volume_of(solid), rest = volume_of(shrunken);
    EXPECT_NEAR(rest, volume_of(model::subtract({solid, near})), 1e-9 * whole);
    EXPECT_NEAR(volume_of(model::symmetric_difference({shrunken, model::subtract({solid, near})})), 0,
                1e-9 * whole);
    left += rest > 0 ? 1 : 0;
  }
  EXPECT_GT(left, 0);
  // A simplex: x_i >= a and a sum of at most 1 - 4 a.
  for (const double a : {0.01, 0.05, 0.1, 0.12, 0.124, 0.126, 0.3}) {
    const double edge = std::max(0.0, 1 - 8 * a);
    EXPECT_NEAR(volume_of(model::grow(model::simplex(4, 1), -a)), std::pow(edge, 4) / 24, 1e-12);
  }
  expect_contains(
      volume_interval(
          model::construct(model::Growth{-0.25, model::Growth::Ball::round, 12}, {model::ball(4, 1)}), 0.1),
      ball_volume(4) * std::pow(0.75, 4), 1.5);
}

/// What is enclosed is a union of polytopes of which one holds the others: that one is moved alone.
TEST(AnyDimension, UnionsOfWhatOneHoldsShrinkLikeIt) {
  const double a = 0.05;
  EXPECT_NEAR(volume_of(model::grow(model::unite({model::simplex(4, 0.5), model::simplex(4, 1)}), -a)),
              std::pow(1 - 8 * a, 4) / 24, 1e-12);
  const auto apart = model::transform(
      std::vector<double>{1, 0, 0, 0, 2, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1},
      model::simplex(4, 1));
  EXPECT_NEAR(volume_of(model::grow(model::unite({model::simplex(4, 1), apart}), -a)),
              std::pow(1 - 8 * a, 4) / 12, 1e-12);
  // A capsule: the cube holds the ball of radius a, and lies in that of 2 a.
  const auto capsule = [](double r) {
    return ball_volume(4) * std::pow(r, 4) + 2 * ball_volume(3) * std::pow(r, 3);
  };
  const auto moved = model::transform(
      std::vector<double>{1, 0, 0, 0, 2, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1},
      model::ball(4, 1));
  const VolumeInterval shrunken = volume_interval(
      model::grow(model::construct(model::Hull{}, {model::unite({model::ball(4, 1), moved})}), -a));
  EXPECT_LT(shrunken.in, capsule(1 - a));
  EXPECT_GT(shrunken.in + shrunken.fuzzy, capsule(1 - 2 * a));
  EXPECT_GT(shrunken.in, 0.5 * capsule(1 - 2 * a));
}

/// What goes by the points of a solid cannot take one that reaches to infinity, and says so; whether it does
/// is a matter of the whole solid.
TEST(AnyDimension, UnboundedOperandsAreRefused) {
  const auto box = model::cuboid({2, 2, 2}), small = model::cuboid({1, 1, 1});
  const auto square = model::cuboid({2, 2}), unit = model::cuboid({1, 1});
  const auto refused = [](const auto& make, const Expression& operand, const std::string& name) {
    try {
      volume_interval(make(operand));
      ADD_FAILURE() << name << " takes a solid without bounds";
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()),
                name + ": the solid has no bounds; intersect it with something that has");
    }
  };
  const auto in_room = [](const Expression& e) {
    return model::intersect(
        {model::cuboid(std::vector<double>(static_cast<std::size_t>(e.dimension()), 10), true), e});
  };
  const auto of = [](const model::Construct& what) {
    return [what](const Expression& e) { return model::construct(what, {e}); };
  };
  const std::vector<Expression> unbounded_solids{
      model::complement(box), model::unite({small, model::complement(box)}),
      model::subtract({model::complement(box), small}),
      model::symmetric_difference({small, model::complement(box)})};
  for (const Expression& unbounded : unbounded_solids) {
    refused([&](const Expression& e) { return in_room(model::minkowski(e, small)); }, unbounded, "minkowski");
    refused([&](const Expression& e) { return in_room(model::minkowski(small, e)); }, unbounded, "minkowski");
    refused([&](const Expression& e) { return in_room(model::grow(e, 0.5)); }, unbounded, "grow");
    refused([&](const Expression& e) { return in_room(model::grow(e, -0.5)); }, unbounded, "shrink");
    refused(
        [&](const Expression& e) {
          return in_room(model::sweep(e, {{0, 0, 0}, {1, 0, 0}}));
        },
        unbounded, "sweep");
    refused([&](const Expression& e) { return in_room(of(model::Hull{})(e)); }, unbounded, "hull");
    refused([&](const Expression& e) { return in_room(model::project(e, {0, 1})); }, unbounded, "project");
    refused(of(model::Projection{}), unbounded, "projection");
    refused(of(model::Resize{{1, 1, 1}, {}}), unbounded, "resize");
  }
  const auto plane = model::complement(square);
  refused(of(model::LinearExtrusion{}), plane, "linear_extrude");
  refused(of(model::LinearExtrusion{.scale = {0.5, 0.5}}), plane, "linear_extrude");
  refused(of(model::RotateExtrusion{}), plane, "rotate_extrude");
  refused(of(model::Offset{.distance = 1}), plane, "offset");
  refused(of(model::Fill{}), plane, "fill");
  refused(of(model::Roof{}), plane, "roof");
  // Complements in bounded solids are no matter.
  for (const auto& bounded :
       {model::intersect({box, model::complement(small)}),
        model::symmetric_difference({model::complement(small), model::complement(box)})}) {
    EXPECT_NEAR(volume_of(bounded), 7, 1e-12);
    EXPECT_NEAR(volume_of(model::grow(bounded, 0.5)), 26, 1e-10);
    EXPECT_NEAR(volume_of(model::project(bounded, {0, 1})), 4, 1e-12);
    EXPECT_NEAR(volume_of(model::construct(model::Hull{}, {bounded})), 7 + 1.0 / 6 * 5, 1e-10);
  }
  EXPECT_NEAR(volume_of(of(model::LinearExtrusion{.direction = {0, 0, 2}})(
                  model::intersect({square, model::complement(unit)}))),
              6, 1e-12);
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
    const double r = 0.5, truth = ball_volume(d) * std::pow(r, d) +
                                  ball_volume(d - 1) * std::pow(r, d - 1) * std::sqrt(square);
    expect_contains(volume_interval(model::sweep(model::ball(d, r), {from, to}), d == 4 ? 0.1 : 0.02), truth,
                    d == 4 ? 2 : 0.2);
  }
  // In the frame of the ball, a point is in the sweep if it is near to the segment.
  const auto matrix = free_matrix(s.random, 3, 1);
  const auto swept = model::sweep(model::transform(matrix, model::ball(3, 0.7)), {{0, 0, 0}, {1, 1, 2}});
  check_labels<3>(swept, 0.1, s.random, [&](const Point& x, Real margin) {
    const Point y = inverse_image(matrix, x), z = inverse_image(matrix, {x[0] - 1, x[1] - 1, x[2] - 2});
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
  for (int d = 2; d <= std::min(5, geometry::built_dimensions); ++d) {
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
  for (int d = 1; d <= std::min(5, geometry::built_dimensions);
       ++d) {  // a simplex and its mirror image: the cross-polytope
    std::vector<double> mirror = identity_matrix(d);
    for (int i = 0; i < d; ++i) mirror[static_cast<std::size_t>(i * (d + 2))] = -1;
    const auto both = model::unite({model::simplex(d, 1), model::transform(mirror, model::simplex(d, 1))});
    EXPECT_NEAR(volume_of(model::construct(model::Hull{}, {both})), std::pow(2, d) / std::tgamma(d + 1),
                1e-10)
        << d;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
