// An evaluation that is suspended and gone on with, any number of times, finds what an uninterrupted one
// finds.

#include <gtest/gtest.h>

#include <cmath>

#include "bsp2/dataflow/regions/archive.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::BspTree;
using geometry::CellBatch;
using Refinements = std::vector<std::shared_ptr<const Refinement>>;

/// The cells of several evaluations in the order in which their trees count them.
void append_sorted(Refinements& all, Refinements more) {
  std::sort(more.begin(), more.end(), [](const auto& a, const auto& b) {
    return std::pair(a->worker, a->first) < std::pair(b->worker, b->first);
  });
  all.insert(all.end(), more.begin(), more.end());
}

/// A run of several evaluations, as the engine makes it.
template <int D>
struct Run {
  const Network<D>& network;
  Partition<D> parts;
  Totals<D> totals;
  std::vector<Region<D>> regions;
  std::vector<std::int32_t> roots;
  BspTree tree;
  Refinements refinements;
  std::uint64_t cells = 0;

  Run(const Network<D>& network_, unsigned depth)
      : network(network_),
        parts(partition(network_, depth)),
        totals(network_.table.radius(), network_.table.width()),
        regions(partition(network_, depth).regions),
        roots(parts.regions.size(), BspTree::empty_leaf) {
    totals.reset_bounds();
    tree.dimension = D;
  }

  bool step(EvaluateOptions options) {
    CollectingConsumer collector;
    std::vector<Consumer*> consumers{&collector};
    options.suspend = options.record_tree = true;
    options.recorded_nodes = static_cast<std::uint32_t>(tree.nodes.size());
    options.recorded_cells = static_cast<std::uint32_t>(cells);
    std::vector<std::uint32_t> numbers;
    for (const auto& region : regions) numbers.push_back(region.number);
    auto result = evaluate(network, std::move(regions), options, consumers);
    add(result, numbers, collector);
    regions = std::move(result.unfinished);
    return !regions.empty();
  }

  void add(const Evaluation<D>& result, const std::vector<std::uint32_t>& numbers,
           const CollectingConsumer& collector) {
    totals += result.totals;
    for (std::size_t i = 0; i < numbers.size(); ++i) roots[numbers[i]] = result.region_roots[i];
    tree.append(result.tree);
    append_sorted(refinements, collector.refinements);
    for (const std::uint64_t count : result.cells_of_worker) cells += count;
  }

  /// As another process finds it: through bytes, without the cells.
  void travel() {
    for (Region<D>& region : regions) {
      Region<D> back;
      from_bytes(to_bytes(region), back);
      back.cell = region_cell(network, parts, back.number);
      region = std::move(back);
    }
  }

  /// What is left becomes FUZZY; the run is over after it.
  void end_with_picture(EvaluateOptions options) {
    CollectingConsumer collector;
    std::vector<Consumer*> consumers{&collector};
    options.record_tree = true;
    options.recorded_nodes = static_cast<std::uint32_t>(tree.nodes.size());
    options.recorded_cells = static_cast<std::uint32_t>(cells);
    std::vector<std::uint32_t> numbers;
    for (const auto& region : regions) numbers.push_back(region.number);
    add(picture<D>(network, regions, options, consumers), numbers, collector);
  }

  /// The cell in which a point is, as label, part and volume.
  [[nodiscard]] std::tuple<int, std::int32_t, double> locate(const std::array<double, D>& x) const {
    BspTree whole = tree;
    const auto child = [&](std::int32_t code) {
      return code >= 0 ? static_cast<std::int32_t>(tree.nodes.size()) + code
                       : roots[static_cast<std::size_t>(~code)];
    };
    BspTree top;
    top.dimension = D;
    for (const auto& node : parts.nodes) {
      const auto h = network.table.rounded(node.hyperplane);
      top.nodes.push_back(
          {static_cast<std::uint32_t>(top.nodes.size()), child(node.negative), child(node.positive)});
      top.hyperplanes.push_back(h.offset);
      top.hyperplanes.insert(top.hyperplanes.end(), h.normal.begin(), h.normal.end());
    }
    whole.append(top);
    whole.root = child(parts.root);
    const std::int32_t leaf = whole.locate(x);
    if (leaf == 0) return {-1, 0, 0};
    std::size_t cell = static_cast<std::size_t>(leaf) - 1, batch = 0;
    while (cell >= refinements[batch]->cells.size()) cell -= refinements[batch++]->cells.size();
    const CellBatch& in = refinements[batch]->cells;
    return {static_cast<int>(in.label[cell]), in.primitive[cell], in.volume[cell]};
  }
};

