// Partitions that are made again elsewhere, and what their cuts cost.
#include "bsp2/dataflow/partition.hpp"

#include <gtest/gtest.h>

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

/// A wall of bricks in three layers with a tunnel in each: cuts between the bricks cost nothing.
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
  const std::uint64_t whole = cells(0), parts = cells(6);
  EXPECT_GT(partition(network, 6).regions.size(), 40U);
  EXPECT_LE(static_cast<double>(parts), 1.1 * static_cast<double>(whole)) << whole;
}

TEST(Partition, SmallModelsAreOneRegion) {
  EXPECT_EQ(suggested_depth(compile<3>(model::cuboid({1, 1, 1}, false), {})), 0U);
  std::vector<model::Expression> many;
  for (int i = 0; i < 2000; ++i)
    many.push_back(moved(2.0 * i, 0, 0, model::cuboid({1, 1, 1}, false)));
  EXPECT_EQ(suggested_depth(compile<3>(model::unite(many), {})), 4U);  // 12,000 facets
}

}  // namespace
}  // namespace bsp2::dataflow
