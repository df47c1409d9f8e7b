// What is always true of an evaluation, on random expressions, against the membership of points in the
// expression.

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "dataflow/oracle.hpp"
#include "geometry/cell_samples.hpp"
#include "support/dimension_types.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::CellBatch;
using geometry::Label;

constexpr Real margin = 1e-7L;

/// Signed distance of the furthest facet: negative inside.
template <int D>
Real outside_by(const CellBatch& batch, std::size_t cell, const Point& x, const Network<D>& network) {
  Real furthest = -std::numeric_limits<Real>::infinity();
  for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
    const std::int32_t code = batch.facet_hyperplane[facet];
    const auto h = network.table.rounded(static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code));
    Real value = h.offset;
    for (int i = 0; i < D; ++i) value += static_cast<Real>(h.normal[i]) * x[static_cast<std::size_t>(i)];
    furthest = std::max(furthest, code < 0 ? -value : value);
  }
  return furthest;
}

template <int D>
double root_volume(const Network<D>& network) {
  return geometry::CellWriter<D>(network.table).measure(geometry::root_cell(network.table)).volume();
}

/// Labels, primitives, disjointness and the root's filling of one evaluation that kept all cells.
template <int D>
void check_cells(const model::Expression& e, const Network<D>& network, const Evaluated<D>& result,
                 Random& random, bool finished) {
  const auto primitives = occurrences(e);
  double sum = 0, in = 0, fuzzy = 0;
  std::uint64_t count = 0;
  for (const auto& refinement : result.refinements) {
    const CellBatch& batch = refinement->cells;
    ASSERT_EQ(batch.dimension, D);
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      ++count;
      const Label label = batch.label[cell];
      sum += batch.volume[cell];
      if (label == Label::in) in += batch.volume[cell];
      if (label == Label::fuzzy) fuzzy += batch.volume[cell];
      ASSERT_TRUE(!finished || label != Label::fuzzy);
      const std::int32_t primitive = batch.primitive[cell];
      if (label == Label::in) {
        ASSERT_TRUE(primitive == geometry::no_primitive ||
                    (primitive >= 0 && static_cast<std::size_t>(primitive) < primitives.size()));
        ASSERT_EQ(batch.part[cell], 0);
      } else {
        ASSERT_EQ(primitive, geometry::no_primitive);
        ASSERT_EQ(batch.part[cell], geometry::no_part);
      }
      if (label == Label::fuzzy) continue;
      for (int sample = 0; sample < 2; ++sample) {
        const Point x = point_in(batch, cell, random);
        const Where truth = where(e, x, margin);
        if (truth.doubtful) continue;
        ASSERT_EQ(label == Label::in, truth.inside) << "cell " << cell << " of level " << batch.level[cell];
        if (primitive >= 0) {
          ASSERT_TRUE(where(primitives[static_cast<std::size_t>(primitive)], x, margin).inside)
              << "primitive " << primitive;
        }
      }
    }
  }
  const double root = root_volume(network);
  // Corners are rounded relative to their distance from the origin, however small the root cell is.
  EXPECT_NEAR(sum, root, 1e-11 * std::max(root, std::pow(root, (D - 1.0) / D) * network.table.radius()));
  const auto& totals = result.evaluation.totals;
  EXPECT_EQ(totals.in_cells + totals.fuzzy_cells + totals.out_cells, count);
  EXPECT_NEAR(totals.in.value().volume(), in, 1e-12 * root);
  EXPECT_NEAR(totals.fuzzy.value().volume(), fuzzy, 1e-12 * root);

  // Any point of the root is in exactly one cell, the one whose label it has.
  for (int sample = 0; sample < 10; ++sample) {
    Point x;
    for (int axis = 0; axis < D; ++axis)
      x.push_back(network.table.axis_value(
          axis, static_cast<std::uint32_t>(uniform(random, 0, 1) * network.table.axis_steps)));
    const Where truth = where(e, x, margin);
    int inside = 0, near = 0;
    for (const auto& refinement : result.refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
        const Real by = outside_by(refinement->cells, cell, x, network);
        near += std::fabs(by) < 1e-9L;
        if (by >= 0) continue;
        ++inside;
        if (!truth.doubtful && refinement->cells.label[cell] != Label::fuzzy) {
          ASSERT_EQ(refinement->cells.label[cell] == Label::in, truth.inside);
        }
      }
    ASSERT_TRUE(near > 0 || inside == 1) << "a point in none or several cells";
  }
}

