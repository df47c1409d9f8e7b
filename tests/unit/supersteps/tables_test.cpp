#include "bsp2/supersteps/loop/tables.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "bsp2/error.hpp"
#include "bsp2/supersteps/loop/run.hpp"
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

/// All numbers of nodes find the surface of the run.
TEST(Tables, NodesShareTheSurfaceOfARun) {
  const samples::TemporaryFolder folder;
  RunOptions options;
  options.model = folder.path() / "balls.csg";
  options.threads = 1;
  std::ofstream file(options.model);
  for (int i = 0; i < 40; ++i)
    file << "multmatrix([[1,0,0," << 0.8 * i << "],[0,1,0," << i % 5 << "],[0,0,1," << i % 3
         << "],[0,0,0,1]]) { sphere(r=1.3, $fn=" << 8 + i % 4 << "); }\n";
  file.close();
  const auto measured = measure_surface(options, {1, 2, 5, 64});
  ASSERT_EQ(measured.size(), 4U);
  options.boundary = options.surface_only = true;
  const RunResult result = run(options);
  for (const SurfaceFigures& figures : measured) {
    EXPECT_EQ(figures.triangles, result.boundary->triangles.size());
    EXPECT_EQ(figures.digest, result.report.boundary->digest);
    for (const auto* steps : {&figures.tracing, &figures.resolution}) {
      for (const auto& step : *steps) EXPECT_EQ(step.size(), figures.nodes);
      EXPECT_GT(SurfaceFigures::mean(*steps), 0);
      EXPECT_GE(SurfaceFigures::most(*steps), SurfaceFigures::mean(*steps));
    }
  }
  EXPECT_EQ(measured[0].joining, 0);
  EXPECT_GT(measured[3].joining, 0);
}

TEST(Tables, RefuseASurfaceThatIsFoundFromCells) {
  const samples::TemporaryFolder folder;
  RunOptions options;
  options.model = folder.path() / "model.csg";
  std::ofstream(options.model) << "ball(r = 1);";
  EXPECT_THROW(measure_surface(options, {2}), Error);
  std::ofstream(options.model) << "square([1, 2]);";
  EXPECT_THROW(measure_surface(options, {2}), Error);
}

}  // namespace
}  // namespace bsp2::supersteps