template <int D>
void expect_same(const Totals<D>& a, const Totals<D>& b) {
  EXPECT_EQ(a.digest.hex(), b.digest.hex());
  EXPECT_EQ(a.in.state(), b.in.state());
  EXPECT_EQ(a.fuzzy.state(), b.fuzzy.state());
  EXPECT_EQ(a.in_cells, b.in_cells);
  EXPECT_EQ(a.fuzzy_cells, b.fuzzy_cells);
  EXPECT_EQ(a.out_cells, b.out_cells);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.upper, b.upper);
}

template <int D>
EvaluateOptions random_options(Random& random, bool keep_out) {
  EvaluateOptions options;
  options.threads = static_cast<unsigned>(pick(random, 1, 4));
  options.order = chance(random, 0.5) ? Order::depth : Order::priority;
  options.keep_out = keep_out;
  return options;
}

/// @return how often the evaluation was interrupted.
template <int D>
int expect_suspendable(Random& random, bool with_level) {
  const Network<D> network =
      compile<D>(random_expression(random, D, chance(random, 0.5) ? Kind::grid_boxes : Kind::solids,
                                   D == 3 && !with_level ? 3 : 2),
                 {});
  const bool keep_out = chance(random, 0.3);
  const auto depth = static_cast<unsigned>(pick(random, 0, 3));
  const std::optional<unsigned> level =
      with_level ? std::optional(static_cast<unsigned>(pick(random, 2, 12))) : std::nullopt;

  EvaluateOptions plain;
  plain.keep_out = keep_out;
  plain.level = level;
  plain.record_tree = true;
  Run<D> uninterrupted(network, depth);
  {
    CollectingConsumer collector;
    std::vector<Consumer*> consumers{&collector};
    std::vector<std::uint32_t> numbers;
    for (const auto& region : uninterrupted.regions) numbers.push_back(region.number);
    uninterrupted.add(evaluate(network, std::move(uninterrupted.regions), plain, consumers), numbers,
                      collector);
  }
  const double truth = uninterrupted.totals.in.value().volume(),
               fuzzy = uninterrupted.totals.fuzzy.value().volume();

  Run<D> run(network, depth);
  int interruptions = 0;
  std::optional<unsigned> level_before;
  for (;; ++interruptions) {
    if (interruptions > 5000) {
      ADD_FAILURE() << "no progress";
      break;
    }
    EvaluateOptions options = random_options<D>(random, keep_out);
    options.level = level;
    const bool last = interruptions > 40;
    if (!last) {  // random points: by cells, by level, before the first token
      options.cells = static_cast<std::uint64_t>(pick(random, 1, 12));
      if (chance(random, 0.3))
        options.level = static_cast<unsigned>(pick(random, 0, level ? static_cast<int>(*level) : 20));
      if (chance(random, 0.05)) options.cells = 0, options.interrupted = [] { return true; };
    }
    options.same_limits = interruptions > 0 && options.level == level_before;
    level_before = options.level;
    run.step(options);
    if (last || run.regions.empty()) break;
    if (chance(random, 0.5)) run.travel();
    if (chance(random, 0.2)) {  // the whole at this moment holds the truth
      const auto now = picture<D>(network, run.regions, random_options<D>(random, keep_out), {});
      const double in = run.totals.in.value().volume() + now.totals.in.value().volume();
      EXPECT_LE(in, truth + fuzzy + 1e-9 * truth);
      EXPECT_GE(in + now.totals.fuzzy.value().volume(), truth - 1e-9 * truth);
    }
  }
  if (!run.regions.empty()) {
    EXPECT_TRUE(level.has_value());
    run.end_with_picture(random_options<D>(random, keep_out));
  }
  expect_same(run.totals, uninterrupted.totals);
  geometry::CellWriter<D> writer(network.table);
  for (int i = 0; i < 5; ++i) {
    std::array<double, D> x;
    for (int axis = 0; axis < D; ++axis)
      x[axis] = network.table.axis_value(
          axis, static_cast<std::uint32_t>(uniform(random, 0, 1) * network.table.axis_steps));
    EXPECT_EQ(run.locate(x), uninterrupted.locate(x));
  }
  return interruptions;
}

TEST(Suspension, ChangesNothing) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int interruptions = 0;
  for (int round = 0; round < samples::rounds(60) && !testing::Test::HasFailure(); ++round)
    interruptions += expect_suspendable<3>(random, false);
  for (int round = 0; round < samples::rounds(15) && !testing::Test::HasFailure(); ++round)
    interruptions += expect_suspendable<2>(random, false);
  for (int round = 0; round < samples::rounds(5) && !testing::Test::HasFailure(); ++round)
    interruptions += expect_suspendable<4>(random, false);
  // Few rounds may meet small models alone, which one step ends.
  for (int more = 0; more < 1000 && interruptions <= samples::rounds(50) && !testing::Test::HasFailure();
       ++more)
    interruptions += expect_suspendable<3>(random, false);
  EXPECT_GT(interruptions, samples::rounds(50));
}

