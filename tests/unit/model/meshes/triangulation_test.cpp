// Faces cut into triangles, beside areas and counts of directed edges, and what finds their ears, beside
// loops.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <map>
#include <numbers>
#include <numeric>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "mesh/index_set.hpp"
#include "mesh/mesh_triangulation.hpp"
#include "mesh/plane_tree.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

std::vector<Triangle> triangles_of(const std::vector<Point3>& face) {
  std::vector<std::uint32_t> cycle(face.size());
  std::iota(cycle.begin(), cycle.end(), 0U);
  std::vector<Triangle> triangles;
  Triangulator(face).triangulate(cycle, triangles);
  return triangles;
}

/// A wall along a spiral around the origin: counter-clockwise, and no edges cross.
std::vector<Point3> spiral(std::size_t corners, double turns) {
  std::vector<Point3> face, back;
  const std::size_t half = corners / 2;
  for (std::size_t i = 0; i < half; ++i) {
    const double share = static_cast<double>(i) / static_cast<double>(half),
                 angle = 2 * std::numbers::pi * turns * share, radius = 10 + 1000 * share,
                 outer = radius + 400 / turns;
    face.push_back({outer * std::cos(angle), outer * std::sin(angle), 0});
    back.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
  }
  face.insert(face.end(), back.rbegin(), back.rend());
  return face;
}

double area_of(const std::vector<Point3>& p, const Triangle& t) {
  return ((p[t[1]][0] - p[t[0]][0]) * (p[t[2]][1] - p[t[0]][1]) -
          (p[t[1]][1] - p[t[0]][1]) * (p[t[2]][0] - p[t[0]][0])) /
         2;
}

double area_of(const std::vector<Point3>& p) {
  double sum = 0;
  for (std::uint32_t i = 2; i < p.size(); ++i) sum += area_of(p, {0, i - 1, i});
  return sum;
}

/// How often the triangles, and the face against them, use each edge in one direction more than in the other.
bool has_edges_of_face(const std::vector<Triangle>& triangles, std::uint32_t corners) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> excess;
  const auto use = [&](std::uint32_t a, std::uint32_t b, int by) {
    excess[std::minmax(a, b)] += a < b ? by : -by;
  };
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) use(t[k], t[(k + 1) % 3], 1);
  for (std::uint32_t i = 0; i < corners; ++i) use(i, (i + 1) % corners, -1);
  return std::ranges::all_of(excess, [](const auto& edge) { return edge.second == 0; });
}

TEST(Triangulation, CoversAFaceThatDoesNotCrossItselfOnce) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(300); ++round) {
    std::vector<Point3> face;
    const std::size_t corners = std::uniform_int_distribution<std::size_t>(4, 300)(random);
    if (round % 2 == 0) {
      face =
          spiral(std::max<std::size_t>(corners, 120), std::uniform_real_distribution<double>(0.5, 5)(random));
    } else {
      for (std::size_t i = 0; i < corners; ++i) {
        const double angle = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(corners),
                     radius = std::uniform_real_distribution<double>(0.1, 1)(random);
        face.push_back({radius * std::cos(angle), radius * std::sin(angle), 0});
      }
    }
    const auto triangles = triangles_of(face);
    ASSERT_EQ(triangles.size(), face.size() - 2);
    ASSERT_TRUE(has_edges_of_face(triangles, static_cast<std::uint32_t>(face.size())));
    double sum = 0;
    for (const Triangle& t : triangles) {
      const auto at = [&](std::size_t k) { return Point2{face[t[k]][0], face[t[k]][1]}; };
      ASSERT_EQ(orientation(at(0), at(1), at(2)), 1) << "round " << round;
      sum += area_of(face, t);
    }
    ASSERT_NEAR(sum, area_of(face), 1e-9 * sum) << "round " << round;
  }
}

