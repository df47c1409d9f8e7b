// Children that a matrix flattens: their points count in hulls, sums and shadows, and nowhere else, which is
// told.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "bsp2/model/expression/csg.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

template <int D>
using Corners = std::vector<std::array<double, D>>;

struct Outcome {
  double content = 0;
  std::vector<std::string> warnings;  // of the reader, then of the compilation
};

template <int D>
Outcome outcome_of(const model::Expression& solid) {
  const auto network = compile<D>(solid, {});
  Outcome outcome{0, network.warnings};
  if (const auto total = evaluate_all(network, 0, {}).evaluation.totals.in.value(); !network.program.empty())
    outcome.content = total.volume();
  return outcome;
}

Outcome outcome_of(const std::string& text) {
  const model::Model model = model::parse_csg(text, "test.csg");
  Outcome outcome =
      model.expression.dimension() == 2 ? outcome_of<2>(model.expression) : outcome_of<3>(model.expression);
  outcome.warnings.insert(outcome.warnings.begin(), model.warnings.begin(), model.warnings.end());
  return outcome;
}

/// A node with the corners of its hull.
template <int D>
struct Child {
  std::string text;
  Corners<D> corners;
};

/// A 4 x 4 matrix of small integers, so that its rank is exact.
using WholeMap = std::array<std::array<int, 4>, 4>;

/// @param rank of what it does to the first D coordinates.
template <int D>
WholeMap random_map(Random& random, int rank) {
  WholeMap map{};
  std::array<std::array<int, D>, D> a{}, b{};
  for (int i = 0; i < D; ++i)
    for (int k = 0; k < rank; ++k) {
      a[i][k] = pick(random, -2, 2);
      b[k][i] = pick(random, -2, 2);
    }
  for (int i = 0; i < D; ++i) {
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < rank; ++k) map[i][j] += a[i][k] * b[k][j];
    map[i][3] = pick(random, -9, 9);
  }
  for (int i = D; i < 4; ++i) map[i][i] = 1;
  return map;
}

/// A projection along an axis, or a scaling or mirroring by 0 of one and more axes, as users write them.
template <int D>
WholeMap usual_map(Random& random) {
  WholeMap map{};
  for (int i = 0; i < 4; ++i) map[i][i] = i < D ? pick(random, -1, 1) : 1;
  map[pick(random, 0, D - 1)] = {};
  map[D - 1][3] = pick(random, 0, 5);
  map[3] = {0, 0, 0, 1};
  return map;
}

template <int D>
Child<D> mapped(const WholeMap& map, const Child<D>& child) {
  std::ostringstream text;
  text << "multmatrix([";
  for (const auto& row : map)
    text << "[" << row[0] << ", " << row[1] << ", " << row[2] << ", " << row[3] << "], ";
  text << "]) { " << child.text << " } ";
  Child<D> image{text.str(), {}};
  for (const auto& corner : child.corners) {
    auto& moved = image.corners.emplace_back();
    for (int i = 0; i < D; ++i) {
      moved[i] = map[i][3];
      for (int j = 0; j < D; ++j) moved[i] += map[i][j] * corner[j];
    }
  }
  return image;
}

template <int D>
Child<D> box(const std::array<int, 3>& size) {
  std::ostringstream text;
  if (D == 2)
    text << "square([" << size[0] << ", " << size[1] << "]); ";
  else
    text << "cube([" << size[0] << ", " << size[1] << ", " << size[2] << "]); ";
  Child<D> child{text.str(), {}};
  for (unsigned corner = 0; corner < 1u << D; ++corner) {
    auto& point = child.corners.emplace_back();
    for (int i = 0; i < D; ++i) point[i] = corner >> i & 1 ? size[i] : 0;
  }
  return child;
}

/// A box without the box at one of its corners: no union of primitives, so it has to be evaluated.
template <int D>
Child<D> notched_box(const std::array<int, 3>& size) {
  Child<D> child = box<D>(size);
  child.text = "difference() { " + child.text + (D == 2 ? "square" : "cube") + "(1); } ";
  child.corners.erase(child.corners.begin());
  for (int i = 0; i < D; ++i) child.corners.emplace_back()[i] = 1;
  return child;
}

