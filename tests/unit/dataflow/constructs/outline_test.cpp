// Constructs that trace the outline of what they are made of: they make the same of it whatever is merged,
// and tell of no clean profile that anything of it is lost.

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/model/expression/csg.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

struct Outcome {
  double content = 0, seconds = 0;  // of this thread's processor time
  std::vector<std::string> warnings;
};

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

template <int D>
Outcome outcome_of(const model::Model& model, double coincidence) {
  Outcome outcome;
  const double start = processor_seconds();
  const auto network = compile<D>(model.expression, {.coincidence = coincidence});
  outcome.warnings = network.warnings;
  outcome.content = evaluate_all(network, 0, {}).evaluation.totals.in.value().volume();
  outcome.seconds = processor_seconds() - start;
  return outcome;
}

Outcome outcome_of(const std::string& text, double coincidence) {
  const model::Model model = model::parse_csg(text, "test.csg");
  return model.expression.dimension() == 2 ? outcome_of<2>(model, coincidence)
                                           : outcome_of<3>(model, coincidence);
}

std::string turned(double degrees, double x, double y, const std::string& child) {
  std::ostringstream text;
  text.precision(17);
  const double c = model::cosine(degrees), s = model::sine(degrees);
  text << "multmatrix([[" << c << ", " << -s << ", 0, " << x << "], [" << s << ", " << c << ", 0, " << y
       << "], [0, 0, 1, 0], [0, 0, 0, 1]]) { " << child << " } ";
  return text.str();
}

/// Regular polygons turned so that edges fall upon edges, but for rounding; boxes and letters of boxes among
/// them.
std::string random_shape(Random& random) {
  const int sides = pick(random, 3, 8);
  const double step = 360.0 / sides;
  const std::string polygon = "circle($fn = " + std::to_string(sides) + ", r = 10); ";
  std::ostringstream text;
  text.precision(17);
  switch (pick(random, 0, 3)) {
    case 0:
      text << polygon << turned(step * pick(random, 1, sides), 0, 0, polygon);
      break;
    case 1:  // the second one outside, edge to edge
      text << polygon
           << turned(180 + step / 2 * pick(random, 0, 1), 20 * model::cosine(step / 2), 0,
                     turned(step / 2, 0, 0, polygon));
      break;
    case 2:
      text << "difference() { group() { " << polygon << turned(step, 0, 0, polygon) << "} "
           << turned(2 * step, 0, 0, "circle($fn = " + std::to_string(sides) + ", r = 5);") << "} ";
      break;
    default:  // letters: bars that overlap and touch
      for (int bar = 0; bar < 4; ++bar)
        text << turned(pick(random, 0, 3) * 30, 0.1 * pick(random, -50, 50), 0.1 * pick(random, -50, 50),
                       chance(random, 0.5) ? "square([1.7, 9.3]); " : "square([9.3, 1.7]); ");
  }
  return turned(uniform(random, 0, 360), 0, 0, text.str());
}

/// The shape to the right of the axis.
std::string profile(const std::string& shape) { return turned(0, 30, 0, shape); }

TEST(Outlines, DoNotDependOnWhatIsMerged) {
  const std::uint64_t seed = new_seed();
  Random random(seed);
  for (int round = 0; round < samples::rounds(12); ++round) {
    const std::string shape = random_shape(random);
    const std::vector<std::string> models{
        "fill() { " + shape + "}",
        "offset(r = 1.5, $fn = 8) { " + shape + "}",
        "offset(delta = -0.4) { " + shape + "}",
        "roof(method = \"straight\") { " + shape + "}",
        "rotate_extrude($fn = 6) { " + profile(shape) + "}",
        "rotate_extrude(angle = 100, $fn = 9) { " + profile(shape) + "}",
        "linear_extrude(height = 5, twist = 60, slices = 3) { " + shape + "}",
        "linear_extrude(height = 5, scale = [0.5, 1.2], slices = 2) { " + shape + "}",
        "linear_extrude(height = 5, scale = 0.3) { " + shape + "}",
        "linear_extrude(height = 7) { " + shape + "}",
        "hull() { " + shape + "}",
        "minkowski() { group() { " + shape + "} square(1); }"};
    for (const std::string& text : models) {
      const Outcome merged = outcome_of(text, 1e-9), exact = outcome_of(text, 0);
      ASSERT_GT(merged.content, 1) << text << " seed " << seed;
      EXPECT_NEAR(exact.content, merged.content, 1e-9 * merged.content)
          << text << " seed " << seed << " round " << round;
      EXPECT_TRUE(merged.warnings.empty()) << merged.warnings.front() << "\n" << text << " seed " << seed;
      EXPECT_TRUE(exact.warnings.empty()) << exact.warnings.front() << "\n" << text << " seed " << seed;
    }
  }
}

