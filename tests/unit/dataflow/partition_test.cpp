// Partitions that are made again elsewhere, and what their cuts cost.
#include "bsp2/dataflow/regions/partition.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "bsp2/dataflow/regions/coarsening.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "dataflow/in_regions.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

template <int D>
void expect_same_cell(const geometry::Cell<D>& a, const geometry::Cell<D>& b) {
  ASSERT_EQ(a.vertices().size(), b.vertices().size());
  for (std::size_t v = 0; v < a.vertices().size(); ++v) EXPECT_EQ(a.vertices()[v].x, b.vertices()[v].x);
}

template <int D>
void expect_same_tree(const Partition<D>& a, const Partition<D>& b) {
  EXPECT_EQ(a.root, b.root);
  EXPECT_EQ(a.work, b.work);
  ASSERT_EQ(a.nodes.size(), b.nodes.size());
  for (std::size_t i = 0; i < a.nodes.size(); ++i) {
    EXPECT_EQ(a.nodes[i].hyperplane, b.nodes[i].hyperplane);
    EXPECT_EQ(a.nodes[i].negative, b.nodes[i].negative);
    EXPECT_EQ(a.nodes[i].positive, b.nodes[i].positive);
  }
}

/// Another number of threads, and several that make their parts alone, make the same regions, also where the
/// limit of the words ends the search. @return how many parts have no region.
template <int D>
int expect_same_partition(const Network<D>& network, unsigned depth, const PartitionLimits& limits,
                          unsigned threads, unsigned shares) {
  const auto whole = partition(network, depth, limits), together = partition(network, depth, limits, threads);
  expect_same_tree(whole, together);
  std::vector<PartitionPart<D>> parts;
  std::vector<std::vector<PartitionNode>> nodes;
  for (unsigned i = 0; i < shares; ++i) {
    parts.push_back(part_of_partition(network, depth, {i, shares}, limits, i % 3 == 0 ? threads : 1));
    nodes.push_back(parts.back().nodes);
  }
  const auto joined = join_parts<D>(nodes);
  expect_same_tree(whole, joined.partition);
  EXPECT_EQ(whole.regions.size(), together.regions.size());
  EXPECT_EQ(whole.regions.size(), joined.share_of_region.size());
  if (testing::Test::HasFailure()) return 0;
  std::vector<std::size_t> next(shares);
  for (std::size_t i = 0; i < whole.regions.size(); ++i) {
    const std::uint32_t share = joined.share_of_region[i];
    const Region<D>& made = parts[share].regions.at(next[share]++);
    for (const Region<D>* other : {&together.regions[i], &made}) {
      EXPECT_EQ(other->level, whole.regions[i].level);
      EXPECT_EQ(other->program, whole.regions[i].program);
      expect_same_cell(other->cell, whole.regions[i].cell);
    }
  }
  for (unsigned i = 0; i < shares; ++i) EXPECT_EQ(next[i], parts[i].regions.size());
  return static_cast<int>(std::count(next.begin(), next.end(), 0U));
}

/// Cubes on a grid.
model::Expression many_cubes(Random& random, int count) {
  std::vector<model::Expression> cubes;
  for (int i = 0; i < count; ++i) {
    const auto at = [&] { return pick(random, 0, 400) / 8.0; };
    cubes.push_back(
        model::transform(std::vector<double>{1, 0, 0, at(), 0, 1, 0, at(), 0, 0, 1, at(), 0, 0, 0, 1},
                         model::cuboid({2, 2, 2}, false)));
  }
  return model::unite(cubes);
}

