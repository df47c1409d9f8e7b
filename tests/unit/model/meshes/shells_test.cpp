// Shells of meshes: nests of boxes whose orientation is known by construction.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include "builder/mesh_shells.hpp"
#include "mesh/mesh_crossing.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

using Corner = std::array<int, 3>;

struct Block {
  Corner low, high;
};

void turn(TriangleMesh& mesh, std::size_t from) {
  for (std::size_t i = from; i < mesh.triangles.size(); ++i)
    std::swap(mesh.triangles[i][1], mesh.triangles[i][2]);
}

void add(TriangleMesh& mesh, const Block& block, bool is_inward) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (unsigned i = 0; i < 8; ++i) {
    Point3& p = mesh.points.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) p[k] = (i >> k & 1 ? block.high : block.low)[k];
  }
  const std::size_t from = mesh.triangles.size();
  for (const auto& [a, b, c] : std::to_array<std::array<std::uint32_t, 3>>({{0, 2, 1},
                                                                            {1, 2, 3},
                                                                            {4, 5, 6},
                                                                            {5, 7, 6},
                                                                            {0, 1, 4},
                                                                            {1, 5, 4},
                                                                            {2, 6, 3},
                                                                            {3, 6, 7},
                                                                            {0, 4, 2},
                                                                            {2, 4, 6},
                                                                            {1, 3, 5},
                                                                            {3, 7, 5}}))
    mesh.triangles.push_back({first + a, first + b, first + c});
  if (is_inward) turn(mesh, from);
}

/// A map of determinant 1 of the integers, so that planes stay planes exactly.
void shear(TriangleMesh& mesh, std::mt19937& random) {
  for (int i = 0; i < 3; ++i) {
    const std::size_t k = random() % 3, l = (k + 1 + random() % 2) % 3;
    const double by = static_cast<double>(random() % 5) - 2;
    for (Point3& p : mesh.points) p[k] += by * p[l];
  }
}

/// A box and what is in it: cavities in a solid, solids in a cavity. They may touch each other and the box.
struct Nest {
  std::mt19937& random;
  TriangleMesh mesh;
  std::vector<std::size_t> parents;  ///< of each shell; its own number for those in nothing

  void fill(const Block& block, bool is_inward, std::size_t parent) {
    const std::size_t shell = parents.size();
    parents.push_back(parent == none ? shell : parent);
    add(mesh, block, is_inward);
    for (const Block& part : parts_of(block))
      if (random() % 2 == 0 && (part.low != block.low || part.high != block.high))
        fill(part, !is_inward, shell);
  }

  /// Cut at random places, up to three times.
  std::vector<Block> parts_of(const Block& block) {
    std::vector<Block> parts{block};
    for (auto cuts = random() % 4; cuts > 0; --cuts) {
      Block& part = parts[random() % parts.size()];
      const std::size_t k = random() % 3;
      const int length = part.high[k] - part.low[k];
      if (length < 2) continue;
      Block rest = part;
      part.high[k] = rest.low[k] =
          part.low[k] + 1 + static_cast<int>(random() % static_cast<unsigned>(length - 1));
      parts.push_back(rest);
    }
    return parts;
  }

  static constexpr std::size_t none = ~std::size_t{0};
};

