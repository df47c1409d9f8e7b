#include "bsp2/model/expression/csg.hpp"

#include <gtest/gtest.h>

#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>
#include <sstream>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/line_finder.hpp"
#include "csg/csg_nodes.hpp"
#include "model/csg_helpers.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

std::string number(double x) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, x).ptr};
}

/// A small printer of expressions, so that what is parsed can be parsed again. Recursive: for shallow trees.
void print(const Expression& e, std::ostream& out);

void print(const Cuboid& box, std::ostream& out) {
  out << "cube(size = [" << number(box.size[0]) << ", " << number(box.size[1]) << ", " << number(box.size[2])
      << "], center = false);\n";
}

void print(const Lathe& lathe, std::ostream& out) {
  const auto &low = lathe.rings.front(), &high = lathe.rings.back();
  if (lathe.rings.size() > 2 || lathe.sides == 3 || lathe.sides == 4) {
    // Only spheres in the texts of these tests have such rings; the outermost ring tells the radius,
    // which is a multiple of 1/64.
    out << "sphere($fn = " << lathe.sides
        << ", $fa = 12, $fs = 2, r = " << number(std::round(64 * std::hypot(high.radius, high.z)) / 64)
        << ");\n";
    return;
  }
  out << "cylinder($fn = " << lathe.sides << ", $fa = 12, $fs = 2, h = " << number(high.z - low.z)
      << ", r1 = " << number(low.radius) << ", r2 = " << number(high.radius)
      << ", center = " << (low.z < 0 ? "true" : "false") << ");\n";
}

void print(const TriangleMesh& mesh, std::ostream& out) {
  out << "polyhedron(points = [";
  for (const auto& p : mesh.points)
    out << (&p == mesh.points.data() ? "[" : ", [") << number(p[0]) << ", " << number(p[1]) << ", "
        << number(p[2]) << "]";
  out << "], faces = [";
  for (const auto& t : mesh.triangles)
    out << (&t == mesh.triangles.data() ? "[" : ", [") << t[2] << ", " << t[1] << ", " << t[0] << "]";
  out << "], convexity = 1);\n";
}

void print(const RegularPolygon& polygon, std::ostream& out) {
  out << "circle($fn = " << polygon.sides << ", r = " << number(polygon.radius) << ");\n";
}

void print(const ConvexPolygon& polygon, std::ostream& out) {
  out << "polygon(points = [";
  for (const auto& p : polygon.points)
    out << (&p == polygon.points.data() ? "[" : ", [") << number(p[0]) << ", " << number(p[1]) << "]";
  out << "], paths = undef, convexity = 1);\n";
}

void print(const Round& round, std::ostream& out) {
  out << "round(" << number(round.bottom) << ", " << number(round.top) << ");\n";
}

void print(const Torus& torus, std::ostream& out) {
  out << "torus(" << number(torus.major) << ", " << number(torus.minor) << ");\n";
}

void print(const TellsOfItself auto& shape, std::ostream& out) {
  for (const double x : shape.numbers()) out << number(x) << ";\n";
}

void print(const Polytope& polytope, std::ostream& out) {
  out << "polytope of " << polytope.corners.size() << " coordinates;\n";
}

void print(const Primitive& primitive, std::ostream& out) {
  std::visit([&](const auto& shape) { print(shape, out); }, primitive);
}

void print(const Boolean& boolean, std::ostream& out) {
  const char* names[] = {"union", "intersection", "difference"};
  out << names[static_cast<int>(boolean.operation)] << "() {\n";
  for (const Expression& child : boolean.children) print(child, out);
  out << "}\n";
}

void print(const Transform& transform, std::ostream& out) {
  out << "multmatrix([";
  for (int i = 0; i < 16; ++i) out << (i % 4 == 0 ? (i ? "], [" : "[") : ", ") << number(transform.matrix[i]);
  out << "]]) {\n";
  print(transform.child, out);
  out << "}\n";
}

void print(const Coloured& coloured, std::ostream& out) {
  out << "color([";
  for (std::size_t i = 0; i < 4; ++i) out << (i > 0 ? ", " : "") << number(coloured.colour[i]);
  out << "]) {\n";
  print(coloured.child, out);
  out << "}\n";
}

