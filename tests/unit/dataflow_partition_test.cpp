// Partitions that are made again elsewhere, and what their cuts cost.
#include "bsp2/dataflow/partition.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "bsp2/model/builder.hpp"
#include "dataflow_oracle.hpp"

namespace bsp2::dataflow {
namespace {

TEST(Partition, RegionsAreMadeAgainFromTheTreeAlone) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < 40; ++round) {
    const Network<3> network = compile<3>(random_expression(random, 3, Kind::solids, 2), {});
    const auto whole = partition(network, static_cast<unsigned>(pick(random, 0, 5)));
    ASSERT_EQ(whole.work.size(), whole.regions.size());
    Partition<3> tree;
    tree.root = whole.root;
    tree.nodes = whole.nodes;
    std::vector<std::uint32_t> numbers;
    for (std::uint32_t i = 0; i < whole.regions.size(); ++i)
      if (chance(random, 0.5)) numbers.push_back(i);
    const auto regions = make_regions<3>(network, tree, numbers);
    ASSERT_EQ(regions.size(), numbers.size());
    for (std::size_t i = 0; i < regions.size(); ++i) {
      const Region<3>& expected = whole.regions[numbers[i]];
      EXPECT_EQ(regions[i].number, expected.number);
      EXPECT_EQ(regions[i].level, expected.level);
      EXPECT_EQ(regions[i].program, expected.program);
      ASSERT_EQ(regions[i].cell.vertices().size(), expected.cell.vertices().size());
      for (std::size_t v = 0; v < expected.cell.vertices().size(); ++v) EXPECT_EQ(regions[i].cell.vertices()[v].x, expected.cell.vertices()[v].x);
    }
    numbers.push_back(static_cast<std::uint32_t>(whole.regions.size()));
    EXPECT_THROW(make_regions<3>(network, tree, numbers), std::out_of_range);
  }
}

model::Expression moved(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}

/// A wall of bricks in three layers with a tunnel in each: cuts between the bricks cost nothing, and are found.
TEST(Partition, CutsAddFewCells) {
  std::vector<model::Expression> bricks;
  for (int x = 0; x < 12; ++x)
    for (int y = 0; y < 8; ++y)
      for (int z = 0; z < 3; ++z) {
        const auto brick = model::cuboid({1, 1, 1}, false), tunnel = model::cuboid({0.4, 1, 0.4}, false);
        bricks.push_back(moved(x, y, z, model::subtract({brick, moved(0.3, 0, 0.3, tunnel)})));
      }
  const Network<3> network = compile<3>(model::unite(bricks), {});
  const auto cells = [&](unsigned depth) { return evaluate(network, partition(network, depth).regions, EvaluateOptions{}, {}).totals.in_cells; };
  const std::uint64_t whole = cells(0), parts = cells(2);
  EXPECT_EQ(partition(network, 2).regions.size(), 4U);
  EXPECT_LE(static_cast<double>(parts), 1.02 * static_cast<double>(whole)) << whole;
}

TEST(Partition, SmallModelsAreOneRegion) {
  EXPECT_EQ(suggested_depth(compile<3>(model::cuboid({1, 1, 1}, false), {})), 0U);
  std::vector<model::Expression> many;
  for (int i = 0; i < 2000; ++i)
    many.push_back(moved(2.0 * i, 0, 0, model::cuboid({1, 1, 1}, false)));
  EXPECT_EQ(suggested_depth(compile<3>(model::unite(many), {})), 4U);  // 12,000 facets
}

/// How far a cell's facets across an axis are from each other at least, over the axes that have two.
double thickness(const geometry::CellBatch& batch, std::size_t cell, const geometry::HyperplaneTable<3>& table) {
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

/// Cuboids and square columns that stand on edge, on a coarse grid: where columns have edges, others have faces. No cut between
/// operands leaves a slab beside a face.
TEST(Partition, NoCutIsNearlyAFaceOfTheModel) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto coordinate = [&](int reach) { return pick(random, -reach, reach) / 2.0; };
  for (int round = 0; round < 12; ++round) {
    std::vector<model::Expression> solids;
    for (int i = 0; i < 40; ++i) {
      std::vector<double> matrix = identity_matrix(3);
      for (const int entry : {3, 7, 11}) matrix[static_cast<std::size_t>(entry)] = coordinate(16);
      const double size = pick(random, 1, 6) / 2.0, height = pick(random, 1, 6) / 2.0;
      const bool column = chance(random, 0.6);
      if (column && chance(random, 0.5)) matrix = {0, 0, 1, matrix[3], 0, 1, 0, matrix[7], -1, 0, 0, matrix[11], 0, 0, 0, 1};
      const double sizes[] = {size, height, size};
      solids.push_back(model::transform(matrix, column ? model::cylinder(height, size, size, 4) : model::cuboid(sizes)));
    }
    const auto e = chance(random, 0.5) ? model::unite(solids) : model::subtract({model::unite({solids.begin(), solids.begin() + 20}), model::unite({solids.begin() + 20, solids.end()})});
    const Network<3> network = compile<3>(e, {});
    for (const auto& refinement : evaluate_all(network, static_cast<unsigned>(pick(random, 0, 4)), keep_everything()).refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) ASSERT_GT(thickness(refinement->cells, cell, network.table), 1e-4) << "round " << round;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