TEST(Partition, IsTheSameOnAnyNumberOfThreadsAndInParts) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int stopped = 0, idle = 0, shared = 0;
  const auto draw = [&](const auto& network) {
    PartitionLimits limits;
    if (chance(random, 0.7)) limits.words = static_cast<std::size_t>(pick(random, 50, 6000));
    if (chance(random, 0.3)) limits.level = static_cast<unsigned>(pick(random, 1, 12));
    if (chance(random, 0.3)) limits.tolerance = network.table.width() / pick(random, 2, 64);
    return limits;
  };
  for (int round = 0; round < samples::rounds(60) || (stopped == 0 && round < 1000); ++round) {
    const auto threads = static_cast<unsigned>(pick(random, 2, 6)),
               depth = static_cast<unsigned>(pick(random, 1, 9)),
               shares = static_cast<unsigned>(pick(random, 1, 7));
    const Network<3> network = compile<3>(random_expression(random, 3, Kind::solids, 2), {});
    const PartitionLimits limits = draw(network);
    const int without_regions = expect_same_partition(network, depth, limits, threads, shares);
    idle += without_regions;
    shared += static_cast<int>(shares) - without_regions > 1 ? 1 : 0;
    PartitionLimits without = limits;
    without.words = PartitionLimits{}.words;
    stopped +=
        partition(network, depth, limits).regions.size() < partition(network, depth, without).regions.size()
            ? 1
            : 0;
    const Network<2> plane = compile<2>(random_expression(random, 2, Kind::solids, 2), {});
    expect_same_partition(plane, depth, draw(plane), threads, shares);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(stopped, 0);
  EXPECT_GT(idle, 0);
  EXPECT_GT(shared, 0);
  // So large that threads have something to share.
  for (const std::size_t words :
       {PartitionLimits{}.words, std::size_t{40000}, std::size_t{150000}, std::size_t{1}}) {
    const Network<3> cubes = compile<3>(many_cubes(random, pick(random, 1000, 3000)), {});
    PartitionLimits limits;
    limits.words = words;
    expect_same_partition(cubes, 8, limits, static_cast<unsigned>(pick(random, 2, 6)),
                          static_cast<unsigned>(pick(random, 2, 40)));
  }
  const Network<3> cube = compile<3>(model::cuboid({1, 1, 1}, false), {});
  for (const unsigned depth : {0U, 7U}) EXPECT_GT(expect_same_partition(cube, depth, {}, 3, 20), 0);
}

TEST(Partition, CellsAreMadeAgainFromTheTreeAlone) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const Network<3> network = compile<3>(random_expression(random, 3, Kind::solids, 2), {});
    const auto whole = partition(network, static_cast<unsigned>(pick(random, 0, 7)));
    ASSERT_EQ(whole.work.size(), whole.regions.size());
    std::vector<Region<3>> regions;
    for (std::uint32_t i = 0; i < whole.regions.size(); ++i)
      if (chance(random, 0.5)) regions.push_back({.number = i});
    std::shuffle(regions.begin(), regions.end(), random);
    make_cells<3>(network, whole, regions);
    for (const Region<3>& region : regions) expect_same_cell(region.cell, whole.regions[region.number].cell);
    regions.push_back({.number = static_cast<std::uint32_t>(whole.regions.size())});
    EXPECT_THROW(make_cells<3>(network, whole, regions), std::out_of_range);
  }
}

/// As regions have become one, or as a damaged snapshot may be.
TEST(Partition, CellsToWhichNoWayLeadsAreRefused) {
  const Network<3> network = compile<3>(model::cuboid({1, 1, 1}, false), {});
  using Table = geometry::HyperplaneTable<3>;
  const auto x = Table::axis_hyperplane(0, Table::axis_steps / 2),
             y = Table::axis_hyperplane(1, Table::axis_steps / 2),
             further = Table::axis_hyperplane(0, Table::axis_steps / 4 * 3);
  const auto made = [&](std::int32_t root, std::vector<Partition<3>::Node> nodes,
                        const std::vector<std::uint32_t>& numbers) {
    Partition<3> partition;
    partition.root = root;
    partition.nodes = std::move(nodes);
    std::vector<Region<3>> regions;
    for (const std::uint32_t number : numbers) regions.push_back({.number = number});
    make_cells<3>(network, partition, regions);
    for (const Region<3>& region : regions) EXPECT_FALSE(region.cell.vertices().empty());
  };
  made(0, {{x, ~0, 1}, {further, ~1, ~2}}, {2, 0, 1});
  EXPECT_THROW(made(0, {{x, ~0, 1}, {further, ~1, ~2}}, {1, 2, 1}), std::invalid_argument);
  EXPECT_THROW(made(~0, {{x, ~0, ~1}}, {1}), std::out_of_range);  // the whole is one region
  EXPECT_THROW(made(0, {{x, ~0, ~2}, {y, ~1, ~1}}, {1}),
               std::out_of_range);  // nobody leads to the second node
  EXPECT_THROW(made(0, {{x, 0, 0}}, {0}), std::out_of_range);
  EXPECT_THROW(made(0, {{x, 0, ~0}}, {1}), std::out_of_range);
  made(~0, {{x, ~0, ~1}}, {0});
}

