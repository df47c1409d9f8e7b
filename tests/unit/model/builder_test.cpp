#include "bsp2/model/builder/builder.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/tessellation.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Tessellation, CountsSidesAsOpenScadDoes) {
  // Columns: radius, $fn, $fa, $fs, and N by the formula of OpenSCAD's documentation.
  const double table[][5] = {
      {1, 0, 12, 2, 5},        {10, 0, 12, 2, 30},     {2, 0, 12, 2, 7},        {5, 0, 12, 1, 30},
      {5, 0, 1, 0.5, 63},      {1, 3, 12, 2, 3},       {1, 2, 12, 2, 3},        {1, 8.9, 12, 2, 8},
      {1, -4, 12, 2, 5},       {1e-7, 50, 12, 2, 3},   {1, infinity, 12, 2, 3}, {1, nan, 12, 2, 3},
      {100, 0, 0.001, 1e9, 5}, {1, 0, 12, 0.0001, 30}, {1, 0, 0, 0, 629},       {1, 0.5, 12, 2, 3}};
  for (const auto& [radius, fn, fa, fs, sides] : table)
    EXPECT_EQ(side_count(radius, {fn, fa, fs}), sides) << radius << ' ' << fn << ' ' << fa << ' ' << fs;
}

TEST(Tessellation, AnglesAreExactAtMultiplesOf30Degrees) {
  EXPECT_EQ(sine(30), 0.5);
  EXPECT_EQ(cosine(60), 0.5);
  EXPECT_EQ(cosine(90), 0);
  EXPECT_EQ(cosine(120), -0.5);
  EXPECT_EQ(sine(180), 0);
  EXPECT_EQ(cosine(180), -1);
  EXPECT_EQ(sine(45), cosine(45));
  for (double angle = -720; angle <= 720; angle += 3.25) {
    EXPECT_NEAR(sine(angle), std::sin(angle * std::numbers::pi / 180), 1e-14) << angle;
    EXPECT_NEAR(cosine(angle), std::cos(angle * std::numbers::pi / 180), 1e-14) << angle;
  }
}

TEST(Builder, SpheresHaveOpenScadsVolumes) {
  EXPECT_NEAR(volume(sphere(1, 8)), 3.22904, 1e-5);
  // By hand: two frustums of height cos 30 between pentagons of radius 1/2 and 1.
  EXPECT_NEAR(volume(sphere(1, 5)),
              7.0 / 6 * std::cos(std::numbers::pi / 6) * 2.5 * std::sin(std::numbers::pi / 2.5), 1e-14);
  EXPECT_NEAR(volume(sphere(1, 5)), 2.40228, 5e-6);
  for (std::uint32_t sides = 3; sides < 60; ++sides) {
    const double whole = volume(sphere(2, sides));
    EXPECT_GT(whole, 0);
    EXPECT_LT(whole, 32 * std::numbers::pi / 3);
  }
  EXPECT_NEAR(volume(sphere(2, 600)), 32 * std::numbers::pi / 3, 2e-3);
}

TEST(Builder, CylindersAreConeFrustums) {
  for (const bool center : {false, true})
    for (const auto& [bottom, top] :
         {std::pair(1.0, 1.0), std::pair(2.0, 0.5), std::pair(0.0, 3.0), std::pair(3.0, 0.0)}) {
      const Expression cone = cylinder(4, bottom, top, 7, center);
      const double base = 3.5 * std::sin(2 * std::numbers::pi / 7);
      EXPECT_NEAR(volume(cone), base * 4 / 3 * (bottom * bottom + bottom * top + top * top), 1e-12);
      const auto& lathe = std::get<Lathe>(std::get<Primitive>(cone.node().value));
      EXPECT_EQ(lathe.rings.front().z, center ? -2 : 0);
      EXPECT_EQ(lathe.rings.back().z, center ? 2 : 4);
    }
}

