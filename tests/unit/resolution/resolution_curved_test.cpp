// The boundary of round solids that share planes: each family names them for itself, and a box does, too.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <numeric>

#include "bsp2/geometry/surface/plane_names.hpp"
#include "dataflow/oracle.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::HyperplaneId;
using geometry::OrientedHyperplane;
using geometry::PlaneNames;
using model::Expression;

EvaluateOptions to_tolerance(double tolerance, unsigned threads = 1) {
  EvaluateOptions options;
  options.tolerance = tolerance;
  options.threads = threads;
  return options;
}

/// Closed, around the volume of the cells. @return the number of triangles.
std::size_t expect_right(const Expression& e, double tolerance, unsigned depth = 0,
                         double coincidence = 1e-9) {
  try {
    const Resolved r = resolved(e, to_tolerance(tolerance), depth, coincidence);
    EXPECT_TRUE(r.surface.is_closed());
    EXPECT_NEAR(r.surface.volume(), r.volume, 1e-11 * r.volume);
    return r.surface.triangles.size();
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what();  // here, so that the seed is told
    return 0;
  }
}

// --- models ---

Expression moved(double x, double y, double z, const Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}
Expression scaled(double x, double y, double z, const Expression& e) {
  return model::transform(std::vector<double>{x, 0, 0, 0, 0, y, 0, 0, 0, 0, z, 0, 0, 0, 0, 1}, e);
}
Expression around_x(double c, double s, const Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, 0, 0, c, -s, 0, 0, s, c, 0, 0, 0, 0, 1}, e);
}
Expression around_z(double c, double s, const Expression& e) {
  return model::transform(std::vector<double>{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, e);
}
/// Through the middle of the origin.
Expression tube(double r, double h) { return moved(0, 0, -h / 2, model::round_cylinder(2, r, {h})); }
Expression cube(double size) { return model::cuboid({size, size, size}, true); }
Expression ball(double r) { return model::ball(3, r); }

/// x goes to an axis, y to another one, and each may be turned round.
Expression turned_along_axes(Random& random, const Expression& e) {
  std::array<int, 3> axis{0, 1, 2};
  std::shuffle(axis.begin(), axis.end(), random);
  std::vector<double> matrix(16, 0);
  for (std::size_t i = 0; i < 3; ++i)
    matrix[4 * i + static_cast<std::size_t>(axis[i])] = chance(random, 0.5) ? 1 : -1;
  matrix[15] = 1;
  return model::transform(matrix, e);
}

Expression random_solid(Random& random) {
  const double r = pick(random, 1, 4), h = pick(random, 1, 6);
  switch (pick(random, 0, 11)) {
    case 0:
    case 1:
    case 2:
      return ball(r);
    case 3:
    case 4:
      return model::round_cylinder(2, r, {h});
    case 5:
      return tube(r, 2 * h);
    case 6:
      return model::cone(h, r, pick(random, 0, 3));
    case 7:
    case 8:
      return model::torus(r, r * pick(random, 1, 4) / 4);
    case 9:
      return cube(2 * r);
    case 10:
      return scaled(pick(random, 1, 3), 1, 1, ball(r));
    default:
      return model::sphere(r, 8);
  }
}

/// In a place of its own, or where another one may be.
Expression placed(Random& random, Expression e) {
  if (chance(random, 0.4)) e = turned_along_axes(random, e);
  if (chance(random, 0.08)) e = around_z(std::sqrt(0.5), std::sqrt(0.5), e);  // then no axis fits exactly
  if (chance(random, 0.08)) e = around_x(0.6, 0.8, e);
  if (chance(random, 0.5)) e = moved(pick(random, -2, 2), pick(random, -2, 2), pick(random, -2, 2), e);
  if (chance(random, 0.3)) e = moved(pick(random, -4, 4), 0, 0, e);
  return e;
}

Expression joined(Random& random, std::vector<Expression> solids) {
  switch (pick(random, 0, 4)) {
    case 0:
    case 1:
      return model::unite(std::move(solids));
    case 2:
    case 3:
      return model::subtract(std::move(solids));
    default:
      return model::intersect(std::move(solids));
  }
}

Expression random_model(Random& random) {
  std::vector<Expression> solids;
  const int count = pick(random, 2, 4);
  for (int i = 0; i < count; ++i) {
    if (i > 0 && chance(random, 0.2)) {  // the same again, a little aside or smaller
      const Expression again = solids[static_cast<std::size_t>(pick(random, 0, i - 1))];
      solids.push_back(chance(random, 0.5) ? moved(pick(random, -3, 3), pick(random, -3, 3), 0, again)
                                           : scaled(0.5, 0.5, 0.5, again));
    } else {
      solids.push_back(placed(random, random_solid(random)));
    }
  }
  while (solids.size() > 2 && chance(random, 0.5)) {
    Expression both = joined(random, {solids[0], solids[1]});
    solids.erase(solids.begin());
    solids[0] = std::move(both);
  }
  return joined(random, std::move(solids));
}

// --- tests ---

TEST(CurvedResolution, OfRandomSolidsThatSharePlanes) {
  constexpr std::array tolerances{0.8, 0.4, 0.2, 0.1};
  const std::size_t count = static_cast<std::size_t>(samples::rounds(160));
  std::size_t solid = 0;
  for (std::size_t round = 0; round < count; ++round) {
    const std::uint64_t seed = new_seed();
    const double tolerance = tolerances[round % 8 == 7 ? 3 : round % 8 > 4 ? 2 : round % 2];
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed << ", tolerance " << tolerance);
    Random random(seed);
    const Expression e = random_model(random);
    solid += expect_right(e, tolerance, round % 3 == 0 ? 3 : 0, round % 10 == 9 ? 0 : 1e-9) > 0 ? 1 : 0;
    if (testing::Test::HasFailure()) return;
  }
  if (std::getenv("BSP2_SEED") == nullptr) {
    EXPECT_GT(solid, count / 2);
  }
}

