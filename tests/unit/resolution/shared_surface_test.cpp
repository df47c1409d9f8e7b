// A surface that several put together is that of one, byte for byte, however its skin is dealt out.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "resolution/equal_breps.hpp"
#include "resolution/resolved.hpp"
#include "resolution/shared_skins.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Brep;
using geometry::Skin;
using geometry::TriangleSurface;

/// Who gets what is there: by chance, by faces, by planes across an axis, or one all of it.
std::vector<Skin> dealt_out_somehow(Random& random, const Skin& skin,
                                    const geometry::HyperplaneTable<3>& table, unsigned count) {
  const int way = pick(random, 0, 3);
  const auto any = [&] { return static_cast<std::size_t>(pick(random, 0, static_cast<int>(count) - 1)); };
  std::vector<std::size_t> of_face(skin.faces.size());
  for (std::size_t& share : of_face) share = any();
  const std::size_t one = any();
  const auto axis = static_cast<std::size_t>(pick(random, 0, 2));
  const double step = 2 * uniform(random, 0.5, 3) / count;
  return dealt_out(skin, count, [&](const Skin::Edge& edge) -> std::size_t {
    if (way == 0) return any();
    if (way == 1) return of_face[edge.face];
    if (way == 2) return one;
    const auto from = geometry::canonical_vertex(table, skin.vertices[edge.from]).x[axis],
               to = geometry::canonical_vertex(table, skin.vertices[edge.to]).x[axis];
    return static_cast<std::size_t>(std::clamp((from + to) / 2 / step + count / 2.0, 0.0, count - 1.0));
  });
}

void expect_surface_of_one(const TriangleSurface& surface, const TriangleSurface& of_one) {
  ASSERT_EQ(surface.points, of_one.points);
  ASSERT_EQ(surface.triangles, of_one.triangles);
  ASSERT_EQ(surface.owner, of_one.owner);
}

class RandomSharing : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Of, RandomSharing, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& p) {
                           return std::string(p.param == Kind::solids ? "solids" : "boxes");
                         });

/// Some solids have parts with names of their own.
TEST_P(RandomSharing, IsTheSurfaceOfOne) {
  std::size_t triangles = 0;
  const int rounds = samples::rounds(120);
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    auto e = random_expression(random, 3, GetParam(), 2 + round % 2);
    if (chance(random, 0.4))
      e = model::unite({model::part("a", e), model::part("b", random_expression(random, 3, GetParam(), 2)),
                        model::part("c", random_expression(random, 3, GetParam(), 1))});
    const auto r = resolved(e, {}, static_cast<unsigned>(round % 4), round % 3 == 0 ? 0 : 1e-9);
    const Skin skin = skin_of(r.network, r.batches, nullptr);
    triangles += r.surface.triangles.size();
    for (const unsigned count : {2U, 1 + static_cast<unsigned>(pick(random, 0, 6))}) {
      SCOPED_TRACE(testing::Message() << count << " shares");
      ASSERT_NO_FATAL_FAILURE(expect_surface_of_one(
          triangulated_by_all(r.network.table, dealt_out_somehow(random, skin, r.network.table, count),
                              1 + static_cast<unsigned>(round) % 2),
          r.surface));
    }
  }
  EXPECT_GT(triangles, static_cast<std::size_t>(rounds));
}

model::Expression placed_at(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}

/// Solids whose parts touch, two of them surely, with interfaces: faces, edges, shells and solids.
TEST_P(RandomSharing, HasTheFacesOfOne) {
  std::size_t open = 0, decided = 0, interfaces = 0;
  for (int round = 0; round < samples::rounds(100); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    auto e = random_expression(random, 3, GetParam(), 2 + round % 2);
    if (chance(random, 0.7))
      e = model::unite({model::part("a", e), model::part("b", random_expression(random, 3, GetParam(), 2)),
                        model::part("c", random_expression(random, 3, GetParam(), 1)),
                        model::part("d", placed_at(20, 0, 0, model::cuboid({1, 2, 3}, false))),
                        model::part("e", placed_at(21, 1, 1, model::cuboid({1, 2, 3}, false)))});
    const auto r = resolved(e, {}, static_cast<unsigned>(round % 4), round % 3 == 0 ? 0 : 1e-9);
    const Skin skin = skin_of(r.network, r.batches, nullptr, round % 4 != 0);
    TriangleSurface outer;
    const Brep of_one = geometry::brep_of(r.network.table, skin, &outer);
    const TriangleSurface all = triangulate(r.network.table, skin);
    ASSERT_NO_FATAL_FAILURE(expect_surface_of_one(outer, r.surface));
    interfaces += geometry::has_interfaces(of_one);
    for (const unsigned count : {2U, 2 + static_cast<unsigned>(pick(random, 0, 5))}) {
      SCOPED_TRACE(testing::Message() << count << " shares");
      TriangleSurface surface;
      ASSERT_NO_FATAL_FAILURE(
          expect_same(brep_by_all(r.network.table, dealt_out_somehow(random, skin, r.network.table, count),
                                  surface, open, decided, 1 + static_cast<unsigned>(round) % 2),
                      of_one));
      ASSERT_NO_FATAL_FAILURE(expect_surface_of_one(surface, all));
    }
  }
  if (std::getenv("BSP2_SEED") != nullptr) return;
  EXPECT_GT(open, 0U);
  EXPECT_GT(decided, 0U);
  EXPECT_GT(interfaces, 0U);
}

