// Which part a point belongs to where parts have names, against the rule itself: of unions the first operand
// that has the point, of differences what the first operand says, of intersections the first that says
// anything, of symmetric differences one that has it, of complements nothing.

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <set>
#include <string>

#include "bsp2/dataflow/regions/coarsening.hpp"
#include "bsp2/model/expression/colour.hpp"
#include "dataflow/oracle.hpp"
#include "geometry/cell_samples.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::CellBatch;
using geometry::Label;
using model::Expression;
using model::Operation;

constexpr Real margin = 1e-7L;
constexpr const char* rest = "";  // what belongs to no name

/// What the rule says about a point.
struct Told {
  bool inside = false, doubtful = false;
  std::optional<std::string> name =
      {};  // nothing: nobody says whose it is; `rest`: of something without a name
};

Told told(const Expression& e, const Point& x, Parts divided_by, const std::string& around);

Told told_by_children(const model::Boolean& boolean, const Point& x, Parts divided_by,
                      const std::string& around) {
  std::vector<Told> children;
  Told all;
  for (const Expression& child : boolean.children) {
    children.push_back(told(child, x, divided_by, around));
    all.doubtful = all.doubtful || children.back().doubtful;
  }
  const auto count =
      std::count_if(children.begin(), children.end(), [](const Told& child) { return child.inside; });
  const auto take_first = [&](bool of_those_that_say) {
    for (const Told& child : children)
      if (child.inside && (!of_those_that_say || child.name)) {
        all.name = child.name;
        return;
      }
  };
  switch (boolean.operation) {
    case Operation::unite:
      all.inside = count > 0;
      take_first(false);
      break;
    case Operation::intersect:
      all.inside = count == std::ssize(children);
      if (all.inside) take_first(true);
      break;
    case Operation::subtract:
      all.inside = count == 1 && children[0].inside;
      if (all.inside) all.name = children[0].name;
      break;
    case Operation::symmetric_difference:
      all.inside = count % 2 == 1;
      if (all.inside) take_first(true);
      break;
    case Operation::complement:
      all.inside = count == 0;
      break;
  }
  return all;
}

Told told(const Expression& e, const Point& x, Parts divided_by, const std::string& around) {
  const auto& value = e.node().value;
  if (const auto* primitive = std::get_if<model::Primitive>(&value)) {
    const Where w = std::visit([&](const auto& shape) { return where(shape, x, margin); }, *primitive);
    return {w.inside, w.doubtful, w.inside ? std::optional(around) : std::nullopt};
  }
  if (const auto* transform = std::get_if<model::Transform>(&value))
    return told(transform->child, inverse_image(transform->matrix, x), divided_by, around);
  if (const auto* named = std::get_if<model::Named>(&value))
    return told(named->child, x, divided_by,
                divided_by == Parts::named && around == rest ? named->name : around);
  if (const auto* coloured = std::get_if<model::Coloured>(&value))
    return told(coloured->child, x, divided_by,
                divided_by == Parts::colours && around == rest ? model::name_of(coloured->colour) : around);
  return told_by_children(std::get<model::Boolean>(value), x, divided_by, around);
}

/// Names and colours, each once, around random operands of a random expression.
class Namer {
 public:
  explicit Namer(Random& random, bool with_names = true) : random_(random), with_names_(with_names) {}

  Expression operator()(const Expression& e) {
    const auto& value = e.node().value;
    Expression inner = e;
    if (const auto* transform = std::get_if<model::Transform>(&value))
      inner = model::transform(transform->matrix, (*this)(transform->child));
    if (const auto* boolean = std::get_if<model::Boolean>(&value)) {
      std::vector<Expression> operands;
      for (const Expression& child : boolean->children) operands.push_back((*this)(child));
      inner = combined(boolean->operation, std::move(operands));
    }
    if (with_names_ && chance(random_, 0.35)) inner = model::part("part " + std::to_string(count_++), inner);
    if (chance(random_, 0.35)) inner = model::colour({colours_++ / 255.0, 0.5, 0.25, 1}, inner);
    return inner;
  }

 private:
  Random& random_;
  bool with_names_;
  int count_ = 0, colours_ = 0;

  static Expression combined(Operation operation, std::vector<Expression> operands) {
    switch (operation) {
      case Operation::unite:
        return model::unite(std::move(operands));
      case Operation::intersect:
        return model::intersect(std::move(operands));
      case Operation::subtract:
        return model::subtract(std::move(operands));
      case Operation::symmetric_difference:
        return model::symmetric_difference(std::move(operands));
      default:
        return model::complement(operands.front());
    }
  }
};