void print(const Named& named, std::ostream& out) {
  out << (named.role == Named::Role::part ? "part(\"" : "measure(\"") << named.name << "\") {\n";
  print(named.child, out);
  out << "}\n";
}

void print(const Construction& construction, std::ostream& out) {
  const char* names[] = {"linear_extrude", "rotate_extrude", "offset", "hull",
                         "minkowski",      "projection",     "resize", "fill"};
  out << names[construction.construct.index()] << "() {\n";
  for (const Expression& operand : construction.operands) print(operand, out);
  out << "}\n";
}

void print(const Expression& e, std::ostream& out) {
  std::visit([&](const auto& value) { print(value, out); }, e.node().value);
}

std::string printed(const Expression& e) {
  std::ostringstream out;
  print(e, out);
  return out.str();
}

/// A random valid text, with all modifiers and empty things among its nodes.
std::string random_text(std::mt19937& random, int depth) {
  const auto pick = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto size = [&] { return number((1 + pick(999)) / 64.0); };
  std::string text = pick(30) == 0 ? "#" : pick(30) == 0 ? "%" : pick(40) == 0 ? "*" : "";
  if (pick(9) == 0) text += "// a comment\n /* and ** another */\n";
  if (depth == 0 || pick(6) == 0) {
    switch (pick(6)) {
      case 0:
        return text + "cube(size = [" + size() + "," + size() + ", " + size() +
               "], center = " + (pick(2) ? "true" : "false") + ");\n";
      case 1:
        return text + "sphere($fn = " + std::to_string(5 + pick(20)) + ", r = " + size() + ");";
      case 2:
        return text + "cylinder(center = true, r2 = " + size() + ", r1 = " + size() +
               ", $fn = " + std::to_string(5 + pick(20)) + ", h = " + size() + ");\n";
      case 3:
        return text + "group();\n";
      case 4:
        return text + "cube(size = 0, unknown = [1, [\"x\\\"y\", undef]]);";
      default:
        return text + "polyhedron(points = [[0, 0, 0], [" + size() +
               ", 0, 0], [0, 1, 0], [0, 0, 1]], faces = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [0, 2, 3]]);\n";
    }
  }
  const char* heads[] = {"group()",
                         "union()",
                         "difference()",
                         "intersection()",
                         "color([1, 0.5, 0, 1])",
                         "render(convexity = 3)",
                         "multmatrix"};
  const int head = pick(7);
  text += heads[head];
  if (head == 6)
    text += "([[1, 0, 0, " + size() + "], [0, -1, 0, " + size() + "], [0, 0.25, " + (pick(9) ? "1" : "0") +
            ", 0], [0, 0, 0, 1]])";
  text += " {";
  for (int children = pick(5); children > 0; --children) text += random_text(random, depth - 1);
  return text + "}\n";
}

TEST(Csg, PrintsAndParsesBack) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(1000); ++round) {
    std::string text;
    for (int i = 0; i < 3; ++i) text += random_text(random, 6);
    const Model model = parse(text);
    EXPECT_EQ(model.primitive_count, count_primitives(model.expression)) << text;
    if (is_empty(model.expression)) continue;
    const std::string once = printed(model.expression);
    const Model again = parse(once);
    ASSERT_EQ(printed(again.expression), once);
    EXPECT_EQ(again.primitive_count, model.primitive_count);
  }
}

TEST(Csg, EqualSubtreesAreOneNode) {
  const std::string part =
      "multmatrix([[1,0,0,1],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { difference() { cube(2); sphere(r = 1); } }";
  const Model model = parse("union() {" + part + " union() {" + part + " cube(9); } intersection() {" + part +
                            " cube(9); }}");
  const auto& top = std::get<Boolean>(model.expression.node().value);
  const auto& second = std::get<Boolean>(top.children[1].node().value);
  const auto& third = std::get<Boolean>(top.children[2].node().value);
  EXPECT_TRUE(top.children[0].same_node(second.children[0]));
  EXPECT_TRUE(top.children[0].same_node(third.children[0]));
  EXPECT_TRUE(second.children[1].same_node(third.children[1]));
  EXPECT_FALSE(top.children[1].same_node(top.children[2]));
  EXPECT_EQ(model.primitive_count, 8u);
}

/// What the text means, as a text of the printer.
std::string meaning(const std::string& text) {
  const Model model = parse(text);
  return is_empty(model.expression) ? "empty" : printed(model.expression);
}

