#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <random>
#include <string>

#include "bsp2/bsp2.hpp"
#include "support/rounds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2 {
namespace {

namespace fs = std::filesystem;

/// BSP2_SEED says the first one, else it is always the same.
std::uint64_t seed_of(int round) {
  const char* given = std::getenv("BSP2_SEED");
  return (given != nullptr ? std::strtoull(given, nullptr, 10) : 1) + static_cast<std::uint64_t>(round);
}

std::string refusal(const std::function<void()>& work) {
  try {
    work();
  } catch (const Error& error) {
    EXPECT_TRUE(error.is_users_mistake());
    return error.what();
  }
  return "";
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

/// A box, and what is in it.
struct Solid {
  Expression expression;
  std::function<bool(const Vector&)> has;
};

class Solids {
 public:
  Solids(std::uint64_t seed, int dimension) : random_(seed), dimension_(dimension) {}
  Solid make(int depth) {
    if (depth == 0) return box();
    const Solid a = make(depth - 1), b = make(depth - 1);
    switch (std::uniform_int_distribution(0, 4)(random_)) {
      case 0:
        return {a.expression + b.expression, [=](const Vector& x) { return a.has(x) || b.has(x); }};
      case 1:
        return {a.expression - b.expression, [=](const Vector& x) { return a.has(x) && !b.has(x); }};
      case 2:
        return {a.expression & b.expression, [=](const Vector& x) { return a.has(x) && b.has(x); }};
      case 3:
        return {a.expression ^ b.expression, [=](const Vector& x) { return a.has(x) != b.has(x); }};
      default:
        return {(a.expression + b.expression) & ~b.expression,
                [=](const Vector& x) { return a.has(x) && !b.has(x); }};
    }
  }
  Vector point() {
    Vector x;
    for (int i = 0; i < dimension_; ++i) x.push_back(std::uniform_real_distribution(-1.0, 5.0)(random_));
    return x;
  }

 private:
  std::mt19937_64 random_;
  int dimension_;

  Solid box() {
    Vector low, size;
    for (int i = 0; i < dimension_; ++i) {
      low.push_back(std::uniform_real_distribution(0.0, 2.0)(random_));
      size.push_back(std::uniform_real_distribution(1.0, 2.0)(random_));
    }
    return {cuboid(size).translate(low), [=](const Vector& x) {
              for (std::size_t i = 0; i < x.size(); ++i)
                if (x[i] < low[i] || x[i] > low[i] + size[i]) return false;
              return true;
            }};
  }
};

TEST(ApiExpression, IsWhatItsOperatorsSay) {
  for (int round = 0; round < samples::rounds(4); ++round)
    for (int dimension = 1; dimension <= 4; ++dimension) {
      const std::uint64_t seed = seed_of(round);
      SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed) + ", dimension " + std::to_string(dimension));
      Solids solids(seed, dimension);
      const Solid solid = solids.make(3);
      const Result result = evaluate(solid.expression, {.threads = 1});
      Vector points;
      std::vector<bool> expected;
      for (int i = 0; i < 200; ++i) {
        const Vector x = solids.point();
        points.insert(points.end(), x.begin(), x.end());
        expected.push_back(solid.has(x));
      }
      const Locations found = result.locate(points);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        EXPECT_EQ(found.labels[i] == label::in, expected[i]) << "point " << i;
        EXPECT_EQ(found.distances[i] < 0, expected[i]) << "point " << i;
      }
      // The text is the expression.
      const Expression again = parse(solid.expression.to_text());
      EXPECT_EQ(again.dimension(), dimension);
      EXPECT_EQ(evaluate(again, {.threads = 1}).digest(), result.digest());
    }
}

TEST(ApiExpression, KeepsAllDigits) {
  const std::uint64_t seed = seed_of(0);
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937_64 random(seed);
  for (int i = 0; i < samples::rounds(1000); ++i) {
    double number = 0;
    const std::uint64_t bits = random();
    std::memcpy(&number, &bits, sizeof number);
    if (!std::isfinite(number)) continue;
    EXPECT_EQ(std::strtod(Value(number).text().c_str(), nullptr), number);
  }
  const double third = 1.0 / 3;
  EXPECT_NE(cuboid({third, third}).to_text().find("0.3333333333333333"), std::string::npos);
}

TEST(ApiExpression, WritesAChainAsOneNode) {
  Expression sum;
  for (int i = 0; i < 1000; ++i) sum += cube().translate({2.0 * i, 0, 0});
  EXPECT_EQ(count(sum.to_text(), "union"), 1U);
  EXPECT_EQ(evaluate(sum, {.threads = 1}).cells().size(), 1000U);
  Expression rest = cube(10);
  for (int i = 0; i < 5; ++i) rest -= cube().translate({2.0 * i, 0, 0});
  EXPECT_EQ(count(rest.to_text(), "difference"), 1U);
  EXPECT_NEAR(evaluate(rest, {.threads = 1}).volume().least, 995, 1e-9);
  // On the right it stands as it is.
  EXPECT_EQ(count((cube() - (cube() - cube())).to_text(), "difference"), 2U);
}

TEST(ApiExpression, NestsAsDeeplyAsOneLikes) {
  Expression solid = cube();
  for (int i = 0; i < 100000; ++i) solid = solid.part("p");
  EXPECT_EQ(count(solid.to_text(), "part("), 100000U);
}

TEST(ApiExpression, RefusesATextThatIsTooLong) {
  Expression solid = cube();
  for (int i = 0; i < 70; ++i) solid = hull({solid, solid});  // shared here, written 2^70 times
  EXPECT_NE(refusal([&] { (void)solid.to_text(); }).find("too large"), std::string::npos);
}

