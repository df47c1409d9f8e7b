#include <gtest/gtest.h>

#include <array>
#include <random>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "model/csg_helpers.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

TEST(CsgPolyhedra, OpenOnesAreLeftOutWithAWarning) {
  const std::string open =
      "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces = [[0,1,2],[0,3,1],[0,2,3]]);";
  const std::string where =
      "this polyhedron is not closed: the edge from point 1 (1, 0, 0) to point 2 (0, 1, 0) has no matching "
      "face on its other side; 2 more "
      "edges are open. It encloses no volume and is left out";
  const Model beside = parse("cube(9);\n " + open);
  ASSERT_EQ(beside.warnings.size(), 1U);
  EXPECT_EQ(beside.warnings[0], "test.csg:2:2: " + where);
  EXPECT_TRUE(std::holds_alternative<Primitive>(beside.expression.node().value)) << "the cube alone";
  EXPECT_EQ(beside.primitive_count, 1U);
  // It is the user's error if nothing else is left.
  const std::string nothing = where + ", and nothing else is left of the model";
  EXPECT_EQ(message(open), "test.csg:1:1: " + nothing);
  EXPECT_EQ(message("cube(0); difference() { " + open + " cube(1); }"), "test.csg:1:25: " + nothing);
  EXPECT_EQ(message("group(); *" + open), "no error");
  EXPECT_EQ(message(open + " !cube(0);"), "no error");
  EXPECT_EQ(message("cube(1); !" + open), "test.csg:1:11: " + nothing);
}

/// The warnings that tell of it are not printed with an error.
TEST(CsgPolyhedra, OpenOnesAloneAreRefusedWithWhatMayBeTheCause) {
  const auto polyhedron = [](const std::string& faces) {
    return "polyhedron(points = [[0,0,0],[1,0,0],[0,1,0],[0,0,1]], faces = [[0,1,2],[0,3,1],[1,3,2]," +
           faces + "]);";
  };
  const auto odd = [](int face, int point) {
    return "; face " + std::to_string(face) + " of this polyhedron names point " + std::to_string(point) +
           ", but there are 4 points, the first being 0; it is passed over";
  };
  const std::string left = ", and nothing else is left of the model";
  const std::string one = message(polyhedron("[2,3,99]"));
  EXPECT_TRUE(one.starts_with("test.csg:1:1: this polyhedron is not closed: ")) << one;
  EXPECT_TRUE(one.ends_with(left + odd(3, 99))) << one;
  const std::string many = message(polyhedron("[5,6,7],[8,9,2]"));
  EXPECT_TRUE(many.ends_with(left + odd(3, 5) + odd(3, 6) + odd(3, 7) + "; and 2 more warnings")) << many;
  // What is odd about something else is not the cause.
  const std::string other =
      message("multmatrix([[1,0,0,inf],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) cube(1); " + polyhedron("[2,3]"));
  EXPECT_TRUE(other.ends_with(left)) << other;
  EXPECT_EQ(parse("cube(9); " + polyhedron("[2,3,99]")).warnings.size(), 2U);
}

TEST(CsgPolyhedra, ThoseThatCrossThemselvesAreToldOf) {
  // Two cubes of side 2, whose volumes sum up to 16; the second one begins at (x, x, x).
  const auto two = [](double x) {
    std::string points, faces;
    for (int i = 0; i < 16; ++i) {
      const double at = i < 8 ? 0 : x;
      for (int k = 0; k < 3; ++k)
        points += (k == 0 ? "[" : "") + std::to_string(at + (i >> k & 1) * 2) + (k == 2 ? "]," : ",");
    }
    for (int first : {0, 8})
      for (const auto& [a, b, c, d] :
           {std::array{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}})
        faces += "[" + std::to_string(first + a) + "," + std::to_string(first + b) + "," +
                 std::to_string(first + c) + "," + std::to_string(first + d) + "],";
    return "polyhedron(points = [" + points + "], faces = [" + faces + "]);";
  };
  const auto warnings = [](const std::string& text) {
    return overlaps_of(parse(text), text, "test.csg").warnings;
  };
  const std::vector<std::string> told = warnings("cube(); \n " + two(1) + two(1));
  ASSERT_EQ(told.size(), 1U) << "equal ones once";
  EXPECT_TRUE(told[0].starts_with("test.csg:2:2: this polyhedron crosses itself: the edge from ("))
      << told[0];
  EXPECT_NE(told[0].find("the volume that the faces sum up to, 16,"), std::string::npos) << told[0];
  EXPECT_EQ(warnings(two(1) + two(1.5)).size(), 2U);
  EXPECT_TRUE(warnings(two(3) + two(2)).empty()) << "apart, and touching";
  EXPECT_TRUE(warnings("hull() { " + two(1) + " } %" + two(1) + " *" + two(1)).empty())
      << "none of them is a solid by itself";
  EXPECT_TRUE(warnings(two(1) + " !cube();").empty());
}

