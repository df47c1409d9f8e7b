// SVG drawings: what hides is left out, what is used is drawn, what is not read is told.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <ctime>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "model/drawing_helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

class SvgDrawing : public ::testing::Test {
 protected:
  DrawingFile file_{"drawing.svg"};

  /// @param elements in units of the page, which are millimetres.
  std::vector<PlaneDrawing> read(const std::string& elements, const SvgSelection& selection = {}) {
    file_.write(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\" "
        "xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" "
        "width=\"100mm\" height=\"100mm\" viewBox=\"0 0 100 100\">" +
        elements + "</svg>");
    const auto drawings = import_svg(file_.path(), 72, false, selection, file_.remarks());
    is_there_ = drawings.has_value();
    return drawings.value_or(std::vector<PlaneDrawing>());
  }
  double area(const std::string& elements, const SvgSelection& selection = {}) {
    double sum = 0;
    for (const PlaneDrawing& drawing : read(elements, selection)) sum += area_of(drawing);
    return sum;
  }
  std::string fault(const std::string& elements) {
    try {
      read(elements);
    } catch (const Error& error) {
      return file_.without_path(error.what());
    }
    return "";
  }
  /// Lowest and highest x and y of all that is drawn, y downwards as in the file.
  std::array<double, 4> box(const std::string& elements) {
    std::array<double, 4> box{1e9, 1e9, -1e9, -1e9};
    for (const PlaneDrawing& drawing : read(elements))
      for (const auto& [x, y] : drawing.points)
        box = {std::min(box[0], x), std::min(box[1], 100 - y), std::max(box[2], x),
               std::max(box[3], 100 - y)};
    return box;
  }
  void expect_box(const std::string& elements, const std::array<double, 4>& expected) {
    const auto found = box(elements);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(found[i], expected[i], 1e-9) << elements << ": " << i;
  }
  bool is_there_ = false;
};

std::string square(double size, const std::string& more = "") {
  return "<rect width=\"" + std::to_string(size) + "\" height=\"" + std::to_string(size) + "\" " + more +
         "/>";
}

TEST_F(SvgDrawing, WhatIsHiddenIsLeftOut) {
  const std::string shown = square(1);
  for (const char* hides :
       {"display=\"none\"", "style=\"fill:red; display : none\"", "style=\"display:none !important\"",
        "visibility=\"hidden\"", "visibility=\"collapse\"", "style=\"visibility:hidden\""}) {
    EXPECT_NEAR(area(shown + square(3, hides)), 1, 1e-9) << hides;
    EXPECT_NEAR(area(shown + "<g " + hides + "><g>" + square(3) + "</g></g>"), 1, 1e-9) << hides;
  }
  EXPECT_NEAR(area("<g inkscape:groupmode=\"layer\" inkscape:label=\"a\" style=\"display:none\">" +
                   square(3) + "</g>" + shown),
              1, 1e-9);
  EXPECT_NEAR(area("<g style=\"display:inline\">" + square(3) + "</g>" + shown), 10, 1e-9);
  // A child of what is not displayed is not either; one of what is invisible may be visible.
  EXPECT_NEAR(area("<g display=\"none\">" + square(3, "display=\"inline\"") + "</g>" + shown), 1, 1e-9);
  EXPECT_NEAR(area("<g visibility=\"hidden\">" + square(3) + square(2, "visibility=\"visible\"") + "</g>"), 4,
              1e-9);
  EXPECT_NEAR(area("<g visibility=\"hidden\"><g style=\"visibility:visible\">" +
                   square(3, "visibility=\"inherit\"") + "</g></g>"),
              9, 1e-9);
  // A style goes before an attribute.
  EXPECT_NEAR(area(square(3, "display=\"none\" style=\"display:block\"")), 9, 1e-9);
  EXPECT_TRUE(file_.warnings.empty());
}

