// Drawings: areas that OpenSCAD 2021.01 gives for the same files.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "model/drawing_helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

double svg_area(const std::string& elements) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.svg";
  std::ofstream(path) << "<svg width=\"100mm\" height=\"100mm\" viewBox=\"0 0 100 100\">" << elements
                      << "</svg>";
  double sum = 0;
  const auto drawings = import_svg(path, 72, false);
  for (const PlaneDrawing& drawing : *drawings) sum += area_of(drawing);
  return sum;
}

using PlaneBox = std::array<double, 4>;

/// Lowest and highest x and y of a rectangle from (10, 20) to (40, 60) in a drawing with these attributes.
PlaneBox page_box(const std::string& attributes, double dpi = 72, bool center = false) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.svg";
  std::ofstream(path) << "<svg " << attributes
                      << "><rect x=\"10\" y=\"20\" width=\"30\" height=\"40\"/></svg>";
  PlaneBox box{1e9, 1e9, -1e9, -1e9};
  const auto drawings = import_svg(path, dpi, center);
  for (const PlaneDrawing& drawing : *drawings)
    for (const auto& p : drawing.points)
      box = {std::min(box[0], p[0]), std::min(box[1], p[1]), std::max(box[2], p[0]), std::max(box[3], p[1])};
  return box;
}

void expect_box(const PlaneBox& a, const PlaneBox& b) {
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(a[i], b[i], 1e-4) << "number " << i;
}

TEST(Svg, PageIsThatOfOpenScad) {
  expect_box(page_box("width=\"100mm\" height=\"50mm\" viewBox=\"0 0 200 100\""), {5, 20, 20, 40});
  expect_box(page_box("width=\"100mm\" height=\"50mm\""), {10, -10, 40, 30});
  expect_box(page_box(""), {10, -60, 40, -20});
  expect_box(page_box("viewBox=\"5 7 200 100\""), {1.76389, 11.6417, 12.3472, 25.7528});
  expect_box(page_box("width=\"100\" height=\"50\" viewBox=\"0 0 200 200\""),
             {9.70139, 12.3472, 12.3472, 15.875});
  expect_box(page_box("width=\"50%\" height=\"25%\" viewBox=\"5 7 200 100\""), {5, 33, 35, 73});
  expect_box(page_box("width=\"10cm\" height=\"5pc\" viewBox=\"5 7 200 100\""),
             {29.8917, 6.98504, 36.2417, 15.4517});
  expect_box(
      page_box("width=\"100mm\" height=\"100mm\" viewBox=\"5 7 200 100\" preserveAspectRatio=\"xMaxYMax\""),
      {2.5, 16.5, 17.5, 36.5});
  expect_box(
      page_box(
          "width=\"100mm\" height=\"100mm\" viewBox=\"5 7 200 100\" preserveAspectRatio=\"xMidYMin slice\""),
      {-45, 33, -15, 73});
  expect_box(
      page_box("width=\"100mm\" height=\"100mm\" viewBox=\"5 7 200 100\" preserveAspectRatio=\"none\""),
      {2.5, 33, 17.5, 73});
  expect_box(page_box("viewBox=\"0 0 200 100\"", 300), {0.846667, 3.38667, 3.38667, 6.77333});
  expect_box(page_box("width=\"100px\" height=\"50px\" viewBox=\"0 0 200 100\"", 300),
             {1.32292, 5.29167, 5.29167, 10.5833});
  expect_box(page_box("width=\"100mm\" height=\"50mm\" viewBox=\"0 0 200 100\"", 72, true),
             {-7.5, -10, 7.5, 10});
}

TEST(Svg, RoundShapesHaveTheSidesOfOpenScad) {
  EXPECT_NEAR(svg_area("<circle cx=\"50\" cy=\"50\" r=\"20\"/>"), 20 * 400 * sine(9), 1e-9);
  EXPECT_NEAR(svg_area("<ellipse cx=\"50\" cy=\"50\" rx=\"20\" ry=\"10\"/>"), 20 * 200 * sine(9), 1e-9);
  const double quarter =
      1 - 4.5 * sine(10);  // what nine chords leave of the unit square outside of a quarter circle
  const std::string rect = "<rect x=\"10\" y=\"20\" width=\"30\" height=\"40\" ";
  EXPECT_NEAR(svg_area(rect + "rx=\"5\" ry=\"8\"/>"), 1200 - 4 * 40 * quarter, 1e-9);
  EXPECT_NEAR(svg_area(rect + "rx=\"5\"/>"), 1200 - 4 * 25 * quarter, 1e-9);
  EXPECT_NEAR(svg_area(rect + "ry=\"50\"/>"), 1200 - 4 * 300 * quarter, 1e-9) << "at most half the rectangle";
  EXPECT_NEAR(svg_area("<rect width=\"30px\" height=\"1in\"/>"), 30 * 96, 1e-9) << "lengths with units";
}