TEST(ApiExpression, TellsMistakesAtOnce) {
  EXPECT_NE(refusal([] { cube() + circle(); }).find("union: solids of 3 dimensions and of 2"),
            std::string::npos);
  EXPECT_NE(refusal([] { cuboid({1, std::nan(""), 1}); }).find("cuboid: 'size'"), std::string::npos);
  EXPECT_NE(refusal([] { ball(7); }).find("ball: 7 dimensions"), std::string::npos);
  EXPECT_NE(refusal([] { (void)cube().translate({1, 2}); }).find("translate: 2 numbers"), std::string::npos);
  EXPECT_NE(refusal([] { (void)cube().mirror({0, 0, 0}); }).find("mirror"), std::string::npos);
  EXPECT_NE(refusal([] { parse("cube("); }).find("model:1:6"), std::string::npos);
  EXPECT_NE(refusal([] { load("/nowhere/at/all.csg"); }).find("/nowhere/at/all.csg"), std::string::npos);
  EXPECT_NE(refusal([] { evaluate(torus(1, 2)); }).find("model:1:1"), std::string::npos);
  EXPECT_NE(refusal([] { evaluate(cube(), {.tolerance = -1}); }).find("tolerance"), std::string::npos);
}

TEST(ApiExpression, TurnsExactlyByQuarters) {
  const Expression turned = cuboid({1, 2, 3}).rotate({90, 180, 270}).rotate(360).rotate(90, {1, 0, 0});
  EXPECT_EQ(turned.to_text().find("e-"), std::string::npos);
  EXPECT_EQ(evaluate(turned, {.threads = 1}).volume().least, 6);
  const auto [lower, upper] = evaluate(cuboid({2, 1}).rotate(90), {.threads = 1}).bounds();
  EXPECT_EQ(lower, (Vector{-1, 0}));
  EXPECT_EQ(upper, (Vector{0, 2}));
  const auto bounds = evaluate(cuboid({1, 2, 3, 4}).rotate_plane(90, 1, 4), {.threads = 1}).bounds();
  EXPECT_EQ(bounds.first, (Vector{-4, 0, 0, 0}));
  EXPECT_EQ(bounds.second, (Vector{0, 2, 3, 1}));
}

TEST(ApiExpression, KnowsTheDimensionOfEachNode) {
  const std::string folder = BSP2_SOURCE_DIR "/examples/expressions";
  std::size_t files = 0;
  for (const auto& file : fs::directory_iterator(folder))
    if (file.path().extension() == ".csg") {
      EXPECT_GE(load(file.path()).dimension(), 1);
      ++files;
    }
  EXPECT_GT(files, 20U);
  const std::vector<std::pair<Expression, int>> all = {
      {square() * cube(), 5},
      {extrude(circle(), {1, 2}), 4},
      {embed(square(), 4, 0.1), 4},
      {project(cuboid({1, 1, 1, 1}), std::vector{1, 4}), 2},
      {section(ball(4), 2), 3},
      {linear_extrude(circle(), 2), 3},
      {rotate_extrude(square().translate({1, 0}), 180), 3},
      {projection(cube()), 2},
      {bezier({{0, 0}, {4, 0}, {0, 5}, {0, 0}}), 2},
      {polytope({{0, 0}, {1, 0}, {0, 1}}), 2},
      {simplex(5), 5},
      {d_cylinder(4, 1, {1, 2}), 4},
      {text("a"), 2},
      {cube().scale(2).resize({1, 0, 0}), 3},
      {minkowski({square(), circle()}), 2},
      {offset(square(), 1, Join::chamfer), 2},
      {grow(square(), 1), 2},
      {sweep(ball(2, 0.5), {{0, 0}, {3, 0}}), 2},
      {roof(square()), 3},
      {fill(square()), 2},
      {mesh(std::vector<double>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1},
            std::vector<std::uint32_t>{0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2}),
       3}};
  for (const auto& [expression, dimension] : all) {
    EXPECT_EQ(expression.dimension(), dimension) << expression.to_text();
    EXPECT_EQ(parse(expression.to_text()).dimension(), dimension) << expression.to_text();
  }
}

TEST(ApiExpression, TakesTextsIn) {
  const samples::TemporaryFolder folder;
  fs::create_directory(folder.path() / "sub");
  const Expression tetrahedron = simplex(3, 1);
  for (const std::string& warning :
       evaluate(tetrahedron, {.threads = 1}).write(folder.path() / "sub/a \"b\".stl"))
    FAIL() << warning;
  std::ofstream(folder.path() / "m.csg")
      << "/* ! */ cube(1); // import(file = \"no.stl\")\n"
         "group() { import(file = \"sub/a \\\"b\\\".stl\"); text(\"file\"); }"
         " // the end";
  const Expression loaded = load(folder.path() / "m.csg");
  const double alone = evaluate(loaded, {.threads = 1}).volume().least;
  EXPECT_NEAR(alone, 1, 1e-12);
  const Expression both = loaded.translate({5, 0, 0}) + loaded;  // found from here, too
  EXPECT_NEAR(evaluate(both, {.threads = 1}).volume().least, 2, 1e-12);
  EXPECT_NE(both.to_text().find("\"file\""), std::string::npos);
  // What is tagged as the root is all there is of a text, and of no other.
  const Expression tagged =
      parse("cube(9); * group() { !cube(8); } group() { ! cube(2); cube(7); } !cube(3);");
  EXPECT_EQ(evaluate(tagged, {.threads = 1}).volume().least, 8);
  EXPECT_EQ(evaluate(tagged.translate({10, 0, 0}) + cube(), {.threads = 1}).volume().least, 9);
}

}  // namespace
}  // namespace bsp2
