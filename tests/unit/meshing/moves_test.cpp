// How far the surface of a mesh is from that of the solid, where much is cleaned.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "meshing/mesh_checks.hpp"
#include "support/rounds.hpp"

namespace bsp2::meshing {
namespace {

using Triangles = std::vector<std::array<Point, 3>>;

double length(const Point& a, const Point& b) { return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]); }

Point between(const Point& a, const Point& b, double share) {
  return {a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2])};
}

double distance_from_segment(const Point& x, const Point& a, const Point& b) {
  double along = 0, size = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    along += (x[k] - a[k]) * (b[k] - a[k]);
    size += (b[k] - a[k]) * (b[k] - a[k]);
  }
  return length(x, between(a, b, size > 0 ? std::clamp(along / size, 0.0, 1.0) : 0));
}

/// From its plane if x is above it: the three triangles that it makes with the sides are as large together.
/// Else from a side.
double distance_from_triangle(const Point& x, const std::array<Point, 3>& t) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < 3; ++k) least = std::min(least, distance_from_segment(x, t[k], t[(k + 1) % 3]));
  const double whole = area(t[0], t[1], t[2]);
  if (!(whole > 0)) return least;
  const double off = std::fabs(static_cast<double>(cone(x, t[0], t[1], t[2]))) * 3 / whole;
  Point normal{}, foot = x;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    normal[k] =
        ((t[1][l] - t[0][l]) * (t[2][m] - t[0][m]) - (t[1][m] - t[0][m]) * (t[2][l] - t[0][l])) / (2 * whole);
  }
  double above = 0;
  for (std::size_t k = 0; k < 3; ++k) above += (x[k] - t[0][k]) * normal[k];
  for (std::size_t k = 0; k < 3; ++k) foot[k] -= above * normal[k];
  const double sum = area(foot, t[0], t[1]) + area(foot, t[1], t[2]) + area(foot, t[2], t[0]);
  return sum <= whole * (1 + 1e-9) ? std::min(least, off) : least;
}

double distance_from(const Point& x, const Triangles& surface) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& triangle : surface) least = std::min(least, distance_from_triangle(x, triangle));
  return least;
}

/// Of corners, and of points inside of triangles, of one surface from the other one: of some of them.
double farthest(const Triangles& from, const Triangles& to, Random& random) {
  constexpr double looked_at = 1500;
  double most = 0;
  for (const auto& [a, b, c] : from) {
    if (!dataflow::chance(random, looked_at / static_cast<double>(from.size()))) continue;
    for (const Point& x :
         {a, between(a, between(b, c, dataflow::uniform(random, 0, 1)), dataflow::uniform(random, 0, 1))})
      most = std::max(most, distance_from(x, to));
  }
  return most;
}

Triangles outside_of(const Tetrahedra& mesh) {
  Triangles all;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
    if (const auto& [a, b, c] = mesh.triangles[i]; mesh.sides[mesh.side[i]].other == PlaneSide::nothing)
      all.push_back({mesh.points[a], mesh.points[b], mesh.points[c]});
  return all;
}

/// Edges are divided between the first moves and the last ones: both together go no farther than they may.
TEST(Moves, SurfaceStaysAsNearAsIsTold) {
  double moved = 0;
  int looked_at = 0;
  for (int round = 0; round < samples::rounds(3); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    // Twice, a little apart: so there are strips everywhere that are about as thin as what is cleaned.
    const double clean = std::pow(10, dataflow::uniform(random, -5, -2.3));
    const auto once = dataflow::random_expression(random, 3, Kind::solids, 1);
    std::vector<double> apart{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    for (const std::size_t k : {3, 7, 11}) apart[k] = clean * dataflow::uniform(random, -0.9, 0.9);
    const auto solid = solid_of(model::unite({once, model::transform(apart, once)}), 1, 0);
    const Complex complex = conforming_complex(solid.network.table, solid.batches);
    if (complex.cells() == 0 || solid.surface.triangles.size() > 1500) continue;
    Triangles before;
    for (const auto& [a, b, c] : solid.surface.triangles)
      before.push_back({solid.surface.points[a], solid.surface.points[b], solid.surface.points[c]});
    Tetrahedra mesh = tetrahedra_of(complex);
    const ShapeOptions options{.clean = clean,
                               .most_clean = dataflow::chance(random, 0.5) ? 16 * clean : 0,
                               .size = dataflow::uniform(random, 0.6, 2),
                               .steepest_growth = 1,
                               .most = 500};
    const ShapeReport report = shape(mesh, options);
    if (report.turned > 0) continue;
    EXPECT_LE(report.clean, std::max(clean, options.most_clean));
    EXPECT_LE(report.largest_move, 1.02 * report.clean);
    ++looked_at;
    moved = std::max(moved, report.largest_move);
    const Triangles after = outside_of(mesh);
    const double most = report.largest_move + 1e-9;
    EXPECT_LE(farthest(after, before, random), most) << "of " << report.clean;
    if (testing::Test::HasFailure()) return;
  }
  if (looked_at > 2) {
    EXPECT_GT(moved, 0);
  }
}

}  // namespace
}  // namespace bsp2::meshing