/// The larger its radii, the nearer an arc is to its chord.
TEST(Svg, ArcsOfAnyRadiusEndAtTheirChord) {
  double before = 1e9;
  for (const char* radius : {"20", "100", "1e4", "1e6", "1e8", "1e10", "5e12", "1e60", "1e154", "1e300"}) {
    SCOPED_TRACE(radius);
    const std::string r = radius;
    const double area = svg_area("<path d=\"M10 10 A " + r + " " + r + " 0 0 1 40 23 L 40 50 L 10 50 Z\"/>");
    EXPECT_GE(area, 1005 - 1e-6);
    EXPECT_LE(area, before + 1e-6);
    before = area;
  }
  EXPECT_NEAR(before, 1005, 1e-9);
}

TEST(Svg, LinesAreAsWideAsTheirStrokes) {
  const std::string line = "<line x1=\"10\" y1=\"10\" x2=\"30\" y2=\"10\" ",
                    path = "<path d=\"M10 10 L30 10 L30 30\" ";
  EXPECT_NEAR(svg_area(line + "stroke-width=\"2\"/>"), 44, 1e-9) << "with square caps";
  EXPECT_NEAR(svg_area(path + "stroke-width=\"2\" fill=\"none\"/>"), 84, 1e-9) << "and a mitre";
  EXPECT_NEAR(svg_area(path + "/>"), 41, 1e-9) << "1 wide if nothing is said";
  EXPECT_NEAR(svg_area(path + "style=\"stroke-width:2;stroke-linecap:butt\"/>"), 80, 1e-9);
  EXPECT_NEAR(svg_area(path + "style=\"stroke-width:2;stroke-linecap:round;stroke-linejoin:round\"/>"),
              82.92688, 1e-4);
  EXPECT_NEAR(svg_area("<g transform=\"scale(2)\">" + line + "stroke-width=\"2\"/></g>"), 176, 1e-9);
  EXPECT_NEAR(svg_area("<g stroke-width=\"2\">" + line + "/></g>"), 21, 1e-9) << "not inherited";
  EXPECT_NEAR(svg_area("<path d=\"M10 10 L30 10 L30 30 Z\" style=\"stroke-width:2\" fill=\"none\"/>"), 200,
              1e-9)
      << "an area has no stroke";
  EXPECT_EQ(svg_area("<defs><rect id=\"a\" width=\"3\" height=\"2\"/></defs>"), 0);
}

