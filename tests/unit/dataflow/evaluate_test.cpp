// Evaluation as a machine: exceptions, limits, what is kept, the tree.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <set>
#include <string>

#include "bsp2/geometry/support/error.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Label;
using Clock = std::chrono::steady_clock;

/// Many small solids, so that there are many batches.
model::Expression grid_of_solids(int side) {
  std::vector<model::Expression> operands;
  for (int x = 0; x < side; ++x)
    for (int y = 0; y < side; ++y)
      for (int z = 0; z < side; ++z) {
        auto m = identity_matrix(3);
        m[3] = 2 * x;
        m[7] = 2 * y;
        m[11] = 2 * z;
        operands.push_back(model::transform(m, model::sphere(0.9, 8)));
      }
  return model::unite(operands);
}

class Thrower : public Consumer {
 public:
  Thrower(int at_batch, bool in_progress) : left_(at_batch), in_progress_(in_progress) {}
  void consume(const std::shared_ptr<const Refinement>& refinement) override {
    weak.push_back(refinement);
    thrown_at = Clock::now();
    if (!in_progress_ && left_-- == 0) throw Error("no room on the disk");
    if (in_progress_) std::this_thread::sleep_for(std::chrono::milliseconds(120));  // let progress come
  }
  void progress(double done, std::uint64_t, std::int64_t) override {
    EXPECT_GE(done, 0);
    EXPECT_LE(done, 1);
    thrown_at = Clock::now();
    if (in_progress_) throw Error("progress cannot be shown");
  }
  std::vector<std::weak_ptr<const Refinement>> weak;
  Clock::time_point thrown_at;

 private:
  int left_;
  bool in_progress_;
};

TEST(Evaluate, LeavesPromptlyWithAConsumersException) {
  const Network<3> network = compile<3>(grid_of_solids(5), {});
  for (const unsigned threads : {1U, 2U, 4U})
    for (const Order order : {Order::depth, Order::priority})
      for (const int at : {0, 3, -1}) {
        CollectingConsumer collector;
        Thrower thrower(at, at < 0);
        std::vector<Consumer*> consumers{&thrower, &collector};
        EvaluateOptions options = keep_everything(threads, order);
        EXPECT_THROW(evaluate(network, partition(network, 2).regions, options, consumers), Error);
        EXPECT_LT(std::chrono::duration<double>(Clock::now() - thrower.thrown_at).count(), 20);
        // Nothing holds on to the batches but the consumers that kept them.
        collector.refinements.clear();
        for (const auto& batch : thrower.weak) EXPECT_TRUE(batch.expired());
      }
  // The network is as good as before.
  EXPECT_GT(evaluate(network, partition(network, 0).regions, EvaluateOptions{}, {}).totals.in_cells, 0U);
}

TEST(Evaluate, ServesAnyNumberOfConsumersWithTheSameBatches) {
  const Network<3> network = compile<3>(grid_of_solids(3), {});
  CollectingConsumer a, b, c;
  std::vector<Consumer*> consumers{&a, &b, &c};
  const auto result = evaluate(network, partition(network, 1).regions, keep_everything(2), consumers);
  EXPECT_EQ(a.refinements, b.refinements);
  EXPECT_EQ(a.refinements, c.refinements);
  std::uint64_t cells = 0;
  Digest digest;
  std::vector<std::vector<std::pair<std::uint64_t, std::uint64_t>>> ranges(2);
  for (const auto& refinement : a.refinements) {
    cells += refinement->cells.size();
    ASSERT_LT(refinement->worker, 2U);
    ranges[refinement->worker].emplace_back(refinement->first, refinement->cells.size());
    for (std::size_t i = 0; i < refinement->cells.size(); ++i) digest.add(refinement->cells, i);
  }
  EXPECT_EQ(digest.hex(), result.totals.digest.hex());
  EXPECT_EQ(cells, result.totals.in_cells + result.totals.out_cells);
  for (auto& own : ranges) {  // each worker numbers its cells without a gap
    std::sort(own.begin(), own.end());
    std::uint64_t next = 0;
    for (const auto& [first, count] : own) {
      EXPECT_EQ(first, next);
      next += count;
    }
  }
  EXPECT_EQ(result.cells_of_worker.size(), 2U);
}