TEST(Csg, ModifiersAndEmptyChildrenMeanWhatOpenScadMeans) {
  const std::string a = "cube(1);", b = "cube(2);", c = "cube(3);";
  EXPECT_EQ(meaning("difference(){%" + a + b + c + "}"), meaning("difference(){" + b + c + "}"));
  EXPECT_EQ(meaning("difference(){*" + a + b + c + "}"), meaning("difference(){" + b + c + "}"));
  EXPECT_EQ(meaning("difference(){group();" + b + c + "}"), "empty");
  EXPECT_EQ(meaning("difference(){" + a + "group();" + c + "cube(0);}"),
            meaning("difference(){" + a + c + "}"));
  EXPECT_EQ(meaning("intersection(){" + a + "group();}"), "empty");
  EXPECT_EQ(meaning("intersection(){" + a + "%group();}"), meaning(a));
  EXPECT_EQ(meaning("intersection(){" + a + "}"), meaning(a));
  EXPECT_EQ(meaning("intersection();"), "empty");
  EXPECT_EQ(meaning("union(){" + a + "group(){} cube(0);}"), meaning(a));
  EXPECT_EQ(meaning("# union(){" + a + "#" + b + "}"), meaning("union(){" + a + b + "}"));
  // The subtree under ! alone, without what is above it; the first one counts; * hides it, % does not.
  EXPECT_EQ(meaning(a + "difference(){" + b + "!" + c + "}"), meaning(c));
  EXPECT_EQ(meaning("multmatrix([[2,0,0,0],[0,2,0,0],[0,0,2,0],[0,0,0,1]]){!" + a + "}" + b), meaning(a));
  EXPECT_EQ(meaning("!union(){" + a + "!" + b + "} !" + c), meaning("union(){" + a + b + "}"));
  EXPECT_EQ(meaning("*group(){!" + a + "}" + b), meaning(b));
  EXPECT_EQ(meaning("%group(){!" + a + "}" + b), meaning(a));
  EXPECT_EQ(meaning("!%" + a + b), meaning(a));
  EXPECT_EQ(meaning("*!" + a + b), meaning(b));
  EXPECT_EQ(meaning("%" + a), "empty");
  EXPECT_EQ(parse("!" + a + b + c).primitive_count, 1u);
}

