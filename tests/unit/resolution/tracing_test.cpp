// The surface that is found without cells is that of the cells, byte for byte.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/dataflow/surface/surface.hpp"
#include "bsp2/geometry/surface/brep.hpp"
#include "resolution/resolved.hpp"
#include "resolution/shared_skins.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::TriangleSurface;

/// Not all shares have as many threads. @return nothing where it gives up.
std::optional<TriangleSurface> traced(Network<3>& network, unsigned shares, unsigned threads) {
  geometry::Skin skin;
  std::vector<geometry::Skin> skins;
  const auto hyperplanes = static_cast<geometry::HyperplaneId>(network.table.size());
  for (unsigned share = 0; share < shares; ++share) {
    network.table.take_back(hyperplanes);  // each share has a table of its own
    SurfaceOptions options;
    options.threads = threads + share % 2;
    options.share = share;
    options.shares = shares;
    const TracedSurface mine = trace_surface(network, options);
    EXPECT_FALSE(mine.interrupted || mine.failure);
    if (mine.has_given_up) {
      EXPECT_EQ(network.table.size(), hyperplanes);
      return std::nullopt;
    }
    skin.append(mine.skin);
    skins.push_back(mine.skin);
  }
  auto surface = triangulate(network.table, std::move(skin));
  EXPECT_EQ(digest_of(triangulated_by_all(network.table, std::move(skins), threads)), digest_of(surface));
  return surface;
}

void expect_equal(const TriangleSurface& surface, const TriangleSurface& of_cells) {
  ASSERT_EQ(surface.points, of_cells.points);
  ASSERT_EQ(surface.triangles, of_cells.triangles);
  ASSERT_EQ(surface.owner, of_cells.owner);
  ASSERT_EQ(digest_of(surface), digest_of(of_cells));
}

class RandomTracing : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Of, RandomTracing, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& p) {
                           return std::string(p.param == Kind::solids ? "solids" : "boxes");
                         });

TEST_P(RandomTracing, IsTheSurfaceOfTheCells) {
  std::size_t triangles = 0, compared = 0;
  const std::size_t wanted = samples::rounds(60U);
  for (int round = 0; compared < wanted; ++round) {
    ASSERT_LT(round, static_cast<int>(100 + 20 * wanted)) << "hardly any of the random solids can be traced";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, GetParam(), 2 + round % 2);
    EvaluateOptions options;
    auto r = resolved(e, options, static_cast<unsigned>(round % 4), round % 3 == 0 ? 0 : 1e-9);
    if (!has_plain_facets(r.network)) continue;
    const auto surface =
        traced(r.network, 1 + static_cast<unsigned>(round) % 3, 1 + static_cast<unsigned>(round / 3) % 2);
    if (!surface) continue;
    ++compared;
    EXPECT_TRUE(surface->is_closed());
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
    EXPECT_NEAR(surface->volume(), r.volume, 1e-11 * (1 + r.volume));
    triangles += surface->triangles.size();
  }
  if (std::getenv("BSP2_SEED") != nullptr) return;  // all rounds are of one expression
  EXPECT_GT(triangles, 2 * compared);
}

using Points = std::vector<std::array<double, 3>>;
using Outline = std::vector<std::array<double, 2>>;
using Faces = std::vector<std::vector<std::uint32_t>>;

/// Moves a corner of some facets into the plane of a facet beside, as near as doubles tell.
void flatten_some(Random& random, Points& points, const Faces& faces, int count) {
  while (count-- > 0) {
    const auto& f = faces[static_cast<std::size_t>(pick(random, 0, static_cast<int>(faces.size()) - 1))];
    const auto &a = points[f[0]], &b = points[f[1]], &c = points[f[2]];
    std::array<double, 3> normal;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
      normal[k] = (b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]);
    }
    const double length = std::hypot(normal[0], normal[1], normal[2]);
    for (const auto& g : faces)
      for (std::size_t k = 0; k < 3; ++k) {
        if (g[k] != f[1] || g[(k + 1) % 3] != f[0]) continue;
        auto& d = points[g[(k + 2) % 3]];
        double away = 0;
        for (std::size_t i = 0; i < 3; ++i) away += (d[i] - a[i]) * normal[i] / length;
        for (std::size_t i = 0; i < 3; ++i) d[i] -= away * normal[i] / length;
      }
  }
}