TEST(Shells, GoodNestsStayAsTheyAreAndTurnedOnesAreTurnedBack) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::size_t most = 0, all_turned = 0;
  for (int round = 0; round < samples::rounds(100); ++round) {
    Nest nest{random, {}, {}};
    nest.fill({{0, 0, 0}, {6, 6, 6}}, false, Nest::none);
    nest.fill({{6, static_cast<int>(random() % 7), 0}, {9, 9, 6}}, false, Nest::none);  // beside it, touching
    TriangleMesh mesh = nest.mesh;
    shear(mesh, random);
    ASSERT_EQ(shells_of(mesh).count, nest.parents.size());
    most = std::max(most, nest.parents.size());
    TriangleMesh good = mesh;
    const ShellFaults none = turn_shells(good);
    EXPECT_EQ(none.turned, 0U) << "round " << round;
    EXPECT_EQ(none.nested, 0U) << "round " << round;
    EXPECT_EQ(good.triangles, mesh.triangles);
    EXPECT_FALSE(self_crossing(mesh)) << "round " << round << ": " << text_of(*self_crossing(mesh));

    // A cavity may have been turned only if what is around it was, else it could as well be meant as a solid.
    TriangleMesh bad = mesh;
    std::vector<bool> turned, is_inward;
    for (std::size_t shell = 0; shell < nest.parents.size(); ++shell) {
      const std::size_t parent = nest.parents[shell];
      is_inward.push_back(parent != shell && !is_inward[parent]);
      turned.push_back(random() % 3 == 0 && (!is_inward[shell] || turned[parent]));
      for (std::size_t i = 12 * shell; i < 12 * shell + 12 && turned[shell]; ++i)
        std::swap(bad.triangles[i][1], bad.triangles[i][2]);
    }
    const ShellFaults faults = turn_shells(bad);
    const auto expected = static_cast<std::uint32_t>(std::count(turned.begin(), turned.end(), true));
    EXPECT_EQ(faults.turned, expected) << "round " << round;
    EXPECT_EQ(faults.nested, 0U) << "round " << round;
    EXPECT_EQ(bad.triangles, mesh.triangles) << "round " << round;
    all_turned += expected;
  }
  EXPECT_GT(most, samples::rounds(10U));
  EXPECT_GT(all_turned, samples::rounds(50U));
}

/// Two boxes as one mesh, beside intervals: they cross unless they are apart, touch, or one lies strictly in
/// the other.
TEST(Shells, BoxesThatShareSpaceCrossOrAreNested) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  int crossing = 0, nested = 0;
  for (int round = 0; round < samples::rounds(3000); ++round) {
    Block blocks[2];
    for (Block& block : blocks)
      for (std::size_t k = 0; k < 3; ++k) {
        block.low[k] = static_cast<int>(random() % 4);
        block.high[k] = block.low[k] + 1 + static_cast<int>(random() % 4);
      }
    if (round % 10 == 0)
      for (std::size_t k = 0; k < 3; ++k) blocks[0].low[k] -= 2, blocks[0].high[k] += 3;
    const auto all = [&](const std::function<bool(std::size_t)>& is) { return is(0) && is(1) && is(2); };
    const auto in = [&](const Block& a, const Block& b, bool strictly) {
      return all([&](std::size_t k) {
        return a.low[k] >= b.low[k] + strictly && a.high[k] <= b.high[k] - strictly;
      });
    };
    const bool share = all([&](std::size_t k) {
      return blocks[0].low[k] < blocks[1].high[k] && blocks[1].low[k] < blocks[0].high[k];
    });
    const bool is_deep = in(blocks[0], blocks[1], true) || in(blocks[1], blocks[0], true);
    const bool is_inside = in(blocks[0], blocks[1], false) || in(blocks[1], blocks[0], false);
    TriangleMesh mesh;
    add(mesh, blocks[0], false);
    add(mesh, blocks[1], false);
    shear(mesh, random);
    const auto found = self_crossing(mesh);
    EXPECT_EQ(found.has_value(), share && !is_deep) << "round " << round;
    crossing += share && !is_deep;
    TriangleMesh same = mesh;
    const ShellFaults faults = turn_shells(same);
    EXPECT_EQ(faults.turned, 0U);
    if (!is_inside || is_deep) {
      EXPECT_EQ(faults.nested, is_deep) << "round " << round;
    }
    nested += is_deep;
    if (is_inside) continue;
    TriangleMesh turned = mesh;
    turn(turned, 12);
    EXPECT_EQ(turn_shells(turned).turned, 1U) << "round " << round;
    EXPECT_EQ(turned.triangles, mesh.triangles) << "round " << round;
  }
  EXPECT_GT(crossing, samples::rounds(500));
  EXPECT_GT(nested, samples::rounds(20));
}

TEST(Shells, SolidsThatShareAnEdgeOrAVertexAreTwo) {
  TriangleMesh mesh;
  add(mesh, {{0, 0, 0}, {1, 1, 1}}, false);
  add(mesh, {{1, 1, 0}, {2, 2, 1}}, true);
  for (auto& triangle : mesh.triangles)  // equal points are one, as after an import
    for (std::uint32_t& corner : triangle)
      corner = static_cast<std::uint32_t>(
          std::find(mesh.points.begin(), mesh.points.end(), mesh.points[corner]) - mesh.points.begin());
  EXPECT_EQ(shells_of(mesh).count, 2U);
  const ShellFaults faults = turn_shells(mesh);
  EXPECT_EQ(faults.turned, 1U);
  EXPECT_EQ(volume(mesh), 2);
  EXPECT_EQ(shells_of({}).count, 0U);
}

