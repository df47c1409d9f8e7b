// The surface that is found without cells is that of the cells, byte for byte.

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <utility>

#include "bsp2/dataflow/surface/surface.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::TriangleSurface;

/// Not all shares have as many threads.
TriangleSurface traced(const Network<3>& network, unsigned shares, unsigned threads) {
  geometry::Skin skin;
  for (unsigned share = 0; share < shares; ++share) {
    SurfaceOptions options;
    options.threads = threads + share % 2;
    options.share = share;
    options.shares = shares;
    const TracedSurface mine = trace_surface(network, options);
    EXPECT_FALSE(mine.has_given_up || mine.interrupted);
    skin.append(mine.skin);
  }
  return triangulate(network.table, std::move(skin));
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
    ASSERT_LT(round, 1000) << "hardly any of the random solids can be traced";
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, GetParam(), 2 + round % 2);
    EvaluateOptions options;
    const auto r = resolved(e, options, static_cast<unsigned>(round % 4), round % 3 == 0 ? 0 : 1e-9);
    if (!has_plain_facets(r.network)) continue;
    ++compared;
    const TriangleSurface surface =
        traced(r.network, 1 + static_cast<unsigned>(round) % 3, 1 + static_cast<unsigned>(round / 3) % 2);
    ASSERT_NO_FATAL_FAILURE(expect_equal(surface, r.surface));
    EXPECT_TRUE(surface.is_closed());
    EXPECT_NEAR(surface.volume(), r.volume, 1e-11 * (1 + r.volume));
    triangles += surface.triangles.size();
  }
  if (std::getenv("BSP2_SEED") != nullptr) return;  // all rounds are of one expression
  EXPECT_GT(triangles, 2 * compared);
}

/// Moments of a box that is not at the origin: by hand.
TEST(Tracing, MomentsOfABox) {
  const auto e = model::transform(std::vector<double>{1, 0, 0, 10, 0, 1, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1},
                                  model::cuboid({1, 2, 3}, false));
  const auto network = compile<3>(e, {});
  const auto moments = traced(network, 1, 1).moments();
  EXPECT_NEAR(moments.volume(), 6, 1e-12);
  using Moments = geometry::Moments<3>;
  EXPECT_NEAR(moments.integral[Moments::index(0, 1)], 6 * 10.5, 1e-10);
  EXPECT_NEAR(moments.integral[Moments::index(2, 2)], 6 * (21 * 21 + 4.0 / 12), 1e-9);
  EXPECT_NEAR(moments.integral[Moments::index(1, 3)], 6 * 10.5 * 31.5, 1e-9);
}

/// Asked again and again while it works; with so many facets, it is asked before it has ended.
TEST(Tracing, IsInterrupted) {
  std::vector<model::Expression> spheres;
  for (int i = 0; i < 400; ++i)
    spheres.push_back(model::transform(
        std::vector<double>{1, 0, 0, 0.1 * (i % 20), 0, 1, 0, 0.1 * (i / 20), 0, 0, 1, 0.01 * i, 0, 0, 0, 1},
        model::sphere(1, 24)));
  const auto network = compile<3>(model::unite(spheres), {});
  ASSERT_TRUE(has_plain_facets(network));
  SurfaceOptions options;
  options.interrupted = [] { return true; };
  EXPECT_TRUE(trace_surface(network, options).interrupted);
}

}  // namespace
}  // namespace bsp2::dataflow