/// An octahedron, each side halved some times, with points as far from the centre as chance has it.
std::pair<Points, Faces> random_ball_faces(Random& random, int halvings) {
  Points points{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  Faces faces;
  for (const std::uint32_t x : {0U, 1U})
    for (const std::uint32_t y : {2U, 3U})
      for (const std::uint32_t z : {4U, 5U})
        faces.push_back((x + y + z) % 2 == 0 ? std::vector{x, z, y} : std::vector{x, y, z});
  for (; halvings > 0; --halvings) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [at, is_new] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
      if (is_new) {
        std::array<double, 3> p;
        for (std::size_t k = 0; k < 3; ++k) p[k] = points[a][k] + points[b][k];
        const double length = std::hypot(p[0], p[1], p[2]);
        for (double& x : p) x /= length;
        points.push_back(p);
      }
      return at->second;
    };
    Faces finer;
    for (const auto& f : faces) {
      const std::uint32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      finer.insert(finer.end(), {{f[0], a, c}, {f[1], b, a}, {f[2], c, b}, {a, b, c}});
    }
    faces = std::move(finer);
  }
  for (auto& point : points) {
    const double radius = 1 + 0.1 * pick(random, -3, 3);
    for (double& x : point) x *= radius;
  }
  return {std::move(points), std::move(faces)};
}

/// @param flat so many facets are put into the planes of others, nearly.
model::Expression random_ball(Random& random, int halvings, int flat = 0) {
  auto [points, faces] = random_ball_faces(random, halvings);
  flatten_some(random, points, faces, flat);
  return model::polyhedron(points, faces);
}

/// Some points are moved to about where others are, so that it crosses itself there; or another ball is part
/// of it, which it overlaps.
model::Expression tangled_ball(Random& random) {
  auto [points, faces] = random_ball_faces(random, 4);
  const auto any_point = [&] {
    return static_cast<std::size_t>(pick(random, 0, static_cast<int>(points.size()) - 1));
  };
  for (int i = pick(random, 1, 3); i > 0; --i) {
    const std::size_t from = any_point();
    std::size_t to = any_point();
    const auto distance = [&] {
      const auto &a = points[from], &b = points[to];
      return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    };
    while (to == from || distance() > 0.5) to = any_point();
    for (std::size_t k = 0; k < 3; ++k) points[from][k] = 0.1 * points[from][k] + 0.87 * points[to][k];
  }
  if (chance(random, 0.5)) {
    const auto [more_points, more_faces] = random_ball_faces(random, 4);
    const auto first = static_cast<std::uint32_t>(points.size());
    for (const auto& [x, y, z] : more_points) points.push_back({x + 1.9, y + 0.01, z});
    for (const auto& f : more_faces) faces.push_back({f[0] + first, f[1] + first, f[2] + first});
  }
  return model::polyhedron(points, faces);
}

/// A cube whose sides are squares, so that facets beside each other lie in one plane.
model::Expression random_cube(Random& random) {
  return model::transform(std::vector<double>{.5, 0, 0, -.5, 0, .5, 0, -.5, 0, 0, .5, -.5, 0, 0, 0, 1},
                          random_polycube(random, pick(random, 2, 8)));
}