/// Corners on a small grid: many coincide, lie on edges, and edges cross.
TEST(Triangulation, KeepsTheEdgesOfAnyFace) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(300); ++round) {
    std::vector<Point3> face(std::uniform_int_distribution<std::size_t>(3, 80)(random));
    for (Point3& p : face)
      for (double& x : p) x = std::uniform_int_distribution<int>(0, 5)(random);
    const auto triangles = triangles_of(face);
    ASSERT_EQ(triangles.size(), face.size() - 2);
    ASSERT_TRUE(has_edges_of_face(triangles, static_cast<std::uint32_t>(face.size())));
  }
}

/// 16 times the corners of a spiral take some 25 times as long, 60 on a busy machine, not 256 times.
TEST(Triangulation, TimeGrowsLikeNLogN) {
  if (samples::is_sanitized) GTEST_SKIP() << "times are those of other builds";
  const auto seconds = [](std::size_t corners) {
    double least = 1e9;
    for (int i = 0; i < 3; ++i) {
      const auto face = spiral(corners, 50);
      const std::clock_t start = std::clock();
      EXPECT_EQ(triangles_of(face).size(), corners - 2);
      least = std::min(least, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    return least;
  };
  EXPECT_LT(seconds(40'000), 120 * seconds(2'500) + 0.01);
}

TEST(IndexSet, FindsTheNextOne) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (const std::uint32_t bound : {1U, 63U, 64U, 65U, 4096U, 5000U, 300'000U}) {
    std::uniform_int_distribution<std::uint32_t> any(0, bound - 1);
    IndexSet set;
    set.fill(bound);
    EXPECT_EQ(set.next(0), 0U);
    EXPECT_EQ(set.next(bound - 1), bound - 1);
    EXPECT_EQ(set.next(bound), IndexSet::none);
    for (std::uint32_t i = 0; i < bound; ++i) set.erase(i);
    std::set<std::uint32_t> expected;
    for (int step = 0; step < 2000; ++step) {
      const std::uint32_t i = any(random), from = any(random);
      if (step % 3 == 0) {
        set.insert(i);
        expected.insert(i);
      } else {
        set.erase(i);
        expected.erase(i);
      }
      const auto next = expected.lower_bound(from);
      ASSERT_EQ(set.next(from), next == expected.end() ? IndexSet::none : *next);
    }
  }
}

TEST(PlaneTree, FindsWhatIsInATriangle) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_int_distribution<int> coordinate(0, 30);
  const auto any_point = [&] {
    return Point2{static_cast<double>(coordinate(random)), static_cast<double>(coordinate(random))};
  };
  for (int round = 0; round < samples::rounds(200); ++round) {
    const std::uint32_t names = std::uniform_int_distribution<std::uint32_t>(1, 200)(random);
    std::vector<PlaneTree::Entry> entries;
    std::map<std::uint32_t, Point2> present;
    for (std::uint32_t i = 0; i < names; ++i)
      if (random() % 2 == 0) entries.push_back({any_point(), i});
    for (const auto& entry : entries) present[entry.name] = entry.at;
    PlaneTree tree;
    tree.build(entries, names);
    for (const auto& entry : entries)
      if (random() % 2 == 0) tree.count(entry.name, -1), present.erase(entry.name);
    for (int look = 0; look < 20; ++look) {
      const Point2 a = any_point(), b = any_point(), c = any_point();
      if (orientation(a, b, c) <= 0) continue;
      const bool rim = random() % 2 == 0;
      const auto is_in = [&](const Point2& at) {
        const int least = rim ? 0 : 1;
        return orientation(a, b, at) >= least && orientation(b, c, at) >= least &&
               orientation(c, a, at) >= least;
      };
      const bool expected = std::ranges::any_of(present, [&](const auto& one) { return is_in(one.second); });
      const auto found = tree.find_in(
          {a, b, c}, rim, [&](std::uint32_t name) { return present.contains(name) && is_in(present[name]); });
      ASSERT_EQ(found.has_value(), expected);
    }
  }
}

}  // namespace
}  // namespace bsp2::model