TEST_F(SvgDrawing, StyleSheetsFollowElementsAround) {
  const std::string nested = "<g class=\"h\"><g>" + square(3) + "</g></g>" + square(1);
  for (const char* selector :
       {"g.h rect", ".h rect", "g g rect", ".h>g>rect", "svg > g > g rect", ".h *", "g rect, circle"}) {
    const std::string sheet = "<style>" + std::string(selector) + "{display:none}</style>";
    EXPECT_NEAR(area(sheet + nested), 1, 1e-9) << selector;
    EXPECT_TRUE(file_.warnings.empty()) << selector;
  }
  for (const char* selector : {".h > rect", "g.k rect", "rect g", "svg > g > rect", "g g g rect"}) {
    EXPECT_NEAR(area("<style>" + std::string(selector) + "{display:none}</style>" + nested), 10, 1e-9)
        << selector;
    EXPECT_TRUE(file_.warnings.empty()) << selector;
  }
  // The more names, the more it counts, wherever it stands.
  EXPECT_NEAR(area("<style>.h rect{display:inline} rect{display:none}</style>" + nested), 9, 1e-9);
}

TEST_F(SvgDrawing, WhatStylesSayAndNobodyReadsIsTold) {
  for (const auto& [text, told] :
       {std::pair<std::string, std::string>{"<style>rect[id]{display:none}</style>" + square(2),
                                            "rule of a style sheet for 'rect[id]'"},
        {"<style>rect + rect{display:none}</style>" + square(2), "for 'rect + rect'"},
        {square(2, "style=\"transform:scale(2)\""), "transform of rect by a style"},
        {"<style>rect{transform:scale(2)}</style>" + square(2), "transform of rect by a style"},
        {square(2, "transform=\"scale(1)\" transform-origin=\"1 1\""), "transform-origin of rect"}}) {
    EXPECT_NEAR(area(text), 4, 1e-9) << text;
    ASSERT_EQ(file_.warnings.size(), 1U) << text;
    EXPECT_NE(file_.warnings[0].find(told), std::string::npos) << file_.warnings[0];
  }
  for (const std::string& text :
       {"<style>rect:hover{visibility:hidden} rect[id]{fill:red}</style>" + square(2),
        square(2, "style=\"fill:red;stroke:none\"")}) {
    EXPECT_NEAR(area(text), 4, 1e-9) << text;
    EXPECT_TRUE(file_.warnings.empty()) << text;
  }
}

/// Beside a walk of its own over a random tree.
TEST_F(SvgDrawing, VisibilityIsInherited) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(50); ++round) {
    double expected = 0;
    std::string text;
    const auto grow = [&](const auto& self, int depth, bool is_visible, bool is_displayed) -> void {
      for (int i = static_cast<int>(random() % 4); i >= 0; --i) {
        const int display = static_cast<int>(random() % 6), visibility = static_cast<int>(random() % 5);
        std::string attributes;
        if (display == 0) attributes += "display=\"none\" ";
        if (display == 1) attributes += "display=\"inline\" ";
        if (visibility == 0) attributes += "style=\"visibility:hidden\" ";
        if (visibility == 1) attributes += "visibility=\"visible\" ";
        const bool visible = visibility == 1 || (visibility != 0 && is_visible),
                   displayed = is_displayed && display != 0;
        if (depth > 0 && random() % 2 == 0) {
          text += "<g " + attributes + ">";
          self(self, depth - 1, visible, displayed);
          text += "</g>";
        } else {
          const double size = 1 + static_cast<double>(random() % 5);
          text += square(size, attributes);
          if (visible && displayed) expected += size * size;
        }
      }
    };
    grow(grow, 4, true, true);
    EXPECT_NEAR(area(text), expected, 1e-6) << text;
  }
}

