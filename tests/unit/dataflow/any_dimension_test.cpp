// Primitives of any dimension, their measures, and consumers of what becomes of them.

#include "dataflow/any_dimension.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/bounds.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "dataflow/producer_stream.hpp"
#include "producers/convex_producer.hpp"

namespace bsp2::dataflow {
namespace {

// --- primitives ---

TEST(AnyDimension, SimplicesHaveTheirVolume) {
  const Seeded s;
  Random random = s.random;
  for (int d = 1; d <= geometry::built_dimensions; ++d) {
    EXPECT_NEAR(volume_of(model::simplex(d, 2)), std::pow(2, d) / std::tgamma(d + 1), 1e-12 * std::pow(2, d))
        << d;
    std::vector<double> corners, matrix;
    for (int i = 0; i < d * (d + 1); ++i) corners.push_back(uniform(random, -3, 3));
    for (int i = d; i < d * (d + 1); ++i)
      matrix.push_back(corners[static_cast<std::size_t>(i)] - corners[static_cast<std::size_t>(i % d)]);
    const double expected = std::fabs(determinant(matrix)) / std::tgamma(d + 1);
    EXPECT_NEAR(volume_of(model::simplex(d, corners)), expected, 1e-9 * expected + 1e-12) << d;
  }
}

TEST(AnyDimension, HullsOfPointsHaveTheContentOfTheirCells) {
  const Seeded s;
  Random random = s.random;
  for (int d = 4; d <= std::min(5, geometry::built_dimensions); ++d) {
    const Expression hull = random_polytope(random, d, d == 4 ? 12 : 4);
    const double content = std::get<model::Polytope>(std::get<model::Primitive>(hull.node().value)).content;
    EXPECT_NEAR(volume_of(hull), content, 1e-10 * content);
    const auto away = free_matrix(random, d, 1000);
    EXPECT_NEAR(volume_of(model::transform(away, hull)),
                content * std::fabs(determinant(linear_part(away, d))), 1e-6 * content);
  }
}

/// Inscribed, nearer the finer they are, and reaching the ball on the axes.
TEST(AnyDimension, BallPolytopesTendToTheBall) {
  for (int d = 4; d <= 5; ++d) {
    double before = 0;
    for (const std::uint32_t sides : {4U, d == 4 ? 12U : 8U}) {
      const Expression polytope = model::ball_polytope(d, 1, sides);
      const double volume =
          std::get<model::Polytope>(std::get<model::Primitive>(polytope.node().value)).content;
      EXPECT_LT(volume, ball_volume(d));
      EXPECT_GT(volume, before * 1.1);
      before = volume;
      for (const auto& ends = model::bounds(polytope); const double x : ends.lower) EXPECT_NEAR(x, -1, 1e-12);
    }
    EXPECT_GT(before, 0.55 * ball_volume(d));
  }
}

/// ConvexProducer over a polytope, and RoundProducer over a product: each cell that is emitted refines the
/// one it replaces.
TEST(AnyDimension, PolytopesEmitStreamsOfRefinements) {
  Seeded s;
  const auto check = [&]<int D>(std::integral_constant<int, D>, const Expression& e) {
    const Network<D> network = compile<D>(e, {});
    ASSERT_EQ(network.producers.size(), 1U);
    check_stream_of<D>(network, ConvexProducer<D>(network, network.producers[0]), 1000, truth_of(e),
                       s.random);
  };
  check(std::integral_constant<int, 2>(), model::simplex(2, 1));
  check(std::integral_constant<int, 4>(),
        model::transform(free_matrix(s.random, 4, 3), model::simplex(4, 1)));
  check(std::integral_constant<int, 4>(), random_polytope(s.random, 4, 6));
#if BSP2_DIMENSIONS > 4
  check(std::integral_constant<int, 5>(), random_polytope(s.random, 5, 1));
  check(std::integral_constant<int, 6>(), model::simplex(6, 2));
#endif
}

// --- measures ---

template <int D>
void check_moments(const Expression& e, double tolerance,
                   const std::vector<std::pair<std::pair<int, int>, double>>& truths, double share) {
  EvaluateOptions how;
  how.tolerance = tolerance;
  const auto totals = measure<D>(e, how);
  const auto in = totals.in.value(), fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
  for (const auto& [entry, truth] : truths) {
    const auto at = static_cast<std::size_t>(geometry::Moments<D>::index(entry.first, entry.second));
    const double least = in.integral[at] + below.integral[at],
                 most = in.integral[at] + fuzzy.integral[at] - below.integral[at];
    EXPECT_LE(least, truth + 1e-12) << D << ": " << entry.first << entry.second;
    EXPECT_GE(most, truth - 1e-12) << D << ": " << entry.first << entry.second;
    EXPECT_LT(most - least, share * ball_volume(D)) << D << ": " << entry.first << entry.second;
  }
}

/// Of the ball V_D r^(D+2) / (D + 2); of a cone and a torus by integration across their axis.
TEST(AnyDimension, MomentsOfRoundSolidsLieInTheirIntervals) {
  check_moments<2>(model::ball(2, 1), 0.01, {{{0, 0}, pi}, {{0, 1}, 0}, {{1, 1}, pi / 4}, {{1, 2}, 0}}, 0.05);
  check_moments<4>(model::ball(4, 1), 0.3,
                   {{{0, 0}, ball_volume(4)}, {{0, 1}, 0}, {{1, 1}, ball_volume(4) / 6}, {{1, 2}, 0}}, 2);
#if BSP2_DIMENSIONS > 4
  check_moments<5>(model::ball(5, 1), 0.6, {{{0, 0}, ball_volume(5)}, {{3, 3}, ball_volume(5) / 7}}, 8);
#endif
  // Apex down, r = z on [0, 1]: V = pi/3, z: pi/4, z^2: pi/5, x^2: pi/20.
  check_moments<3>(model::cone(1, 0, 1), 0.02,
                   {{{0, 0}, pi / 3}, {{0, 3}, pi / 4}, {{3, 3}, pi / 5}, {{1, 1}, pi / 20}, {{1, 3}, 0}},
                   0.05);
  // V = 2 pi^2 R r^2; z^2: V r^2 / 4; x^2: V (4 R^2 + 3 r^2) / 8.
  const double v = 2 * pi * pi * 2 * 0.25;
  check_moments<3>(model::torus(2, 0.5), 0.05,
                   {{{0, 0}, v}, {{3, 3}, v * 0.25 / 4}, {{1, 1}, v * (16 + 0.75) / 8}, {{1, 2}, 0}}, 5);
}

/// The promise of docs/curved.md, "Intervals": of a solid within R of the origin an entry of the tensor has
/// an interval of at most 3 R^2 times the FUZZY volume (R for one factor x_0 = 1); a sixteenth of the
/// tolerance makes all of them about 16 times narrower.
template <int D>
void check_widths(const Expression& e, double reach, double tolerance) {
  std::vector<double> before;
  for (const double h : {tolerance, tolerance / 16}) {
    const auto totals = measure<D>(e, thinner_than(h));
    const auto fuzzy = totals.fuzzy.value(), below = totals.fuzzy_below.value();
    std::vector<double> widths;
    for (int i = 0; i <= D; ++i)
      for (int j = i; j <= D; ++j) {
        const auto at = static_cast<std::size_t>(geometry::Moments<D>::index(i, j));
        widths.push_back(fuzzy.integral[at] - 2 * below.integral[at]);
        const double most = (i == 0 ? 1 : reach) * (j == 0 ? 1 : reach);
        EXPECT_LE(widths.back(), 3 * most * fuzzy.volume()) << D << ": " << i << j;
        if (before.size() >= widths.size()) {
          EXPECT_LT(widths.back(), before[widths.size() - 1] / 8) << D << ": " << i << j;
        }
      }
    if (before.empty()) before = widths;
  }
}

TEST(AnyDimension, IntervalsOfMomentsShrinkWithTheLayer) {
  check_widths<2>(model::ball(2, 1), 1.2, 0.1);
  check_widths<3>(model::ball(3, 1), 1.2, 0.04);
  check_widths<3>(model::cone(3, 2, 0), 3.7, 0.04);
  check_widths<3>(model::cone(3, 2, 1), 3.7, 0.04);
  check_widths<3>(model::round_cylinder(2, 2, {3}), 3.7, 0.04);
  check_widths<3>(model::torus(2, 1), 3.2, 0.08);
  check_widths<4>(model::round_cylinder(2, 1, {1, 1}), 1.9, 0.04);
}

/// The layer between chords and tangents at level l of the fan is 1 - 1 / sqrt(1 + (D - 1) / 4^l) thick: it
/// shrinks fourfold in the limit.
TEST(AnyDimension, BallsOfHighDimensionShrinkAsPromised) {
  const auto layer = [](int d, int level) { return 1 - 1 / std::sqrt(1 + (d - 1) * std::pow(0.25, level)); };
  for (const auto& [d, levels] :
       {std::pair(2, 6), std::pair(3, 3), std::pair(4, 1), std::pair(5, 1), std::pair(6, 0)})
    for (int level = 0; level <= levels && d <= geometry::built_dimensions; ++level) {
      const double thickness = layer(d, level), surface = d * ball_volume(d);
      const VolumeInterval now = volume_interval(model::ball(d, 1), thickness * 1.0001);
      EXPECT_LE(now.in, ball_volume(d));
      EXPECT_GE(now.in + now.fuzzy, ball_volume(d));
      EXPECT_LE(now.fuzzy, surface * thickness * std::pow(1 + thickness, d)) << d << " " << level;
    }
}

TEST(AnyDimension, TheComplementOfNothingIsEverything) {
  const auto all = model::complement(model::Expression(4));
  EXPECT_NEAR(volume_of(model::intersect({model::cuboid({1, 2, 1, 1}), all})), 2, 1e-12);
  EXPECT_NEAR(volume_of(model::section(model::intersect({model::cuboid({1, 2, 1, 1}), all}), 0, 0.5)), 2,
              1e-12);
}

/// Several consumers of one evaluation see the same cells, each in the same batches; one of them is anybody's
/// own.
TEST(AnyDimension, ConsumersOfTheirOwnSeeAllCells) {
  struct Sum : Consumer {
    double volume = 0;
    std::size_t cells = 0;
    void consume(const std::shared_ptr<const Refinement>& refinement) override {
      for (std::size_t i = 0; i < refinement->cells.size(); ++i)
        if (refinement->cells.label[i] == Label::in) volume += refinement->cells.volume[i], ++cells;
    }
  };
  const Network<4> network =
      compile<4>(model::subtract({model::cuboid({2, 2, 2, 2}), model::simplex(4, 1)}), {});
  Sum first, second;
  CollectingConsumer collector;
  Consumer* const consumers[] = {&first, &collector, &second};
  EvaluateOptions how;
  how.threads = 2;
  const auto evaluation = evaluate(network, partition(network, 0).regions, how, consumers);
  EXPECT_NEAR(first.volume, 16 - 1.0 / 24, 1e-12);
  EXPECT_EQ(first.volume, second.volume);
  EXPECT_EQ(first.cells, evaluation.totals.in_cells);
  std::size_t kept = 0;
  for (const auto& refinement : collector.refinements) kept += refinement->cells.size();
  EXPECT_EQ(kept, evaluation.totals.in_cells + evaluation.totals.fuzzy_cells);
}

/// View-driven: with a budget of cells, what is near to the eye is refined more.
TEST(AnyDimension, TheViewIsRefinedWhereTheEyeIs) {
  const auto at = [](double x) {
    return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                            model::ball(3, 1));
  };
  const Network<3> network = compile<3>(model::unite({at(-8), at(8)}), {});
  const auto fuzzy_on = [&](double eye, int side) {
    EvaluateOptions how;
    how.order = Order::priority;
    how.eye = {eye, 0, 0};
    how.cells = 1500;
    how.tolerance = 0.001;
    CollectingConsumer collector;
    Consumer* const consumers[] = {&collector};
    evaluate(network, partition(network, 0).regions, how, consumers);
    double volume = 0;
    for (const auto& refinement : collector.refinements)
      for (std::size_t i = 0; i < refinement->cells.size(); ++i)
        if (refinement->cells.label[i] == Label::fuzzy && refinement->cells.cell_points(i)[0] * side > 0)
          volume += refinement->cells.volume[i];
    return volume;
  };
  EXPECT_LT(fuzzy_on(10, 1), 0.8 * fuzzy_on(10, -1));
  EXPECT_LT(fuzzy_on(-10, -1), 0.8 * fuzzy_on(-10, 1));
}

/// What stops a view: every FUZZY cell is thin, or is seen so from the eye. Cells do not depend on threads
/// and order.
TEST(AnyDimension, TheViewIsRefinedToAnAngle) {
  const auto at = [](double x) {
    return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                            model::ball(3, 1));
  };
  const Expression solid =
      model::unite({at(-8), at(8),
                    model::transform(std::vector<double>{1, 0, 0, -6, 0, 1, 0, 4, 0, 0, 1, 0, 0, 0, 0, 1},
                                     model::torus(2, 0.5))});
  const Network<3> network = compile<3>(solid, {});
  EvaluateOptions how;
  how.eye = {12, 0.5, 0};
  how.tolerance = 0.003;
  std::uint64_t before = 0;
  for (const double angle : {0.02, 0.005}) {
    how.angle = angle;
    std::string digest;
    for (const unsigned threads : {1U, 2U}) {
      how.threads = threads;
      how.order = threads == 1 ? Order::depth : Order::priority;
      const auto [evaluation, refinements] = evaluate_all(network, 0, how);
      if (digest.empty()) digest = evaluation.totals.digest.hex();
      EXPECT_EQ(digest, evaluation.totals.digest.hex());
      expect_contains({evaluation.totals.in.value().volume(), evaluation.totals.fuzzy.value().volume(), 0},
                      8 * pi / 3 + pi * pi, 1);
      double near = 0, far = 0;
      for (const auto& refinement : refinements)
        for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
          if (refinement->cells.label[cell] != Label::fuzzy) continue;
          const auto points = refinement->cells.cell_points(cell);
          double distance = 1e300, thickness = 1e300, x = 0;
          for (std::size_t i = 0; i < points.size(); i += 3) {
            distance = std::min(distance, std::hypot(points[i] - how.eye[0], points[i + 1] - how.eye[1],
                                                     points[i + 2] - how.eye[2]));
            x += points[i] * 3 / static_cast<double>(points.size());
          }
          // No thicker across a facet, or along an axis.
          for (std::uint32_t facet = refinement->cells.facet_offset[cell];
               facet < refinement->cells.facet_offset[cell + 1]; ++facet) {
            const std::int32_t code = refinement->cells.facet_hyperplane[facet];
            const auto h =
                network.table.rounded(static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code));
            double reach = 0;
            for (std::size_t i = 0; i < points.size(); i += 3)
              reach = std::max(reach, std::fabs(h.at({points[i], points[i + 1], points[i + 2]})));
            thickness = std::min(thickness, reach);
          }
          for (std::size_t axis = 0; axis < 3; ++axis) {
            double low = 1e300, high = -1e300;
            for (std::size_t i = axis; i < points.size(); i += 3)
              low = std::min(low, points[i]), high = std::max(high, points[i]);
            thickness = std::min(thickness, high - low);
          }
          ASSERT_LT(thickness, std::max(0.003, angle * distance) * 1.000001);
          (x > 0 ? near : far) += refinement->cells.volume[cell];
        }
      EXPECT_LT(near, 0.5 * far);
      const std::uint64_t cells = evaluation.totals.in_cells + evaluation.totals.fuzzy_cells;
      if (threads == 1) {
        EXPECT_GT(cells, before);
        before = cells;
      }
    }
  }
}

