// Surfaces without short edges and slivers: closed, not crossing themselves, and near to where they were.

#include "bsp2/model/mesh/cleaning.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "mesh/mesh_crossing.hpp"
#include "mesh/predicates.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

using geometry::TriangleSurface;
using Triangle = std::array<std::uint32_t, 3>;

/// The unit cube's surface with a net of `cells` squares a side on each face.
TriangleSurface cube_of_squares(int cells) {
  TriangleSurface surface;
  std::map<Point3, std::uint32_t> numbers;
  const auto number = [&](const Point3& p) {
    const auto [at, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(surface.points.size()));
    if (is_new) surface.points.push_back(p);
    return at->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const bool upper : {false, true})
      for (int i = 0; i < cells; ++i)
        for (int k = 0; k < cells; ++k) {
          const auto corner = [&](int u, int v) {
            Point3 p;
            p[axis] = upper ? 1 : 0;
            p[(axis + 1) % 3] = static_cast<double>(u) / cells;
            p[(axis + 2) % 3] = static_cast<double>(v) / cells;
            return number(p);
          };
          const std::uint32_t a = corner(i, k), b = corner(i + 1, k), c = corner(i + 1, k + 1),
                              d = corner(i, k + 1);
          for (Triangle t : {Triangle{a, b, c}, Triangle{a, c, d}}) {
            if (!upper) std::swap(t[1], t[2]);
            surface.triangles.push_back(t);
            surface.owner.push_back(0);
          }
        }
  return surface;
}

double thickness(const TriangleSurface& surface, const Triangle& t) {
  const Point3 &a = surface.points[t[0]], &b = surface.points[t[1]], &c = surface.points[t[2]];
  const Point3 n = cross(minus(b, a), minus(c, a));
  const auto length = [](const Point3& v) { return std::sqrt(dot(v, v)); };
  return length(n) / std::max({length(minus(b, a)), length(minus(c, b)), length(minus(a, c))});
}

bool crosses_itself(const TriangleSurface& surface) {
  TriangleMesh mesh;
  mesh.points = surface.points;
  mesh.triangles = surface.triangles;
  return self_crossing(mesh).has_value();
}

/// Puts a new point on an edge, or in a triangle, moved by up to `reach`: what cuts leave beside each other.
void add_point(TriangleSurface& surface, std::mt19937& random, double reach, bool anywhere) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto i = std::uniform_int_distribution<std::size_t>(0, surface.triangles.size() - 1)(random);
  const Triangle t = surface.triangles[i];
  const auto added = static_cast<std::uint32_t>(surface.points.size());
  // Close to a corner, so that edges are short, or somewhere on an edge, so that triangles may be thin.
  const double share = anywhere && uniform(0, 1) < 0.5 ? uniform(0.2, 0.8) : reach;
  Point3 point;
  for (std::size_t k = 0; k < 3; ++k)
    point[k] = surface.points[t[0]][k] + share * (surface.points[t[1]][k] - surface.points[t[0]][k]) +
               uniform(-reach, reach) / 8;
  surface.points.push_back(point);
  std::vector<Triangle> kept;
  std::vector<std::int32_t> owner;
  for (std::size_t each = 0; each < surface.triangles.size(); ++each) {
    const Triangle& o = surface.triangles[each];
    const auto from = std::ranges::find(o, t[0]), to = std::ranges::find(o, t[1]);
    owner.push_back(surface.owner[each]);
    if (from == o.end() || to == o.end()) {
      kept.push_back(o);
      continue;
    }
    Triangle first = o, second = o;
    std::ranges::replace(first, t[1], added);
    std::ranges::replace(second, t[0], added);
    kept.push_back(first);
    kept.push_back(second);
    owner.push_back(surface.owner[each]);
  }
  surface.triangles = std::move(kept);
  surface.owner = std::move(owner);
}

TEST(Cleaning, LeavesWhatIsCleanByteForByte) {
  const TriangleSurface cube = cube_of_squares(3);
  const CleanSurface same = cleaned(cube, {0.1});
  EXPECT_EQ(same.surface.points, cube.points);
  EXPECT_EQ(same.surface.triangles, cube.triangles);
  EXPECT_FALSE(same.cleaning.is_changed());
}