Child<3> cone(int sides, int height) {
  Child<3> child{
      "cylinder(h = " + std::to_string(height) + ", r1 = 2, r2 = 1, $fn = " + std::to_string(sides) + "); ",
      {}};
  for (int k = 0; k < sides; ++k) {
    const double angle = 2 * std::numbers::pi * k / sides;
    child.corners.push_back({2 * std::cos(angle), 2 * std::sin(angle), 0});
    child.corners.push_back({std::cos(angle), std::sin(angle), static_cast<double>(height)});
  }
  return child;
}

Child<2> disk(int sides) {
  Child<2> child{"circle(r = 2, $fn = " + std::to_string(sides) + "); ", {}};
  for (int k = 0; k < sides; ++k)
    child.corners.push_back(
        {2 * std::cos(2 * std::numbers::pi * k / sides), 2 * std::sin(2 * std::numbers::pi * k / sides)});
  return child;
}

template <int D>
Child<D> random_child(Random& random, bool convex) {
  const std::array<int, 3> size{pick(random, 2, 5), pick(random, 2, 5), pick(random, 2, 5)};
  if (chance(random, 0.4)) return box<D>(size);
  if (!convex && chance(random, 0.5)) return notched_box<D>(size);
  if constexpr (D == 2)
    return disk(pick(random, 3, 9));
  else
    return cone(pick(random, 3, 9), size[2]);
}

template <int D>
Child<D> random_flat_child(Random& random, bool convex) {
  Child<D> child = random_child<D>(random, convex);
  if (chance(random, 0.3)) child = mapped(random_map<D>(random, D), child);  // which is not always regular
  child = mapped(chance(random, 0.5) ? usual_map<D>(random) : random_map<D>(random, pick(random, 0, D - 1)),
                 child);
  if (chance(random, 0.3)) child = mapped(random_map<D>(random, D), child);
  if (chance(random, 0.2)) child.text = "color([1, 0, 0, 1]) { " + child.text + "} ";
  if (chance(random, 0.2)) child.text = "group() { " + child.text + "} ";
  return child;
}

template <int D>
double hull_content(const Corners<D>& points) {
  return outcome_of<D>(model::convex_hull(points)).content;
}

template <int D>
void check_hulls(std::uint64_t seed, int rounds) {
  Random random(seed);
  for (int round = 0; round < rounds; ++round) {
    std::string text = "hull() { ";
    Corners<D> corners;
    const int flats = pick(random, 1, 3), solids = pick(random, 0, 1);
    for (int i = 0; i < flats + solids; ++i) {
      const Child<D> child = i < flats ? random_flat_child<D>(random, false) : random_child<D>(random, false);
      text += child.text;
      corners.insert(corners.end(), child.corners.begin(), child.corners.end());
    }
    text += "}";
    const Outcome outcome = outcome_of(text);
    const double expected = hull_content<D>(corners);
    EXPECT_NEAR(outcome.content, expected, 1e-9 * (1 + expected))
        << text << " seed " << seed << " round " << round;
    EXPECT_EQ(outcome.warnings.size(), expected > 1e-9 ? 0 : 1)
        << text << " seed " << seed << " round " << round;
  }
}

TEST(Flattened, CountsByItsPointsInHulls) {
  const std::uint64_t seed = new_seed();
  check_hulls<3>(seed, 60);
  check_hulls<2>(seed, 60);
}

