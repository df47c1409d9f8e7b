#include "bsp2/model/builder/bounds.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "bsp2/model/builder/builder.hpp"

namespace bsp2::model {
namespace {

void expect_box(const Expression& e, const std::vector<double>& lower, const std::vector<double>& upper,
                bool exact = true) {
  const Bounds box = bounds(e);
  ASSERT_EQ(box.lower.size(), lower.size());
  EXPECT_EQ(box.exact, exact);
  for (std::size_t i = 0; i < lower.size(); ++i) {
    EXPECT_LE(box.lower[i], lower[i]);
    EXPECT_GE(box.upper[i], upper[i]);
    EXPECT_NEAR(box.lower[i], lower[i], 1e-12);
    EXPECT_NEAR(box.upper[i], upper[i], 1e-12);
  }
}

TEST(Bounds, OfPrimitives) {
  expect_box(cuboid({1, 2, 3, 4}), {0, 0, 0, 0}, {1, 2, 3, 4});
  expect_box(ball(5, 2), {-2, -2, -2, -2, -2}, {2, 2, 2, 2, 2});
  expect_box(round_cylinder(2, 1, {3, 4}), {-1, -1, 0, 0}, {1, 1, 3, 4});
  expect_box(cone(3, 2, 1), {-2, -2, 0}, {2, 2, 3});
  expect_box(torus(3, 1), {-4, -4, -1}, {4, 4, 1});
  expect_box(simplex(4, 2), {0, 0, 0, 0}, {2, 2, 2, 2});
  expect_box(circle(2, 3), {-1, -std::sqrt(3.0)}, {2, std::sqrt(3.0)});
  expect_box(cylinder(2, 1, 3, 4, true), {-3, -3, -1}, {3, 3, 1});
  expect_box(polygon({{0, 0}, {4, 1}, {1, 5}}), {0, 0}, {4, 5});
}

/// A map of a primitive is looked at as a whole: exact, however it is turned.
TEST(Bounds, OfPrimitivesUnderMaps) {
  const double s = std::sqrt(0.5);
  const std::vector<double> turn{s, -s, 0, 0, s, s, 0, 0, 0, 0, 1, 5, 0, 0, 0, 1};
  expect_box(transform(turn, ball(3, 1)), {-1, -1, 4}, {1, 1, 6});
  expect_box(transform(turn, transform(turn, cuboid({1, 1, 1}))), {-1, 0, 10}, {0, 1, 11});
  expect_box(transform(turn, torus(2, 1)), {-3, -3, 4}, {3, 3, 6});
  // A map of a union is that of its box.
  expect_box(transform(turn, unite({cuboid({1, 1, 1}), cuboid({2, 1, 1})})), {-s, 0, 5}, {2 * s, 3 * s, 6},
             false);
}

TEST(Bounds, OfBooleans) {
  const Expression a = cuboid({2, 2}), b = transform(std::vector<double>{1, 0, 1, 0, 1, -1, 0, 0, 1}, a);
  expect_box(unite({a, b}), {0, -1}, {3, 2});
  expect_box(intersect({a, b}), {1, 0}, {2, 1}, false);
  expect_box(subtract({a, b}), {0, 0}, {2, 2}, false);
  expect_box(symmetric_difference({a, b}), {0, -1}, {3, 2}, false);
  EXPECT_FALSE(bounds(complement(a)).is_finite());
  expect_box(intersect({a, complement(b)}), {0, 0}, {2, 2}, false);
  EXPECT_TRUE(bounds(Expression(4)).is_empty());
  EXPECT_TRUE(bounds(intersect({a, Expression(2)})).is_empty());
}

TEST(Bounds, OfConstructs) {
  expect_box(product({cuboid({1, 2}), ball(2, 1)}), {0, 0, -1, -1}, {1, 2, 1, 1});
  expect_box(extrude(ball(2, 1), {3}, true), {-1, -1, -1.5}, {1, 1, 1.5});
  expect_box(project(cuboid({1, 2, 3, 4}), {3, 0}), {0, 0}, {4, 1});
  expect_box(section(ball(4, 1), 3, 0.5), {-1, -1, -1}, {1, 1, 1}, false);
  EXPECT_TRUE(bounds(section(ball(4, 1), 3, 2)).is_empty());
  expect_box(minkowski(cuboid({1, 2, 3}), cuboid({1, 1, 1}, true)), {-0.5, -0.5, -0.5}, {1.5, 2.5, 3.5});
  expect_box(sweep(ball(2, 1), {{0, 0}, {3, 1}, {0, 5}}), {-1, -1}, {4, 6});
  expect_box(grow(cuboid({1, 2}), 0.5), {-0.5, -0.5}, {1.5, 2.5});
  expect_box(grow(cuboid({1, 2}), -0.25), {0.25, 0.25}, {0.75, 1.75}, false);
  expect_box(construct(Hull{}, {unite({cuboid({1, 1, 1}), ball(3, 2)})}), {-2, -2, -2}, {2, 2, 2});
  expect_box(construct(Resize{.size = {10, 0, 0}, .automatic = {false, true, false}}, {cuboid({2, 3})}),
             {0, 0}, {10, 15});
  EXPECT_FALSE(bounds(construct(Resize{.size = {10, 10, 0}}, {subtract({cuboid({2, 3}), cuboid({1, 1})})}))
                   .is_finite());
}

TEST(Bounds, OfProjectiveMaps) {
  const std::vector<double> perspective{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1};
  expect_box(projective(perspective, cuboid({1, 1, 1})), {0, 0, 0}, {1, 1, 0.5}, false);
  EXPECT_FALSE(bounds(projective(perspective, ball(3, 2))).is_finite());
}

TEST(Bounds, DeepExpressionsNeedNoStack) {
  Expression e = cuboid({1, 1});
  for (int i = 0; i < 100000; ++i) e = unite({e, cuboid({1, 2})});
  expect_box(e, {0, 0}, {1, 2});
}

}  // namespace
}  // namespace bsp2::model
