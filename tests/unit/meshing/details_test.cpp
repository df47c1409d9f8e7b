// Solids that are thin in places: strips between two of their edges that run along each other, and corners
// that are next to an edge.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/vectors.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/simplices/orientation.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::meshing {
namespace {

using dataflow::Random;

/// Two blocks, one on the other, of which the upper one stands back by this much at one side, and by more or
/// less at the others: so there are strips. All of it turned, so that nothing is exact.
model::Expression steps(Random& random, double width, bool in_parts = false) {
  const double other = width * dataflow::uniform(random, 1, 3), far = 1 + dataflow::uniform(random, 0, 1);
  const std::vector<double> up{1, 0, 0, width, 0, 1, 0, other, 0, 0, 1, 1, 0, 0, 0, 1};
  const auto upper = model::transform(up, model::cuboid({3 - width - far, 2 - 2 * other, 0.7}, false));
  const double a = dataflow::uniform(random, 0.1, 1.4);
  const std::vector<double> turn{
      std::cos(a), -std::sin(a), 0, 0, std::sin(a), std::cos(a), 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  const auto lower = model::cuboid({3, 2, 1}, false);
  return model::transform(turn, in_parts
                                    ? model::unite({model::part("lower", lower), model::part("upper", upper)})
                                    : model::unite({lower, upper}));
}

dataflow::Resolved thin_solid(const model::Expression& e) {
  return dataflow::resolved(e, dataflow::EvaluateOptions(), 0, 0);
}

void expect_valid(const Tetrahedra& mesh, double volume, double may_differ_by) {
  EXPECT_EQ(quality_of(mesh).turned, 0U);
  const FaceUse use = face_use(mesh);
  EXPECT_EQ(use.more + use.folded + use.strange, 0U);
  double sum = 0;
  for (const double part : volumes_of(mesh, 2)) sum += part;
  EXPECT_NEAR(sum, volume, may_differ_by);
}

TEST(Details, StripsAreMeshedWell) {
  for (int round = 0; round < samples::rounds(6); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = thin_solid(steps(random, std::pow(10, dataflow::uniform(random, -2, -0.5))));
    Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = 0.5});
    EXPECT_EQ(report.turned, 0U);
    EXPECT_EQ(report.too_many, 0);
    expect_valid(mesh, solid.volume, 1e-9 * solid.volume);
    const Quality quality = quality_of(mesh);
    EXPECT_GT(quality.smallest_angle, 3);
    EXPECT_LE(100 * quality.tetrahedra_below[2], mesh.tetrahedra.size());
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Details, WhatIsThinnerThanIsCleanedIsAbsorbed) {
  for (int round = 0; round < samples::rounds(12); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = thin_solid(steps(random, std::pow(10, dataflow::uniform(random, -12, -7))));
    Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = 0.5});
    EXPECT_EQ(report.turned, 0U);
    EXPECT_GT(report.largest_move, 0);
    EXPECT_LE(report.largest_move, 1e-6);
    expect_valid(mesh, solid.volume, 1e-9 * solid.volume + report.largest_move * solid.surface.area());
    EXPECT_GT(quality_of(mesh).smallest_angle, 3);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Details, PartsThatAreShapedByThemselvesFitTogether) {
  for (int round = 0; round < samples::rounds(4); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const double power =
        round % 2 == 0 ? dataflow::uniform(random, -9, -6.3) : dataflow::uniform(random, -1.7, -1);
    const auto solid = thin_solid(steps(random, std::pow(10, power), true));
    Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = 0.5, .most = 3000, .by_parts_from = 0});
    EXPECT_EQ(report.turned, 0U);
    EXPECT_LE(report.largest_move, 1e-6);
    expect_valid(mesh, solid.volume, 1e-9 * solid.volume + report.largest_move * solid.surface.area());
    if (testing::Test::HasFailure()) return;
  }
}

/// Where what may be added does not do for all of the strips, those that are bad then may have as much again.
TEST(Details, ThatLeaveManyBadGetMore) {
  constexpr double share = 0.2;  // of what is there where as many may be added as it takes
  for (int round = 0; round < samples::rounds(2); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = thin_solid(steps(random, 0.002));
    const Tetrahedra cones = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    Tetrahedra free = cones, bounded = cones;
    EXPECT_EQ(shape(free, {.clean = 1e-6, .size = 0.5}).turned, 0U);
    const double most = share * static_cast<double>(free.tetrahedra.size());
    EXPECT_EQ(shape(bounded, {.clean = 1e-6, .size = 0.5, .most = most}).turned, 0U);
    EXPECT_LT(bounded.tetrahedra.size(), free.tetrahedra.size());
    EXPECT_LE(100 * quality_of(bounded).tetrahedra_below[2], bounded.tetrahedra.size());
    expect_valid(bounded, solid.volume, 1e-9 * solid.volume);
  }
}

TEST(Details, ThatAreTooManyAreTold) {
  Random random(dataflow::new_seed());
  const auto solid = thin_solid(steps(random, 1e-3));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = 0.5, .most = 500});
  EXPECT_GT(report.too_many, 500);
  EXPECT_GE(report.detail, 1.0 / 128);
  expect_valid(mesh, solid.volume, 1e-9 * solid.volume);
}