/// The moments, to 1e-12 of their own scale.
template <int D>
void expect_same_moments(const geometry::Moments<D>& a, const geometry::Moments<D>& b, double radius,
                         const char* what) {
  const double volume = std::max(a.volume(), 1e-300);
  for (int i = 0; i < geometry::Moments<D>::size; ++i) {
    const double scale = volume * std::pow(radius, i == 0 ? 0 : i <= D ? 1 : 2);
    EXPECT_NEAR(a.integral[i], b.integral[i], 1e-12 * scale) << what << ", moment " << i;
  }
}

template <int D>
void check_invariants(const model::Expression& e, Random& random, bool everything) {
  const Network<D> network = compile<D>(e, {});
  const Evaluated<D> one = evaluate_all(network, 0, keep_everything());
  check_cells(e, network, one, random, true);
  if (testing::Test::HasFatalFailure() || !everything) return;
  const auto moments = one.evaluation.totals.in.value();
  const double radius = network.table.radius();

  // The same cells with any number of threads, in any order.
  for (const Order order : {Order::depth, Order::priority})
    for (const unsigned threads : {1U, 2U, 4U}) {
      const auto other =
          evaluate(network, partition(network, 0).regions, keep_everything(threads, order), {});
      ASSERT_EQ(other.totals.digest.hex(), one.evaluation.totals.digest.hex()) << threads << " threads";
      ASSERT_EQ(other.totals.in.value().integral, moments.integral);
      ASSERT_EQ(other.totals.level, one.evaluation.totals.level);
      ASSERT_EQ(other.totals.lower, one.evaluation.totals.lower);
    }

  // The same point set in any partition; whatever is kept, the IN cells are the same.
  for (const unsigned depth : {1U, 3U}) {
    const Evaluated<D> parts = evaluate_all(network, depth, keep_everything(2));
    check_cells(e, network, parts, random, true);
    if (testing::Test::HasFatalFailure()) return;
    expect_same_moments<D>(parts.evaluation.totals.in.value(), moments, radius, "partition");
    if (one.evaluation.totals.in_cells > 0) {
      for (int i = 0; i < D; ++i)
        EXPECT_NEAR(parts.evaluation.totals.lower[i], one.evaluation.totals.lower[i], 1e-9);
    }
  }
  EvaluateOptions in_only;
  in_only.threads = 2;
  const auto less = evaluate(network, partition(network, 0).regions, in_only, {});
  expect_same_moments<D>(less.totals.in.value(), moments, radius, "without OUT cells");

  // Bounds at each level hold the truth and only get better.
  double low = 0, high = root_volume(network) * (1 + 1e-12);
  for (unsigned level = 0; level <= one.evaluation.totals.level + 1;
       level = level < 4 ? level + 1 : level * 2) {
    EvaluateOptions options = keep_everything(1, level % 2 == 0 ? Order::depth : Order::priority);
    options.level = level;
    const Evaluated<D> coarse = evaluate_all(network, 0, options);
    const double in = coarse.evaluation.totals.in.value().volume(),
                 fuzzy = coarse.evaluation.totals.fuzzy.value().volume();
    const double slack = 1e-12 * root_volume(network);
    ASSERT_GE(in, low - slack);
    ASSERT_LE(in + fuzzy, high + slack);
    ASSERT_LE(in, moments.volume() + slack);
    ASSERT_GE(in + fuzzy, moments.volume() - slack);
    ASSERT_LE(coarse.evaluation.totals.level, std::max(level, one.evaluation.totals.level));
    low = in;
    high = in + fuzzy;
    if (level == 3) check_cells(e, network, coarse, random, false);
    if (testing::Test::HasFatalFailure()) return;
    options.threads = 4;
    ASSERT_EQ(evaluate(network, partition(network, 0).regions, options, {}).totals.digest.hex(),
              coarse.evaluation.totals.digest.hex());
  }
}

/// Content of an expression on the integer grid, by asking the middle of every unit cube.
template <int D>
double count_unit_cubes(const model::Expression& e, int reach) {
  std::vector<int> at(D, -reach);
  double count = 0;
  for (;;) {
    Point x;
    for (const int i : at) x.push_back(i + Real{0.5});
    count += where(e, x, 0).inside;
    int axis = 0;
    while (axis < D && ++at[static_cast<std::size_t>(axis)] == reach)
      at[static_cast<std::size_t>(axis++)] = -reach;
    if (axis == D) return count;
  }
}