TEST(Csg, ArgumentsHaveOpenScadsDefaults) {
  EXPECT_EQ(meaning("cube();"), meaning("cube(size=[1,1,1], center=false);"));
  EXPECT_EQ(meaning("cube([1,2,3]);"), meaning("cube(center = false, size = [1, 2, 3]);"));
  EXPECT_EQ(meaning("cube(size = undef);"), meaning("cube();"));
  EXPECT_EQ(meaning("cube([1,2,3], true);"),
            meaning("multmatrix([[1,0,0,-0.5],[0,1,0,-1],[0,0,1,-1.5]]){cube([1,2,3]);}"));
  EXPECT_EQ(meaning("sphere(5);"), meaning("sphere($fn = 0, $fa = 12, $fs = 2, r = 5);"));
  EXPECT_EQ(meaning("sphere(d = 5);"), meaning("sphere(r = 2.5);"));
  EXPECT_EQ(meaning("cylinder(4, 2, 3);"), meaning("cylinder(h = 4, r1 = 2, r2 = 3);"));
  EXPECT_EQ(meaning("cylinder(h = 4, r = 3);"), meaning("cylinder(h = 4, r1 = 3, r2 = 3, center = false);"));
  EXPECT_EQ(meaning("cylinder(h = 4, d1 = 3, d2 = 1);"), meaning("cylinder(h = 4, r1 = 1.5, r2 = 0.5);"));
  EXPECT_EQ(meaning("multmatrix() {cube();}"),
            meaning("multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) {cube();}"));
  EXPECT_EQ(meaning("multmatrix(m = [[2,0,0,2],[0,2,0,0],[0,0,2,0],[9,9,9,2]]) {cube();}"),
            meaning("multmatrix([[1,0,0,1]]) {cube();}"));
  EXPECT_EQ(meaning("multmatrix([[1,0,0,0],[0,1,0,0],[0,0,nan,0],[0,0,0,1]]) {cube();}"), "empty");
  EXPECT_EQ(meaning("multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,0]]) {cube();}"), "empty");
  EXPECT_EQ(meaning("cube([1, -inf, 1]);"), "empty");
  EXPECT_EQ(meaning("sphere(r = -nan);"), "empty");
  EXPECT_EQ(meaning("cylinder(h = 1, r1 = 1, r2 = -1);"), "empty");
  EXPECT_EQ(meaning("color(\"Red\") cube();"), meaning("color([1, 0, 0, 1]) cube();"));
  EXPECT_EQ(meaning("color(\"yellowgreen\", 0.5) cube();"),
            meaning("color(\"#9acd32\", alpha = 0.5) cube();"));
  EXPECT_EQ(meaning("color(\"#f08\") cube();"), meaning("color(\"#FF0088\") cube();"));
  EXPECT_EQ(meaning("color(\"#f083\") cube();"), meaning("color(\"#ff008833\") cube();"));
  EXPECT_EQ(meaning("color(\"transparent\") cube();"), meaning("color([0, 0, 0, 0]) cube();"));
  for (const std::string none : {"reds", "", "#", "#ff", "#ff000", "#ff00zz", "#ff0088ff0", "yellowgreenx"}) {
    EXPECT_EQ(meaning("color(\"" + none + "\") cube();"), meaning("cube();")) << none;
    EXPECT_EQ(parse("color(\"" + none + "\") cube();").warnings.size(), 1U) << none;
  }
  // OpenSCAD reads numbers up to the first that is none.
  for (const auto& [size, taken] : {std::pair("[2, 3]", "[1, 1, 1]"),
                                    {"[\"a\", 5, 6]", "[1, 1, 1]"},
                                    {"[2, 3, undef]", "[2, 3, 1]"},
                                    {"[2, [3], 4]", "[2, 1, 1]"},
                                    {"true", "[1, 1, 1]"}}) {
    const std::string given = std::string("cube(size = ") + size + ");";
    EXPECT_EQ(meaning(given), meaning(std::string("cube(") + taken + ");")) << given;
    EXPECT_EQ(parse(given).warnings.size(), 1U) << given;
  }
  EXPECT_EQ(parse(" square([2, true]);").warnings,
            (std::vector<std::string>{"test.csg:1:2: the size of this square is neither a number nor a "
                                      "vector of two numbers; it is taken to be [1, 1]"}));
  EXPECT_EQ(parse("sphere(r = -1);").warnings,
            (std::vector<std::string>{"test.csg:1:1: this sphere is empty: its radius is -1"}));
}

TEST(Csg, ReadsNumbersToTheNearestDouble) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937_64 random(seed);
  for (int round = 0; round < 20'000; ++round) {
    double value = 0;
    do {
      const std::uint64_t bits = random() & ~(std::uint64_t{1} << 63);
      std::memcpy(&value, &bits, sizeof value);
      if (round % 2)
        value =
            static_cast<double>(random() % 100'000'000) / std::pow(10.0, static_cast<double>(random() % 12));
    } while (!std::isfinite(value) || value == 0);
    char text[40];
    std::snprintf(text, sizeof text, round % 3 == 0 ? "%.17g" : round % 3 == 1 ? "%.6g" : "%.12g", value);
    const Model model = parse("cube([" + std::string(text) + ", 1.50, +1.e0]);");
    const double expected = std::strtod(text, nullptr);
    if (std::isinf(expected)) continue;
    const auto& box = std::get<Cuboid>(std::get<Primitive>(model.expression.node().value));
    EXPECT_EQ(box.size, (std::vector<double>{expected, 1.5, 1})) << text;
  }
  EXPECT_EQ(meaning("cube(1e-400);"), "empty");
  EXPECT_EQ(meaning("cube(1e400);"), "empty");
  EXPECT_EQ(meaning("cube(.5);"), meaning("cube(0.5);"));
}