/// A hull takes the points of what is no solid, like OpenSCAD: also those of a plane polygon.
TEST(CsgPolyhedra, OnlyThePointsOfAHollowOneCountUnderAHull) {
  const std::string square = "polyhedron(points = [[0,0,0],[1,0,0],[1,1,0],[0,1,0]], faces = [[0,1,2,3]]);";
  const std::string lifted =
      "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,2],[0,0,0,1]]) { color([1,0,0]) { " + square + " } }";
  for (const std::string construct : {"hull() {", "minkowski() { cube(1); group() {"}) {
    const Model model = parse(construct + lifted + " }" + (construct.size() > 10 ? "}" : ""));
    ASSERT_EQ(model.warnings.size(), 1U) << construct;
    EXPECT_NE(model.warnings[0].find("Only its points count here"), std::string::npos) << model.warnings[0];
    EXPECT_TRUE(std::holds_alternative<Construction>(model.expression.node().value));
  }
  const Model between = parse("cube(1); hull() { difference() { " + square + " cube(1); } }");
  ASSERT_EQ(between.warnings.size(), 1U);
  EXPECT_NE(between.warnings[0].find("is left out"), std::string::npos) << "a difference takes solids";
}

/// As OpenSCAD does: a point that no face names is no corner, and an index that names no point is passed
/// over.
TEST(CsgPolyhedra, HoldWhatTheirFacesName) {
  const std::string tetrahedron = "polyhedron([[0,0,0],[1,0,0],[0,1,0],[0,0,1]], [[0,1,2],[0,3,1],[0,2,3],";
  EXPECT_TRUE(parse(tetrahedron + "[1,3,2]]);").warnings.empty());
  const auto one_warning = [](const Model& model, const char* text) {
    ASSERT_EQ(model.warnings.size(), 1U);
    EXPECT_NE(model.warnings[0].find(text), std::string::npos) << model.warnings[0];
    EXPECT_TRUE(std::holds_alternative<Primitive>(model.expression.node().value));
  };
  one_warning(parse(tetrahedron + "[1,3,2,9]]);"),
              "face 3 of this polyhedron names point 9, but there are 4 points");
  one_warning(parse(tetrahedron + "[1,3,2,-1]]);"), "face 3 of this polyhedron names point -1");
  one_warning(parse(tetrahedron + "[1,3,2],7]);"), "face 4 of this polyhedron is no vector");
  EXPECT_EQ(message(tetrahedron + "[1,3,9]]);").find("test.csg:1:1: this polyhedron is not closed"), 0U);
  const Model hull = parse("hull() { polyhedron([[0,0,0],[1,0,0],[0,1,0],[0,0,1]], [[0,1,2]]); }");
  EXPECT_EQ(hull.expression.node().parts, 1U);
  ASSERT_EQ(hull.warnings.size(), 1U);
}

/// Those that are written alike are read once: beside each of them read alone.
TEST(CsgPolyhedra, ThoseThatAreWrittenAgainAreTheSame) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const auto comment = [&] { return std::array{"", " ", "/* :-) */", "/* ) ; */", "// )\n"}[random() % 5]; };
  for (int round = 0; round < samples::rounds(50); ++round) {
    std::vector<std::string> different;
    for (int i = 0; i < 5; ++i) {
      const std::string size = std::to_string(1 + random() % 3);
      std::string text = "polyhedron(";
      text += comment();
      text += "points = [[0,0,0],[" + size + ",0,0],[0,1,0],[0,0,1]]," + comment() +
              "faces = [[0,1,2],[0,3,1],[0,2,3],[1,3,2";
      if (random() % 4 == 0) text += ",9";  // is warned of
      different.push_back(text + "]]" + comment() + ");");
    }
    std::string all;
    std::size_t warnings = 0;
    std::vector<std::string> written;
    for (int i = 0; i < 20; ++i) {
      written.push_back(different[random() % different.size()]);
      // Moved apart, as equal operands might be one.
      all += "\nmultmatrix([[1,0,0," + std::to_string(10 * i) + "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) " +
             written.back();
      warnings += parse(written.back()).warnings.size();
    }
    const Model model = parse(all);
    EXPECT_EQ(model.warnings.size(), warnings) << all;
    const auto& operands = std::get<Boolean>(model.expression.node().value).children;
    ASSERT_EQ(operands.size(), written.size());
    for (std::size_t i = 0; i < operands.size(); ++i) {
      const Expression& moved = operands[i];
      const auto* map = std::get_if<Transform>(&moved.node().value);
      const Expression& solid = map != nullptr ? map->child : moved;  // the first one is not moved at all
      EXPECT_EQ(mesh_of(solid), mesh_of(parse(written[i]).expression)) << written[i];
    }
  }
}

}  // namespace
}  // namespace bsp2::model
