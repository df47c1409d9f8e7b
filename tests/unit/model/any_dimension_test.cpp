// The nodes of the text form that have no fixed dimension, and their builders.

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/csg.hpp"

namespace bsp2::model {
namespace {

Model parse_t(const std::string& text) { return parse_csg(text, "t.csg"); }

std::string error_of(const std::string& text) {
  try {
    parse_t(text);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(AnyDimension, TheDimensionComesFromTheArguments) {
  EXPECT_EQ(parse_t("cuboid([1, 2, 3, 4, 5]);").expression.dimension(), 5);
  EXPECT_EQ(parse_t("cuboid(2);").expression.dimension(), 1);
  EXPECT_EQ(parse_t("ball(6);").expression.dimension(), 6);
  EXPECT_EQ(parse_t("ball();").expression.dimension(), 3);
  EXPECT_EQ(parse_t("simplex(points = [[0, 0], [1, 0], [0, 1]]);").expression.dimension(), 2);
  EXPECT_EQ(parse_t("d_cylinder(dimension = 5, h = [1, 2]);").expression.dimension(), 5);
  EXPECT_EQ(parse_t("product() { cuboid([1, 1]); ball(3); cuboid(1); }").expression.dimension(), 6);
  EXPECT_EQ(parse_t("extrude([1, 2]) ball(2);").expression.dimension(), 4);
  EXPECT_EQ(parse_t("embed(4, thickness = 0.1) ball(2);").expression.dimension(), 4);
  EXPECT_EQ(parse_t("project(2) ball(5);").expression.dimension(), 2);
  EXPECT_EQ(parse_t("project(axes = [5, 1, 2]) ball(5);").expression.dimension(), 3);
  EXPECT_EQ(parse_t("section(axis = 1, at = 0) ball(5);").expression.dimension(), 4);
  EXPECT_EQ(parse_t("minkowski() { simplex(4); cuboid([1, 1, 1, 1]); }").expression.dimension(), 4);
  EXPECT_EQ(parse_t("hull() simplex(1);").expression.dimension(), 1);
}

TEST(AnyDimension, TheTextGivesWhatTheBuilderGives) {
  const Model model =
      parse_t("section(axis = 2, at = 0.5) sweep(path = [[0, 0, 0], [1, 2, 3]]) simplex(3, size = 2);");
  const Expression built = section(sweep(simplex(3, 2), {{0, 0, 0}, {1, 2, 3}}), 1, 0.5);
  const auto& a = std::get<Construction>(model.expression.node().value);
  const auto& b = std::get<Construction>(built.node().value);
  EXPECT_EQ(a.construct, b.construct);
  const auto& c = std::get<Construction>(a.operands[0].node().value);
  const auto& d = std::get<Construction>(b.operands[0].node().value);
  EXPECT_EQ(c.construct, d.construct);
  EXPECT_EQ(std::get<Primitive>(c.operands[0].node().value), std::get<Primitive>(d.operands[0].node().value));
}

TEST(AnyDimension, EqualSubtreesAreOneNode) {
  const Model model = parse_t("product() { extrude(1) ball(2); extrude(1) ball(2); }");
  const auto& product = std::get<Construction>(model.expression.node().value);
  EXPECT_TRUE(product.operands[0].same_node(product.operands[1]));
}

TEST(AnyDimension, MatricesHaveOneRowMoreThanDimensions) {
  const Model model = parse_t(
      "multmatrix([[2, 0, 0, 0, 1], [0, 1, 0, 0, 0], [0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 2]]) "
      "ball(4);");
  const auto& map = std::get<Transform>(model.expression.node().value);
  EXPECT_EQ(map.matrix[0], 1);  // divided by the last entry
  EXPECT_EQ(map.matrix[4], 0.5);
  EXPECT_EQ(map.matrix[6], 0.5);
  EXPECT_NE(error_of("multmatrix([[1, 0], [0, 1]]) ball(4);")
                .find("t.csg:1:1: multmatrix: its children have 4 dimensions, so its matrix has to be 5 x 5"),
            std::string::npos);
  EXPECT_EQ(parse_t("multmatrix([[0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [0, 0, "
                    "0, 0, 1]]) ball(4);")
                .warnings.size(),
            1U);
}

TEST(AnyDimension, MistakesHaveAPlaceAndAHint) {
  const std::pair<const char*, const char*> mistakes[] = {
      {"\n  ball(7);", "t.csg:2:3: ball: has 7 dimensions; 1 to 6 are possible"},
      {"ball(radius = 1);", "t.csg:1:1: ball: has no argument 'radius'; it takes dimension, r, d"},
      {"ball(r = 1, d = 2);", "has both 'r' and 'd'"},
      {"ball(3, 1, 2, 4, 5);", "takes at most 4 arguments"},
      {"ball(3, $fn = 2);", "'$fn' is a whole number from 3"},
      {"ball(r = inf);", "'r' has to be a finite number"},
      {"ball(dimension = 2.5);", "whole number"},
      {"bal(3);", "there is no node 'bal'; did you mean 'ball'?"},
      {"cuboid();", "needs the argument 'size'; it takes size, center"},
      {"cuboid([1, 2, 3, 4, 5, 6, 7]);", "has 7 lengths"},
      {"cuboid([1, \"a\"]);", "'size' has to be a list of finite numbers"},
      {"simplex(points = [[0, 0], [1, 0]]);", "simplex: it takes 3 corners of 2 coordinates"},
      {"polytope(points = [[0, 0], [1]]);", "lists of finite numbers, all of the same length"},
      {"torus(R = 1, r = 2);", "t.csg:1:1: torus: its tube would cross the axis: r is larger than R"},
      {"subdivision([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]);",
       "is open at the edge from point 0 to point 1; it takes meshes without a border"},
      {"d_cylinder(2, h = [1, 2]);", "one axis at least"},
      {"extrude(h = -1) ball(2);", "'h' is a length above 0"},
      {"group() {\n extrude(h = 1)\n  ball(6); }", "t.csg:2:2: product: 7 dimensions; the limit is 6"},
      {"embed(2, thickness = 1) ball(3);", "does not fit into 2"},
      {"embed(4) ball(3);", "needs the argument 'thickness'"},
      {"project(3) ball(2);", "there is no axis 3 in 2 dimensions"},
      {"project() ball(2);", "either 'dimension'"},
      {"project(axes = [1, 1]) ball(2);", "each once"},
      {"section(axis = 4, at = 0) ball(3);", "there is no axis 4 in 3 dimensions"},
      {"projective([[1, 0], [0, 1]]) ball(3);", "a matrix of 4 x 4"},
      {"grow(r = 1, delta = 1) ball(3);", "has both 'r' and 'delta'"},
      {"grow(delta = -1) ball(3);", "shrink is for that"},
      {"sweep(path = [[0, 0]]) ball(2);", "fewer than two points"},
      {"sweep(path = [[0, 0], [1, 1]]) ball(3);", "coordinates, the solid has 3 dimensions"},
      {"part() ball(3);", "needs a name"},
      {"union() { ball(3); ball(4); }",
       "t.csg:1:1: 'union' has children of 3 and of 4 dimensions; extrude, embed and project"},
      {"group() {\n offset(delta = 0.5) cuboid([1, 2, 3, 4]); }",
       "t.csg:2:2: 'offset' takes children of 2 dimensions, not of 4; grow and shrink"},
      {"resize([2, 2, 2]) cuboid([1, 1, 1, 1]);",
       "t.csg:1:1: 'resize' takes children of 2 or 3 dimensions, not of 4; scale takes any"},
      {"offset(r = 1) cuboid([1, 2, 3]);",
       "t.csg:1:1: 'offset' takes children of 2 dimensions, not of 3; grow and shrink"},
      {"offset(r = 1) { square(1); intersection() { cube(1); ball(3); } }",
       "t.csg:1:1: 'offset' takes children of 2 dimensions, not of 3; grow and shrink"},
      {"linear_extrude(1) ball(4);",
       "'linear_extrude' takes children of 2 dimensions, not of 4; extrude takes any"},
      {"projection() ball(4);", "'projection' takes children of 3 dimensions, not of 4; project and section"},
      {"nurbs(degree = 3, points = [[0, 0], [1, 1]]);", "t.csg:1:1: nurbs: 2 points"},
      {"nurbs(points = [[1], [2]]);", "nurbs: points of 1 coordinate; it takes 2 to 6"},
      {"nurbs(knot = [1]);", "nurbs: has no argument 'knot'"},
      {"bspline(closed = 1, points = [[0, 0], [1, 1]]);", "bspline: 'closed' is true or false"},
      {"product(1) { ball(3); }", "takes at most 0 arguments; it takes none"},
  };
  for (const auto& [text, expected] : mistakes)
    EXPECT_NE(error_of(text).find(expected), std::string::npos) << text << "\n" << error_of(text);
}

TEST(AnyDimension, TheComplementOfNothingIsEverything) {
  EXPECT_EQ(parse_t("intersection() { cuboid([1, 1]); complement() ball(2, r = 0); }").primitive_count, 1U);
}

TEST(AnyDimension, WhatTakesNoPartMayBeWrong) {
  EXPECT_EQ(error_of("%ball(7); *extrude() ball(2); ball(3);"), "");
  EXPECT_EQ(parse_t("%ball(7); ball(4);").expression.dimension(), 4);
  EXPECT_EQ(error_of("union() { ball(7); !ball(4); }"), "");
}

TEST(AnyDimension, NothingStaysNothing) {
  EXPECT_EQ(parse_t("product() { cuboid([0, 1]); ball(2); }").primitive_count, 0U);
  EXPECT_EQ(parse_t("product() { cuboid([0, 1]); ball(2); }").expression.dimension(), 4);
  EXPECT_EQ(parse_t("part(\"a\") ball(r = 0);").primitive_count, 0U);
  EXPECT_EQ(parse_t("extrude(1) group();").expression.dimension(),
            3);  // nothing of no dimension: the empty model
  EXPECT_EQ(parse_t("extrude(1) ball(4, r = 0);").expression.dimension(), 5);
  EXPECT_EQ(parse_t("intersection() { ball(4); cuboid([1, 1, 1, 0]); }").primitive_count, 0U);
  EXPECT_EQ(parse_t("bezier([[1, 2], [1, 2]], weights = [1, 3]); cuboid([1, 1]);").primitive_count,
            1U);  // a single point
  EXPECT_EQ(parse_t("subdivision([[1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3]], [[0, 1, 2], [0, 3, 1], [0, 2, "
                    "3], [1, 3, 2]]);")
                .primitive_count,
            0U);
  EXPECT_EQ(parse_t("bezier([[1, 2], [1, 2.5]]);").primitive_count, 1U);
}

/// OpenSCAD's meaning of its own nodes is what it was.
TEST(AnyDimension, TheOldLanguageIsUntouched) {
  EXPECT_EQ(parse_t("union() { cube(1); square(1); }").warnings.size(), 1U);
  EXPECT_EQ(parse_t("offset(r = 1) cube(1);").primitive_count, 0U);
  EXPECT_EQ(parse_t("offset(r = 1) cube(1);").warnings.size(), 1U);
  EXPECT_EQ(parse_t("cuboid([1, 1]); offset(r = 1) { square(1); cube(1); }").primitive_count, 2U);
  EXPECT_EQ(parse_t("multmatrix([[1, 0, 0, 0, 7], [0, 1, 0, 0, 7], [0, 0, 1, 0, 7], [0, 0, 0, 1, 7], [0, 0, "
                    "0, 0, 1]]) cube(1);")
                .primitive_count,
            1U);
  EXPECT_EQ(parse_t("linear_extrude(1) square(1);").expression.dimension(), 3);
}

TEST(AnyDimension, NamedPartsCountTheirPrimitivesAsOne) {
  const Model model = parse_t("cuboid([1, 1]); part(\"a\") { ball(2); cuboid([2, 2]); } ball(2, r = 3);");
  EXPECT_EQ(model.primitive_count, 4U);
  EXPECT_EQ(model.expression.node().parts, 4U);
}

TEST(AnyDimension, HullsOfPointsHaveTheirContent) {
  for (int d = 4; d <= 6; ++d) {
    std::vector<double> points;
    for (unsigned corner = 0; corner < 1U << d; ++corner)
      for (int i = 0; i < d; ++i) points.push_back(1000 + (corner >> i & 1 ? 2 : 0));
    const Expression cube = convex_hull(d, points);
    const auto& polytope = std::get<Polytope>(std::get<Primitive>(cube.node().value));
    EXPECT_NEAR(polytope.content, std::pow(2, d), 1e-9);
    EXPECT_EQ(polytope.half_spaces.size(), static_cast<std::size_t>(2 * d * (d + 1)));
    EXPECT_EQ(polytope.corners.size(), points.size());
    points.resize(static_cast<std::size_t>(d * d));
    EXPECT_EQ(convex_hull(d, points).node().parts, 0U);  // too few points
  }
  EXPECT_THROW(convex_hull(4, std::vector<double>{1, 2, 3}), Error);
  EXPECT_THROW(convex_hull(7, std::vector<double>{}), Error);
}

TEST(AnyDimension, FlatPointsAreEmpty) {
  std::vector<double> points;
  for (int i = 0; i < 40; ++i) {
    const double x = 0.1 * i, y = std::sin(i), z = std::cos(3 * i);
    points.insert(points.end(), {x, y, z, 0.3 * x - 0.7 * y + z});
  }
  EXPECT_EQ(convex_hull(4, points).node().parts, 0U);
}

}  // namespace
}  // namespace bsp2::model
