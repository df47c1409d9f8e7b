// What hulls, sums and shadows make of splines, subdivision surfaces, and prisms and sections of what is
// curved.

#include "bsp2/geometry/support/error.hpp"
#include "dataflow/refined/spline_samples.hpp"

namespace bsp2::dataflow {
namespace {

using RefinedParts = Seeded;

const Expression& disk() {
  static const Expression solid = model::spline(2, {nurbs_circle(1)});
  return solid;
}

template <int D>
VolumeInterval interval_of(const Expression& e) {
  return volume_interval<D>(e, {});
}

void expect_narrow(const VolumeInterval& interval, double truth, double share) {
  expect_contains(interval, truth);
  EXPECT_LT(interval.fuzzy, share * truth);
}

TEST_F(RefinedParts, ConstructsOfADiskHaveTheAreasOfTheirFormulas) {
  const Expression square = model::cuboid({1, 1}, true);
  expect_narrow(interval_of<2>(model::minkowski(disk(), square)), pi + 4 + 1, 0.1);
  expect_narrow(interval_of<2>(model::construct(
                    model::Hull{},
                    {model::unite({disk(), model::transform(std::vector<double>{1, 0, 2, 0, 1, 0, 0, 0, 1},
                                                            disk())})})),
                pi + 4, 0.1);
  expect_narrow(interval_of<2>(model::sweep(disk(), {{0, 0}, {2, 0}})), pi + 4, 0.1);
  expect_narrow(interval_of<2>(model::grow(disk(), 0.5)), pi + 4 + 1, 0.1);
  // The square without a disk: complements exchange the sides.
  const Expression frame = model::subtract({model::cuboid({4, 4}, true), disk()});
  const double common = 2 * (std::asin(std::sqrt(15.0) / 4) - std::asin(0.25)) - std::sqrt(15.0) / 4 +
                        0.25;  // of unit disks around (+-1/4, +-1/4)
  expect_narrow(interval_of<2>(model::minkowski(frame, model::cuboid({0.5, 0.5}, true))), 4.5 * 4.5 - common,
                0.1);
  expect_narrow(interval_of<2>(model::grow(disk(), -0.25)), common, 0.1);
  expect_narrow(interval_of<2>(model::construct(
                    model::Hull{}, {model::symmetric_difference({disk(), model::cuboid({1, 1}, true)})})),
                pi, 0.1);
}

TEST_F(RefinedParts, ConstructsInSpaceHaveTheVolumesOfTheirFormulas) {
  const Expression sphere = model::spline(3, {nurbs_sphere(1)});
  expect_narrow(interval_of<2>(model::project(sphere, {0, 1})), pi, 0.6);
  expect_narrow(interval_of<3>(model::construct(model::Hull{}, {sphere})), 4 * pi / 3, 1);
  const Expression prism = model::extrude(disk(), {1});  // is its own hull
  expect_narrow(interval_of<3>(model::construct(model::Hull{}, {prism})), pi, 0.6);
  // A slice of a torus is a ring between radii 1 and 3; its hull fills the hole.
  expect_narrow(interval_of<2>(model::construct(model::Hull{}, {model::section(model::torus(2, 1), 2, 0)})),
                9 * pi, 0.1);
}

/// Their cells have many corners on common hyperplanes, in rounded coordinates.
TEST_F(RefinedParts, ConstructsOfProductsInFourDimensions) {
  const Expression square = model::cuboid({1, 1});
  expect_contains(interval_of<4>(model::grow(model::product({disk(), square}), -0.25)),
                  (2 * (std::asin(std::sqrt(15.0) / 4) - std::asin(0.25)) - std::sqrt(15.0) / 4 + 0.25) / 4);
  expect_contains(interval_of<3>(model::project(model::product({disk(), square}), {0, 1, 2})), pi);
}

/// The sum of a thin set and a box: every sum of two of their points is in it, and nothing is surely in it.
TEST_F(RefinedParts, SumsOfThinSetsHoldTheSumsOfTheirPoints) {
  for (int round = 0; round < 3; ++round) {
    const Piece piece = waved_piece<2>(random, {3}, {6}, round % 2 == 1);
    const Expression sum = model::minkowski(model::spline(2, {piece}), model::cuboid({0.3, 0.2}));
    const Network<2> network = compile<2>(sum, {});
    EvaluateOptions options;
    options.record_tree = true;
    auto [evaluation, refinements] = evaluate_all(network, 0, options);
    std::vector<Label> labels;
    for (const auto& refinement : refinements)
      labels.insert(labels.end(), refinement->cells.label.begin(), refinement->cells.label.end());
    evaluation.tree.root = evaluation.region_roots[0];
    const geometry::PointQuery<2> query(network.table, evaluation.tree, labels);
    EXPECT_EQ(evaluation.totals.in_cells, 0U);
    for (auto point : points_of<2>(piece, 10'000, random)) {
      point[0] += uniform(random, 0, 0.3);
      point[1] += uniform(random, 0, 0.2);
      ASSERT_EQ(query.ask(point).label, Label::fuzzy) << point[0] << ", " << point[1];
    }
  }
}

/// An L is not convex: its IN cells are several, and nothing is between them.
TEST_F(RefinedParts, AreShrunkAsAWhole) {
  const Piece outline{
      {1}, {{0, 0, 1, 2, 3, 4, 5, 6, 6}}, {0, 0, 1, 2, 0, 1, 2, 1, 1, 1, 1, 1, 1, 2, 1, 0, 2, 1, 0, 0, 1}};
  expect_narrow(interval_of<2>(model::grow(model::spline(2, {outline}), -0.25)), 1.25, 0.2);
}

TEST_F(RefinedParts, SumsOfTooManyCellsAreRefused) {
  const Expression sphere = model::spline(3, {nurbs_sphere(1)});
  EXPECT_THROW(static_cast<void>(compile<3>(model::minkowski(sphere, sphere), {})), Error);
}

TEST_F(RefinedParts, AreTheSameInEveryRun) {
  expect_same_digest<2>(model::minkowski(disk(), model::cuboid({1, 1})), {}, 0);
}

TEST_F(RefinedParts, AreNoCornersForConstructsThatAreNotMonotone) {
  const auto compiled = [](const Expression& e) { static_cast<void>(compile<2>(e, {})); };
  EXPECT_THROW(compiled(model::construct(model::Resize{.size = {2, 2, 0}}, {disk()})), Error);
}

}  // namespace
}  // namespace bsp2::dataflow