/// Edges of two bars are in one line but for rounding. Once they are moved there is a step between them, or,
/// where the bars are then beside each other, a neck of no width: no piece is told of as too thin.
TEST(Outlines, AreMovedWithoutStepsAndNecks) {
  const auto bar = [](int degrees, int x, int y, const std::string& size) {
    return turned(degrees, x * 0.1, y * 0.1, "square(" + size + "); ");
  };
  const std::string long_bar = "[9.3, 1.7]", high_bar = "[1.7, 9.3]";
  const std::string with_step =
      "offset(delta = -0.4) { multmatrix([[-0.17869350079690668, 0.98390478846936502, 0, 0], "
      "[-0.98390478846936502, -0.17869350079690668, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { " +
      bar(60, -16, -12, long_bar) + bar(30, 21, 38, high_bar) + bar(30, 17, 46, long_bar) +
      bar(0, -20, 28, long_bar) + "} }";
  const std::string with_neck =
      "offset(delta = -0.4) { multmatrix([[-0.336746652397588, 0.94159529103485751, 0, 0], "
      "[-0.94159529103485751, -0.336746652397588, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { " +
      bar(90, -20, -5, high_bar) + bar(90, -23, 49, high_bar) + bar(60, 13, -42, long_bar) +
      bar(0, -31, -44, high_bar) + "} }";
  for (const std::string& text : {with_step, with_neck}) {
    const Outcome merged = outcome_of(text, 1e-9), exact = outcome_of(text, 0);
    EXPECT_TRUE(merged.warnings.empty()) << merged.warnings.front() << "\n" << text;
    EXPECT_NEAR(exact.content, merged.content, 1e-9 * merged.content) << text;
  }
}

/// A clean profile of decimal numbers: what is horizontal stays horizontal, though its corners are rounded
/// each for itself.
TEST(Outlines, OfCleanLathesAreStraight) {
  const std::uint64_t seed = new_seed();
  Random random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    std::ostringstream text;
    text << "rotate_extrude($fn = 5, angle = " << (chance(random, 0.5) ? 360 : 90)
         << ") { polygon(points = [";
    // Down along the axis or an inner wall, then steps outwards and inwards on the way up.
    const double inner = chance(random, 0.5) ? 0 : 0.1 * pick(random, 1, 99);
    double z = 0.1 * pick(random, -200, 0);
    text << "[" << inner << ", " << z << "], ";
    for (int step = pick(random, 1, 5); step > 0; --step) {
      const double radius = inner + 0.1 * pick(random, 1, 150);
      text << "[" << radius << ", " << z << "], ";
      z += 0.1 * pick(random, 1, 120);
      text << "[" << radius << ", " << z << "], ";
    }
    text << "[" << inner << ", " << z << "]]); }";
    for (const double coincidence : {1e-9, 0.0}) {
      const Outcome outcome = outcome_of(text.str(), coincidence);
      EXPECT_GT(outcome.content, 0) << text.str() << " seed " << seed;
      EXPECT_TRUE(outcome.warnings.empty()) << outcome.warnings.front() << "\n"
                                            << text.str() << " seed " << seed;
    }
  }
}

