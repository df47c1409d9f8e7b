#include "builder/polygon.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "support/rounds.hpp"

namespace bsp2::model {
namespace {

using PlanePoint = std::array<double, 2>;

FaceCycles cycle_of(std::size_t corners) {
  FaceCycles cycles;
  for (std::uint32_t i = 0; i < corners; ++i) cycles.corners.push_back(i);
  cycles.end_face();
  return cycles;
}

double area_of(const std::vector<PlanePoint>& cycle) {
  double twice = 0;
  for (std::size_t i = 0; i < cycle.size(); ++i) {
    const PlanePoint &p = cycle[i], &q = cycle[(i + 1) % cycle.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return twice / 2;
}

double area_of(const PolygonPieces& polygon) {
  return std::accumulate(polygon.pieces.begin(), polygon.pieces.end(), 0.0,
                         [](double sum, const ConvexPolygon& piece) { return sum + area_of(piece.points); });
}

/// Of small integers: exact.
int turn(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c) {
  const double d = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  return (d > 0) - (d < 0);
}

bool is_between(const PlanePoint& a, const PlanePoint& b, const PlanePoint& p) {
  return turn(a, b, p) == 0 && std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= p[1] && p[1] <= std::max(a[1], b[1]);
}

bool touch(const PlanePoint& a, const PlanePoint& b, const PlanePoint& c, const PlanePoint& d) {
  if (is_between(a, b, c) || is_between(a, b, d) || is_between(c, d, a) || is_between(c, d, b)) return true;
  return turn(a, b, c) * turn(a, b, d) < 0 && turn(c, d, a) * turn(c, d, b) < 0;
}

/// Every edge against every other.
bool is_simple(const std::vector<PlanePoint>& cycle) {
  const std::size_t n = cycle.size();
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = i + 2; j < n; ++j)
      if ((i > 0 || j + 1 < n) && touch(cycle[i], cycle[i + 1], cycle[j], cycle[(j + 1) % n])) return false;
  return true;
}

TEST(Polygon, PiecesAreDisjointIfItsEdgesOnlyMeetAtCorners) {
  std::mt19937 random(20);
  int simple = 0, crossing = 0;
  for (int round = 0; round < samples::rounds(20000); ++round) {
    SCOPED_TRACE("seed 20, round " + std::to_string(round));
    const std::size_t n = 4 + random() % 6;
    std::vector<PlanePoint> grid, cycle;
    for (int x = 0; x < 6; ++x)
      for (int y = 0; y < 6; ++y) grid.push_back({static_cast<double>(x), static_cast<double>(y)});
    std::shuffle(grid.begin(), grid.end(), random);
    cycle.assign(grid.begin(), grid.begin() + static_cast<std::ptrdiff_t>(n));
    bool is_straight = false;
    for (std::size_t i = 0; i < n; ++i)
      is_straight |= turn(cycle[i], cycle[(i + 1) % n], cycle[(i + 2) % n]) == 0;
    if (is_straight) continue;
    const PolygonPieces polygon = convex_pieces(cycle, cycle_of(n));
    const bool expected = is_simple(cycle);
    ++(expected ? simple : crossing);
    ASSERT_EQ(polygon.disjoint, expected);
    if (expected) {
      ASSERT_NEAR(area_of(polygon), std::fabs(area_of(cycle)), 1e-9);
    }
  }
  EXPECT_GT(simple, samples::rounds(500));
  EXPECT_GT(crossing, samples::rounds(500));
}

/// All its edges lie side by side in one direction.
TEST(Polygon, CombsOfManyTeethAreSimple) {
  std::vector<PlanePoint> comb;
  constexpr int teeth = 10000;
  for (int i = 0; i < teeth; ++i) comb.push_back({0, 2.0 * i}), comb.push_back({1, 2.0 * i + 1});
  comb.push_back({-1, 2.0 * teeth});
  comb.push_back({-1, 0});
  const PolygonPieces polygon = convex_pieces(comb, cycle_of(comb.size()));
  EXPECT_TRUE(polygon.disjoint);
  EXPECT_NEAR(area_of(polygon), std::fabs(area_of(comb)), 1e-6);
}

}  // namespace
}  // namespace bsp2::model