/// Random trees of groups: what is wanted, by a walk of its own.
TEST(Svg, ElementsAndLayersAreSelected) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.svg";
  const std::vector<std::string> names{"", "a", "b", "c", "d"};
  for (int round = 0; round < samples::rounds(60); ++round) {
    const SvgSelection wanted{names[random() % 4], names[random() % 4]};
    std::string text;
    bool any_label = false;
    struct Group {
      std::string id, label;
      bool is_layer;
      bool is_group = true;
    };
    std::vector<Group> groups;  // from the root to here
    struct Rect {
      std::vector<Group> above;
      std::string id;
      double area;
    };
    std::vector<Rect> rects;
    const auto attribute = [](const std::string& name, const std::string& value) {
      return value.empty() ? "" : " " + name + "=\"" + value + "\"";
    };
    for (int i = 0; i < 25; ++i) {
      if (random() % 3 == 0 && !groups.empty()) {
        groups.pop_back();
        text += "</g>";
      } else if (random() % 2 == 0) {
        const Group group{names[random() % 5], names[random() % 5], random() % 2 == 0};
        groups.push_back(group);
        any_label |= group.is_layer && group.label == wanted.layer;
        text += "<g" + attribute("id", group.id) + attribute("inkscape:label", group.label) +
                (group.is_layer ? " inkscape:groupmode=\"layer\">" : ">");
      } else {
        const double width = 1 + static_cast<double>(random() % 1000);
        rects.push_back({groups, names[random() % 5], width});
        text += "<rect" + attribute("id", rects.back().id) + " width=\"" +
                std::to_string(static_cast<int>(width)) + "\" height=\"1\"/>";
      }
    }
    for (; !groups.empty(); groups.pop_back()) text += "</g>";
    std::ofstream(path) << "<svg xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" "
                           "width=\"100mm\" height=\"100mm\" viewBox=\"0 0 100 100\">"
                        << text << "</svg>";

    const auto is_layer = [&](const Group& group) {
      return any_label ? group.is_layer && group.label == wanted.layer
                       : group.is_group && group.id == wanted.layer;
    };
    double expected = 0;
    bool is_there = wanted.id.empty() && wanted.layer.empty();
    const auto look = [&](const std::vector<Group>& chain,
                          double area) {  // whether one in the chain is named and in a layer
      bool in_layer = wanted.layer.empty(), is_wanted = in_layer && wanted.id.empty();
      for (const Group& group : chain) {
        in_layer |= is_layer(group);
        is_wanted |= in_layer && (wanted.id.empty() || group.id == wanted.id);
      }
      is_there |= is_wanted;
      if (is_wanted) expected += area;
    };
    for (const Rect& rect : rects) {
      auto chain = rect.above;
      chain.push_back({rect.id, "", false, false});
      look(chain, rect.area);
    }
    const auto drawings = import_svg(path, 72, false, wanted);
    if (!drawings) {
      EXPECT_EQ(expected, 0) << text;
      EXPECT_FALSE(is_there) << text;
      continue;
    }
    double sum = 0;
    for (const PlaneDrawing& drawing : *drawings) sum += area_of(drawing);
    EXPECT_NEAR(sum, expected, 1e-9) << wanted.text() << " of " << text;
  }
}

TEST(Svg, FaultsAreToldWithTheirLine) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.svg";
  const auto fault_of = [&](const std::string& text) -> std::string {
    std::ofstream(path) << text;
    try {
      import_svg(path, 72, false);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(
      fault_of("<svg>\n<g>\n<rect width=\"1\"").find("import: " + path.string() + ":3: this is no XML: "),
      0u);
  EXPECT_EQ(fault_of("<svg>\n<g>\n\n</svg>").find("import: " + path.string() + ":4: this is no XML: "), 0u);
  EXPECT_EQ(fault_of("").find("import: " + path.string() + ":1: this is no XML: "), 0u);
  EXPECT_EQ(fault_of("<html/>"),
            "import: " + path.string() + " is no SVG file: its outermost element is not 'svg'");
  EXPECT_EQ(fault_of("<svg/>"), "");
  std::filesystem::remove(path);
  try {
    import_svg(path, 72, false);
    FAIL() << "a file that is not there was read";
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()), "import: " + path.string() + " cannot be read");
  }
}

/// Wherever it is cut off: a drawing is read whole or not at all.
TEST(Dxf, ADrawingThatIsCutOffIsAnError) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  const std::string sections = "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n3\n20\n4\n40\n5\n0\nENDSEC\n",
                    end = "0\nEOF\n";
  const auto whole = [&](const std::string& text) {
    std::ofstream(path) << text;
    return area_of(import_dxf(path, "", {}, {}));
  };
  const double area = whole(sections + end);
  EXPECT_GT(area, 70);
  EXPECT_EQ(whole(sections), area);  // there is nothing after it
  EXPECT_EQ(whole(sections + end + "\n"), area);
  EXPECT_EQ(whole(sections + end + "\x1a"), area);
  EXPECT_EQ(whole(end), 0) << "nothing, but whole";
  for (std::size_t bytes = 0; bytes < sections.find("ENDSEC") + 6; ++bytes) {
    SCOPED_TRACE(sections.substr(0, bytes));
    EXPECT_THROW(whole(sections.substr(0, bytes)), Error);
  }
}

/// However often they are said to go around.
TEST(Dxf, ArcsGoAroundOnceAtMost) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  const auto area_to = [&](const char* last_angle) {
    std::ofstream(path) << "0\nSECTION\n2\nENTITIES\n0\nARC\n8\n0\n10\n25\n20\n0\n40\n2.5\n50\n5\n51\n"
                        << last_angle << "\n0\nENDSEC\n0\nEOF\n";
    const PlaneDrawing drawing = import_dxf(path, "", {}, {.fn = 64});
    EXPECT_LE(drawing.points.size(), 65U);
    return area_of(drawing);
  };
  const double disk = 32 * std::sin(std::numbers::pi / 32) * 2.5 * 2.5;
  EXPECT_NEAR(area_to("365"), disk, 0.01);
  EXPECT_NEAR(area_to("180149200"), disk, 0.01);
  EXPECT_THROW(import_dxf(path, "", {}, {.fn = 1e9}), Error);
}