template <int D>
void check_sums(std::uint64_t seed, int rounds) {
  Random random(seed);
  for (int round = 0; round < rounds; ++round) {
    const bool is_first = chance(random, 0.5);
    const Child<D> flat = random_flat_child<D>(random, true),
                   other = chance(random, 0.5) ? random_flat_child<D>(random, true)
                                               : random_child<D>(random, true),
                   third = random_flat_child<D>(random, true);
    Corners<D> sums{{}};
    for (const auto* operand : {&flat, &other, &third}) {
      Corners<D> all;
      for (const auto& p : sums)
        for (const auto& q : operand->corners) {
          auto& sum = all.emplace_back(p);
          for (int i = 0; i < D; ++i) sum[i] += q[i];
        }
      sums = std::move(all);
    }
    const std::string text =
        "minkowski() { " + (is_first ? flat.text + other.text : other.text + flat.text) + third.text + "}";
    const Outcome outcome = outcome_of(text);
    const double expected = hull_content<D>(sums);
    EXPECT_NEAR(outcome.content, expected, 1e-9 * (1 + expected))
        << text << " seed " << seed << " round " << round;
    EXPECT_EQ(outcome.warnings.size(), expected > 1e-9 ? 0 : 1)
        << text << " seed " << seed << " round " << round;
  }
}

TEST(Flattened, CountsByItsPointsInSums) {
  const std::uint64_t seed = new_seed();
  check_sums<3>(seed, 40);
  check_sums<2>(seed, 40);
}

TEST(Flattened, CastsItsShadow) {
  const std::uint64_t seed = new_seed();
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const Child<3> flat = random_flat_child<3>(random, true);
    Corners<2> shadow;
    for (const auto& p : flat.corners) shadow.push_back({p[0], p[1]});
    const double expected = hull_content<2>(shadow);
    EXPECT_NEAR(outcome_of("projection() { " + flat.text + "}").content, expected, 1e-9 * (1 + expected))
        << flat.text << " seed " << seed;
  }
}

const std::string sheet = "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]) { cube(2); } ";
const std::string raised_cube = "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]) { cube(1); } ";

TEST(Flattened, IsWhatOpenScadMakesOfIt) {
  EXPECT_NEAR(outcome_of("hull() { " + sheet + raised_cube + "}").content, 14, 1e-12);
  EXPECT_NEAR(outcome_of("hull() { hull() { " + sheet + "} " + raised_cube + "}").content, 14, 1e-12);
  EXPECT_NEAR(outcome_of("hull() { group() { " + sheet + "cube(1); } " + raised_cube + "}").content, 14,
              1e-12);
  EXPECT_NEAR(
      outcome_of("hull() { cube(1); multmatrix([[0,0,0,0],[0,0,0,0],[0,0,0,9],[0,0,0,1]]) { cube(2); } }")
          .content,
      11.0 / 3, 1e-12);
  EXPECT_NEAR(outcome_of("minkowski() { " + sheet + "cube(1); }").content, 9, 1e-12);
  EXPECT_NEAR(outcome_of("minkowski() { " + sheet +
                         "multmatrix([[0,0,0,0],[0,0,0,0],[0,0,1,0],[0,0,0,1]]) { cube(3); } }")
                  .content,
              12, 1e-12);
  EXPECT_NEAR(outcome_of("projection() { " + sheet + "}").content, 4, 1e-12);
}

/// What is evaluated beside it, and what is truly round, leaves it its points.
TEST(Flattened, KeepsItsPointsBesideOtherSolids) {
  const std::string notched =
      "difference() { cube(1); multmatrix([[1,0,0,0.5],[0,1,0,0.5],[0,0,1,0.5],[0,0,0,1]]) { cube(1); } } ";
  EXPECT_NEAR(outcome_of("hull() { " + notched +
                         "multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,6],[0,0,0,1]]) { cube(1); } }")
                  .content,
              6, 1e-12);
  EXPECT_NEAR(outcome_of("minkowski() { group() { " + notched + sheet + "} cube(1); }").content,
              7.875 + 9 - 4, 1e-12);
  const model::Model round = model::parse_csg(
      "hull() { ball(r = 1); multmatrix([[1,0,0,0],[0,1,0,0],[0,0,0,0],[0,0,0,1]]) { ball(r = 3); } }",
      "test.csg");
  const auto network = compile<3>(round.expression, {});
  EXPECT_TRUE(network.warnings.empty());
  const auto totals = evaluate_all(network, 0, {}).evaluation.totals;
  EXPECT_GT(totals.in.value().volume(), 17) << "a disk of radius 3 with a ball in its middle";
}

