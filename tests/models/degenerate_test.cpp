// Input that breaks kernels with an epsilon: coincident and almost coincident faces, contacts in edges and
// points.

#include <gtest/gtest.h>

#include "models.hpp"
#include "support/rounds.hpp"

namespace bsp2::models {
namespace {

using dataflow::chance;
using dataflow::pick;
using dataflow::uniform;
using model::intersect;
using model::subtract;
using model::unite;

/// The solid in a frame that no coordinate likes.
Expression somewhere(const Expression& e) {
  return model::transform(
      std::vector<double>{0.36, -0.8, 0.48, 0.1, 0.48, 0.6, 0.64, 0.2, -0.8, 0, 0.6, 0.3, 0, 0, 0, 1}, e);
}

TEST(DegenerateModel, TouchingFacesAreOneFace) {
  for (const auto& place :
       {+[](const Expression& e) { return e; }, +[](const Expression& e) { return somewhere(e); }}) {
    const Expression a = place(cube(1)), b = place(move(1, 0, 0, cube(1)));
    EXPECT_NEAR(evaluate(unite({a, b})).volume(), 2, 1e-13);
    EXPECT_EQ(evaluate(intersect({a, b})).cells(), 0U);
    EXPECT_NEAR(evaluate(subtract({a, b})).volume(), 1, 1e-13);
    // The union of halves has no wall between them: not more cells than the two.
    EXPECT_LE(evaluate(unite({a, b})).cells(), 2U);
    // A hole that ends in the face leaves no film.
    const Expression drilled = place(subtract({cube(2), move(0.5, 0.5, 0, model::cuboid({1, 1, 2}))}));
    EXPECT_NEAR(evaluate(drilled).volume(), 6, 1e-12);
    EXPECT_GT(thinnest(evaluate(drilled)), 0.4);
  }
}

TEST(DegenerateModel, TouchesInAnEdgeAVertexAndPartOfAFace) {
  for (const double dx : {-1.0, 0.0, 0.5, 1.0})
    for (const double dy : {-1.0, 0.0, 0.25, 1.0})
      for (const double dz : {-1.0, 0.0, 0.75, 1.0}) {
        const Expression a = cube(1), b = move(dx, dy, dz, cube(1));
        const double both = (1 - std::fabs(dx)) * (1 - std::fabs(dy)) * (1 - std::fabs(dz));
        for (const double coincidence : {0.0, 1e-9}) {
          EXPECT_NEAR(evaluate(unite({a, b}), coincidence).volume(), 2 - both, 1e-13);
          EXPECT_NEAR(evaluate(intersect({a, b}), coincidence).volume(), both, 1e-13);
          EXPECT_NEAR(evaluate(subtract({a, b}), coincidence).volume(), 1 - both, 1e-13);
          EXPECT_NEAR(evaluate(model::symmetric_difference({a, b}), coincidence).volume(), 2 - 2 * both,
                      1e-13);
        }
      }
}

TEST(DegenerateModel, EdgesThroughVertices) {
  // Octahedra and tetrahedra whose corners and edges lie in corners, edges and faces of cubes.
  const Expression octahedron = model::polyhedron(
      {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
      {{0, 4, 2}, {2, 4, 1}, {1, 4, 3}, {3, 4, 0}, {2, 5, 0}, {1, 5, 2}, {3, 5, 1}, {0, 5, 3}});
  EXPECT_NEAR(evaluate(octahedron).volume(), 4.0 / 3, 1e-14);
  EXPECT_NEAR(evaluate(subtract({cube(2, true), octahedron})).volume(), 8 - 4.0 / 3, 1e-13);
  EXPECT_NEAR(evaluate(intersect({cube(1), octahedron})).volume(), 1.0 / 6, 1e-14);
  EXPECT_NEAR(evaluate(unite({cube(1), octahedron})).volume(), 1 + 4.0 / 3 - 1.0 / 6, 1e-13);
  EXPECT_NEAR(evaluate(intersect({cube(1, true), octahedron})).volume(), 4.0 / 3 - 6 * 2 * 0.125 / 3, 1e-13);
  const Expression moved = move(1, 1, 0, octahedron);  // they share an edge's middle
  EXPECT_NEAR(evaluate(unite({octahedron, moved})).volume(), 8.0 / 3, 1e-13);
  EXPECT_EQ(evaluate(intersect({octahedron, moved})).cells(), 0U);
}

TEST(DegenerateModel, ASolidMinusItselfIsEmpty) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  dataflow::Random random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    const Expression e = dataflow::random_expression(random, 3, dataflow::Kind::solids, 1);
    const Expression bounded = intersect({cube(20, true), e});
    const Solid nothing = evaluate(subtract({bounded, bounded}), round % 2 == 0 ? 0 : 1e-9);
    EXPECT_EQ(nothing.cells(), 0U);
    EXPECT_EQ(nothing.volume(), 0);
    // There and back again: the map's rounding makes faces that almost coincide, and merging makes them one.
    const double angle = uniform(random, 0.1, 3);
    const Expression back = turn(-angle, turn(angle, bounded));
    EXPECT_EQ(evaluate(subtract({bounded, back})).cells(), 0U);
    EXPECT_EQ(evaluate(subtract({back, bounded})).cells(), 0U);
    if (HasFailure()) return;
  }
}

/// A centred unit square without itself turned by a: four right triangles, one at each corner.
long double corner_area(long double a) {
  // By symmetry these are congruent to the triangles in which the turned square stands out of the sides. Its
  // corner is h = (cos a + sin a - 1) / 2 above a side, computed without cancellation: cos a - 1 = -2
  // sin^2(a/2). The legs are h / cos a and h / sin a.
  const long double half = std::sin(a / 2);
  const long double h = (std::sin(a) - 2 * half * half) / 2;
  return h * h / (2 * std::sin(a) * std::cos(a));
}

TEST(DegenerateModel, CubesTurnedByLessAndLess) {
  for (int k = 3; k <= 12; ++k) {
    const double angle = std::pow(10.0, -k);
    const Expression a = cube(1, true), b = turn(angle, cube(1, true));
    const auto difference = static_cast<double>(4 * corner_area(angle));
    {  // every feature that the doubles express; a matrix of doubles turns by the angle and stretches by
       // 2^-53
      const Solid minus = evaluate(subtract({a, b}), 0);
      EXPECT_NEAR(minus.volume(), difference, 1e-9 * difference + 4e-16) << "1e-" << k;
      EXPECT_GT(minus.cells(), 0U);
      EXPECT_NEAR(evaluate(unite({a, b}), 0).volume(), 1 + difference, 1e-13) << "1e-" << k;
      EXPECT_NEAR(evaluate(intersect({a, b}), 0).volume(), 1 - difference, 1e-13) << "1e-" << k;
    }
    const Solid merged = evaluate(subtract({a, b}));
    if (k <= 7) {
      EXPECT_NEAR(merged.volume(), difference, 4e-9) << "1e-" << k;
    } else if (k >= 10) {
      EXPECT_EQ(merged.cells(), 0U) << "1e-" << k;
    } else {
      EXPECT_NEAR(merged.volume(), 0, 4e-9 + difference) << "1e-" << k;
    }
    const Solid united = evaluate(unite({a, b}));
    EXPECT_NEAR(united.volume(), 1 + difference, 8e-9) << "1e-" << k;
    EXPECT_TRUE(k < 10 || united.cells() == 1U) << "1e-" << k;
  }
}

TEST(DegenerateModel, CubesTurnedAboutTheirCommonAxis) {
  // In polar coordinates a square's side is at r = 1/2 / cos t, t from -45 to 45 degrees. Of N squares,
  // turned by 90/N degrees each, the union takes the largest r: that of t within the last 45/N degrees before
  // a corner, 8 N times.
  for (const int n : {1, 2, 3, 4, 5, 6, 8, 12, 24, 45}) {
    std::vector<Expression> cubes;
    for (int k = 0; k < n; ++k) cubes.push_back(turn(std::numbers::pi / 2 * k / n, cube(1, true)));
    const double low = std::numbers::pi / 4 * (1 - 1.0 / n), high = std::numbers::pi / 4;
    const double area = n * (std::tan(high) - std::tan(low));  // 8 N integrals of r^2 / 2
    const Solid united = evaluate(unite(cubes));
    EXPECT_NEAR(united.volume(), area, 1e-9) << n << " cubes";
    EXPECT_LE(united.cells(), 5 * std::pow(n, 1.5)) << n << " cubes";
    EXPECT_GT(thinnest(united), 1e-6) << n << " cubes";
    EXPECT_NEAR(evaluate(unite(cubes), 0).volume(), area, 1e-13 * n) << n << " cubes";
    // Their intersection is the regular polygon of 4 N sides around the circle of radius 1/2.
    EXPECT_NEAR(evaluate(intersect(cubes)).volume(), 4 * n * 0.25 * std::tan(std::numbers::pi / (4 * n)),
                1e-9)
        << n << " cubes";
  }
}

TEST(DegenerateModel, CubesTurnedAboutAnyAxes) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  dataflow::Random random(seed);
  std::vector<Expression> cubes;
  for (int k = 0; k < 12; ++k) {
    Expression turned = cube(1, true);
    for (int turns = 0; turns < 3; ++turns)  // about z, and with the axes exchanged
      turned = model::transform(std::vector<double>{0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 1},
                                turn(uniform(random, 0, 6.3), turned));
    cubes.push_back(turned);
  }
  const Expression all = unite(cubes);
  const Solid merged = evaluate(all), exact = evaluate(all, 0);
  EXPECT_NEAR(merged.volume(), exact.volume(), 1e-8);
  EXPECT_LT(gap(merged), 1e-9);
  int inside = 0;
  constexpr int samples = 4000;
  for (int k = 0; k < samples; ++k) {
    dataflow::Point x;
    for (int i = 0; i < 3; ++i) x.push_back(uniform(random, -0.9, 0.9));
    inside += dataflow::where(all, x, 0).inside;
  }
  const double box = 1.8 * 1.8 * 1.8;
  EXPECT_NEAR(exact.volume(), inside * box / samples, 6 * box / (2 * std::sqrt(samples)));
}