/// Is there for the progress alone.
class Onlooker : public Consumer {
 public:
  void consume(const std::shared_ptr<const Refinement>&) override { ++batches; }
  [[nodiscard]] bool takes_cells() const override { return false; }
  int batches = 0;
};

TEST(Evaluate, FindsTheSameWhetherCellsAreWrittenOrNot) {
  const auto pillar = model::cylinder(3, 5, 5, 150, false);  // a cell with 300 corners
  for (const auto& [solid, most_corners] :
       {std::pair{grid_of_solids(3), std::size_t{16}}, {pillar, std::size_t{300}}}) {
    const Network<3> network = compile<3>(solid, {});
    CollectingConsumer collector;
    Onlooker onlooker;
    std::vector<Consumer*> both{&onlooker, &collector}, one{&onlooker};
    const auto written = evaluate(network, partition(network, 0).regions, keep_everything(2), both);
    EXPECT_GT(onlooker.batches, 0);  // what is written for one goes to all
    std::size_t largest = 0;
    for (const auto& refinement : collector.refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell)
        largest = std::max(largest, refinement->cells.point_count(cell));
    EXPECT_GE(largest, most_corners);
    onlooker.batches = 0;
    const auto seen = evaluate(network, partition(network, 0).regions, keep_everything(2), one);
    EXPECT_EQ(onlooker.batches, 0);
    EXPECT_EQ(seen.totals.digest.hex(), written.totals.digest.hex());
    EXPECT_EQ(seen.totals.in.state(), written.totals.in.state());
    EXPECT_EQ(seen.totals.in_cells, written.totals.in_cells);
    EXPECT_EQ(seen.totals.out_cells, written.totals.out_cells);
    EXPECT_EQ(seen.totals.lower, written.totals.lower);
  }
}

TEST(Evaluate, KeepsWhatIsAskedFor) {
  const Network<3> network = compile<3>(grid_of_solids(2), {});
  for (int mask = 0; mask < 8; ++mask) {
    CollectingConsumer collector;
    std::vector<Consumer*> consumers{&collector};
    EvaluateOptions options;
    options.keep_in = (mask & 1) != 0;
    options.keep_fuzzy = (mask & 2) != 0;
    options.keep_out = (mask & 4) != 0;
    options.level = 9;
    const auto result = evaluate(network, partition(network, 0).regions, options, consumers);
    std::array<std::uint64_t, 3> seen{};
    for (const auto& refinement : collector.refinements)
      for (const Label label : refinement->cells.label) ++seen[static_cast<std::size_t>(label)];
    EXPECT_EQ(seen[static_cast<std::size_t>(Label::in)], options.keep_in ? result.totals.in_cells : 0);
    EXPECT_EQ(seen[static_cast<std::size_t>(Label::fuzzy)],
              options.keep_fuzzy ? result.totals.fuzzy_cells : 0);
    EXPECT_EQ(seen[static_cast<std::size_t>(Label::out)], options.keep_out ? result.totals.out_cells : 0);
    EXPECT_GT(result.totals.fuzzy_cells, 0U);
  }
}

TEST(Evaluate, StopsAtALevel) {
  const Network<3> network = compile<3>(grid_of_solids(3), {});
  std::uint64_t last = 0;
  for (const unsigned level : {0U, 1U, 2U, 5U, 8U, 12U}) {
    EvaluateOptions options = keep_everything(2);
    options.level = level;
    const auto result = evaluate_all(network, 0, options);
    EXPECT_EQ(result.evaluation.totals.level, level);
    for (const auto& refinement : result.refinements)
      for (std::size_t i = 0; i < refinement->cells.size(); ++i) {
        ASSERT_LE(refinement->cells.level[i], level);
        if (refinement->cells.label[i] == Label::fuzzy) {
          ASSERT_EQ(refinement->cells.level[i], level);
        }
      }
    const std::uint64_t cells = result.evaluation.totals.in_cells + result.evaluation.totals.fuzzy_cells +
                                result.evaluation.totals.out_cells;
    EXPECT_GE(cells, last);
    last = cells;
  }
}