/// Strips for which there are neither tetrahedra nor moves, until more may move.
TEST(Details, ThatLeaveThinOnesAreAbsorbedByLargerMoves) {
  constexpr double clean = 1e-6;
  for (int round = 0; round < samples::rounds(2); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = thin_solid(steps(random, clean * dataflow::uniform(random, 1.1, 3)));
    const Tetrahedra cones = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    Tetrahedra strict = cones, loose = cones;
    const ShapeReport little = shape(strict, {.clean = clean, .size = 2, .most = 50});
    EXPECT_EQ(little.clean, clean);
    EXPECT_LE(little.largest_move, 1.02 * clean);
    EXPECT_GT(quality_of(strict).tetrahedra_below[0], 0U);
    const ShapeReport more = shape(loose, {.clean = clean, .most_clean = 16 * clean, .size = 2, .most = 50});
    EXPECT_GE(more.clean, 2 * clean);
    EXPECT_LE(more.clean, 16 * clean);
    EXPECT_GT(more.largest_move, clean);
    EXPECT_LE(more.largest_move, 1.02 * more.clean);
    EXPECT_GT(more.thin_spared, 0U);
    EXPECT_LE(10 * quality_of(loose).tetrahedra_below[0], quality_of(strict).tetrahedra_below[0]);
    expect_valid(loose, solid.volume, 1e-9 * solid.volume + more.largest_move * solid.surface.area());
    if (testing::Test::HasFailure()) return;
  }
}

/// Of foils, walls and fins nearly all tetrahedra are thin: they stay, though larger moves would take them
/// away.
TEST(Details, FoilsWallsAndFinsStay) {
  constexpr double clean = 1e-6;
  const auto at = [](double x, double y, double z, const model::Expression& e) {
    return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
  };
  const auto foil = model::part("foil", model::cuboid({0.1, 0.07, 5 * clean}, false));
  const auto block = model::part("block", model::cuboid({0.04, 0.03, 0.05}, true));
  const auto plate = model::cuboid({1, 1, 0.1}, false);
  const auto wall = at(0.2, 0.5, 0, model::cuboid({0.6, 2.3 * clean, 0.8}, false));
  const auto fin = at(0.5, 0.5, 0.05, model::cuboid({0.005, 2.3 * clean, 0.06}, false));
  for (const auto& [e, size] :
       {std::pair(model::unite({block, foil}), 5.0), std::pair(model::unite({plate, wall}), 1e5),
        std::pair(model::unite({plate, fin}), 1e5)}) {
    const auto solid = thin_solid(e);
    const Tetrahedra before = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    Tetrahedra mesh = before;
    const ShapeReport report =
        shape(mesh, {.clean = clean, .most_clean = 16 * clean, .size = size, .most = 50});
    EXPECT_LE(report.largest_move, 1.02 * report.clean);
    const std::vector<double> volumes = volumes_of(mesh, 2), had = volumes_of(before, 2);
    for (std::size_t part = 0; part < had.size(); ++part)
      EXPECT_NEAR(volumes[part], had[part], 2e-3 * had[part]) << "of part " << part;
    std::array<double, 2> highest{};
    for (const Point& p : before.points) highest[0] = std::max(highest[0], p[2]);
    for (const Point& p : mesh.points) highest[1] = std::max(highest[1], p[2]);
    EXPECT_NEAR(highest[1], highest[0], 2 * report.clean);
  }
}

/// Faces that belong to one tetrahedron, each on a side of its own but for those of the plane z = 0.
void add_outer_faces(Tetrahedra& mesh) {
  std::map<std::array<std::uint32_t, 3>, std::vector<std::array<std::uint32_t, 3>>> uses;
  for (const auto& [a, b, c, d] : mesh.tetrahedra)
    for (const std::array<std::uint32_t, 3>& face :
         {std::array{b, c, d}, std::array{a, d, c}, std::array{a, b, d}, std::array{a, c, b}}) {
      std::array<std::uint32_t, 3> key = face;
      std::ranges::sort(key);
      uses[key].push_back(face);
    }
  for (const auto& [key, faces] : uses) {
    if (faces.size() != 1) continue;
    const auto& [a, b, c] = faces.front();
    const Point u = geometry::minus(mesh.points[b], mesh.points[a]),
                v = geometry::minus(mesh.points[c], mesh.points[a]);
    const bool is_on_top = mesh.points[a][2] == 0 && mesh.points[b][2] == 0 && mesh.points[c][2] == 0;
    const auto plane = is_on_top ? 0 : 1 + static_cast<std::uint32_t>(mesh.sides.size());
    mesh.triangles.push_back(faces.front());
    mesh.side.push_back(static_cast<std::uint32_t>(mesh.sides.size()));
    mesh.sides.push_back({plane, 0, PlaneSide::nothing, geometry::cross(u, v)});
  }
}

/// A fin of two flat tetrahedra whose rim is in the midst of the one: either alone would leave a gap.
TEST(Details, FlakesOfSeveralTetrahedraAreTakenAway) {
  constexpr double thin = 1e-7;
  Tetrahedra mesh;
  enum : std::uint32_t { a, b, c, d, e, f };
  mesh.points = {{0.01, 0, -thin}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {-1, 0, 0}, {0, 0.3, -1}};
  mesh.tetrahedra = {{a, e, d, f}, {a, d, b, f}, {e, d, c, a}, {b, c, d, a}};
  for (const auto& [p, q, r, s] : mesh.tetrahedra)
    ASSERT_GT(orientation(mesh.points[p], mesh.points[q], mesh.points[r], mesh.points[s]), 0);
  mesh.part.assign(mesh.tetrahedra.size(), 0);
  add_outer_faces(mesh);
  double volume = 0;
  for (const double part : volumes_of(mesh, 1)) volume += part;
  const ShapeReport report = shape(mesh, {.clean = 1e-6});
  EXPECT_EQ(report.taken_away, 2U);
  EXPECT_GE(report.largest_move, thin);
  EXPECT_LE(report.largest_move, 1e-6);
  EXPECT_EQ(mesh.tetrahedra.size(), 2U);
  expect_valid(mesh, volume, 4 * thin);
}

}  // namespace
}  // namespace bsp2::meshing