TEST(Csg, ErrorsSayWhere) {
  const std::string source(source_hint);
  EXPECT_EQ(message("cube();\n\n  warp(size = [1, 1]);"), "test.csg:3:3: there is no node 'warp'");
  EXPECT_EQ(message("group() {\n\tcubee(); }"),
            "test.csg:2:2: there is no node 'cubee'; did you mean 'cube'?");
  EXPECT_EQ(message("cube() sphere();"),
            "test.csg:1:8: expected ';' or '{' after 'cube(...)', found 'sphere'");
  EXPECT_EQ(message("cube(text = \"\xC3\xA4\xC3\xB6\") x"),
            "test.csg:1:19: expected ';' or '{' after 'cube(...)', found 'x'");
  EXPECT_EQ(message("translate([1, 2, 3]) {}"),
            "test.csg:1:1: 'translate' is no node of a .csg file" + source);
  EXPECT_EQ(message("module a() { cube(); }"),
            "test.csg:1:8: expected '(' after the name of a node, found 'a'" + source);
  EXPECT_EQ(message("for (i = [0:3]) cube();"),
            "test.csg:1:12: expected ',' or ']' in a vector, found ':'" + source);
  EXPECT_EQ(message("x = 5; cube(x);"),
            "test.csg:1:3: expected '(' after the name of a node, found '='" + source);
  EXPECT_EQ(message("cube(2 / 3);"),
            "test.csg:1:8: expected ',' or ')' in the arguments, found '/'" + source);
  EXPECT_EQ(message("translate([1, 2, 3]) cube();"),
            "test.csg:1:22: expected ';' or '{' after 'translate(...)', found 'cube'" + source);
  EXPECT_EQ(message("\xFF\xFE"
                    "c\1u\1"),
            "test.csg:1:1: this text is UTF-16; save it as UTF-8");
  EXPECT_EQ(message("union() {\n group() {\n"),
            "test.csg:3:1: the text ends inside 'group' of 2:2; a '}' is missing, or the file is cut off");
  EXPECT_EQ(message("cube(); }"), "test.csg:1:9: this '}' closes nothing");
  EXPECT_EQ(message("cube(size = abc);"),
            "test.csg:1:13: expected a value, found 'abc'; a .csg file holds numbers, not names" + source);
  EXPECT_EQ(message("cube(1.2.3);"), "test.csg:1:6: this is not a number");
  EXPECT_EQ(message("\x7F"
                    "ELF"),
            "test.csg:1:1: expected a node, found the byte 0x7F");
  EXPECT_EQ(message("// nothing"), "test.csg: holds no model: there is no node in it");
  EXPECT_EQ(message("group() { sphere($fn = 1e9); }"),
            "test.csg:1:11: 1e+09 sides asked for ($fn = 1e+09, $fa = 12, $fs = 2, radius 1); the limit is "
            "200000");
  EXPECT_EQ(message("offset($fn = 1e9) { square(1); }"),
            "test.csg:1:1: 1e+09 sides asked for ($fn = 1e+09, $fa = 12, $fs = 2, radius 1); the limit is "
            "200000");
  EXPECT_EQ(message("offset(r = 1, $fn = 1e9) { square(1); }"),
            "test.csg:1:1: 1e+09 sides asked for ($fn = 1e+09, $fa = 12, $fs = 2, radius 1); the limit is "
            "200000");
  EXPECT_EQ(message("linear_extrude(height = 1, twist = 9, slices = 1e9) { square(1); }"),
            "test.csg:1:1: 1e+09 slices asked for; the limit is 200000");
  EXPECT_EQ(message("cube(1) cube(2);"), "test.csg:1:9: expected ';' or '{' after 'cube(...)', found 'cube'");
  EXPECT_EQ(message("group() }"), "test.csg:1:9: expected ';' or '{' after 'group(...)', found '}'");
  EXPECT_EQ(message("group() union()"),
            "test.csg:1:16: expected ';' or '{' after 'union(...)', found the end of the text");
  EXPECT_EQ(message("group();"), "no error");
}

TEST(Csg, PolygonsTakePairsAndAnEmptyListOfPathsIsNone) {
  EXPECT_TRUE(parse("polygon([[0,0],[4,0],[4,4]], paths = []);").warnings.empty());
  EXPECT_EQ(parse("polygon([[0,0],[4,0],[4,4]], paths = []);").primitive_count, 1U);
  EXPECT_EQ(parse("polygon([[0,0,1],[4,0,1],[4,4,1]]);").primitive_count, 0U);
}

