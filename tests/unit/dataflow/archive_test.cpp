// What travels and is stored comes back as it was.

#include "bsp2/dataflow/regions/archive.hpp"

#include <gtest/gtest.h>

#include <boost/serialization/string.hpp>
#include <cstring>

#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

template <int D>
void expect_equal(const Totals<D>& a, const Totals<D>& b) {
  EXPECT_EQ(a.in.state(), b.in.state());
  EXPECT_EQ(a.fuzzy.state(), b.fuzzy.state());
  EXPECT_EQ(a.in.value().integral, b.in.value().integral);
  EXPECT_EQ(a.in_cells, b.in_cells);
  EXPECT_EQ(a.fuzzy_cells, b.fuzzy_cells);
  EXPECT_EQ(a.out_cells, b.out_cells);
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.upper, b.upper);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.digest.hex(), b.digest.hex());
  EXPECT_EQ(a.counts.splits, b.counts.splits);
  EXPECT_EQ(a.counts.exact_vertices, b.counts.exact_vertices);
}

template <int D>
void expect_round_trips(Random& random) {
  const Network<D> network = compile<D>(random_expression(random, D, Kind::grid_boxes, 2), {});
  EvaluateOptions options = keep_everything(2);
  options.level = 6;
  const auto result = evaluate_all(network, 2, options);

  Totals<D> totals(network.table.radius(), network.table.width());
  from_bytes(to_bytes(result.evaluation.totals), totals);
  expect_equal(totals, result.evaluation.totals);
  totals += result.evaluation.totals;  // and goes on as a sum
  Totals<D> twice = result.evaluation.totals;
  twice += result.evaluation.totals;
  expect_equal(totals, twice);

  for (const auto& refinement : result.refinements) {
    const geometry::CellBatch& batch = refinement->cells;
    geometry::CellBatch back;
    from_bytes(to_bytes(batch), back);
    EXPECT_EQ(back.dimension, batch.dimension);
    EXPECT_EQ(back.points, batch.points);
    EXPECT_EQ(back.point_offset, batch.point_offset);
    EXPECT_EQ(back.facet_offset, batch.facet_offset);
    EXPECT_EQ(back.facet_vertex_offset, batch.facet_vertex_offset);
    EXPECT_EQ(back.facet_vertices, batch.facet_vertices);
    EXPECT_EQ(back.facet_hyperplane, batch.facet_hyperplane);
    EXPECT_EQ(back.label, batch.label);
    EXPECT_EQ(back.primitive, batch.primitive);
    EXPECT_EQ(back.part, batch.part);
    EXPECT_EQ(back.region, batch.region);
    EXPECT_EQ(back.level, batch.level);
    EXPECT_EQ(back.volume, batch.volume);
  }

  Partition<D> parts = partition(network, 3);
  for (Region<D>& region : parts.regions) {
    region.frontier.nodes = {{Frontier::Kind::split, geometry::Label::fuzzy, 0, -7},
                             {Frontier::Kind::held, geometry::Label::in, 0, 3}};
    region.frontier.programs = region.program;
    Region<D> back;
    from_bytes(to_bytes(region), back);
    EXPECT_EQ(back.number, region.number);
    EXPECT_EQ(back.level, region.level);
    EXPECT_EQ(back.program, region.program);
    EXPECT_EQ(back.frontier, region.frontier);
    back.cell = region_cell(network, parts, back.number);
    ASSERT_EQ(back.cell.vertices().size(), region.cell.vertices().size());
    for (std::size_t i = 0; i < back.cell.vertices().size(); ++i) {
      EXPECT_EQ(back.cell.vertices()[i].x, region.cell.vertices()[i].x);
      EXPECT_EQ(back.cell.vertices()[i].hyperplanes, region.cell.vertices()[i].hyperplanes);
    }
  }
  EXPECT_THROW(region_cell(network, parts, 1000), std::out_of_range);
}

TEST(Archive, RoundTripsWhatTravels) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(5); ++round) {
    expect_round_trips<2>(random);
    expect_round_trips<3>(random);
    expect_round_trips<4>(random);
  }
}

TEST(Archive, KeepsNegativeSums) {
  geometry::MomentSum<2> sum(3, 1);
  geometry::Moments<2> moments;
  moments.integral = {1, -2, 0.5, 3, -1e-9, 0.25};
  sum.add(moments);
  geometry::MomentSum<2> back;
  back.set_state(sum.state());
  EXPECT_EQ(back.value().integral, sum.value().integral);
  EXPECT_LT(back.value().integral[1], 0);
}

TEST(Archive, IsAboutAsLargeAsItsArrays) {
  geometry::CellBatch batch;
  batch.points.assign(30000, 1.5);
  batch.label.assign(1000, geometry::Label::in);
  EXPECT_LT(to_bytes(batch).size(), 30000 * sizeof(double) + 1000 + 512);
  Frontier frontier;
  frontier.nodes.resize(1000);
  EXPECT_LT(to_bytes(frontier).size(), 1000 * sizeof(Frontier::Node) + 256);
}

TEST(Archive, RefusesTruncatedBytes) {
  Frontier frontier;
  frontier.nodes.resize(100);
  const std::string bytes = to_bytes(frontier);
  Frontier back;
  EXPECT_ANY_THROW(from_bytes(std::span(bytes).first(bytes.size() / 2), back));
}

TEST(Archive, RefusesALengthBeyondItsEndBeforeItTakesMemory) {
  Frontier frontier;
  frontier.nodes.resize(100);
  std::string bytes = to_bytes(frontier);
  const std::uint64_t length = 100, large = std::uint64_t{1} << 28, largest = ~std::uint64_t{0};
  const auto at = bytes.find(std::string(reinterpret_cast<const char*>(&length), sizeof length));
  ASSERT_NE(at, std::string::npos);
  for (const std::uint64_t damaged : {large, largest}) {
    std::memcpy(bytes.data() + at, &damaged, sizeof damaged);
    Frontier back;
    EXPECT_THROW(from_bytes(std::span<const char>(bytes), back), boost::archive::archive_exception);
    EXPECT_LT(back.nodes.capacity(), bytes.size());
  }
}

TEST(Archive, RefusesATextBeyondItsEndBeforeItTakesMemory) {
  const std::vector<std::string> texts{"", "abc", std::string(1000, 'x')};
  std::string bytes = to_bytes(texts);
  std::vector<std::string> back;
  from_bytes(bytes, back);
  EXPECT_EQ(back, texts);
  const std::uint64_t length = 1000, large = std::uint64_t{1} << 28, largest = ~std::uint64_t{0};
  const auto at = bytes.find(std::string(reinterpret_cast<const char*>(&length), sizeof length));
  ASSERT_NE(at, std::string::npos);
  for (const std::uint64_t damaged : {large, largest}) {
    std::memcpy(bytes.data() + at, &damaged, sizeof damaged);
    std::vector<std::string> wrong;
    EXPECT_THROW(from_bytes(std::span<const char>(bytes), wrong), boost::archive::archive_exception);
    for (const std::string& text : wrong) EXPECT_LT(text.capacity(), bytes.size());
  }
}

}  // namespace
}  // namespace bsp2::dataflow