/// Every IN cell says of random points what the rule says.
template <int D>
void expect_the_rule(const Expression& e, const Network<D>& network, const Evaluated<D>& result,
                     Parts divided_by, Random& random) {
  std::map<std::int32_t, double> volume;
  for (const auto& refinement : result.refinements) {
    const CellBatch& batch = refinement->cells;
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      const std::int32_t part = batch.part[cell];
      if (batch.label[cell] != Label::in) {
        ASSERT_EQ(part, geometry::no_part);
        continue;
      }
      volume[part] += batch.volume[cell];
      if (!network.is_divided()) {
        ASSERT_EQ(part, 0);
        continue;
      }
      ASSERT_LT(part, std::ssize(network.parts));
      const std::string name = part < 0 ? rest : network.parts[static_cast<std::size_t>(part)].name;
      for (int sample = 0; sample < 4; ++sample) {
        const Told truth = told(e, point_in(batch, cell, random), divided_by, rest);
        if (truth.doubtful) continue;
        ASSERT_TRUE(truth.inside);
        ASSERT_EQ(name, truth.name.value_or(rest));
      }
    }
  }
  for (std::size_t part = 0; part < network.parts.size(); ++part) {
    const auto& sums = result.evaluation.totals.parts;
    const double sum = part < sums.size() ? sums[part].value().volume() : 0;
    EXPECT_NEAR(sum, volume[static_cast<std::int32_t>(part)], 1e-9) << network.parts[part].name;
  }
}

/// The digest of an evaluation in regions, where what is whole is given back across their cuts.
template <int D>
std::string digest_in_regions(const Network<D>& network, unsigned depth, unsigned threads) {
  EvaluateOptions options;
  options.threads = threads;
  options.suspend = options.hold_uniform_regions = options.same_limits = true;
  Partition<D> parts = partition(network, depth);
  auto found = evaluate(network, std::move(parts.regions), options, {});
  Totals<D> totals = found.totals;
  std::vector<UniformRegion> uniform;
  std::vector<std::uint32_t> unfinished;
  for (const auto& region : found.unfinished)
    if (const auto whole = uniform_region_of(region))
      uniform.push_back(*whole);
    else
      unfinished.push_back(region.number);
  std::vector<Region<D>> rest_of_it;
  for (auto& region : found.unfinished)
    if (!uniform_region_of(region)) rest_of_it.push_back(std::move(region));
  for (const UniformRegion& whole : coarsen<D>(network, parts, uniform, unfinished))
    rest_of_it.push_back({whole.region,
                          whole.level,
                          region_cell(network, parts, whole.region),
                          {},
                          {{{Frontier::Kind::held, whole.label, 0, whole.owner}}, {}}});
  totals += picture<D>(network, rest_of_it, options, {}).totals;
  return totals.digest.hex();
}

template <int D>
void check(const Expression& e, Parts divided_by, Random& random) {
  const Network<D> network = compile<D>(e, {.parts = divided_by});
  const Evaluated<D> result = evaluate_all(network, 0, EvaluateOptions{});
  expect_the_rule<D>(e, network, result, divided_by, random);
  const std::string digest = result.evaluation.totals.digest.hex();
  for (const unsigned depth : {0U, 4U, 7U})
    for (const unsigned threads : {1U, 2U})
      ASSERT_EQ(digest_in_regions<D>(network, depth, threads), digest) << "depth " << depth;
}