TEST(Evaluate, ABudgetLeavesFuzzyCellsThatHoldTheTruth) {
  const Network<3> network = compile<3>(grid_of_solids(6), {});
  const double truth =
      evaluate(network, partition(network, 0).regions, EvaluateOptions{}, {}).totals.in.value().volume();
  for (const Order order : {Order::depth, Order::priority})
    for (const bool by_time : {false, true}) {
      EvaluateOptions options;
      options.threads = 2;
      options.order = order;
      if (by_time)
        options.budget_seconds = 0.0;
      else
        options.cells = 100;
      const auto start = Clock::now();
      const auto totals = evaluate(network, partition(network, 0).regions, options, {}).totals;
      EXPECT_LT(std::chrono::duration<double>(Clock::now() - start).count(), 30);
      const double in = totals.in.value().volume(), fuzzy = totals.fuzzy.value().volume();
      EXPECT_LE(in, truth * (1 + 1e-12));
      EXPECT_GE(in + fuzzy, truth * (1 - 1e-12));
    }
}

TEST(Evaluate, TakesTheLargestCellFirstByPriority) {
  // One worker that stops once it has decided some cells. By priority the largest cell that is left is then
  // smaller than depth first, which has dug one hole and left the rest as it was.
  const Network<3> network = compile<3>(grid_of_solids(6), {});
  std::array<double, 2> largest{};
  for (const Order order : {Order::depth, Order::priority}) {
    EvaluateOptions options;
    options.order = order;
    options.level = 14;
    options.cells = 100;
    options.keep_in = options.keep_fuzzy = true;
    const auto result = evaluate_all(network, 0, options);
    for (const auto& refinement : result.refinements)
      for (std::size_t i = 0; i < refinement->cells.size(); ++i)
        if (refinement->cells.label[i] == Label::fuzzy)
          largest[static_cast<std::size_t>(order)] =
              std::max(largest[static_cast<std::size_t>(order)], refinement->cells.volume[i]);
  }
  EXPECT_LT(largest[1], largest[0]);
}

/// Cells of the whole when a limit of cells has ended its evaluation.
template <int D>
std::uint64_t cells_at_end(const Network<D>& network, EvaluateOptions options) {
  auto evaluation = evaluate(network, partition(network, 0).regions, options, {});
  EXPECT_TRUE(evaluation.stopped);
  Totals<D> totals = evaluation.totals;
  if (options.suspend) {
    EXPECT_EQ(evaluation.unfinished.size(), 1U);
    const std::uint64_t left = evaluation.unfinished.front().cells_left(options.keep_out);
    const Totals<D> rest = picture<D>(network, evaluation.unfinished, options, {}).totals;
    EXPECT_EQ(left, rest.in_cells + rest.fuzzy_cells + rest.out_cells);
    totals += rest;
  }
  return totals.in_cells + totals.fuzzy_cells + totals.out_cells;
}

/// What is undecided counts as it would be seen. With one worker each split brings one cell more, or one cut
/// along all of a convex solid as many as it has.
TEST(Evaluate, ALimitOfCellsHoldsWhateverIsUndecided) {
  const auto ball = model::ball(3, 1);
  const Network<3> round = compile<3>(model::subtract({ball, model::torus(0.5, 0.2)}), {}),
                   straight = compile<3>(grid_of_solids(8), {});
  for (const Network<3>* network : {&round, &straight})
    for (const Order order : {Order::depth, Order::priority})
      for (const bool keep_out : {false, true})
        for (const bool suspend : {false, true}) {
          SCOPED_TRACE(testing::Message()
                       << (network == &round) << static_cast<int>(order) << keep_out << suspend);
          EvaluateOptions options;
          options.order = order;
          options.keep_out = keep_out;
          options.suspend = suspend;
          options.tolerance = 0.001;
          options.cells = 300;
          const std::uint64_t cells = cells_at_end(*network, options);
          EXPECT_GE(cells, 300U);
          EXPECT_LE(cells, 340U);
          options.threads = 3;
          EXPECT_NEAR(static_cast<double>(cells_at_end(*network, options)), 320, 80);
        }
}