TEST(Cleaning, TakesAwayWhatIsShorterOrThinner) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    constexpr double length = 1e-3;
    const int cells = 1 + round % 4, added = 1 + round % 40;
    TriangleSurface surface = cube_of_squares(cells);
    const TriangleSurface plain = surface;
    for (int i = 0; i < added; ++i) add_point(surface, random, length / 8, round % 2 == 0);
    ASSERT_TRUE(surface.is_closed());
    if (crosses_itself(surface)) continue;
    const CleanSurface clean = cleaned(surface, {length});
    ASSERT_FALSE(clean.cleaning.has_given_up);
    EXPECT_TRUE(clean.surface.is_closed());
    EXPECT_FALSE(crosses_itself(clean.surface));
    EXPECT_LE(clean.cleaning.moved, length);
    EXPECT_LT(std::fabs(clean.surface.volume() - surface.volume()), length * surface.area());
    EXPECT_NEAR(clean.cleaning.volume, clean.surface.volume() - surface.volume(), 1e-12);
    std::size_t thin = 0;
    for (const Triangle& t : clean.surface.triangles) thin += thickness(clean.surface, t) < length ? 1 : 0;
    EXPECT_EQ(thin, clean.cleaning.left);
    EXPECT_EQ(thin, 0U);
    // Of corners beside others nothing is left.
    if (round % 2 == 1) {
      EXPECT_LE(clean.surface.triangles.size(), plain.triangles.size()) << "round " << round;
    }
  }
}

/// Cubes in a row, each a part that has its side of what is between two.
TriangleSurface row_of_parts(int parts, int cells) {
  TriangleSurface row;
  row.closes_parts = true;
  std::map<Point3, std::uint32_t> numbers;
  const TriangleSurface cube = cube_of_squares(cells);
  for (int part = 0; part < parts; ++part)
    for (const Triangle& t : cube.triangles) {
      Triangle& added = row.triangles.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        Point3 p = cube.points[t[k]];
        p[0] += part;
        const auto [at, is_new] = numbers.try_emplace(p, static_cast<std::uint32_t>(row.points.size()));
        if (is_new) row.points.push_back(p);
        added[k] = at->second;
      }
      row.owner.push_back(part);
    }
  return row;
}

TriangleSurface only(const TriangleSurface& surface, std::int32_t part) {
  TriangleSurface result;
  result.points = surface.points;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i)
    if (surface.owner[i] == part) {
      result.triangles.push_back(surface.triangles[i]);
      result.owner.push_back(part);
    }
  return result;
}

/// Without those that two parts have, one a side.
TriangleSurface outside_of(const TriangleSurface& surface) {
  std::map<std::array<std::uint32_t, 3>, std::vector<std::size_t>> by_corners;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    Triangle corners = surface.triangles[i];
    std::ranges::sort(corners);
    by_corners[corners].push_back(i);
  }
  TriangleSurface result;
  result.points = surface.points;
  for (const auto& [corners, all] : by_corners) {
    EXPECT_LE(all.size(), 2U);
    if (all.size() != 1) {
      EXPECT_NE(surface.owner[all[0]], surface.owner[all[1]]);
      continue;
    }
    result.triangles.push_back(surface.triangles[all[0]]);
    result.owner.push_back(surface.owner[all[0]]);
  }
  return result;
}

TEST(Cleaning, MovesWhatIsBetweenPartsForBoth) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  int changed = 0;
  for (int round = 0; round < samples::rounds(60); ++round) {
    constexpr double length = 1e-3;
    const int parts = 2 + round % 2, cells = 1 + round % 3, added = 1 + round % 40;
    TriangleSurface surface = row_of_parts(parts, cells);
    const TriangleSurface plain = surface;
    for (int i = 0; i < added; ++i) add_point(surface, random, length / 8, round % 4 < 2);
    if (crosses_itself(surface)) continue;
    const CleanSurface clean = cleaned(surface, {length});
    if (clean.cleaning.has_given_up) continue;
    changed += clean.cleaning.is_changed() ? 1 : 0;
    ASSERT_TRUE(clean.surface.closes_parts);
    EXPECT_LE(clean.cleaning.moved, length);
    EXPECT_FALSE(crosses_itself(clean.surface));
    double sum = 0;
    for (int part = 0; part < parts; ++part) {
      const TriangleSurface before = only(surface, part), now = only(clean.surface, part);
      EXPECT_TRUE(now.is_closed()) << "part " << part;
      EXPECT_FALSE(crosses_itself(now)) << "part " << part;
      EXPECT_LT(std::fabs(now.volume() - before.volume()), length * before.area());
      sum += now.volume();
    }
    // What is left is the outside alone: the two sides of what is between parts have the same triangles.
    const TriangleSurface outside = outside_of(clean.surface);
    EXPECT_TRUE(outside.is_closed());
    EXPECT_NEAR(outside.volume(), sum, 1e-12);
    EXPECT_NEAR(outside.area(), 2 + 4 * parts, 0.1);
    std::size_t thin = 0;
    for (const Triangle& t : clean.surface.triangles) thin += thickness(clean.surface, t) < length ? 1 : 0;
    EXPECT_EQ(clean.cleaning.left, 0U);
    EXPECT_EQ(thin, 0U);
    // Of corners beside others nothing is left.
    if (round % 4 >= 2) {
      EXPECT_LE(clean.surface.triangles.size(), plain.triangles.size()) << "round " << round;
    }
  }
  EXPECT_GT(changed, 0);
}