TEST(Suspension, ChangesNothingAtALevel) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(50) && !testing::Test::HasFailure(); ++round)
    expect_suspendable<3>(random, true);
  for (int round = 0; round < samples::rounds(10) && !testing::Test::HasFailure(); ++round)
    expect_suspendable<2>(random, true);
}

/// However short a step is, it does something new, and looks at nothing twice that stays FUZZY.
TEST(Suspension, ShortStepsComeToAnEnd) {
#ifdef __SANITIZE_THREAD__
  GTEST_SKIP() << "thousands of steps take minutes here, and their threads do what those of other tests do";
#endif
  const Network<3> network =
      compile<3>(model::subtract({model::ball(3, 1), model::cuboid({1, 1, 1}, true)}), {});
  for (const Order order : {Order::depth, Order::priority}) {
    EvaluateOptions options;
    options.order = order;
    options.suspend = true;
    options.tolerance = 0.015;
    const auto whole = evaluate(network, partition(network, 3).regions, options, {});
    const auto fuzzy = [](const std::vector<Region<3>>& regions) {
      std::uint64_t cells = 0;
      for (const Region<3>& region : regions) cells += region.cells_left(false);
      return cells;
    };
    ASSERT_GT(fuzzy(whole.unfinished), 100U);
    options.budget_seconds = 0;  // one token, or a few
    options.same_limits = true;
    std::uint64_t splits = 0;
    int steps = 0;
    auto regions = partition(network, 3).regions;
    for (bool stopped = true; stopped; ++steps) {
      ASSERT_LT(steps, 5'000) << "no progress";
      auto result = evaluate(network, std::move(regions), options, {});
      stopped = result.stopped;
      splits += result.totals.counts.splits;
      regions = std::move(result.unfinished);
    }
    EXPECT_GT(steps, 2);
    EXPECT_EQ(fuzzy(regions), fuzzy(whole.unfinished));
    // Nothing is left to do, not even cells to make again; but for who wants to see more or less than before.
    auto again = evaluate(network, std::move(regions), options, {});
    EXPECT_EQ(again.totals.counts.splits, 0U);
    EXPECT_EQ(fuzzy(again.unfinished), fuzzy(whole.unfinished));
    options.same_limits = false;
    options.tolerance = 0.005;
    options.budget_seconds.reset();
    const auto finer = evaluate(network, std::move(again.unfinished), options, {});
    EXPECT_GT(fuzzy(finer.unfinished), 2 * fuzzy(whole.unfinished));
    EXPECT_GT(splits, 100U);
  }
}

TEST(Suspension, LeavesNothingOnceAllIsDone) {
  const Network<3> network = compile<3>(model::sphere(1, 8), {});
  EvaluateOptions options;
  options.suspend = true;
  const auto result = evaluate(network, partition(network, 2).regions, options, {});
  EXPECT_TRUE(result.unfinished.empty());
  EXPECT_FALSE(result.stopped);
  const Network<3> hollow =
      compile<3>(model::subtract({model::sphere(1, 8), model::cuboid({0.5, 0.5, 0.5}, true)}), {});
  options.cells = 1;  // more than there are regions
  const auto stopped = evaluate(hollow, partition(hollow, 2).regions, options, {});
  EXPECT_TRUE(stopped.stopped);
  EXPECT_FALSE(stopped.unfinished.empty());
  EXPECT_EQ(stopped.totals.fuzzy_cells, 0U);
}

TEST(Suspension, RefusesFrontiersThatAreNoTree) {
  const Network<3> network = compile<3>(model::sphere(1, 8), {});
  using Node = Frontier::Node;
  const Node split{Frontier::Kind::split, geometry::Label::fuzzy, 0, 0},
      token{Frontier::Kind::token, geometry::Label::fuzzy, 0, 1};
  for (const Frontier& bad : {Frontier{{split}, {}}, Frontier{{token}, {}}, Frontier{{split, token}, {0}},
                              Frontier{{token, token}, {0, 0}},
                              Frontier{{{Frontier::Kind::token, geometry::Label::fuzzy, 0, -1}}, {}}}) {
    auto regions = partition(network, 0).regions;
    regions[0].frontier = bad;
    EXPECT_THROW(evaluate(network, std::move(regions), EvaluateOptions{}, {}), std::invalid_argument);
  }
}

}  // namespace
}  // namespace bsp2::dataflow
