// What a model's files and fonts are like is told once, wherever they are named.

#include <gtest/gtest.h>

#include <string>

#include "model/csg_helpers.hpp"
#include "model/drawing_helpers.hpp"

namespace bsp2::model {
namespace {

/// A text with one node many times, each time somewhere else.
std::string many(const std::string& node, int count) {
  std::string text;
  for (int i = 0; i < count; ++i)
    text += "multmatrix([[1,0,0," + std::to_string(i) + "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) " + node + "\n";
  return text;
}

TEST(Remarks, OneMissingFontIsOneWarning) {
  const std::string letter = R"(text(text = "a", font = "No Such Font");)";
  const Model one = parse(letter), all = parse(many(letter, 188));
  ASSERT_EQ(one.warnings.size(), 1U);
  ASSERT_EQ(all.warnings.size(), 1U);
  EXPECT_NE(one.warnings[0].find("there is no font 'No Such Font' here"), std::string::npos)
      << one.warnings[0];
  EXPECT_TRUE(all.warnings[0].ends_with(" is taken (and at 187 more places)")) << all.warnings[0];
  EXPECT_TRUE(parse(many(letter, 2)).warnings[0].ends_with(" is taken (and at 1 more place)"));
  EXPECT_EQ(parse(many(letter, 9) + many(R"(text(text = "a", font = "Nor This One");)", 9)).warnings.size(),
            2U);
  EXPECT_TRUE(parse(many(letter, 9) + "!cube(1);").warnings.empty()) << "nothing of that is in the model";
}

TEST(Remarks, OneDrawingIsOneWarning) {
  DrawingFile drawing("a.svg");
  drawing.write(
      "<svg width=\"9mm\" height=\"9mm\" viewBox=\"0 0 9 9\"><rect width=\"3\" "
      "height=\"3\"/><text>a</text><text>b</text></svg>");
  const Model model = parse(many("import(file = \"" + drawing.path().string() + "\");", 5));
  ASSERT_EQ(model.warnings.size(), 1U);
  EXPECT_NE(drawing.without_path(model.warnings[0]).find(": 2 things in FILE are not read: 2 text. "),
            std::string::npos)
      << model.warnings[0];
  EXPECT_TRUE(model.warnings[0].ends_with("(and at 4 more places)"));
  // And a polygon that names points that are not there.
  const Model polygon = parse("polygon(points = [[0,0],[4,0],[4,4]], paths = [[0,1,2],[7,8,9],[0,1,5]]);");
  ASSERT_EQ(polygon.warnings.size(), 1U);
  EXPECT_EQ(polygon.warnings[0],
            "test.csg:1:1: path 1 of this polygon names a point that is not there; there are 3; in all, 4 "
            "names of points are passed over");
}

/// The units of a drawing are no reason for doubt.
TEST(Remarks, UnitsAreANote) {
  DrawingFile drawing("a.dxf");
  drawing.write(
      "0\nSECTION\n2\nHEADER\n9\n$"
      "INSUNITS\n70\n1\n0\nENDSEC\n0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n10\n0\n20\n0\n40\n9\n0\nENDSEC\n0\nEOF"
      "\n");
  const std::string node = "import(file = \"" + drawing.path().string() + "\");";
  const Model model = parse(many(node, 3));
  EXPECT_TRUE(model.warnings.empty());
  ASSERT_EQ(model.notes.size(), 1U);
  EXPECT_NE(model.notes[0].find(" is drawn in inches ($INSUNITS); nothing is scaled"), std::string::npos)
      << model.notes[0];
  EXPECT_TRUE(model.notes[0].ends_with("(and at 2 more places)")) << model.notes[0];
  EXPECT_TRUE(parse(node + "!cube(1);").notes.empty());
}

}  // namespace
}  // namespace bsp2::model