/// OpenSCAD 2021.01 passes over empty solids everywhere, over empty areas only if the first child and one
/// more are something.
TEST(Csg, PlaneMinkowskiSumsOfNothingAreEmpty) {
  const auto count = [](const std::string& children) {
    return parse("minkowski() { " + children + " }").primitive_count;
  };
  EXPECT_EQ(count("square(2); circle(0);"), 0U);
  EXPECT_EQ(count("circle(0); square(2); circle(1);"), 0U);
  EXPECT_EQ(count("square(2); group();"), 0U);
  EXPECT_EQ(count("square(2); circle(0); circle(1);"), 2U);
  EXPECT_EQ(count("square(2); circle(1); group();"), 2U);
  EXPECT_EQ(count("square(2);"), 1U);
  EXPECT_EQ(count("cube(2); cube(0);"), 1U);
  EXPECT_EQ(count("cube(0); cube(2);"), 1U);
}

/// In any order of the places, beside a count from the beginning for each.
TEST(LineFinder, CountsLinesAndCharacters) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(20); ++round) {
    const unsigned newlines = round % 3 == 0 ? 0 : round % 3 == 1 ? 3 : 400;
    std::string text;
    while (text.size() < 20'000)
      text += random() % 500 < newlines ? "\n" : random() % 4 == 0 ? "\xC3\xA4" : "x";
    LineFinder finder(text);
    for (int look = 0; look < 50; ++look) {
      const std::size_t offset = look == 0 ? text.size() : random() % (text.size() + 1);
      std::size_t line = 1, column = 1;
      for (std::size_t i = 0; i < offset; ++i) {
        column = text[i] == '\n' ? 1 : column + (text[i] != '\xA4');
        line += text[i] == '\n';
      }
      ASSERT_EQ(finder.at(offset), std::to_string(line) + ":" + std::to_string(column));
    }
  }
}

TEST(Csg, PartsAreThePrimitivesOfTheSource) {
  const Model model = parse(
      "square(1);\n%circle(1);\ngroup() { circle(0); polygon([[0,0],[2,0],[2,2],[1,1],[0,2]]); cube(1); }\n  "
      "hull() { square(2); circle(3); }");
  ASSERT_EQ(model.primitive_count, 4U);
  EXPECT_EQ(model.expression.node().parts, 4U);
  const auto all = [&](const std::string& text) {
    const Model read = parse(text);
    EXPECT_EQ(read.expression.node().parts, read.primitive_count);
    std::string places;
    for (const std::size_t offset : read.part_offsets) places += place_in(text, "a", offset) + " ";
    return places;
  };
  EXPECT_EQ(all("cube(1);\n sphere(0);\n  sphere(1);"), "a:1:1 a:3:3 ") << "what is empty is no part";
  EXPECT_EQ(all("cube(1);\n group() { square(1); }\n !group() { cube(1); %cube(2); cube(3); }\n cube(9);"),
            "a:3:13 a:3:32 ");
  EXPECT_EQ(all("cube(1);\n square(1); union() { cube(2); cube(3); } difference() { sphere(0); cube(4); } "
                "cube(5);"),
            "a:1:1 a:2:23 a:2:32 a:2:80 ");
  EXPECT_EQ(all("group() { polygon([[0,0],[2,0],[2,2],[1,1],[0,2]]);\n square(9); }"), "a:1:11 a:2:2 ")
      << "in several pieces";
}

TEST(Csg, WhatTakesNoPartNeedNotBeSupported) {
  EXPECT_EQ(meaning("group() difference() { union() group() cube(1); *group() cube(2); } cube(3);"),
            meaning("group() { difference() { union() { group() { cube(1); } } } } cube(3);"));
  EXPECT_EQ(meaning("%linear_extrude(height = 3) { square(1); } *text(\"x\"); cube(1);"),
            meaning("cube(1);"));
  EXPECT_EQ(meaning("hull() { cube(); !sphere(); } minkowski();"), meaning("sphere();"));
  EXPECT_EQ(message("!warp() { cube(); } cube();"), "test.csg:1:2: there is no node 'warp'");
}