/// Facets that fall upon each other but for rounding, slice after slice, as they do where a slice turns a
/// regular polygon into itself.
TEST(Outlines, OfTwistedPolygonsTakeNoLongerWhereNothingIsMerged) {
  const std::string polygon = turned(0, 4, 0, "circle($fn = 20, r = 8);");
  const std::string star =
      "polygon([[0, 10], [2, 3], [9, 3], [3, -1], [6, -8], [0, -3], [-6, -8], [-3, -1], "
      "[-9, 3], [-2, 3]]); ";
  for (const std::string& text :
       {"linear_extrude(height = 30, twist = 360, scale = [0, 0], slices = 20) { " + polygon + "}",
        "multmatrix([[1, 0, 0, 3], [0, 0.8, -0.6, 2], [0, 0.6, 0.8, 1], [0, 0, 0, 1]]) { "
        "linear_extrude(height = 30, twist = 360, slices = 20) { " +
            polygon + "} }",
        // Concave ones, and one with a hole.
        "linear_extrude(height = 30, scale = [0.5, 0.5], slices = 20) { " + star + "}",
        "linear_extrude(height = 30, scale = [0.5, 0.7], slices = 20) { " + star + "}",
        "linear_extrude(height = 30, twist = 90, scale = [0, 0], slices = 20) { " + star + "}",
        "linear_extrude(height = 30, twist = 180, scale = [0.3, 0.3], slices = 20) { difference() { "
        "circle($fn = 40, r = 14); " +
            polygon + "} }"}) {
    const Outcome merged = outcome_of(text, 1e-9), exact = outcome_of(text, 0);
    EXPECT_NEAR(exact.content, merged.content, 1e-9 * merged.content) << text;
    EXPECT_LE(exact.seconds, 3 * merged.seconds + 0.5)
        << "of processor time against " << merged.seconds << "; " << text;
  }
}

/// Nothing is absolute: an outline that is tiny or huge against the height keeps all its digits.
TEST(Outlines, OfAnySizeAreExtrudedAlike) {
  const std::string shape = "polygon([[0, 3], [1, 1], [4, 0], [1, -1], [0, -5], [-2, 0]]); ";
  for (const char* arguments : {"twist = 30, scale = [2, 2], slices = 5", "scale = [0.5, 3], slices = 4",
                                "twist = -70, slices = 7"}) {
    const auto content = [&](double size) {
      std::ostringstream text;
      text.precision(17);
      text << "linear_extrude(height = 3, " << arguments << ") { multmatrix([[" << size << ", 0, 0, 0], [0, "
           << size << ", 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]) { " << shape << "} }";
      return outcome_of(text.str(), 0).content / (size * size);
    };
    const double expected = content(1);
    for (const double size : {3e-9, 7e-6, 0.3, 1e5, 3e9, 1e12})  // corners are rounded to 1e-16 of the height
      EXPECT_NEAR(content(size), expected, 2e-11 * expected) << arguments << ", size " << size;
  }
}

/// Where primitives are flat, the message does not speak of a tolerance that is 0, nor of an option that is
/// given already.
TEST(Outlines, TellOfWhatIsFlatWithoutContradiction) {
  const auto warnings = [](int count, double coincidence) {
    std::string text;
    for (int i = 0; i < count; ++i)
      text += "multmatrix([[1, 0, 0, " + std::to_string(3 * i) +
              "], [0, 1, 0, 0], [0, 0, 1e-40, 0], [0, 0, 0, 1]]) { cube(1); } ";
    return compile<3>(model::parse_csg("cube(10); " + text, "test.csg").expression,
                      {.coincidence = coincidence})
        .warnings;
  };
  EXPECT_TRUE(warnings(0, 1e-9).empty());
  ASSERT_EQ(warnings(1, 1e-9).size(), 1);
  EXPECT_NE(warnings(1, 1e-9)[0].find("1 primitive is thinner than the tolerance, 1e-09 of the model, and "
                                      "left out: primitive 1, between"),
            std::string::npos)
      << warnings(1, 1e-9)[0];
  EXPECT_NE(warnings(2, 1e-9)[0].find("2 primitives are thinner than the tolerance, 1e-09 of the model, and "
                                      "left out: the first one is primitive 1, between"),
            std::string::npos)
      << warnings(2, 1e-9)[0];
  for (const int count : {1, 2})
    for (const std::string& text : warnings(count, 0)) {
      EXPECT_EQ(text.find("tolerance"), std::string::npos) << text;
      EXPECT_EQ(text.find("--coincidence"), std::string::npos) << text;
    }
}

}  // namespace
}  // namespace bsp2::dataflow
