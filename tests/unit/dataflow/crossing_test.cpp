// How winding numbers change along a segment, against whole numbers.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "bsp2/dataflow/shapes/facet_tree.hpp"
#include "dataflow/oracle.hpp"
#include "shapes/facet_crossing.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using UniformRegion = std::array<std::int64_t, 3>;

std::int64_t determinant(const UniformRegion& u, const UniformRegion& v, const UniformRegion& w) {
  return u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) +
         u[2] * (v[0] * w[1] - v[1] * w[0]);
}

UniformRegion minus(const UniformRegion& a, const UniformRegion& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

/// 1 or -1 where the segment from p to q goes through the inside of abc, 0 where it has no point in common
/// with the facet, else nothing.
std::optional<int> exact_crossing(const UniformRegion& p, const UniformRegion& q, const UniformRegion& a,
                                  const UniformRegion& b, const UniformRegion& c) {
  const auto p_side = determinant(minus(a, p), minus(b, p), minus(c, p)),
             q_side = determinant(minus(a, q), minus(b, q), minus(c, q));
  if ((p_side > 0 && q_side > 0) || (p_side < 0 && q_side < 0)) return 0;
  const UniformRegion along = minus(q, p);
  const std::array<std::int64_t, 3> line{determinant(along, minus(a, p), minus(b, p)),
                                         determinant(along, minus(b, p), minus(c, p)),
                                         determinant(along, minus(c, p), minus(a, p))};
  const auto count = [&](int sign) {
    return std::count_if(line.begin(), line.end(), [&](std::int64_t x) { return x * sign > 0; });
  };
  if (count(1) > 0 && count(-1) > 0) return 0;
  if (p_side == 0 || q_side == 0 || count(1) + count(-1) < 3) return std::nullopt;
  return p_side < 0 ? 1 : -1;
}

/// Points are known up to an error: what is called certain is true of the points themselves.
TEST(Crossing, WhatIsCertainIsTrue) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int crossings = 0, certain = 0, missed = 0, none = 0;
  constexpr int rounds = 200000;
  for (int round = 0; round < rounds; ++round) {
    const int size = 1 << pick(random, 1, 8);  // small ones touch and lie in one plane
    const double error = pick(random, 0, 3) == 0 ? 0 : uniform(random, 0, 0.3);
    std::array<UniformRegion, 5> exact;
    std::array<std::array<double, 3>, 5> known;
    for (std::size_t i = 0; i < 5; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        exact[i][k] = pick(random, -size, size);
        known[i][k] = static_cast<double>(exact[i][k]) +
                      uniform(random, -error / 2, error / 2);  // differences are off by `error`
      }
    const auto& [p, q, a, b, c] = known;
    const auto expected = exact_crossing(exact[0], exact[1], exact[2], exact[3], exact[4]);
    const auto found = crossing(p, q, a, b, c, error);
    const bool misses = SegmentAmongFacets(p, q, error).misses(a, b, c);
    ASSERT_TRUE(!found || found == expected) << round;
    ASSERT_TRUE(!misses || expected.value_or(0) == 0) << round;
    crossings += expected.value_or(0) != 0 ? 1 : 0;
    none += expected == 0 ? 1 : 0;
    certain += found ? 1 : 0;
    missed += misses ? 1 : 0;
  }
  EXPECT_GT(crossings, rounds / 50);
  EXPECT_GT(certain, rounds / 2);
  EXPECT_GT(missed, none / 2);
}

/// Facets along a segment: a tree passes over none that does not certainly miss it, and over most of the
/// others.
TEST(Crossing, ATreeFindsTheFacetsAlongASegment) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  using Point = std::array<double, 3>;
  for (int round = 0; round < samples::rounds(60); ++round) {
    const auto count = static_cast<std::size_t>(pick(random, 0, 3000));
    const double reach = uniform(random, 0.001, 0.3),
                 error = pick(random, 0, 1) == 0 ? 0 : uniform(random, 0, 0.01);
    const auto any_point = [&](double low, double high) {
      return Point{uniform(random, low, high), uniform(random, low, high), uniform(random, low, high)};
    };
    std::vector<std::array<Point, 3>> facets(count);
    std::vector<FacetTree::Box> boxes;
    for (auto& facet : facets) {
      const Point centre = any_point(0, 1);
      for (Point& corner : facet) {
        const Point way = any_point(-reach, reach);
        for (std::size_t i = 0; i < 3; ++i) corner[i] = centre[i] + way[i];
      }
      FacetTree::Box box{facet[0], facet[0]};
      for (const Point& corner : facet)
        for (std::size_t i = 0; i < 3; ++i)
          box.low[i] = std::min(box.low[i], corner[i]), box.high[i] = std::max(box.high[i], corner[i]);
      boxes.push_back(box);
    }
    const FacetTree tree(boxes);
    for (int segments = 0; segments < 10; ++segments) {
      const Point p = any_point(-1, 2), q = any_point(-1, 2);
      const SegmentAmongFacets segment(p, q, error);
      std::vector<bool> seen(count);
      std::size_t visited = 0;
      tree.visit([&](const FacetTree::Box& box) { return segment.misses_box(box.low, box.high); },
                 [&](std::uint32_t facet) {
                   EXPECT_FALSE(seen[facet]) << "each once";
                   seen[facet] = true;
                   ++visited;
                   return true;
                 });
      for (std::size_t i = 0; i < count; ++i)
        ASSERT_TRUE(seen[i] || segment.misses(facets[i][0], facets[i][1], facets[i][2]))
            << "facet " << i << " of " << count;
      if (reach < 0.02 && error < 0.01 && count > 1000) {
        EXPECT_LT(visited, count / 4);
      }
    }
  }
}

}  // namespace
}  // namespace bsp2::dataflow