/// One worker stops at the same cell each time.
TEST(Evaluate, ALimitOfCellsIsTheSameForOneWorker) {
  const Network<3> network = compile<3>(model::ball(3, 1), {});
  EvaluateOptions options;
  options.tolerance = 0.001;
  options.cells = 300;
  std::set<std::string> digests;
  for (int round = 0; round < 3; ++round)
    digests.insert(evaluate(network, partition(network, 0).regions, options, {}).totals.digest.hex());
  EXPECT_EQ(digests.size(), 1U);
}

/// Corners that are small integers have moments that doubles hold, before they are divided: each is its
/// formula, rounded once.
TEST(Evaluate, MomentsOfIntegerBoxesAreRoundedOnce) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(::testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    std::array<std::int64_t, 3> low{}, high{};
    auto m = identity_matrix(3);
    std::vector<double> size;
    for (std::size_t i = 0; i < 3; ++i) {
      low[i] = pick(random, -50, 50);
      high[i] = low[i] + pick(random, 1, 50);
      m[4 * i + 3] = static_cast<double>(low[i]);
      size.push_back(static_cast<double>(high[i] - low[i]));
    }
    const auto moments = evaluate_all(compile<3>(model::transform(m, model::cuboid(size)), {}), 0, {})
                             .evaluation.totals.in.value();
    const std::int64_t volume = (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]);
    using M = geometry::Moments<3>;
    ASSERT_EQ(moments.volume(), static_cast<double>(volume)) << "round " << round;
    for (std::size_t i = 0; i < 3; ++i) {
      const int at = static_cast<int>(i) + 1;
      ASSERT_EQ(moments.integral[M::index(0, at)], static_cast<double>(volume * (low[i] + high[i])) / 2)
          << "round " << round;
      const std::int64_t square = low[i] * low[i] + low[i] * high[i] + high[i] * high[i];
      ASSERT_EQ(moments.integral[M::index(at, at)], static_cast<double>(volume * square) / 3)
          << "round " << round;
    }
  }
}

/// Squares turned about one axis: the cells are about the sides of the star, not the pairs of cubes.
TEST(Evaluate, CubesTurnedAboutOneAxisAreFewCells) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < 4; ++round) {
    const int count = pick(random, 2, 120);
    const double pi = std::acos(-1.0);
    std::vector<model::Expression> cubes;
    for (int i = 0; i < count; ++i) {
      const double turn = i * pi / 2 / count;
      auto m = identity_matrix(3);
      m[0] = m[5] = std::cos(turn);
      m[4] = std::sin(turn);
      m[1] = -m[4];
      m[3] = -m[0] - m[1];
      m[7] = -m[4] - m[5];
      cubes.push_back(model::transform(m, model::cuboid({2, 2, 2})));
    }
    const Network<3> network = compile<3>(model::unite(cubes), {});
    const auto result = evaluate(network, partition(network, 0).regions, EvaluateOptions{}, {});
    EXPECT_LE(result.totals.in_cells, static_cast<std::uint64_t>(4 * count)) << count << " cubes";
    EXPECT_NEAR(result.totals.in.value().volume(), 8 * count * (1 - std::tan(pi / 4 - pi / 4 / count)), 1e-11)
        << count << " cubes";
  }
}

TEST(Evaluate, OfNothingIsNothing) {
  for (const auto& e :
       {model::Expression(3), model::intersect({model::cuboid({1, 1, 1}), model::Expression(3)}),
        model::subtract({model::Expression(3), model::cuboid({1, 1, 1})})}) {
    const Network<3> network = compile<3>(e, {});
    const auto result = evaluate(network, partition(network, 2).regions, EvaluateOptions{}, {});
    EXPECT_EQ(result.totals.in_cells, 0U);
    EXPECT_EQ(result.totals.in.value().volume(), 0);
    EXPECT_GT(result.totals.lower[0], result.totals.upper[0]);
  }
  const Network<3> network = compile<3>(model::cuboid({1, 1, 1}), {});
  EXPECT_EQ(evaluate(network, {}, EvaluateOptions{}, {}).totals.in_cells, 0U);  // no regions
}