TEST(Builder, WhatHasNoSizeIsEmpty) {
  EXPECT_TRUE(is_empty(cuboid({1, 0, 1})));
  EXPECT_TRUE(is_empty(cuboid({1, -2, 1})));
  EXPECT_TRUE(is_empty(cylinder(0, 1, 1, 8)));
  EXPECT_TRUE(is_empty(cylinder(1, 0, 0, 8)));
  EXPECT_TRUE(is_empty(cylinder(1, -1, 2, 8)));
  EXPECT_TRUE(is_empty(sphere(0, 8)));
  EXPECT_TRUE(is_empty(sphere(std::numeric_limits<double>::denorm_min(), 8)));
  EXPECT_EQ(cuboid({1, 0}).dimension(), 2);
  const double flat[] = {1, 2, 0, 0, 2, 4, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_TRUE(is_empty(transform(flat, cuboid({1, 1, 1}))));
}

TEST(Builder, RejectsWhatIsNoNumberOrNotOneDimension) {
  EXPECT_THROW(cuboid({1, nan, 1}), Error);
  EXPECT_THROW(cylinder(infinity, 1, 1, 8), Error);
  EXPECT_THROW(cylinder(1, 1, 1, 2), Error);
  EXPECT_THROW(cylinder(1, 1, 1, 1'000'000'000), Error);
  EXPECT_THROW(sphere(1, 100'000), Error);
  EXPECT_THROW(sphere(nan, 10), Error);
  EXPECT_THROW(unite({cuboid({1, 1}), cuboid({1, 1, 1})}), Error);
  EXPECT_THROW(subtract({}), Error);
  const double bad[] = {1, 0, 0, nan, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  EXPECT_THROW(transform(bad, cuboid({1, 1, 1})), Error);
  EXPECT_THROW(transform(bad, cuboid({1, 1})), Error);
}

TEST(Builder, TransformDividesByTheLastEntryAndForgetsTheLastRow) {
  const double matrix[] = {2, 0, 0, 4, 0, 2, 0, 6, 0, 0, 2, 8, 7, 7, 7, 2};
  const Expression image = transform(matrix, cuboid({1, 1, 1}));
  const auto& node = std::get<Transform>(image.node().value);
  EXPECT_EQ(node.matrix, (std::vector<double>{1, 0, 0, 2, 0, 1, 0, 3, 0, 0, 1, 4, 0, 0, 0, 1}));
}

TEST(Builder, TellsThinMapsFromFlatOnes) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> whole(-50, 50);  // so that the products are exact
  for (int round = 0; round < samples::rounds(200); ++round) {
    // Two random maps with a thin one between them: thin but regular; with a flat one: singular up to
    // rounding.
    std::array<double, 9> a, b;
    const auto determinant = [](const std::array<double, 9>& m) {
      return m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
             m[2] * (m[3] * m[7] - m[4] * m[6]);
    };
    for (double& x : a) x = whole(random);
    for (double& x : b) x = whole(random);
    if (determinant(a) == 0 || determinant(b) == 0) continue;
    for (const double thickness : {0x1p-24, 0.0}) {
      std::vector<double> matrix(16);
      matrix[15] = 1;
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          matrix[4 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + thickness * a[3 * i + 2] * b[6 + j];
      EXPECT_EQ(is_empty(transform(matrix, cuboid({1, 1, 1}))), thickness == 0);
    }
  }
  const double tiny[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1e-300, 0, 0, 0, 0, 1};
  EXPECT_FALSE(is_empty(transform(tiny, cuboid({1, 1, 1}))));
}

TEST(Expression, DeepChainsAreReleasedWithoutRecursion) {
  Expression deep = cuboid({1, 1, 1});
  const double shift[] = {1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  for (int i = 0; i < 300'000; ++i) deep = i % 2 ? transform(shift, deep) : unite({deep, deep});
  const Expression copy = deep;
  deep = Expression();
  EXPECT_EQ(copy.dimension(), 3);
}

}  // namespace
}  // namespace bsp2::model