TEST(Partition, PartsThatDoNotFitTogetherAreRefused) {
  using Kind = PartitionNode::Kind;
  using Parts = std::vector<std::vector<PartitionNode>>;
  const PartitionNode split{Kind::split, 3, 0}, region{Kind::region, 0, 1}, elsewhere{};
  EXPECT_EQ(join_parts<3>(Parts{{split, region, elsewhere}, {split, elsewhere, region}}).share_of_region,
            (std::vector<std::uint32_t>{0, 1}));
  EXPECT_THROW(join_parts<3>(Parts{{split, region, elsewhere}, {split, elsewhere, elsewhere}}),
               std::invalid_argument);  // nobody has it
  EXPECT_THROW(join_parts<3>(Parts{{split, region}}), std::invalid_argument);
  EXPECT_THROW(join_parts<3>(Parts{{split, region, region}, {split, elsewhere, region}}),
               std::invalid_argument);  // two have it
  EXPECT_THROW(join_parts<3>(Parts{{split, region, region}, {{Kind::split, 4, 0}, elsewhere, elsewhere}}),
               std::invalid_argument);
  EXPECT_THROW(join_parts<3>(Parts{{region, region}}), std::invalid_argument);
  EXPECT_THROW(join_parts<3>(Parts{}), std::invalid_argument);
}

TEST(Partition, FillsTheRootWithRegions) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    const Network<3> network = compile<3>(random_expression(random, 3, Kind::solids, 2), {});
    geometry::CellWriter<3> writer(network.table);
    const double root = writer.measure(geometry::root_cell(network.table)).volume();
    for (const unsigned depth : {0U, 1U, 2U, 5U}) {
      const auto a = partition(network, depth);
      EXPECT_LE(a.regions.size(), std::size_t{1} << depth);
      EXPECT_EQ(a.nodes.size() + 1, a.regions.size());
      double sum = 0;
      for (std::size_t i = 0; i < a.regions.size(); ++i) {
        EXPECT_LT(a.regions[i].level, a.regions.size());  // as deep as the evaluation cuts there
        sum += writer.measure(a.regions[i].cell).volume();
      }
      // Corners are rounded relative to their distance from the origin, however small the root cell is.
      EXPECT_NEAR(sum, root, 2e-12 * std::pow(root, 2 / 3.0) * network.table.radius());
    }
  }
}

model::Expression moved(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}

/// A wall of bricks in three layers with a tunnel in each.
model::Expression wall() {
  std::vector<model::Expression> bricks;
  for (int x = 0; x < 12; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 3; ++z) {
        const auto brick = model::cuboid({1, 1, 1}, false), tunnel = model::cuboid({0.4, 1, 0.4}, false);
        bricks.push_back(moved(x, y, z, model::subtract({brick, moved(0.3, 0, 0.3, tunnel)})));
      }
  return model::unite(bricks);
}

/// @return by how many cells there would be more if nothing were given back across cuts.
template <int D>
std::uint64_t expect_the_same_in_regions(const model::Expression& e, const EvaluateOptions& options,
                                         Random& random) {
  const Network<D> network = compile<D>(e, {});
  const auto whole = evaluate(network, partition(network, 0).regions, options, {}).totals;
  std::uint64_t given_back = 0;
  for (const unsigned depth : {1U, 3U, 6U}) {
    const auto parts = evaluated_in_regions<D>(network, depth, options, random);
    EXPECT_EQ(parts.digest.hex(), whole.digest.hex()) << "depth " << depth;
    EXPECT_EQ(parts.in_cells, whole.in_cells);
    EXPECT_EQ(parts.fuzzy_cells, whole.fuzzy_cells);
    EXPECT_EQ(parts.out_cells, whole.out_cells);
    EXPECT_EQ(parts.in.value().integral, whole.in.value().integral);
    EXPECT_EQ(parts.level, whole.level);
    if (options.level) continue;
    const auto parted = evaluate(network, partition(network, depth).regions, options, {}).totals;
    given_back += parted.in_cells + parted.out_cells - parts.in_cells - parts.out_cells;
  }
  return given_back;
}