TEST_F(SvgDrawing, StyleSheetsHide) {
  const auto styled = [&](const std::string& sheet, const std::string& attributes) {
    return area("<style>" + sheet + "</style>" + square(3, attributes));
  };
  EXPECT_EQ(styled(".a { fill: red; display: none }", "class=\"b a\""), 0);
  EXPECT_NEAR(styled(".a { display: none }", "class=\"aa\""), 9, 1e-9);
  EXPECT_EQ(styled("/* .a{} */ rect.a, #x { visibility: hidden; }", "class=\"a\""), 0);
  EXPECT_EQ(styled("<![CDATA[ #x{display:none} ]]>", "id=\"x\""), 0);
  EXPECT_EQ(styled("rect { display: none }", ""), 0);
  EXPECT_EQ(styled("* { visibility: hidden }", ""), 0);
  EXPECT_NEAR(styled("circle.a { display: none }", "class=\"a\""), 9, 1e-9);
  EXPECT_NEAR(styled("g .a { display: none }", "class=\"a\""), 9, 1e-9)
      << "no element around it is asked for";
  EXPECT_NEAR(styled("@media print { .a { display: none } } @import url(x); .b { }", "class=\"a\""), 9, 1e-9);
  // The one that asks for more counts, then the later one; a style of its own goes before, what is important
  // before that.
  EXPECT_NEAR(styled("rect.a { display: inline } .a { display: none }", "class=\"a\""), 9, 1e-9);
  EXPECT_EQ(styled(".a { display: inline } .b { display: none }", "class=\"b a\""), 0);
  EXPECT_NEAR(styled(".a { display: none }", "class=\"a\" style=\"display:inline\""), 9, 1e-9);
  EXPECT_EQ(styled(".a { display: none !important }", "class=\"a\" style=\"display:inline\""), 0);
  EXPECT_NEAR(styled(".a { display: inline }", "class=\"a\" display=\"none\""), 9, 1e-9)
      << "a sheet goes before an attribute";
  for (const char* odd : {"", "{", "}", "a{", ".a", ".a{display", "/*", ".{display:none}", "#{display:none}",
                          "{display:none}", ",{display:none}", "@", "@a{{}", ";"})
    EXPECT_NEAR(styled(odd, "class=\"a\""), 9, 1e-9) << odd;
  EXPECT_NEAR(
      area("<style>.s{stroke-width:4;stroke-linecap:butt}</style><path class=\"s\" d=\"M10 10 L30 10\"/>"),
      80, 1e-9)
      << "strokes, too";
}

TEST_F(SvgDrawing, WhatIsHiddenIsNotThereByNameEither) {
  const std::string layer =
      "<g inkscape:groupmode=\"layer\" inkscape:label=\"cut\" id=\"c\" style=\"display:none\">" + square(3) +
      "</g>" + square(1);
  EXPECT_EQ(area(layer, {"", "cut"}), 0);
  EXPECT_TRUE(is_there_);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0],
            "this import is empty: the layer 'cut' is hidden in FILE; make it visible in the program that "
            "made the file");
  EXPECT_EQ(area(layer, {"nobody", ""}), 0);
  EXPECT_FALSE(is_there_);
}

TEST_F(SvgDrawing, UsesAreFollowed) {
  const std::string defined = "<defs>" + square(3, "id=\"a\"") + "</defs>";
  EXPECT_EQ(area(defined), 0);
  expect_box(defined + "<use href=\"#a\" x=\"10\" y=\"20\"/>", {10, 20, 13, 23});
  expect_box(defined + "<use xlink:href=\"#a\" x=\"10\"/>", {10, 0, 13, 3});
  expect_box(defined + "<use href=\"#a\" x=\"10\" y=\"20\" transform=\"scale(2)\"/>", {20, 40, 26, 46});
  expect_box("<defs><g id=\"b\" transform=\"translate(1,1)\"><use href=\"#a\" x=\"5\"/></g></defs>" +
                 defined + "<g transform=\"scale(3)\"><use href=\"#b\" y=\"1\"/></g>",
             {18, 6, 27, 15});
  // What is drawn where it stands as well.
  EXPECT_NEAR(area(square(3, "id=\"a\"") + "<use href=\"#a\" x=\"10\"/>"), 18, 1e-9);
  // Hidden by the use, by itself, but not by what is around it.
  EXPECT_EQ(area(defined + "<use href=\"#a\" display=\"none\"/>"), 0);
  EXPECT_EQ(area(defined + "<use href=\"#a\" visibility=\"hidden\"/>"), 0);
  EXPECT_EQ(area("<defs>" + square(3, "id=\"a\" style=\"display:none\"") + "</defs><use href=\"#a\"/>"), 0);
  EXPECT_NEAR(area("<g style=\"display:none\">" + square(3, "id=\"a\"") + "</g><use href=\"#a\"/>"), 9, 1e-9);
  // Selected as a whole.
  EXPECT_NEAR(area(defined + "<use id=\"u\" href=\"#a\"/><use href=\"#a\" x=\"9\"/>", {"u", ""}), 9, 1e-9);
  EXPECT_TRUE(file_.warnings.empty());
}

