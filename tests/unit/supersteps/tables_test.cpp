#include "bsp2/supersteps/loop/tables.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "support/temporary_folder.hpp"

namespace bsp2::supersteps {
namespace {

std::uint64_t sum(const std::vector<NodeFigures>& nodes, std::uint64_t NodeFigures::*figure) {
  std::uint64_t total = 0;
  for (const NodeFigures& node : nodes) total += node.*figure;
  return total;
}

/// The nodes share the cells of the run; their boundaries are that of the solid and the interfaces, seen from
/// both sides.
TEST(Tables, NodesShareTheCellsOfARun) {
  const samples::TemporaryFolder folder;
  RunOptions options;
  options.model = folder.path() / "row.csg";
  options.threads = 1;
  options.regions = 8;
  options.collect_cells = false;
  std::ofstream file(options.model);
  // Each is wider than the one before: they share the hyperplanes between them alone, and are parted there.
  for (int i = 0; i < 8; ++i)
    file << "multmatrix([[1,0,0," << i + 0.5 << "],[0,1,0,0],[0,0,1,0],[0,0,0,1]]) { "
         << "cube(size=[1," << 1 + i / 4.0 << ',' << 2 + i / 4.0 << "], center=true); }\n";
  file.close();
  const auto measured = measure_tables(options, {1, 2, 4, 8}, {2U, std::nullopt});
  ASSERT_EQ(measured.size(), 2U);
  EXPECT_EQ(measured[0].level, 2U);
  const auto& finest = measured[1].nodes;
  ASSERT_EQ(finest.size(), 4U);
  const RunReport report = run(options).report;
  for (const auto& nodes : finest) {
    EXPECT_EQ(sum(nodes, &NodeFigures::cells), report.in_cells);
    EXPECT_EQ(sum(nodes, &NodeFigures::splits), report.splits);
    EXPECT_EQ(sum(nodes, &NodeFigures::predicates), report.predicates);
    for (const NodeFigures& node : nodes) EXPECT_GE(node.seconds, 0);
  }
  EXPECT_EQ(measured[1].distribution_seconds.size(), 4U);
  EXPECT_GT(measured[1].distribution_seconds.front(), 0);
  EXPECT_EQ(report.in_cells, 8U);
  EXPECT_EQ(sum(finest[0], &NodeFigures::facets),
            8U * 5 + 1);  // a row of eight boxes: one side of each is covered, but for the last
  EXPECT_EQ(sum(finest[3], &NodeFigures::facets), 8U * 6);  // a box a node
  for (const NodeFigures& node : finest[3]) EXPECT_EQ(node.cells, 1U);
}

/// Round solids are refined as far as a run does.
TEST(Tables, EndForRoundSolids) {
  const samples::TemporaryFolder folder;
  RunOptions options;
  options.model = folder.path() / "ball.csg";
  options.threads = 1;
  options.regions = 4;
  std::ofstream(options.model) << "ball(r = 1);";
  const auto measured = measure_tables(options, {1, 2}, {2U, std::nullopt});
  const RunReport report = run(options).report;
  for (const auto& nodes : measured.at(1).nodes)
    EXPECT_EQ(sum(nodes, &NodeFigures::cells), report.in_cells + report.fuzzy_cells);
  EXPECT_GT(report.fuzzy_cells, 1000U);
}

}  // namespace
}  // namespace bsp2::supersteps