/// Regions are what the evaluation of the whole would cut, and what it would give back is given back across
/// their cuts: the cells are the same byte for byte, in whatever order the regions are evaluated.
TEST(Partition, CutsChangeNoCell) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::uint64_t given_back = 0;
  for (int round = 0; round < samples::all_rounds(60); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    EvaluateOptions options;
    options.threads = static_cast<unsigned>(pick(random, 1, 3));
    options.keep_out = chance(random, 0.5);
    if (chance(random, 0.3)) options.level = static_cast<unsigned>(pick(random, 1, 12));
    const Kind kind = chance(random, 0.5) ? Kind::solids : Kind::grid_boxes;
    given_back += expect_the_same_in_regions<3>(random_expression(random, 3, kind, 2), options, random);
    given_back += expect_the_same_in_regions<2>(random_expression(random, 2, kind, 2), options, random);
    if (round % 10 == 0)
      expect_the_same_in_regions<4>(random_expression(random, 4, kind, 1), options, random);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(given_back, 0U);
  expect_the_same_in_regions<3>(wall(), {}, random);
}

TEST(Partition, WorkIsSharedOutInAboutEqualRegions) {
  const Network<3> network = compile<3>(wall(), {});
  const auto parts = partition(network, 4);
  ASSERT_EQ(parts.regions.size(), 16U);
  // The others wait for the one with the most.
  EXPECT_LE(*std::max_element(parts.work.begin(), parts.work.end()),
            2 * std::accumulate(parts.work.begin(), parts.work.end(), 0.0) / 16);
}

TEST(Partition, SmallModelsAreOneRegion) {
  EXPECT_EQ(suggested_depth(compile<3>(model::cuboid({1, 1, 1}, false), {})), 0U);
  std::vector<model::Expression> many;
  for (int i = 0; i < 2000; ++i) many.push_back(moved(2.0 * i, 0, 0, model::cuboid({1, 1, 1}, false)));
  EXPECT_EQ(suggested_depth(compile<3>(model::unite(many), {})), 4U);  // 12,000 facets
}

/// How far a cell's facets across an axis are from each other at least, over the axes that have two.
double thickness(const geometry::CellBatch& batch, std::size_t cell,
                 const geometry::HyperplaneTable<3>& table) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<double> places;
    for (std::size_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
      const std::int32_t code = batch.facet_hyperplane[facet];
      const auto h = table.rounded(static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code));
      if (std::fabs(h.normal[axis]) > 1 - 1e-12) places.push_back(-h.offset / h.normal[axis]);
    }
    if (places.size() == 2) least = std::min(least, std::fabs(places[0] - places[1]));
  }
  return least;
}

/// Cuboids and square columns that stand on edge, on a coarse grid: where columns have edges, others have
/// faces. No cut between operands leaves a slab beside a face.
TEST(Partition, NoCutIsNearlyAFaceOfTheModel) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto coordinate = [&](int reach) { return pick(random, -reach, reach) / 2.0; };
  for (int round = 0; round < samples::rounds(12); ++round) {
    std::vector<model::Expression> solids;
    for (int i = 0; i < 40; ++i) {
      std::vector<double> matrix = identity_matrix(3);
      for (const int entry : {3, 7, 11}) matrix[static_cast<std::size_t>(entry)] = coordinate(16);
      const double size = pick(random, 1, 6) / 2.0, height = pick(random, 1, 6) / 2.0;
      const bool column = chance(random, 0.6);
      if (column && chance(random, 0.5))
        matrix = {0, 0, 1, matrix[3], 0, 1, 0, matrix[7], -1, 0, 0, matrix[11], 0, 0, 0, 1};
      const double sizes[] = {size, height, size};
      solids.push_back(
          model::transform(matrix, column ? model::cylinder(height, size, size, 4) : model::cuboid(sizes)));
    }
    const auto e = chance(random, 0.5) ? model::unite(solids)
                                       : model::subtract({model::unite({solids.begin(), solids.begin() + 20}),
                                                          model::unite({solids.begin() + 20, solids.end()})});
    const Network<3> network = compile<3>(e, {});
    for (const auto& refinement :
         evaluate_all(network, static_cast<unsigned>(pick(random, 0, 4)), keep_everything()).refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell)
        ASSERT_GT(thickness(refinement->cells, cell, network.table), 1e-4) << "round " << round;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