TEST_F(SvgDrawing, SymbolsHaveViewports) {
  const std::string box = "viewBox=\"0 0 10 10\"";
  EXPECT_EQ(area("<symbol id=\"s\">" + square(3) + "</symbol>"), 0);
  expect_box("<symbol id=\"s\">" + square(3) + "</symbol><use href=\"#s\" x=\"7\"/>", {7, 0, 10, 3});
  expect_box("<symbol id=\"s\" " + box + ">" + square(10) +
                 "</symbol><use href=\"#s\" x=\"7\" y=\"1\" width=\"20\" height=\"20\"/>",
             {7, 1, 27, 21});
  expect_box(
      "<symbol id=\"s\" " + box + ">" + square(10) + "</symbol><use href=\"#s\" width=\"20\" height=\"40\"/>",
      {0, 10, 20, 30});
  expect_box("<symbol id=\"s\" " + box + " preserveAspectRatio=\"none\">" + square(10) +
                 "</symbol><use href=\"#s\" width=\"20\" height=\"40\"/>",
             {0, 0, 20, 40});
  expect_box("<symbol id=\"s\" " + box + ">" + square(10) + "</symbol><use href=\"#s\"/>", {0, 0, 100, 100});
  expect_box("<symbol id=\"s\" " + box + ">" + square(10) +
                 "</symbol><use href=\"#s\" width=\"50%\" height=\"50%\"/>",
             {0, 0, 50, 50});
  expect_box("<defs><svg id=\"s\" viewBox=\"5 5 10 10\" width=\"30\" height=\"30\">" + square(10) +
                 "</svg></defs><use href=\"#s\"/>",
             {-15, -15, 15, 15});
}

TEST_F(SvgDrawing, UsesAreBounded) {
  const std::clock_t start = std::clock();
  EXPECT_EQ(fault("<g id=\"a\"><use href=\"#a\"/></g>"), "import: FILE: a <use> of '#a' is in what it uses");
  EXPECT_EQ(fault("<defs><g id=\"a\"><use href=\"#b\"/></g><g id=\"b\"><use href=\"#a\"/></g></defs><use "
                  "href=\"#a\"/>"),
            "import: FILE: a <use> of '#a' is in what it uses");
  EXPECT_EQ(fault("<use id=\"a\" href=\"#a\"/>"), "import: FILE: a <use> of '#a' is in what it uses");
  if (samples::is_sanitized) return;  // what follows takes a minute there
  std::string wide = "<defs>" + square(1, "id=\"w0\""), deep = "<defs>" + square(1, "id=\"d0\"");
  for (int i = 1; i < 30; ++i) {
    wide += "<g id=\"w" + std::to_string(i) + "\">";
    for (int k = 0; k < 10; ++k) wide += "<use href=\"#w" + std::to_string(i - 1) + "\"/>";
    wide += "</g>";
  }
  for (int i = 1; i < 3000; ++i)
    deep += "<use id=\"d" + std::to_string(i) + "\" href=\"#d" + std::to_string(i - 1) + "\"/>";
  EXPECT_EQ(fault(wide + "</defs><use href=\"#w29\"/>"),
            "import: FILE: its <use> elements draw more than 1000000 elements");
  EXPECT_EQ(fault(deep + "</defs><use href=\"#d2999\"/>"),
            "import: FILE: <use> elements use each other more than 100 deep");
  std::string transforms = "<g transform=\"";
  for (int i = 0; i < 300'000; ++i) transforms += "scale(1) ";
  EXPECT_EQ(fault(transforms + "\">" + square(1) + "</g>"), "");
  EXPECT_LT(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC, 60) << "seconds of the processor";
}

TEST_F(SvgDrawing, WhatDrawsNothingIsNotDrawn) {
  for (const char* name : {"defs", "clipPath", "mask", "pattern", "marker", "symbol", "linearGradient",
                           "metadata", "title", "filter"})
    EXPECT_NEAR(area("<" + std::string(name) + ">" + square(3) + "</" + name + ">" + square(1)), 1, 1e-9)
        << name;
  EXPECT_TRUE(file_.warnings.empty());
  EXPECT_NEAR(area("<inkscape:path-effect>" + square(3) + "</inkscape:path-effect><a>" + square(1) + "</a>"),
              1, 1e-9);
  EXPECT_NEAR(area("<switch><foreignObject requiredExtensions=\"x\"/><g>" + square(2) + "</g>" + square(9) +
                   "</switch>"),
              4, 1e-9)
      << "the first that can be";
  EXPECT_TRUE(file_.warnings.empty());
}

TEST_F(SvgDrawing, WhatIsNotReadIsOneWarning) {
  EXPECT_NEAR(area(square(1) + "<text>a<tspan>b</tspan></text><image/><text>c</text><flowRoot><flowRegion>" +
                   square(9) + "</flowRegion></flowRoot>"),
              1, 1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0],
            "4 things in FILE are not read: 1 flowRoot, 1 image, 2 text. The result lacks them; convert them "
            "to paths in the program that "
            "made the file, or delete them there");
  area(
      "<text display=\"none\">a</text><g "
      "visibility=\"hidden\"><text>b</text></g><defs><text>c</text></defs>" +
      square(1));
  EXPECT_TRUE(file_.warnings.empty());
  area(
      "<defs><text id=\"t\">c</text></defs><use href=\"#t\"/><use href=\"#t\"/><use href=\"#x\"/><use "
      "href=\"y.svg#z\"/>");
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0].find("3 things in FILE are not read: 1 text, 1 use of an element that is not "
                                   "there, 1 use of another file. The result"),
            0U)
      << file_.warnings[0];
  EXPECT_NEAR(area("<g clip-path=\"url(#c)\">" + square(2) + "</g>" + square(1, "style=\"mask:none\"")), 5,
              1e-9);
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0].find("1 thing in FILE is not read: 1 clip-path (nothing is cut off). The "
                                   "result lacks it; convert it to paths"),
            0U)
      << file_.warnings[0];
  area("<path d=\"M0 0L9 9\" style=\"marker-end:url(#m)\"/>");
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_EQ(file_.warnings[0].find("1 thing in FILE is not read: 1 marker of a line."), 0U)
      << file_.warnings[0];
}