/// What people make of round solids.
TEST(CurvedResolution, OfOrdinarySolids) {
  const Expression pipe = model::subtract({tube(3, 12), tube(2, 14)}), bar = tube(2, 14);
  const std::vector<std::pair<const char*, Expression>> models{
      {"two equal balls", model::unite({ball(3), moved(2, 0, 0, ball(3))})},
      {"two balls that touch", model::unite({ball(3), moved(6, 0, 0, ball(3))})},
      {"lens", model::intersect({ball(3), moved(4, 0, 0, ball(3))})},
      {"hollow ball", model::subtract({ball(3), ball(2)})},
      {"half of a hollow ball", model::subtract({ball(4), ball(3), moved(0, 0, 5, cube(10))})},
      {"ball in a cube", model::subtract({cube(6), ball(3)})},
      {"cube that holds a ball, joined", model::unite({cube(6), moved(3, 0, 0, ball(2))})},
      {"napkin ring", model::subtract({ball(4), tube(2, 10)})},
      {"dumb-bell", model::unite({tube(1, 8), moved(0, 0, 4, ball(2)), moved(0, 0, -4, ball(2))})},
      {"capsule", model::unite({tube(2, 6), moved(0, 0, 3, ball(2)), moved(0, 0, -3, ball(2))})},
      {"cross of bars", model::unite({tube(3, 12), around_x(0, 1, tube(3, 12))})},
      {"common part of two bars", model::intersect({tube(3, 12), around_x(0, 1, tube(3, 12))})},
      {"cross of pipes",
       model::subtract({model::unite({tube(3, 12), around_x(0, 1, tube(3, 12))}), bar, around_x(0, 1, bar)})},
      {"pipe", pipe},
      {"two pipes in a row", model::unite({pipe, moved(0, 0, 12, pipe)})},
      {"hollow torus", model::subtract({model::torus(5, 2), model::torus(5, 1.5)})},
      {"two links", model::unite({model::torus(4, 1), moved(4, 0, 0, around_x(0, 1, model::torus(4, 1)))})},
      {"crossed tori", model::unite({model::torus(4, 1), around_x(0, 1, model::torus(4, 1))})},
      {"torus with a groove", model::subtract({model::torus(5, 2), model::torus(7, 1)})},
      {"torus around a bar", model::unite({tube(3, 8), model::torus(4, 1)})},
      {"horn torus and ball", model::unite({model::torus(2, 2), ball(2)})},
      {"cone on a bar", model::unite({tube(2, 4), moved(0, 0, 2, model::cone(3, 2, 0))})},
      {"two cones, tip to tip",
       model::unite({model::cone(3, 2, 0), scaled(1, 1, -1, moved(0, 0, -6, model::cone(3, 2, 0)))})},
      {"countersunk hole",
       model::subtract({model::cuboid({8, 8, 2}, true), tube(1, 4), moved(0, 0, -1, model::cone(2, 1, 3))})},
      {"washer", model::subtract({tube(3, 1), tube(2, 4)})},
      {"step shaft", model::unite({tube(3, 2), moved(0, 0, 2, tube(2, 2)), moved(0, 0, 4, tube(1, 2))})},
      {"ball in a faceted ball", model::subtract({model::sphere(4, 12), ball(3)})},
  };
  for (const auto& [name, e] : models) {
    SCOPED_TRACE(name);
    EXPECT_GT(expect_right(e, 0.4), 10U);
  }
}