TEST(AnyDimension, NamedPartsAreOnePart) {
  const auto model =
      model::unite({model::cuboid({1, 1, 1, 1}),
                    model::part("rest", model::unite({model::simplex(4, 3), model::ball(4, 2)}))});
  const Network<4> network = compile<4>(model, {});
  ASSERT_EQ(network.parts.size(), 1U);
  EXPECT_EQ(network.parts[0].name, "rest");
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(network.producers[i].primitive, static_cast<std::int32_t>(i));
    EXPECT_EQ(network.producers[i].part, i == 0 ? geometry::no_part : 0);
  }
}

/// The errors of constructs have the place of the construct.
TEST(AnyDimension, ErrorsOfConstructsHaveTheirPlace) {
  const std::string text = "union() {\n  extrude(h = 1) complement() cuboid(size = [1, 1]);\n}";
  const auto model = model::parse_csg(text, "t.csg");
  CompileOptions options;
  options.place_of = [&](const model::Node& node) {
    return model::place_in(text, "t.csg", model.construct_offsets.at(&node)) + ": ";
  };
  try {
    compile<3>(model.expression, options);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(std::string(error.what()).find("t.csg:2:3: product: an operand has no bounds"), 0U)
        << error.what();
  }
}

/// So have those that only compilation finds.
TEST(AnyDimension, ErrorsOfPrimitivesHaveTheirPlace) {
  const std::string surface =
      "subdivision(points = [[0,0,0,0],[1,0,0,0],[0,1,0,0],[0,0,1,1]], faces = "
      "[[0,2,1],[0,1,3],[1,2,3],[2,0,3]]);";
  const auto error_of = [](const std::string& text) -> std::string {
    const auto model = model::parse_csg(text, "t.csg");
    CompileOptions options;
    options.place_of_primitive = [&](std::int32_t primitive) {
      return model::place_in(text, "t.csg", model.part_offsets.at(static_cast<std::size_t>(primitive))) +
             ": ";
    };
    try {
      geometry::in_dimension(model.expression.dimension(),
                             [&](auto d) { compile<d()>(model.expression, options); });
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of("cuboid([1, 1, 1]);\nsection(axis = 1, at = 0.5)\n " + surface),
            "t.csg:3:2: only subdivision surfaces of space have products and sections");
  if (geometry::built_dimensions > 4) {
    EXPECT_EQ(error_of("extrude(h = 1) " + surface),
              "t.csg:1:16: only subdivision surfaces of space have products and sections");
  }
  EXPECT_EQ(error_of("cuboid([1, 1, 1]);\ncuboid([1e300, 1, 1]);").find("t.csg:2:1: the model is too large"),
            0U);
}

}  // namespace
}  // namespace bsp2::dataflow