/// Shares of the viewport as SVG 1.1 (7.10) has them: of its width, its height, or their quadratic mean.
TEST_F(SvgDrawing, PercentagesAreSharesOfTheViewport) {
  expect_box("<rect x=\"10%\" y=\"20%\" width=\"50%\" height=\"25%\"/>", {10, 20, 60, 45});
  expect_box("<circle cx=\"50%\" cy=\"50%\" r=\"10%\"/>", {40, 40, 60, 60});
  expect_box("<g id=\"a\">" + square(1) + "</g><use href=\"#a\" x=\"30%\" y=\"40%\"/>", {0, 0, 31, 41});
  // In a symbol they are shares of its view box: half of 10 units there, 4 times as large here.
  expect_box(
      "<symbol id=\"s\" viewBox=\"0 0 10 20\" preserveAspectRatio=\"none\"><rect width=\"50%\" "
      "height=\"50%\"/></symbol>"
      "<use href=\"#s\" width=\"40\" height=\"40%\"/>",
      {0, 0, 20, 20});
  file_.write(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"30mm\" height=\"40mm\" viewBox=\"0 0 30 "
      "40\"><circle r=\"10%\"/></svg>");
  const double radius = 0.1 * std::hypot(30.0, 40.0) / std::sqrt(2.0);
  const auto drawings = import_svg(file_.path(), 72, false, {}, file_.remarks());
  EXPECT_NEAR(area_of(drawings->at(0)), 20 * radius * radius * std::sin(2 * std::acos(-1.0) / 40), 1e-9);
  EXPECT_NEAR(area("<polyline points=\"0,5 50,5\" style=\"stroke-width:2%;stroke-linecap:butt\"/>"), 100,
              1e-3);
  EXPECT_TRUE(file_.warnings.empty());
}