TEST(DegenerateModel, CubesShiftedByLessThanTheTolerance) {
  for (int k = 1; k <= 15; ++k) {
    const double shift = std::pow(10.0, -k);
    const Expression a = cube(1), b = move(shift, 0, 0, cube(1));
    const double exact = 1 - (1 - static_cast<long double>(shift));
    EXPECT_NEAR(evaluate(subtract({a, b}), 0).volume(), exact, 1e-9 * exact + 2e-16) << "1e-" << k;
    const Solid apart = evaluate(unite({a, move(1 + shift, 0, 0, cube(1))}));
    EXPECT_NEAR(apart.volume(), 2, 1e-8) << "1e-" << k;
    const Solid merged = evaluate(subtract({a, b}));
    if (k >= 10) {
      EXPECT_EQ(merged.cells(), 0U) << "1e-" << k;
    } else if (k <= 8) {
      EXPECT_NEAR(merged.volume(), shift, 1e-13) << "1e-" << k;
    }
  }
}

TEST(DegenerateModel, LeavesNoCellThinnerThanTheToleranceThatTheGeometryDoesNotHave) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  dataflow::Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    // Boxes of a coarse grid in a turned frame: the maps' rounding moves faces by 1e-16, which nobody may
    // see.
    std::vector<Expression> operands;
    for (int i = 0; i < 6; ++i) {
      const Expression box =
          model::transform(dataflow::grid_matrix(random, 3, 2), dataflow::grid_cuboid(random, 3));
      const double angle = uniform(random, 0, 6);
      operands.push_back(chance(random, 0.5) ? somewhere(box) : turn(-angle, turn(angle, somewhere(box))));
    }
    const Expression e = round % 2 == 0 ? unite(operands) : subtract(operands);
    const Solid solid = evaluate(e);
    EXPECT_NEAR(solid.volume(), std::round(solid.volume()), 1e-10);
    EXPECT_GT(thinnest(solid), 0.3);  // widths along diagonals of the grid do not occur
    EXPECT_LT(gap(solid), 1e-9);
    if (HasFailure()) return;
  }
}

