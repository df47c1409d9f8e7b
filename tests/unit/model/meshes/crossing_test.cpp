// Meshes that cross themselves, beside a solver of linear equations, and meshes that only touch themselves.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "bsp2/geometry/support/box_tree.hpp"
#include "mesh/mesh_crossing.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

TriangleMesh box(const Point3& low, const Point3& high) {
  TriangleMesh mesh;
  for (unsigned i = 0; i < 8; ++i)
    mesh.points.push_back({i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]});
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TriangleMesh both(TriangleMesh mesh, const TriangleMesh& other) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  mesh.points.insert(mesh.points.end(), other.points.begin(), other.points.end());
  for (const auto& [a, b, c] : other.triangles) mesh.triangles.push_back({first + a, first + b, first + c});
  return mesh;
}

double determinant(const Point3& u, const Point3& v, const Point3& w) {
  return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

/// By Cramer's rule: p + t (q - p) = a + x (b - a) + y (c - a).
bool goes_through(const Point3& p, const Point3& q, const Point3& a, const Point3& b, const Point3& c) {
  Point3 d, u, v, r;
  for (std::size_t k = 0; k < 3; ++k)
    d[k] = p[k] - q[k], u[k] = b[k] - a[k], v[k] = c[k] - a[k], r[k] = p[k] - a[k];
  const double all = determinant(d, u, v), t = determinant(r, u, v) / all, x = determinant(d, r, v) / all,
               y = determinant(d, u, r) / all;
  return t > 0 && t < 1 && x > 0 && y > 0 && x + y < 1;
}

TEST(Crossing, IsFoundWhereAnEdgeGoesThroughATriangle) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(0, 1);
  int crossing = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    TriangleMesh mesh;  // two tetrahedra
    for (std::uint32_t first : {0U, 4U}) {
      for (int i = 0; i < 4; ++i)
        mesh.points.push_back(
            {coordinate(random) + (first == 0 ? 0 : 0.4), coordinate(random), coordinate(random)});
      for (const auto& [a, b, c] : {std::array{0U, 2U, 1U}, {0U, 1U, 3U}, {0U, 3U, 2U}, {1U, 2U, 3U}})
        mesh.triangles.push_back({first + a, first + b, first + c});
    }
    bool expected = false;
    for (std::size_t s = 0; s < 8; ++s)
      for (std::size_t t = 0; t < 8; ++t)
        for (std::size_t k = 0; k < 3 && (s < 4) != (t < 4); ++k) {
          const auto& own = mesh.triangles[s];
          const auto& [a, b, c] = mesh.triangles[t];
          expected |= goes_through(mesh.points[own[k]], mesh.points[own[(k + 1) % 3]], mesh.points[a],
                                   mesh.points[b], mesh.points[c]);
        }
    const auto found = self_crossing(mesh);
    ASSERT_EQ(found.has_value(), expected) << "round " << round;
    if (found) {
      EXPECT_TRUE(found->other.size() == 2 &&
                  goes_through(found->other[0], found->other[1], found->triangle[0], found->triangle[1],
                               found->triangle[2]));
    }
    crossing += expected;
  }
  EXPECT_GT(crossing, samples::rounds(200));
  EXPECT_LT(crossing, 1800);
}

/// The edges go through the middles of faces, on their diagonals.
TEST(Crossing, IsFoundBetweenBoxesOnAGrid) {
  EXPECT_TRUE(self_crossing(both(box({0, 0, 0}, {2, 2, 2}), box({1, 1, 1}, {3, 3, 3}))));
  EXPECT_TRUE(self_crossing(both(box({0, 0, 0}, {4, 4, 4}), box({1, 1, -1}, {3, 3, 5})))) << "right through";
}

using Whole = std::array<int, 3>;