template <typename T>
class Invariants : public testing::Test {};
TYPED_TEST_SUITE(Invariants, samples::Dimensions);

TYPED_TEST(Invariants, HoldForRandomBoxesOnTheGrid) {
  constexpr int D = TypeParam::value;
  const int rounds = samples::rounds(D <= 2 ? 300 : D == 3 ? 150 : D == 4 ? 20 : D == 5 ? 6 : 2);
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    check_invariants<D>(random_expression(random, D, Kind::grid_boxes, D <= 3 ? 2 : 1), random,
                        round % 4 == 0);
    if (testing::Test::HasFailure()) return;
  }
}

TYPED_TEST(Invariants, HoldForRandomSolids) {
  constexpr int D = TypeParam::value;
  const int rounds = samples::rounds(D <= 2 ? 300 : D == 3 ? 300 : D == 4 ? 10 : 2);
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    check_invariants<D>(random_expression(random, D, Kind::solids, D <= 3 ? 2 : 1), random, round % 6 == 0);
    if (testing::Test::HasFailure()) return;
  }
}

TYPED_TEST(Invariants, VolumesOfGridBoxesAreCounts) {
  constexpr int D = TypeParam::value;
  const int rounds = samples::rounds(D <= 3 ? 200 : D == 4 ? 30 : D == 5 ? 6 : 2);
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    // Within a box, so that complements are bounded. Cuboids reach from -2-3 to 2+3.
    const int reach = D <= 4 ? 5 : 3;
    const auto world = model::cuboid(std::vector<double>(D, 2.0 * reach), true);
    const auto e = model::intersect({world, random_expression(random, D, Kind::grid_boxes, D <= 3 ? 2 : 1)});
    const double expected = count_unit_cubes<D>(e, reach);
    EXPECT_NEAR(volume<D>(e), expected, 1e-11 * std::pow(2.0 * reach, D));
    EXPECT_NEAR(volume<D>(e, 0), expected, 1e-11 * std::pow(2.0 * reach, D));
    if (testing::Test::HasFailure()) return;
  }
}

TYPED_TEST(Invariants, InclusionExclusionAndDeMorgan) {
  constexpr int D = TypeParam::value;
  const int rounds = samples::rounds(D <= 3 ? 60 : D == 4 ? 5 : 1);
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto world = model::cuboid(std::vector<double>(D, 20.0), true);
    const int depth = D <= 3 ? 1 : 0;
    const auto inside = [&](const model::Expression& e) { return model::intersect({world, e}); };
    const auto a = random_expression(random, D, Kind::solids, depth),
               b = random_expression(random, D, Kind::solids, depth);
    const double both = volume<D>(inside(model::intersect({a, b}))),
                 either = volume<D>(inside(model::unite({a, b})));
    const double va = volume<D>(inside(a)), vb = volume<D>(inside(b)), slack = 1e-11 * std::pow(20.0, D);
    EXPECT_NEAR(either + both, va + vb, slack);
    EXPECT_NEAR(volume<D>(inside(model::symmetric_difference({a, b}))), either - both, slack);
    EXPECT_NEAR(volume<D>(inside(model::subtract({a, b}))), va - both, slack);
    const auto outside = [](const model::Expression& e) { return model::complement(e); };
    EXPECT_NEAR(volume<D>(inside(outside(model::intersect({outside(a), outside(b)})))), either, slack);
    EXPECT_NEAR(volume<D>(inside(outside(model::unite({outside(a), outside(b)})))), both, slack);
    EXPECT_NEAR(volume<D>(inside(outside(outside(a)))), va, slack);
    const auto c = random_expression(random, D, Kind::solids, 0);
    const auto distributed = model::unite({model::intersect({a, b}), model::intersect({a, c})}),
               joint = model::intersect({a, model::unite({b, c})});
    EXPECT_NEAR(volume<D>(inside(model::symmetric_difference({distributed, joint}))), 0, slack);
    EXPECT_EQ(volume<D>(model::subtract({a, a})), 0);
    EXPECT_EQ(volume<D>(model::symmetric_difference({a, b, a, b})), 0);
    EXPECT_NEAR(volume<D>(inside(model::symmetric_difference({a, b, a}))), vb, slack);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