TEST(Flattened, IsToldWhereItIsLeftOut) {
  const auto expect_told = [](const std::string& text, double content, const std::string& what) {
    const Outcome outcome = outcome_of(text);
    EXPECT_NEAR(outcome.content, content, 1e-12) << text;
    ASSERT_EQ(outcome.warnings.size(), 1) << text;
    EXPECT_NE(outcome.warnings[0].find(what), std::string::npos) << outcome.warnings[0];
  };
  const std::string flattens = "this multmatrix flattens its children";
  expect_told("cube(1); " + sheet, 1, flattens);
  expect_told("resize([4, 4, 4]) { " + sheet + "}", 0, flattens);
  expect_told("projection(cut = true) { " + sheet + "}", 0, flattens);
  expect_told("hull() { cube(1); resize([4, 4, 4]) { " + sheet + "} }", 1, flattens);
  expect_told("cube(1); hull() { " + sheet + sheet + "}", 1,
              "hull: all its points lie in one plane, so it encloses nothing and is left out");
  expect_told("difference() { cube(1); hull() { " + sheet + "} }", 1,
              "hull: all its points lie in one plane");
  expect_told(
      "linear_extrude(1) { square(1); minkowski() { square(0.5); "
      "multmatrix([[0,0,0,0],[0,0,0,0],[0,0,1,0],[0,0,0,1]]) { square(1); } } "
      "hull() { multmatrix([[1,0,0,0],[0,0,0,0],[0,0,1,0],[0,0,0,1]]) { square(1); } } }",
      1, "hull: all its points lie on one line");
  expect_told(
      "difference() { cube(3, center = true); " + raised_cube + " minkowski() { " + sheet + sheet + "} }", 27,
      "minkowski: all its points lie in one plane");
}

/// A construct is made of what comes out of its operands; what they lose is told as if it were in the model
/// itself, once for each construct however often its operands are looked at.
TEST(Nested, LossesAreTold) {
  const std::string thin = "difference() { cube([2, 2, 2]); cube([1, 1, 1e-12]); } ",
                    sound = "difference() { cube([2, 2, 2]); cube([1, 1, 0.5]); } ";
  const std::string
      corner = "cube([0.5, 0.25, 0.125]); ",
      told =
          "1 primitive is thinner than the tolerance, 1e-09 of what it is made of, and left out: between (";
  const auto made_of = [](const std::string& solid, const std::string& other) {
    return std::vector<std::string>{
        "hull() { " + solid + other + "}", "minkowski() { " + solid + other + "}",
        "projection() { " + solid + "}",
        "linear_extrude(height = 1) { projection(cut = false) { " + solid + "} }"};
  };
  for (const std::string& text : made_of(thin, corner)) {
    const auto warnings = outcome_of(text).warnings;
    ASSERT_EQ(warnings.size(), 1U) << text;
    EXPECT_EQ(warnings[0].find(told), 0U) << warnings[0];
    EXPECT_EQ(warnings[0].find("part"), std::string::npos) << warnings[0];
  }
  for (const std::string& text : made_of(sound, corner))
    EXPECT_TRUE(outcome_of(text).warnings.empty()) << text;
  const model::Model two =
      model::parse_csg("hull() { " + thin + "} minkowski() { " + thin + corner + "}", "test.csg");
  int places = 0;
  CompileOptions options;
  options.place_of = [&](const model::Node&) { return "place " + std::to_string(++places) + ": "; };
  const auto network = compile<3>(two.expression, options);
  ASSERT_EQ(network.warnings.size(), 2U);
  for (const std::string& warning : network.warnings) EXPECT_EQ(warning.find("place "), 0U) << warning;
  EXPECT_NE(network.warnings[0], network.warnings[1]);
}

}  // namespace
}  // namespace bsp2::dataflow