template <int D>
void check_random(int rounds, int depth) {
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Expression plain =
        random_expression(random, D, round % 2 == 0 ? Kind::grid_boxes : Kind::solids, depth);
    check<D>(Namer(random)(plain), round % 3 == 0 ? Parts::colours : Parts::named, random);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(NamedParts, FollowTheRule) { check_random<3>(60, 2); }

TEST(NamedParts, FollowTheRuleInThePlane) { check_random<2>(100, 3); }

/// What is outside of a box and not in another belongs to nobody, also where a later operand has it.
TEST(NamedParts, HaveNothingOfWhatIsInAComplement) {
  Random random(1);
  const auto box = [](double x, double y, double width) {
    const double matrix[] = {1, 0, x, 0, 1, y, 0, 0, 1};
    return model::transform(matrix, model::cuboid({width, width}));
  };
  const Expression outside = model::complement(box(0, 0, 1)), other = box(3, 0, 1), later = box(2.5, 0, 1);
  for (const Expression& first :
       {model::symmetric_difference({outside, other}), model::symmetric_difference({other, outside}),
        model::unite({outside, other}), model::intersect({outside, model::complement(other)})})
    check<2>(model::intersect({model::complement(model::complement(box(-5, -5, 10))),
                               model::part("a", model::unite({first, later}))}),
             Parts::named, random);
}

/// Named operands of a union: nothing is in an earlier one.
TEST(NamedParts, BelongToTheFirstThatHasThem) {
  for (int round = 0; round < samples::rounds(30); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<Expression> plain, named;
    for (int i = 0; i < 4; ++i) {
      plain.push_back(random_expression(random, 3, Kind::solids, 1));
      named.push_back(model::part(std::to_string(i), plain.back()));
    }
    const Network<3> network = compile<3>(model::unite(named), {});
    const auto result = evaluate_all(network, 0, EvaluateOptions{});
    for (const auto& refinement : result.refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
        const std::int32_t part = refinement->cells.part[cell];
        const Point x = point_in(refinement->cells, cell, random);
        for (std::size_t i = 0; i < plain.size() && part != geometry::no_part; ++i) {
          const Where truth = where(plain[i], x, margin);
          const std::string& name = network.parts[static_cast<std::size_t>(part)].name;
          if (truth.doubtful || std::to_string(i) > name) continue;
          ASSERT_EQ(truth.inside, std::to_string(i) == name);
        }
      }
  }
}

/// Cells are what they are without names, and what they belong to is an operand on all of each cell, even
/// where a larger primitive that contains it is cut away.
TEST(Primitives, AreNotThoseThatAreCutAway) {
  for (int round = 0; round < samples::rounds(60); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<Expression> operands, primitives;  // by number
    for (int i = 0; i < 3; ++i) {
      const Expression body = random_expression(random, 3, Kind::grid_boxes, 0),
                       hole = random_expression(random, 3, Kind::solids, 0);
      const Expression operand = chance(random, 0.7) ? model::subtract({body, hole}) : body;
      const std::size_t count = operand.same_node(body) ? 1 : 2;
      operands.push_back(operand);
      for (std::size_t k = 0; k < count; ++k) primitives.push_back(k == 0 ? operand : Expression(3));
    }
    const Network<3> network = compile<3>(model::unite(operands), {});
    const auto result = evaluate_all(network, 0, EvaluateOptions{});
    for (const auto& refinement : result.refinements)
      for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
        ASSERT_EQ(refinement->cells.part[cell], 0);
        const std::int32_t primitive = refinement->cells.primitive[cell];
        for (int sample = 0; sample < 4 && primitive != geometry::no_primitive; ++sample) {
          const Where truth = where(primitives[static_cast<std::size_t>(primitive)],
                                    point_in(refinement->cells, cell, random), margin);
          ASSERT_TRUE(truth.inside || truth.doubtful) << "primitive " << primitive;
        }
      }
  }
}

/// The primitives of which one may be told to have a point, by the rule; of an intersection those of all
/// operands, since it depends on the whole cell which of them says anything.
struct Allowed {
  bool inside = false, doubtful = false;
  std::set<std::int32_t> primitives = {};
};

Allowed allowed(const Expression& e, const Point& x, std::int32_t& next) {
  const auto& value = e.node().value;
  if (const auto* primitive = std::get_if<model::Primitive>(&value)) {
    const Where w = std::visit([&](const auto& shape) { return where(shape, x, margin); }, *primitive);
    return {w.inside, w.doubtful, {next++}};
  }
  if (const auto* transform = std::get_if<model::Transform>(&value))
    return allowed(transform->child, inverse_image(transform->matrix, x), next);
  if (const auto* named = std::get_if<model::Named>(&value)) return allowed(named->child, x, next);
  if (const auto* coloured = std::get_if<model::Coloured>(&value)) return allowed(coloured->child, x, next);
  const auto& boolean = std::get<model::Boolean>(value);
  Allowed all;
  std::int64_t count = 0;
  bool first_is_inside = false;
  for (std::size_t i = 0; i < boolean.children.size(); ++i) {
    const Allowed child = allowed(boolean.children[i], x, next);
    all.doubtful = all.doubtful || child.doubtful;
    count += child.inside;
    if (i == 0) first_is_inside = child.inside;
    const bool owns =
        boolean.operation == Operation::subtract ? i == 0 : boolean.operation != Operation::complement;
    if (child.inside && owns) all.primitives.insert(child.primitives.begin(), child.primitives.end());
  }
  switch (boolean.operation) {
    case Operation::unite:
      all.inside = count > 0;
      break;
    case Operation::intersect:
      all.inside = count == std::ssize(boolean.children);
      break;
    case Operation::subtract:
      all.inside = first_is_inside && count == 1;
      break;
    case Operation::symmetric_difference:
      all.inside = count % 2 == 1;
      break;
    case Operation::complement:
      all.inside = count == 0;
      break;
  }
  return all;
}