/// Lengths near those of whole parts: these vanish, or are left, but are never inside out.
TEST(Cleaning, TurnsNothingInsideOut) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::size_t vanished = 0;
  for (int round = 0; round < samples::rounds(100); ++round) {
    TriangleSurface surface = row_of_parts(3, 1 + round % 2);
    for (Point3& p : surface.points)  // a sheared row of other proportions
      p = {p[0] * 0.6 + 0.3 * unit(random), p[1] * 0.5 + 0.2 * unit(random), p[2] + 0.3 * unit(random)};
    if (crosses_itself(surface)) continue;
    const CleanSurface clean = cleaned(surface, {0.2 + unit(random)});
    for (int part = 0; part < 3; ++part) {
      const TriangleSurface before = only(surface, part), now = only(clean.surface, part);
      const bool is_gone = std::ranges::find(clean.cleaning.vanished, part) != clean.cleaning.vanished.end();
      EXPECT_EQ(now.triangles.empty(), is_gone);
      EXPECT_TRUE(now.is_closed());
      EXPECT_GE(now.volume() * before.volume(), 0) << "round " << round << ", part " << part;
      vanished += is_gone ? 1 : 0;
    }
  }
  EXPECT_GT(vanished, 0U);
}

/// Corners that are left out one after the other do not add up: a fine cylinder with one sliver stays round.
TEST(Cleaning, DoesNotFlattenWhatIsRound) {
  constexpr std::uint32_t sides = 600;
  constexpr double length = 5e-4;
  TriangleSurface surface;
  for (std::uint32_t i = 0; i < sides; ++i) {
    // The second corner is so near to the first one that they become one.
    const double angle = 2 * 3.14159265358979323846 * (i == 1 ? 0.02 : i) / sides;
    for (const double z : {0.0, 1.0}) surface.points.push_back({std::cos(angle), std::sin(angle), z});
  }
  surface.points.push_back({0, 0, 0});
  surface.points.push_back({0, 0, 1});
  for (std::uint32_t i = 0; i < sides; ++i) {
    const std::uint32_t a = 2 * i, b = 2 * ((i + 1) % sides);
    for (const Triangle& t : {Triangle{a, b, b + 1}, Triangle{a, b + 1, a + 1}, Triangle{2 * sides, b, a},
                              Triangle{2 * sides + 1, a + 1, b + 1}}) {
      surface.triangles.push_back(t);
      surface.owner.push_back(0);
    }
  }
  ASSERT_TRUE(surface.is_closed());
  const CleanSurface clean = cleaned(surface, {length});
  EXPECT_TRUE(clean.cleaning.is_changed());
  EXPECT_TRUE(clean.surface.is_closed());
  // A chord of the rim that is farther from it than the length would be as far from a corner of it.
  double farthest = 0;
  for (std::uint32_t i = 0; i < sides; ++i) {
    double nearest = 2;
    for (const Triangle& t : clean.surface.triangles)
      for (std::size_t k = 0; k < 3; ++k) {
        const Point3 &p = clean.surface.points[t[k]], &q = clean.surface.points[t[(k + 1) % 3]];
        if (p[2] != 0 || q[2] != 0 || dot(p, p) < 0.9 || dot(q, q) < 0.9) continue;
        const Point3 along = minus(q, p), to = minus(surface.points[2 * i], p);
        const double share = std::clamp(dot(to, along) / dot(along, along), 0.0, 1.0);
        double square = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
          square += (to[axis] - share * along[axis]) * (to[axis] - share * along[axis]);
        nearest = std::min(nearest, std::sqrt(square));
      }
    farthest = std::max(farthest, nearest);
  }
  EXPECT_LE(farthest, length);
}