/// A column whose walls are cut into rings: nearly all of its triangles are parallel to one axis.
void add_column(TriangleMesh& mesh, const Corner& low, std::uint32_t rings, std::size_t axis) {
  const auto first = static_cast<std::uint32_t>(mesh.points.size());
  for (std::uint32_t ring = 0; ring <= rings; ++ring)
    for (const auto& [x, y] : std::to_array<std::array<int, 2>>({{0, 0}, {2, 0}, {2, 2}, {0, 2}})) {
      const Point3 p{static_cast<double>(low[0] + x), static_cast<double>(low[1] + y),
                     low[2] + 10.0 * ring / rings};
      mesh.points.push_back({p[(3 - axis) % 3], p[(4 - axis) % 3], p[(5 - axis) % 3]});
    }
  for (std::uint32_t a = first; a < first + 4 * rings; a += 4)
    for (std::uint32_t i = 0; i < 4; ++i) {
      const std::uint32_t j = (i + 1) % 4;
      mesh.triangles.push_back({a + i, a + j, a + 4 + j});
      mesh.triangles.push_back({a + i, a + 4 + j, a + 4 + i});
    }
  const std::uint32_t top = first + 4 * rings;
  mesh.triangles.insert(mesh.triangles.end(), {{first, first + 2, first + 1},
                                               {first, first + 3, first + 2},
                                               {top, top + 1, top + 2},
                                               {top, top + 2, top + 3}});
}

TEST(Shells, AreTurnedHoweverTheirWallsAreCut) {
  for (const std::uint32_t rings : {1U, 30U, 200U})
    for (std::size_t axis = 0; axis < 3; ++axis) {
      TriangleMesh mesh;
      add_column(mesh, {0, 0, 0}, rings, axis);
      const std::size_t from = mesh.triangles.size();
      add_column(mesh, {1, 1, 1}, rings, axis);
      const TriangleMesh good = mesh;
      turn(mesh, from);
      const ShellFaults faults = turn_shells(mesh);
      EXPECT_EQ(faults.turned, 1U) << rings << " rings along " << axis;
      EXPECT_NEAR(volume(mesh), volume(good), 1e-9);
    }
}

/// So deep that lines are rationed: all shells are still told apart, whichever of them are turned.
TEST(Shells, ADeepNestIsToldApart) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  const int count = 2 * samples::rounds(200);
  std::vector<int> sizes(static_cast<std::size_t>(count));
  std::iota(sizes.begin(), sizes.end(), 1);
  std::shuffle(sizes.begin(), sizes.end(), random);
  TriangleMesh good, alike, bad;
  const int first_turned =
      1 + static_cast<int>(random() % static_cast<unsigned>(count));  // it and all around it
  for (const int size : sizes) {
    const Block block{{-size, -size, -size}, {size, size, size}};
    const bool is_cavity = size % 2 != 0;  // the largest is a solid
    add(good, block, is_cavity);
    add(bad, block, is_cavity != (size >= first_turned));
    add(alike, block, false);
  }
  const TriangleMesh expected = good;
  EXPECT_EQ(turn_shells(good).turned, 0U);
  EXPECT_EQ(turn_shells(bad).turned, static_cast<std::uint32_t>(count + 1 - first_turned));
  EXPECT_EQ(bad.triangles, expected.triangles);
  EXPECT_EQ(turn_shells(alike).nested, static_cast<std::uint32_t>(count - 1));
}

TEST(Shells, AShellIsTurnedByItselfHoweverThinItIs) {
  TriangleMesh mesh{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.25, 0.25, 1e-300}},
                    {{0, 1, 2}, {0, 3, 1}, {1, 3, 2}, {2, 3, 0}}};
  add(mesh, {{3, 3, 3}, {4, 4, 4}}, false);
  const TriangleMesh before = mesh;
  const ShellFaults faults = turn_shells(mesh);
  EXPECT_EQ(faults.shells, 2U);
  EXPECT_EQ(faults.turned, 1U);
  EXPECT_NE(mesh.triangles[0], before.triangles[0]);
  EXPECT_EQ(mesh.triangles[5], before.triangles[5]);
}

}  // namespace
}  // namespace bsp2::model