TEST(Csg, DeepTextsNeedNoCallStack) {
  const auto nested = [](const std::string& open, int depth, const std::string& inside,
                         const std::string& close) {
    std::string text;
    for (int i = 0; i < depth; ++i) text += open;
    text += inside;
    for (int i = 0; i < depth; ++i) text += close;
    return text;
  };
  EXPECT_EQ(parse(nested("group(){", 1'000'000, "cube();", "}")).primitive_count, 1u);
  EXPECT_EQ(parse(nested("multmatrix([[1,0,0,1]]){", 200'000, "cube();", "}")).primitive_count, 1u);
  EXPECT_EQ(parse(nested("difference(){cube(5);", 200'000, "cube();", "}")).primitive_count, 200'001u);
  EXPECT_EQ(meaning("cube(size = " + nested("[", 1'000'000, "", "]") + ");"), meaning("cube();"));
  EXPECT_NE(message(nested("group(){", 100'000, "", "")).find("a '}' is missing"), std::string::npos);
}

TEST(Csg, DamagedTextsAreReadOrRejectedButNeverCrash) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const std::string alphabet = "(){}[];,=.-+eE\"\\/*%#!$ \n0123456789abcsuv\x80\xFF" + std::string(1, '\0');
  int taken = 0;
  for (int round = 0; round < samples::rounds(5000); ++round) {
    std::string text = random_text(random, 4);
    for (int edits = 1 + static_cast<int>(random() % 4); edits > 0 && !text.empty(); --edits) {
      const std::size_t at = random() % text.size();
      switch (random() % 5) {
        case 0:
          text[at] = alphabet[random() % alphabet.size()];
          break;
        case 1:
          text.erase(at, 1 + random() % 5);
          break;
        case 2:
          text.insert(at, 1, alphabet[random() % alphabet.size()]);
          break;
        case 3:
          text.insert(at, text.substr(random() % text.size(), random() % 30));
          break;
        default:
          text.resize(at);
      }
    }
    try {
      parse(text);
      ++taken;
    } catch (const Error& error) {
      EXPECT_EQ(std::string(error.what()).rfind("test.csg:", 0), 0u);
    }
  }
  EXPECT_GT(taken, 0);
}

TEST(Csg, FilesThatAreNone) {
  EXPECT_THROW(read_csg("/no/such/file.csg"), Error);
  EXPECT_THROW(read_csg(std::filesystem::temp_directory_path()), Error);
  const auto path = std::filesystem::temp_directory_path() /
                    ("bsp2_empty_" + std::to_string(std::random_device{}()) + ".csg");
  std::ofstream(path).close();
  EXPECT_THROW(read_csg(path), Error);
  std::ofstream(path) << "cube();";
  EXPECT_EQ(read_csg(path).primitive_count, 1u);
  std::filesystem::remove(path);
}

TEST(Csg, ExamplesParse) {
  const std::filesystem::path folder = std::filesystem::path(BSP2_SOURCE_DIR) / "examples";
  EXPECT_EQ(read_csg(folder / "leaning_tower.csg").primitive_count, 2609u);
  EXPECT_EQ(read_csg(folder / "mechanical_piece.csg").primitive_count, 7u);
  EXPECT_EQ(read_csg(folder / "menger_sponge.csg").primitive_count, 28u);
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".csg") continue;
    EXPECT_GT(read_csg(entry.path()).primitive_count, 0u) << entry.path();
  }
}

/// The collection of models that lies beside a developer's source tree, if it does.
TEST(Csg, CorpusModelsOfLevel0Parse) {
  const char* variable = std::getenv("BSP2_SHARED");
  const std::filesystem::path shared =
      variable ? variable : std::filesystem::path(BSP2_SOURCE_DIR).parent_path() / "shared";
  std::ifstream manifest(shared / "corpus" / "csg" / "manifest.tsv");
  if (!manifest) GTEST_SKIP() << "no corpus at " << shared;
  int models = 0;
  for (std::string line; std::getline(manifest, line);) {
    std::vector<std::string> fields;
    std::istringstream stream(line);
    for (std::string field; std::getline(stream, field, '\t');) fields.push_back(field);
    if (fields.size() < 15 || fields[7] != "0") continue;
    SCOPED_TRACE(fields[0]);
    const Model model = read_csg(shared / "corpus" / "csg" / fields[0]);
    EXPECT_EQ(std::to_string(model.primitive_count), fields[8]);
    const auto* primitive = std::get_if<Primitive>(&model.expression.node().value);
    if (primitive && !fields[14].empty()) {
      const double expected = std::stod(fields[14]);
      EXPECT_NEAR(volume(model.expression), expected, 1e-6 * expected);
    }
    ++models;
  }
  EXPECT_GT(models, 0);
}

}  // namespace
}  // namespace bsp2::model