/// Edges of one face that cross, which one share finds, are divided in the faces of all.
TEST(Sharing, DividesEdgesThatCrossInAllFaces) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::vector<model::Expression> operands;
  using Outline = std::vector<std::array<double, 2>>;
  for (int i = 0; i < 25; ++i) {
    const int row = i / 5;
    const double x = 4 * (i % 5), y = 4 * row;
    operands.push_back(placed_at(x, y, 0, model::sphere(1.5, 8)));
    if (i % 2 == 0)
      for (const auto& outline : {Outline{{0, 0}, {2, 0}, {2, 2}}, Outline{{0, 0}, {0, 2}, {-2, 0}},
                                  Outline{{0, 0}, {-2, -2}, {0, -2}}})
        operands.push_back(placed_at(x, y, 3, prism(outline, 0, 1)));
    else
      operands.push_back(
          placed_at(x, y, 1, model::transform(free_matrix(random, 3, 1), model::cuboid({1, 1, 1}, true))));
  }
  auto r = resolved(model::unite(operands), {}, 0, 1e-9);
  const Skin skin = skin_of(r.network, r.batches, nullptr);
  for (int round = 0; round < samples::rounds(10); ++round) {
    const auto count = static_cast<unsigned>(pick(random, 1, 7));
    std::size_t crossings = 0;
    ASSERT_NO_FATAL_FAILURE(expect_surface_of_one(
        triangulated_by_all(r.network.table, dealt_out_somehow(random, skin, r.network.table, count), 1,
                            &crossings),
        r.surface));
    EXPECT_GT(crossings, 0U);
  }
}

/// Shares are boxes that fill space: no part of the surface is found twice or by nobody, and all of them have
/// about as much of it.
TEST(Sharing, SpaceIsSharedEvenly) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::vector<model::Expression> operands;
  for (int i = 0; i < 1500; ++i)
    operands.push_back(
        placed_at(uniform(random, 0, 20), uniform(random, 0, 20), uniform(random, 0, 20),
                  model::transform(free_matrix(random, 3, 0.5), model::cuboid({1, 1, 1}, true))));
  auto network = compile<3>(model::unite(operands), {});
  const auto surface = triangulate(network.table, trace_surface(network, {}).skin);
  constexpr unsigned count = 7;
  std::vector<Skin> skins;
  std::size_t most = 0, all = 0;
  for (unsigned share = 0; share < count; ++share) {
    SurfaceOptions options;
    options.share = share;
    options.shares = count;
    skins.push_back(trace_surface(network, options).skin);
    most = std::max(most, skins.back().edges.size());
    all += skins.back().edges.size();
  }
  EXPECT_LT(static_cast<double>(most) * count, 1.5 * static_cast<double>(all));
  expect_surface_of_one(triangulated_by_all(network.table, std::move(skins)), surface);
}

/// Many share little: most have nothing.
TEST(Sharing, SomeMayHaveNothing) {
  for (const unsigned count : {2U, 9U, 40U}) {
    auto network = compile<3>(model::cuboid({1, 2, 3}, false), {});
    const auto surface = triangulate(network.table, trace_surface(network, {}).skin);
    std::vector<Skin> skins;
    for (unsigned share = 0; share < count; ++share) {
      SurfaceOptions options;
      options.share = share;
      options.shares = count;
      skins.push_back(trace_surface(network, options).skin);
    }
    expect_surface_of_one(triangulated_by_all(network.table, std::move(skins)), surface);
    expect_surface_of_one(triangulated_by_all(network.table, std::vector<Skin>(count)), {});
  }
}

}  // namespace
}  // namespace bsp2::dataflow