/// Balls of many facets, of which few meet others, and solids with coplanar ones.
TEST(Tracing, MeshesHaveTheSurfaceOfTheirCells) {
  std::size_t compared = 0, triangles = 0;
  const std::size_t wanted = samples::rounds(16U);
  for (std::size_t round = 0; compared < wanted; ++round) {
    ASSERT_LT(round, 20 * wanted) << "few can be traced";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> operands;
    for (int i = pick(random, 1, 3); i >= 0; --i) {
      const auto solid = chance(random, 0.6)   ? random_ball(random, pick(random, 1, 3))
                         : chance(random, 0.5) ? random_cube(random)
                                               : model::sphere(1, 12);
      operands.push_back(model::transform(free_matrix(random, 3, 1), solid));
    }
    const int kind = pick(random, 0, 3);
    const auto e = kind == 0   ? model::unite(operands)
                   : kind == 1 ? model::intersect(operands)
                   : kind == 2 ? model::symmetric_difference(operands)
                               : model::subtract(operands);
    auto r = resolved(e, {}, 0, round % 2 == 0 ? 0 : 1e-9);
    if (!has_plain_facets(r.network)) continue;
    const auto surface =
        traced(r.network, 1 + static_cast<unsigned>(round) % 3, 1 + static_cast<unsigned>(round) % 2);
    if (!surface) continue;
    ++compared;
    triangles += surface->triangles.size();
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
  }
  EXPECT_GT(triangles, compared);
}

/// Balls and polytopes that are turned and moved by whatever doubles, so that no facet lies in the plane of
/// another solid's: all boxes in which they meet are told by the facets.
TEST(Tracing, FacetsThatCrossNeedNoCells) {
  std::size_t compared = 0, triangles = 0;
  const std::size_t wanted = samples::rounds(12U);
  for (std::size_t round = 0; compared < wanted; ++round) {
    ASSERT_LT(round, 20 * wanted) << "few can be traced";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto any = [&] { return 1e-6 * pick(random, -1'000'000, 1'000'000); };
    std::vector<model::Expression> operands;
    for (int i = pick(random, 1, 3); i >= 0; --i) {
      const auto solid = chance(random, 0.7) ? random_ball(random, pick(random, 1, 3)) : model::sphere(1, 12);
      std::vector<double> matrix(16);
      for (std::size_t k = 0; k < 12; ++k) matrix[k] = (k % 5 == 0 ? 1 : 0) + 0.5 * any();
      matrix[15] = 1;
      operands.push_back(model::transform(matrix, solid));
    }
    const auto e = chance(random, 0.5)   ? model::subtract(operands)
                   : chance(random, 0.5) ? model::unite(operands)
                                         : model::symmetric_difference(operands);
    auto r = resolved(e, {}, 0, 0);
    const auto surface = traced(r.network, 1 + static_cast<unsigned>(round) % 3, 1);
    if (!surface) continue;
    ++compared;
    triangles += surface->triangles.size();
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
    EXPECT_EQ(trace_surface(r.network, {}).boxes_of_cells, 0);
  }
  EXPECT_GT(triangles, compared);
}

/// Where it crosses itself, its surface is found by cells, else as ever.
TEST(Tracing, MeshesThatCrossThemselvesSomewhereHaveTheSurfaceOfTheirCells) {
  std::size_t compared = 0, crossing = 0;
  const std::size_t wanted = samples::rounds(6U);
  const bool is_one = std::getenv("BSP2_SEED") != nullptr;  // then all rounds are of one expression
  for (std::size_t round = 0; compared < wanted || (!is_one && 2 * crossing < wanted); ++round) {
    ASSERT_LT(round, 20 * wanted) << "few can be traced, or cross themselves";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> operands{tangled_ball(random)};
    if (chance(random, 0.7))
      operands.push_back(model::transform(
          free_matrix(random, 3, 1), chance(random, 0.5) ? random_ball(random, 2) : tangled_ball(random)));
    auto r = resolved(chance(random, 0.5) ? model::subtract(operands) : model::unite(operands), {}, 0,
                      round % 2 == 0 ? 0 : 1e-9);
    const auto surface = traced(r.network, 1 + static_cast<unsigned>(round) % 3, 1);
    if (!surface) continue;
    ++compared;
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
    const bool is_embedded =
        std::ranges::all_of(r.network.meshes, [](const Mesh& mesh) { return mesh.is_embedded; });
    const std::uint64_t boxes = trace_surface(r.network, {}).boxes_of_cells;
    EXPECT_TRUE(is_embedded || boxes > 0);
    crossing += is_embedded ? 0 : 1;
  }
}