/// All lines of a star meet in one point: each path takes the next of them that is left. Looking through all
/// of them each time takes minutes.
TEST(Dxf, StarsOfManyLinesAreJoined) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  constexpr int lines = 200'000;
  {
    std::ofstream file(path);
    file << "0\nSECTION\n2\nENTITIES\n";
    for (int i = 0; i < lines; ++i)
      file << "0\nLINE\n8\n0\n10\n0\n20\n0\n11\n" << 1 + i % 500 << "\n21\n" << 1 + i / 500 << '\n';
    file << "0\nENDSEC\n0\nEOF\n";
  }
  const PlaneDrawing drawing = import_dxf(path, "", {}, {});
  EXPECT_EQ(drawing.points.size(), lines + 1U);
  EXPECT_EQ(drawing.paths.size(), lines / 2U);  // from one end through the middle to another
}

TEST(Dxf, BlocksAreInserted) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  const auto write = [&](std::initializer_list<const char*> lines) {
    std::ofstream file(path);
    for (const char* line : lines) file << line << '\n';
  };
  write({"0", "SECTION",    "2",   "BLOCKS", "0",  "BLOCK",   "8",           "0",        "2",  "B1", "10",
         "0", "20",         "0",  //
         "0", "LWPOLYLINE", "8",   "0",      "70", "1",       "10",          "0",        "20", "0",  "10",
         "2", "20",         "0",   "10",     "2",  "20",      "1",           "10",       "0",  "20", "1",  //
         "0", "ENDBLK",     "0",   "ENDSEC", "0",  "SECTION", "2",           "ENTITIES",                   //
         "0", "INSERT",     "8",   "0",      "2",  "B1",      "10",          "10",       "20", "5",  "41",
         "2", "42",         "3",   "50",     "30",                                                   //
         "0", "INSERT",     "8",   "0",      "2",  "B1",      "10",          "-10",      "20", "5",  //
         "0", "ELLIPSE",    "8",   "0",      "10", "0",       "20",          "-20",      "11", "4",  "21",
         "3", "40",         "0.5", "41",     "0",  "42",      "6.283185307",  //
         "0", "ENDSEC",     "0",   "EOF"});
  // OpenSCAD gives 52.819, since the points of a block lie on its grid of 2^-10 before it is scaled; the
  // exact area is 52.823.
  EXPECT_NEAR(area_of(import_dxf(path, "", {}, {.fn = 24})), 52.823, 5e-3);
  // An arc whose angles are far apart ends all the same.
  write({"0",  "SECTION", "2",  "ENTITIES", "0",  "ARC", "10", "0",      "20", "0",
         "40", "1",       "50", "1e300",    "51", "0",   "0",  "ENDSEC", "0",  "EOF"});
  EXPECT_EQ(import_dxf(path, "", {}, {}).paths.size(), 0U);
}

TEST(Dxf, ScaleAndOriginComeBeforeFacetsAndGrid) {
  const samples::TemporaryFolder folder;
  const auto path = folder.path() / "drawing.dxf";
  std::ofstream(path) << "0\nSECTION\n2\nENTITIES\n0\nCIRCLE\n8\n0\n10\n3\n20\n4\n40\n5\n0\nENDSEC\n0\nEOF\n";
  // Areas by OpenSCAD 2021.01, which prints six digits of each coordinate.
  EXPECT_NEAR(area_of(import_dxf(path, "", {}, {})), 76.52706, 1e-4);
  EXPECT_NEAR(area_of(import_dxf(path, "", {.scale = 10}, {})), 7796.744, 0.02);
  EXPECT_NEAR(area_of(import_dxf(path, "", {.scale = 0.1}, {})), 0.5942673, 1e-6);
  EXPECT_NEAR(area_of(import_dxf(path, "", {.origin = {1.23456, 2}, .scale = 10}, {.fa = 1, .fs = 1})),
              7853.4517, 0.01);
}

}  // namespace
}  // namespace bsp2::model