/// What is damaged, or in units that only a font knows, is told.
TEST_F(SvgDrawing, LengthsAndPathsThatAreNotReadAreTold) {
  const auto told = [&](const std::string& elements, double drawn, const std::string& kind) {
    EXPECT_NEAR(area(elements + square(1)), 1 + drawn, 1e-9) << elements;
    ASSERT_EQ(file_.warnings.size(), 1U) << elements;
    EXPECT_EQ(file_.warnings[0].find("1 thing in FILE is not read: 1 " + kind + ". The result lacks it"), 0U)
        << file_.warnings[0];
  };
  told("<rect width=\"2em\" height=\"3\"/>", 0, "rect with a length in 'em'");
  told("<rect x=\"wide\" width=\"2\" height=\"3\"/>", 0, "rect with a length that is none");
  told("<circle r=\"-1\"/>", 0, "circle with a negative length");
  told("<ellipse rx=\"1ex\" ry=\"2\"/>", 0, "ellipse with a length in 'ex'");
  told("<line x2=\"1rem\" y2=\"2\"/>", 0, "line with a length in 'rem'");
  told("<path d=\"M0 0H3V3H0ZM4 4H6V6H4ZL9 oops\"/>", 13, "path with damaged data 'd' (drawn up to there)");
  told("<path d=\"oops\"/>", 0, "path with damaged data 'd' (drawn up to there)");
  told("<polygon points=\"0,0 2,0 2,2 0,2 7\"/>", 4, "polygon with damaged points (drawn up to there)");
  told("<polygon points=\"0,0 2,0 2,2 x 0,2\"/>", 2, "polygon with damaged points (drawn up to there)");
  told("<g id=\"a\"/><use href=\"#a\" x=\"2em\"/>", 0, "use with a length in 'em'");
  area("<polyline points=\"0,5 50,5\" stroke-width=\"1em\"/>");
  ASSERT_EQ(file_.warnings.size(), 1U);
  EXPECT_NE(file_.warnings[0].find("1 polyline with a stroke-width that is not read (drawn 1 wide)."),
            std::string::npos)
      << file_.warnings[0];
  for (const char* sound : {"<path d=\"M0 0H3V3z \n\"/>", "<path d=\"\"/>", "<path d=\"none\"/>", "<path/>",
                            "<rect rx=\"auto\" width=\"1\" height=\"0\"/>",
                            "<polygon points=\" 0,0 2,0,2,2 \"/>", "<circle r=\"0\"/>"}) {
    area(sound);
    EXPECT_TRUE(file_.warnings.empty()) << sound << ": " << file_.warnings[0];
  }
}

/// A drawing with everything, damaged at random, is an error or another drawing; never anything else.
TEST_F(SvgDrawing, DamagedDrawingsAreErrorsOrDrawings) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const std::string sound =
      "<style>.a{display:none}rect.b,#c{visibility:hidden}</style><defs><symbol id=\"s\" viewBox=\"0 0 9 "
      "9\">" +
      square(3, "class=\"a\"") +
      "</symbol><g id=\"g\"><use href=\"#s\" width=\"5\"/></g></defs><use href=\"#g\" x=\"1\" "
      "transform=\"rotate(30) scale(2)\"/>"
      "<path d=\"M1 1L5 1C6 2 7 3 5 5A2 2 0 0 1 3 5Z\"/><text>a</text><g clip-path=\"url(#c)\" "
      "style=\"display:inline\">" +
      square(1) + "</g>";
  ASSERT_EQ(fault(sound), "");
  int errors = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    std::string damaged = sound;
    for (int i = static_cast<int>(random() % 3); i >= 0; --i) {
      const std::size_t at = random() % damaged.size();
      switch (random() % 4) {
        case 0:
          damaged[at] = static_cast<char>(random());
          break;
        case 1:
          damaged[at] = std::array{'0', '9', 'e', '-', '#', 's', 'g', ':', '{', '}'}[random() % 10];
          break;
        case 2:
          damaged.erase(at, 1 + random() % 3);
          break;
        default:
          damaged.insert(at, std::array{"1e308", "-", "#g", "999999999", "%"}[random() % 5]);
      }
    }
    errors += fault(damaged).empty() ? 0 : 1;
  }
  EXPECT_GT(errors, samples::rounds(50));
  EXPECT_LT(errors, 1950);
}

}  // namespace
}  // namespace bsp2::model