model::Expression shifted(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}

/// The surface of the cells, which others that are of one region or four, or traced, must be equal to.
TriangleSurface surface_in_all_ways(const model::Expression& e, double coincidence = 1e-9) {
  auto r = resolved(e, {}, 0, coincidence);
  expect_equal(resolved(e, {}, 2, coincidence).surface, r.surface);
  const auto surface = traced(r.network, 1, 1);
  EXPECT_TRUE(surface);
  if (surface) expect_equal(*surface, r.surface);
  EXPECT_TRUE(r.surface.is_closed());
  EXPECT_NEAR(r.surface.volume(), r.volume, 1e-12 * r.volume);
  return r.surface;
}

/// Around the first point, above which the solid leans, two pairs of facets lie in one plane, apart from each
/// other: a groove parts them.
TEST(Tracing, FacetsOfOnePlaneMayMeetInACorner) {
  const Points points{{0, 0, 0},  {-4, -6, -3}, {4, -1, 0}, {5, 1, 0},
                      {4, 2, -2}, {4, 4, 0},    {3, 4, 0},  {-2, 3, 4}};
  Faces faces;
  for (std::uint32_t i = 0; i < 6; ++i) {
    const std::uint32_t from = 2 + i, to = 2 + (i + 1) % 6;
    faces.insert(faces.end(), {{from, 0, to}, {to, 1, from}});
  }
  const auto solid = model::polyhedron(points, faces);
  surface_in_all_ways(model::subtract({solid, shifted(2, -1, 0.5, solid)}));
}

/// On top of a box lie facets of a mesh that makes no difference there: they are not the box's a second time.
TEST(Tracing, MeshesThatMakeNoDifferenceAddNothing) {
  const auto mesh = shifted(1, 1, 0, l_shape(1, 1, 1)), base = model::cuboid({5, 5, 1}, false),
             within = shifted(0.5, 0.5, 0.25, model::cuboid({1, 3, 0.5}, false));
  for (const auto& e : {model::unite({model::intersect({within, mesh}), base}),
                        model::unite({model::intersect({mesh, within}), base}),
                        model::unite({base, model::intersect({within, mesh})})})
    EXPECT_NEAR(surface_in_all_ways(e).volume(), 25, 1e-12);
}

/// Where merging finds that few facets are nearly in one plane with others of their mesh, they keep their
/// own.
TEST(Tracing, MeshesWithFewFlatPlacesHaveTheSurfaceOfTheirCells) {
  std::size_t compared = 0;
  const std::size_t wanted = samples::rounds(4U);
  for (int round = 0; compared < wanted; ++round) {
    ASSERT_LT(round, static_cast<int>(60 + 20 * wanted)) << "hardly any of the random balls can be traced";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto ball = random_ball(random, 3, pick(random, 1, 5));
    const auto e = model::subtract({ball, model::transform(free_matrix(random, 3, 1), model::sphere(1, 12))});
    auto r = resolved(e, {}, 0, 1e-9);
    ASSERT_TRUE(r.network.meshes.at(0).is_exact);
    EXPECT_EQ(compile<3>(ball, {}).table.size(), compile<3>(ball, {.coincidence = 0}).table.size());
    const auto surface = traced(r.network, 1, 1);
    if (!surface) {
      if (std::getenv("BSP2_SEED") != nullptr) return;  // the same ball again
      continue;
    }
    ++compared;
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
  }
}