int determinant(const Whole& u, const Whole& v, const Whole& w) {
  return u[0] * (v[1] * w[2] - v[2] * w[1]) - u[1] * (v[0] * w[2] - v[2] * w[0]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

using Tetrahedron = std::array<Whole, 4>;

Whole difference(const Whole& p, const Whole& q) { return {p[0] - q[0], p[1] - q[1], p[2] - q[2]}; }

/// Positively wound, on a small grid.
Tetrahedron any_tetrahedron(std::mt19937& random) {
  for (;;) {
    Tetrahedron t;
    for (Whole& p : t)
      for (int& x : p) x = std::uniform_int_distribution<int>(0, 4)(random);
    const int volume = determinant(difference(t[1], t[0]), difference(t[2], t[0]), difference(t[3], t[0]));
    if (volume < 0) std::swap(t[0], t[1]);
    if (volume != 0) return t;
  }
}

TriangleMesh mesh_of(const Tetrahedron& t) {
  TriangleMesh mesh;
  for (const auto& [x, y, z] : t)
    mesh.points.push_back({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

/// Whether a plane parts them, by all that convex solids can be parted by; they may touch it.
bool are_parted(const Tetrahedron& s, const Tetrahedron& t) {
  std::vector<Whole> of_s, of_t, normals;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < i; ++j)
      of_s.push_back(difference(s[i], s[j])), of_t.push_back(difference(t[i], t[j]));
  const auto add = [&](const std::vector<Whole>& us, const std::vector<Whole>& vs) {
    for (const Whole& u : us)
      for (const Whole& v : vs)
        normals.push_back({u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]});
  };
  add(of_s, of_s), add(of_t, of_t), add(of_s, of_t);
  return std::ranges::any_of(normals, [&](const Whole& n) {
    if (n == Whole{0, 0, 0}) return false;
    const auto range = [&](const Tetrahedron& all) {
      std::array<int, 4> along{};
      for (std::size_t i = 0; i < 4; ++i) along[i] = n[0] * all[i][0] + n[1] * all[i][1] + n[2] * all[i][2];
      return std::minmax({along[0], along[1], along[2], along[3]});
    };
    const auto [low, high] = range(s);
    const auto [other_low, other_high] = range(t);
    return high <= other_low || other_high <= low;
  });
}

bool contains(const Tetrahedron& outer, const Tetrahedron& inner) {
  return std::ranges::all_of(inner, [&](const Whole& p) {
    return std::ranges::all_of(
        std::array<std::array<std::size_t, 3>, 4>{{{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}},
        [&](const auto& face) {
          const auto& [a, b, c] = face;
          return determinant(difference(outer[b], outer[a]), difference(outer[c], outer[a]),
                             difference(p, outer[a])) <= 0;
        });
  });
}

/// Each edge of two tetrahedra in a cube passes exactly through an edge of the other one.
TEST(Crossing, IsFoundWhereEdgesOnlyMeetEdges) {
  const auto found = self_crossing(both(mesh_of({{{0, 0, 0}, {2, 2, 0}, {2, 0, 2}, {0, 2, 2}}}),
                                        mesh_of({{{0, 0, 2}, {2, 2, 2}, {0, 2, 0}, {2, 0, 0}}})));
  ASSERT_TRUE(found);
  EXPECT_EQ(found->other.size(), 3U);
  EXPECT_NE(text_of(*found).find("go through each other"), std::string::npos) << text_of(*found);
}

/// On a small grid, where edges meet edges and corners, and corners lie in faces.
TEST(Crossing, IsFoundWhereConvexSolidsShareSpace) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(3000); ++round) {
    const Tetrahedron s = any_tetrahedron(random), t = any_tetrahedron(random);
    const bool apart = are_parted(s, t);
    if (!apart && (contains(s, t) || contains(t, s))) continue;  // they may touch from inside
    EXPECT_EQ(self_crossing(both(mesh_of(s), mesh_of(t))).has_value(), !apart) << "round " << round;
  }
}

/// Of many boxes: any two that cross are found, by any number of threads, and the same place is told.
TEST(Crossing, IsTheSameForAnyThreads) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  int crossing = 0;
  constexpr int rounds = 40;
  for (int round = 0; round < rounds; ++round) {
    const bool on_grid = round % 2 == 0;  // there edges hit edges, and faces lie in each other
    std::vector<TriangleMesh> boxes;
    std::vector<geometry::Box3> bounds;
    TriangleMesh all;
    for (int i = 0; i < 400; ++i) {  // so many that threads share the work
      auto& [low, high] = bounds.emplace_back();
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::uniform_real_distribution<double>(0, 110)(random);
        high[k] = low[k] + std::uniform_real_distribution<double>(0.1, 2)(random);
        if (on_grid) low[k] = std::floor(low[k]), high[k] = low[k] + 2;
      }
      all = both(all, boxes.emplace_back(box(low, high)));
    }
    const auto found = self_crossing(all);
    crossing += found ? 1 : 0;
    if (!on_grid) {
      bool expected = false;
      for (std::size_t i = 0; i < boxes.size(); ++i)
        for (std::size_t j = 0; j < i && !expected; ++j)
          expected = bounds[i].meets(bounds[j]) && self_crossing(both(boxes[i], boxes[j]));
      ASSERT_EQ(found.has_value(), expected);
    }
    for (const unsigned threads : {2U, 3U}) {
      const auto again = self_crossing(all, threads);
      ASSERT_EQ(again.has_value(), found.has_value());
      ASSERT_EQ(again ? text_of(*again) : "", found ? text_of(*found) : "");
    }
  }
  EXPECT_GT(crossing, rounds / 20);
  EXPECT_LT(crossing, rounds);
}

TEST(Crossing, TouchingIsNone) {
  const TriangleMesh unit = box({0, 0, 0}, {2, 2, 2});
  EXPECT_FALSE(self_crossing({}));
  EXPECT_FALSE(self_crossing(unit));
  for (const Point3& at :
       {Point3{2, 0, 0}, {2, 1, 1}, {2, 2, 0}, {2, 2, 1}, {2, 2, 2}, {5, 0, 0}, {0.5, 0.5, 0.5}})
    EXPECT_FALSE(self_crossing(both(unit, box(at, {at[0] + 1, at[1] + 1, at[2] + 1}))))
        << at[0] << ' ' << at[1] << ' ' << at[2];
  // Two tents whose ridges touch crosswise.
  const TriangleMesh lower{{{0, -1, -1}, {0, 1, -1}, {-1, 0, 0}, {1, 0, 0}},
                           {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  const TriangleMesh upper{{{-1, 0, 1}, {1, 0, 1}, {0, -1, 0}, {0, 1, 0}},
                           {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
  EXPECT_FALSE(self_crossing(both(lower, upper)));
  TriangleMesh sunk = upper;
  for (Point3& p : sunk.points) p[2] -= 1e-9;
  EXPECT_TRUE(self_crossing(both(lower, sunk)));
}

}  // namespace
}  // namespace bsp2::model