template <int D>
void expect_allowed(const Expression& e, const Network<D>& network, Random& random) {
  const auto result = evaluate_all(network, 0, EvaluateOptions{});
  for (const auto& refinement : result.refinements) {
    const CellBatch& batch = refinement->cells;
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      if (batch.label[cell] != Label::in || batch.primitive[cell] == geometry::no_primitive) continue;
      for (int sample = 0; sample < 4; ++sample) {
        std::int32_t next = 0;
        const Allowed truth = allowed(e, point_in(batch, cell, random), next);
        if (truth.doubtful) continue;
        ASSERT_TRUE(truth.inside);
        ASSERT_TRUE(truth.primitives.contains(batch.primitive[cell]))
            << "primitive " << batch.primitive[cell];
      }
    }
  }
}

template <int D>
void check_random_primitives(int rounds, int depth) {
  for (int round = 0; round < rounds; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Expression plain =
        random_expression(random, D, round % 2 == 0 ? Kind::grid_boxes : Kind::solids, depth);
    const Expression coloured = model::colour({1, 0, 0, 1}, Namer(random, false)(plain));
    expect_allowed<D>(coloured, compile<D>(coloured, {}), random);
    expect_allowed<D>(coloured, compile<D>(coloured, {.parts = Parts::colours}), random);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Primitives, AreWhatTheRuleAllows) {
  check_random_primitives<3>(60, 2);
  check_random_primitives<2>(60, 3);
}

/// Operands of long expressions are asked hastily first.
TEST(NamedParts, FollowTheRuleInLongExpressions) {
  for (int round = 0; round < 2; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<Expression> operands;
    for (int i = 0; i < 70; ++i)
      operands.push_back(
          random_expression(random, 2, i % 2 == 0 ? Kind::grid_boxes : Kind::solids, i % 3 == 0 ? 1 : 0));
    const Expression named = Namer(random)(model::unite(operands));
    check<2>(named, round % 2 == 0 ? Parts::named : Parts::colours, random);
    const Expression coloured = Namer(random, false)(model::unite(operands));
    expect_allowed<2>(coloured, compile<2>(coloured, {}), random);
    if (testing::Test::HasFailure()) return;
  }
}

/// A post in the recess of a base: the base's box has it, but it is cut away there.
TEST(NamedParts, AreNotThoseThatAreCutAway) {
  const auto moved = [](double x, double y, double z, const Expression& solid) {
    const double matrix[] = {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
    return model::transform(matrix, solid);
  };
  const Expression base = model::part(
      "base", model::subtract({model::cuboid({20, 20, 20}), moved(4, 4, 6, model::cuboid({12, 12, 20}))}));
  const Expression post = model::part("post", moved(9, 9, 1, model::cuboid({2, 2, 15})));
  for (const auto& e : {model::unite({base, post}), model::unite({post, base})}) {
    const Network<3> network = compile<3>(e, {});
    const auto& sums = evaluate(network, partition(network, 0).regions, {}, {}).totals.parts;
    std::map<std::string, double> volume;
    for (std::size_t part = 0; part < sums.size(); ++part)
      volume[network.parts[part].name] = sums[part].value().volume();
    const bool base_first = network.parts[0].name == "base";
    EXPECT_NEAR(volume["base"], 8000 - 12 * 12 * 14 - (base_first ? 0 : 2 * 2 * 5), 1e-9);
    EXPECT_NEAR(volume["post"], 2 * 2 * 15 - (base_first ? 2 * 2 * 5 : 0), 1e-9);
  }
}

/// What is left FUZZY about a part's round surface within another part is IN.
TEST(NamedParts, AreInWhereOnlyThePartIsUndecided) {
  const Expression ball = model::part("ball", model::ball(3, 1)),
                   box = model::part("box", model::cuboid({3, 3, 3}, true));
  const Network<3> network = compile<3>(model::unite({ball, box}), {});
  EvaluateOptions options;
  options.tolerance = 0.1;
  const auto totals = evaluate(network, partition(network, 0).regions, options, {}).totals;
  EXPECT_EQ(totals.fuzzy_cells, 0U);
  EXPECT_NEAR(totals.in.value().volume(), 27, 1e-9);
  ASSERT_EQ(totals.parts.size(), 2U);
  const double ball_volume = totals.parts[0].value().volume();
  EXPECT_GT(ball_volume, 3.2);
  EXPECT_LT(ball_volume, 4 * std::numbers::pi / 3);
}

}  // namespace
}  // namespace bsp2::dataflow