/// A few shapes of many facets, each in many places: turned, mirrored, and moved by whole steps, so that they
/// share planes. Of some the model's space holds a part. The second round has an edge, besides edges that
/// cross, that ends for one of two shares where it goes on for the other.
TEST(Tracing, ManyOfOneShapeHaveTheSurfaceOfTheirCells) {
  constexpr std::uint64_t second_seed = 1661189486;
  std::size_t compared = 0;
  const std::size_t wanted = samples::rounds(8U);
  for (std::size_t round = 0; compared < wanted; ++round) {
    ASSERT_LT(round, 20 * wanted) << "few can be traced";
    const std::uint64_t seed = round == 1 ? second_seed : new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto sides = static_cast<std::uint32_t>(pick(random, 6, 12));
    const std::vector<model::Expression> shapes{model::sphere(1, sides),
                                                model::cylinder(1, 1, 0.5, 2 * sides)};
    std::vector<model::Expression> operands;
    for (int i = 0; i < 20; ++i) {
      std::vector<double> matrix = free_matrix(random, 3, 2);
      if (chance(random, 0.5)) {
        const auto step = [&] { return 0.5 * pick(random, -2, 2); };
        matrix = {1, 0, 0, step(), 0, 1, 0, step(), 0, 0, 1, step(), 0, 0, 0, 1};
      }
      if (chance(random, 0.3))
        for (const std::size_t x : {0, 4, 8}) matrix[x] = -matrix[x];
      operands.push_back(model::transform(matrix, shapes[i / 10]));
    }
    const auto all = chance(random, 0.5) ? model::unite(operands) : model::symmetric_difference(operands);
    const auto e = round % 3 == 0 ? model::intersect({model::cuboid({1, 1.5, 1}, true), all}) : all;
    auto r = resolved(e, {}, 0, round % 2 == 0 ? 0 : 1e-9);
    const auto surface = traced(r.network, 1 + static_cast<unsigned>(round) % 2, 1);
    if (!surface) continue;
    ++compared;
    ASSERT_NO_FATAL_FAILURE(expect_equal(*surface, r.surface));
  }
}

/// A prism's upright edge ends on the side of a box, above which it goes on: where it crosses the box's upper
/// edge nothing ends. A plane of the other box leads through there, and tells of it or not.
TEST(Tracing, EdgesThatOnlyCrossHaveNoVertexThere) {
  const std::array<model::Expression, 3> operands{shifted(-3, -1, -2, model::cuboid({3, 2, 2}, false)),
                                                  shifted(1, 0, -1, model::cuboid({1, 2, 2}, false)),
                                                  shifted(1, 0, -1, model::cylinder(2, 1, 1, 4, false))};
  std::array<std::size_t, 3> order{0, 1, 2};
  std::optional<TriangleSurface> first;
  do {
    const auto surface =
        surface_in_all_ways(model::unite({operands[order[0]], operands[order[1]], operands[order[2]]}));
    if (!first) first = surface;
    EXPECT_EQ(surface.points.size(), 20);
    EXPECT_EQ(surface.triangles.size(), first->triangles.size());
  } while (std::next_permutation(order.begin(), order.end()));
}

/// Found by chance: here the surface without cells had a vertex too many.
TEST(Tracing, EdgesThatOnlyCrossHaveNoVertexThereWithoutCells) {
  const auto prism = model::transform(std::vector<double>{0, 1, 0, 2, 0, 0, 1, -1, -1, 0, 0, 2, 0, 0, 0, 1},
                                      model::cylinder(3, 2, 2, 4, true));
  const auto bracket = model::transform(std::vector<double>{0, 0, -1, 1, 0, 1, 0, -2, 1, 0, 0, 0, 0, 0, 0, 1},
                                        l_shape(1, 2, 2));
  const auto box = shifted(-3, -3, -2, model::cuboid({3, 2, 2}, false));
  surface_in_all_ways(model::subtract({model::unite({prism, bracket}), box}));
}

/// Three lines through a point bound every other one of six sectors of the top and of the bottom: all go
/// straight on there, and yet it is a corner of triangles.
TEST(Tracing, EdgesOfOneFaceThatCrossAreDivided) {
  const auto surface = surface_in_all_ways(
      model::unite({prism({{0, 0}, {2, 0}, {2, 2}}, 0, 1), prism({{0, 0}, {0, 2}, {-2, 0}}, 0, 1),
                    prism({{0, 0}, {-2, -2}, {0, -2}}, 0, 1)}));
  EXPECT_EQ(surface.points.size(), 14);
}