/// Each place has its own step: what is small and near the origin stays beside what is far away.
TEST(Cleaning, MeasuresByTheCoordinatesOfThePlace) {
  TriangleSurface surface = cube_of_squares(1);
  const TriangleSurface small = surface;
  for (Point3& p : surface.points)
    for (double& x : p) x *= 0.01;
  for (const Point3& p : small.points) surface.points.push_back({p[0] + 1e6, p[1] + 1e6, p[2] + 1e6});
  for (const auto& [a, b, c] : small.triangles) {
    surface.triangles.push_back({a + 8, b + 8, c + 8});
    surface.owner.push_back(0);
  }
  EXPECT_FALSE(cleaned(surface, {.of_coordinate = 1e-8}).cleaning.is_changed());
  const CleanSurface clean = cleaned(surface, {.of_coordinate = 1e-5});
  EXPECT_EQ(clean.surface.triangles.size(), 12U) << "the far cube is gone";
  EXPECT_NEAR(clean.surface.volume(), 1e-6, 1e-15);
}

/// A hundred walls thinner than the length: what would cross stays.
TEST(Cleaning, NeverMakesASurfaceCrossItself) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  int changed = 0;
  for (int round = 0; round < samples::rounds(40); ++round) {
    TriangleSurface surface;
    // Boxes above each other, with gaps and thicknesses from far below the length to far above it.
    double z = 0;
    for (int i = 0; i < 12; ++i) {
      TriangleSurface box = cube_of_squares(1 + i % 2);
      const double height = std::pow(10, -4 * unit(random)), turn = unit(random);
      const auto first = static_cast<std::uint32_t>(surface.points.size());
      for (const Point3& p : box.points)
        surface.points.push_back({p[0] * std::cos(turn) - p[1] * std::sin(turn),
                                  p[0] * std::sin(turn) + p[1] * std::cos(turn), z + p[2] * height});
      for (const Triangle& t : box.triangles)
        surface.triangles.push_back({first + t[0], first + t[1], first + t[2]});
      surface.owner.insert(surface.owner.end(), box.triangles.size(), i);
      z += height + std::pow(10, -4 * unit(random));
    }
    ASSERT_FALSE(crosses_itself(surface));
    const CleanSurface clean = cleaned(surface, {0.01});
    changed += clean.cleaning.is_changed() ? 1 : 0;
    EXPECT_TRUE(clean.surface.is_closed());
    EXPECT_FALSE(crosses_itself(clean.surface));
    EXPECT_LE(clean.cleaning.moved, 0.01);
  }
  EXPECT_GT(changed, 0) << "cleaning always gives up";
}

/// Two cubes that go through each other as one surface: what is short goes all the same, and where they cross
/// is told.
TEST(Cleaning, GoesOnWhereASurfaceCrossesItselfBefore) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uint64_t merged = 0, crossing = 0;
  const int rounds = samples::all_rounds(20);
  for (int round = 0; round < rounds; ++round) {
    TriangleSurface surface = cube_of_squares(6);
    const TriangleSurface other = surface;
    const auto count = static_cast<std::uint32_t>(surface.points.size());
    for (const Point3& p : other.points) surface.points.push_back({p[0] + 0.5, p[1] + 0.4, p[2] + 0.3});
    for (const Triangle& t : other.triangles)
      surface.triangles.push_back({count + t[0], count + t[1], count + t[2]});
    surface.owner.resize(surface.triangles.size(), 0);
    for (int i = 0; i < 60; ++i) add_point(surface, random, 1e-6, false);
    ASSERT_TRUE(crosses_itself(surface));
    const CleanSurface clean = cleaned(surface, {1e-4});
    EXPECT_FALSE(clean.cleaning.has_given_up);
    EXPECT_TRUE(clean.surface.is_closed());
    merged += clean.cleaning.merged_points;
    crossing += clean.cleaning.crossing_before.size();
    EXPECT_NEAR(clean.surface.volume(), 2, 1e-3);
  }
  EXPECT_GT(merged, static_cast<std::uint64_t>(rounds)) << "of some 60 each";
  EXPECT_GT(crossing, 0U);
}

}  // namespace
}  // namespace bsp2::model