TEST(CurvedResolution, DoesNotDependOnThreadsOrRegions) {
  for (std::size_t round = 0; round < static_cast<std::size_t>(samples::rounds(10)); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Expression e = random_model(random);
    const Resolved one = resolved(e, to_tolerance(0.4)), other = resolved(e, to_tolerance(0.4, 3));
    EXPECT_EQ(other.surface.points, one.surface.points);
    EXPECT_EQ(other.surface.triangles, one.surface.triangles);
    EXPECT_EQ(other.surface.owner, one.surface.owner);
    if (testing::Test::HasFailure()) return;
  }
}

// --- names ---

/// Whether two planes are one, by the points of a tetrahedron: three of them are on no line. Not exactly.
double largest_difference(const geometry::HyperplaneTable<3>& table, OrientedHyperplane a,
                          OrientedHyperplane b) {
  const auto value = [&](OrientedHyperplane plane, const std::array<double, 3>& x) {
    return (plane.flipped() ? -1 : 1) * table.rounded(plane.id()).at(x);
  };
  double largest = 0;
  for (const auto& x : {std::array<double, 3>{1, 2, 3}, {-3, 1, 2}, {2, -2, 1}, {0, 0, -4}})
    largest = std::max(largest, std::fabs(value(a, x) - value(b, x)));
  return largest;
}

/// Exactly: the two covectors are one but for a factor.
bool are_one(const geometry::HyperplaneTable<3>& table, HyperplaneId a, HyperplaneId b) {
  using Integer = boost::multiprecision::cpp_int;
  const auto u = table.exact(a), v = table.exact(b);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (Integer(u[i]) * Integer(v[k]) != Integer(u[k]) * Integer(v[i])) return false;
  return true;
}

/// All pairs of planes with names are told apart by their names exactly if they differ.
TEST(PlaneNames, AreOneForEachPlane) {
  for (std::size_t round = 0; round < static_cast<std::size_t>(samples::rounds(12)); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Resolved r = resolved(random_model(random), to_tolerance(1.0));
    const auto& table = r.network.table;
    const std::vector<HyperplaneId> planes = geometry::family_planes(table, r.batches);
    const PlaneNames names(table, planes);
    std::vector<HyperplaneId> all = planes;
    for (HyperplaneId id = 0; id < table.size(); ++id) all.push_back(id);
    for (int axis = 0; axis < 3; ++axis)
      for (const double x : {-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0})
        all.push_back(table.axis_hyperplane(axis, table.axis_position(axis, x)));
    std::shuffle(all.begin(), all.end(), random);
    all.resize(std::min<std::size_t>(all.size(), 400));
    for (const HyperplaneId a : all) {
      const OrientedHyperplane name = names.find(a);
      ASSERT_LT(largest_difference(table, geometry::oriented(a), name), 1e-9)
          << "the name is another plane's, or turned round";
      ASSERT_EQ(names.find(name.id()), geometry::oriented(name.id())) << "a name has another name";
      for (const HyperplaneId b : all) {
        const bool are_near =
            std::min(largest_difference(table, geometry::oriented(a), geometry::oriented(b)),
                     largest_difference(table, geometry::oriented(a), geometry::oriented(b, true))) < 1e-9;
        ASSERT_EQ(names.find(b).id() == name.id(), are_near && are_one(table, a, b));
      }
    }
  }
}

}  // namespace
}  // namespace bsp2::dataflow