/// Many edges, among them some that have to be divided where they cross, put together by several threads.
TEST(Tracing, ThreadsPutTheSameSurfaceTogether) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::vector<model::Expression> operands;
  for (int i = 0; i < 100; ++i) {
    const int column = i % 10, row = i / 10;
    const double x = column, y = row;
    operands.push_back(shifted(4 * x, 4 * y, 0, model::sphere(1.5, 8)));
    if (chance(random, 0.3))
      for (const auto& outline : {Outline{{0, 0}, {2, 0}, {2, 2}}, Outline{{0, 0}, {0, 2}, {-2, 0}},
                                  Outline{{0, 0}, {-2, -2}, {0, -2}}})
        operands.push_back(shifted(4 * x, 4 * y, 3, prism(outline, 0, 1)));
    else
      operands.push_back(shifted(
          4 * x, 4 * y, 1, model::transform(free_matrix(random, 3, 1), model::cuboid({1, 1, 1}, true))));
  }
  auto r = resolved(model::unite(operands), {}, 0, 1e-9);
  const TracedSurface skin = trace_surface(r.network, {});
  ASSERT_FALSE(skin.has_given_up);
  ASSERT_GT(r.surface.triangles.size(), 4096);  // several shares of work
  for (const unsigned threads : {1U, 2U, 5U})
    ASSERT_NO_FATAL_FAILURE(expect_equal(triangulate(r.network.table, skin.skin, {}, threads), r.surface));
  const auto faces = geometry::brep_of(r.network.table, skin.skin),
             also = geometry::brep_of(r.network.table, skin.skin, nullptr, {}, 3);
  EXPECT_EQ(faces.points, also.points);
  EXPECT_EQ(faces.triangles, also.triangles);
  EXPECT_EQ(faces.face_of_triangle, also.face_of_triangle);
}

/// Of three solids of one shape the last has all its facets in space, but a corner that the end of space,
/// which it just reaches, gave the name.
TEST(Tracing, CornersMayLieWhereSpaceEnds) {
  const auto ball = model::transform(std::vector<double>{-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                     model::sphere(1, 9));
  const auto balls = model::unite({shifted(-0.5, -0.5, -1, ball), shifted(-1, -1, 0, ball), ball});
  surface_in_all_ways(model::intersect({model::cuboid({1, 1.5, 1}, true), balls}), 0);
}

/// Moments of a box that is not at the origin: by hand.
TEST(Tracing, MomentsOfABox) {
  const auto e = model::transform(std::vector<double>{1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1},
                                  model::cuboid({1, 2, 3}, false));
  auto network = compile<3>(e, {});
  const auto surface = traced(network, 1, 1);
  ASSERT_TRUE(surface);
  const auto moments = surface->moments();
  EXPECT_NEAR(moments.volume(), 6, 1e-12);
  using Moments = geometry::Moments<3>;
  EXPECT_NEAR(moments.integral[Moments::index(0, 1)], 6 * 10.5, 1e-10);
  EXPECT_NEAR(moments.integral[Moments::index(2, 2)], 6 * (21 * 21 + 4.0 / 12), 1e-9);
  EXPECT_NEAR(moments.integral[Moments::index(1, 3)], 6 * 10.5 * 31.5, 1e-9);
}

/// Asked again and again while it works; with so many facets, it is asked before it has ended.
TEST(Tracing, IsInterrupted) {
  std::vector<model::Expression> spheres;
  for (int i = 0; i < 400; ++i) {
    const int x = i % 20, y = i / 20;
    spheres.push_back(model::transform(
        std::vector<double>{1, 0, 0, 0.1 * x, 0, 1, 0, 0.1 * y, 0, 0, 1, 0.01 * i, 0, 0, 0, 1},
        model::sphere(1, 24)));
  }
  auto network = compile<3>(model::unite(spheres), {});
  ASSERT_TRUE(has_plain_facets(network));
  SurfaceOptions options;
  options.interrupted = [] { return true; };
  EXPECT_TRUE(trace_surface(network, options).interrupted);
}

}  // namespace
}  // namespace bsp2::dataflow