TEST(Evaluate, RecordsATreeThatLocatesPoints) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const auto e = random_expression(random, 3, Kind::solids, 2);
    const Network<3> network = compile<3>(e, {});
    EvaluateOptions options;
    options.threads = 1 + static_cast<unsigned>(round) % 3;
    options.record_tree = true;
    const auto result = evaluate_all(network, 0, options);
    auto sorted = result.refinements;
    std::sort(sorted.begin(), sorted.end(), [](const auto& a, const auto& b) {
      return std::pair(a->worker, a->first) < std::pair(b->worker, b->first);
    });
    ASSERT_EQ(result.evaluation.region_roots.size(), 1U);
    geometry::BspTree tree = result.evaluation.tree;
    tree.root = result.evaluation.region_roots[0];
    for (int i = 0; i < 100; ++i) {
      std::array<double, 3> x;
      for (int axis = 0; axis < 3; ++axis)
        x[axis] = network.table.axis_value(
            axis, static_cast<std::uint32_t>(uniform(random, 0, 1) * network.table.axis_steps));
      if (i >= 50 &&
          !sorted.empty()) {  // where it is hard: a rounded corner of a cell, on or next to hyperplanes
        const auto& some =
            sorted[static_cast<std::size_t>(pick(random, 0, static_cast<int>(sorted.size()) - 1))]->cells;
        const auto corners =
            some.cell_points(static_cast<std::size_t>(pick(random, 0, static_cast<int>(some.size()) - 1)));
        std::copy_n(corners.begin() + 3 * pick(random, 0, static_cast<int>(corners.size() / 3) - 1), 3,
                    x.begin());
      }
      const std::int32_t exact = tree.locate<3>(network.table, x);
      if (exact != 0) {  // exactly inside the cell, or on its boundary
        std::size_t cell = static_cast<std::size_t>(exact) - 1, batch = 0;
        while (cell >= sorted[batch]->cells.size()) cell -= sorted[batch++]->cells.size();
        const auto& cells = sorted[batch]->cells;
        for (std::uint32_t facet = cells.facet_offset[cell]; facet < cells.facet_offset[cell + 1]; ++facet) {
          const std::int32_t code = cells.facet_hyperplane[facet];
          const auto id = static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code);
          if (std::find(tree.ids.begin(), tree.ids.end(), id) == tree.ids.end())
            continue;  // a face of the root cell
          const int side = network.table.side(x, id);
          ASSERT_LE(code < 0 ? -side : side, 0);
        }
      }
      const Where far = where(e, Point(x.begin(), x.end()), 1e-7L);
      if (!far.doubtful) {
        ASSERT_EQ(exact != 0, far.inside);
      }
      if (i >= 50) continue;
      const Where truth = where(e, Point(x.begin(), x.end()), 1e-7L);
      const std::int32_t leaf = tree.locate(x);
      if (!truth.doubtful) {
        ASSERT_EQ(leaf != 0, truth.inside);
      }
      if (leaf == 0) continue;
      std::size_t cell = static_cast<std::size_t>(leaf) - 1, batch = 0;
      while (cell >= sorted[batch]->cells.size()) cell -= sorted[batch++]->cells.size();
      const auto points = sorted[batch]->cells.cell_points(cell);
      for (std::size_t axis = 0; axis < 3; ++axis) {  // within the cell's box
        double low = INFINITY, high = -INFINITY;
        for (std::size_t k = axis; k < points.size(); k += 3)
          low = std::min(low, points[k]), high = std::max(high, points[k]);
        ASSERT_GE(x[axis], low - 1e-9);
        ASSERT_LE(x[axis], high + 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace bsp2::dataflow