/// A star of two pyramids: the height of all corners at its rim is on no grid of cuts.
TEST(DegenerateModel, CutsKeepAwayFromTheCornersOfMeshes) {
  constexpr std::uint32_t rim = 120;
  constexpr double height = 0.1234567, top = 5.1, bottom = -5.3, turn = 2 * std::numbers::pi / rim;
  std::vector<std::array<double, 3>> points{{0, 0, top}, {0, 0, bottom}};
  std::vector<std::vector<std::uint32_t>> faces;
  for (std::uint32_t i = 0; i < rim; ++i) {
    const double r = i % 2 == 0 ? 2 : 3;
    points.push_back({r * std::cos(turn * i), r * std::sin(turn * i), height});
    const std::uint32_t a = 2 + i, b = 2 + (i + 1) % rim;
    faces.push_back({0, b, a});
    faces.push_back({1, a, b});
  }
  const Solid solid = evaluate(model::polyhedron(points, faces));
  EXPECT_NEAR(solid.volume(), rim * 0.5 * 2 * 3 * std::sin(turn) * (top - bottom) / 3, 1e-9);
  EXPECT_GT(thinnest(solid), 1e-4);
  EXPECT_LT(solid.cells(), 2 * rim * 4);
}

TEST(DegenerateModel, MeshesThatOverlapThemselvesCountOnce) {
  // Two cubes as one mesh, one in the other, or across it: winding number 2 is inside, and so is -1.
  const auto two = [](double shift, bool inverted) {
    std::vector<std::array<double, 3>> points;
    std::vector<std::vector<std::uint32_t>> faces;
    for (std::uint32_t k = 0; k < 2; ++k) {
      for (int i = 0; i < 8; ++i)
        points.push_back({(i & 1) + k * shift, (i >> 1 & 1) + k * shift, (i >> 2) + k * shift});
      for (std::vector<std::uint32_t> face : std::vector<std::vector<std::uint32_t>>{
               {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}}) {
        if (inverted && k == 1) std::reverse(face.begin(), face.end());
        for (auto& index : face) index += 8 * k;
        faces.push_back(face);
      }
    }
    return model::polyhedron(points, faces);
  };
  EXPECT_NEAR(evaluate(two(0.5, false)).volume(), 2 - 0.125, 1e-13);
  EXPECT_NEAR(evaluate(subtract({cube(3, true), two(0.5, false)})).volume(), 27 - 1.875, 1e-12);
  EXPECT_NEAR(evaluate(two(3, false)).volume(), 2, 1e-13);
  EXPECT_NEAR(evaluate(two(0.5, true)).volume(), 2 - 2 * 0.125, 1e-13);  // +1 - 1 = 0 where they overlap
}

TEST(DegenerateModel, NeedlesAndPlates) {
  for (const double thin : {1e-3, 1e-6, 1e-9, 1e-12}) {
    const Expression plate = somewhere(model::cuboid({1, 1, thin})),
                     needle = somewhere(model::cuboid({thin, thin, 1}));
    EXPECT_NEAR(evaluate(plate, 0).volume(), thin, 1e-3 * thin + 4e-16);
    EXPECT_NEAR(evaluate(unite({plate, needle}), 0).volume(), thin + thin * thin * (1 - thin),
                1e-3 * thin + 4e-16);
    EXPECT_NEAR(evaluate(unite({plate, somewhere(cube(1))})).volume(), 1, 1e-12);
  }
}

}  // namespace
}  // namespace bsp2::models
