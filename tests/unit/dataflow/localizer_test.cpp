// Producers and combiners one token at a time: lowering, answers, folding, and the stream of refinements.

#include "bsp2/dataflow/evaluate/localizer.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "dataflow/oracle.hpp"
#include "geometry/cell_samples.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Cell;
using geometry::Label;
using geometry::Position;
using Net = Network<3>;

model::Expression at(double x, double y, double z, const model::Expression& e) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1}, e);
}
model::Expression cube(double size = 1) { return model::cuboid({size, size, size}); }

/// A program as text: +0 a leaf, -0 a complemented one, (u ...) (i ...) (d ...) combiners.
std::string text(std::span<const Word> program) {
  std::string out;
  const std::function<const Word*(const Word*)> visit = [&](const Word* word) {
    const Word kind = word[0] & Net::kind_mask;
    const Word* const end = word + word[1];
    if (kind == Net::kind_leaf) {
      out += (word[0] & Net::negated) != 0 ? '-' : '+';
      out += std::to_string(word[2]);
    } else {
      out += kind == Net::kind_unite ? "(u" : kind == Net::kind_intersect ? "(i" : "(d";
      for (const Word* operand = word + Net::header; operand != end;) {
        out += ' ';
        operand = visit(operand);
      }
      out += ')';
    }
    return end;
  };
  if (!program.empty()) visit(program.data());
  return out;
}

std::string lowered(const model::Expression& e) { return text(compile<3>(e, {}).program); }

TEST(Lowering, FlattensNestedCombinersAndPushesComplementsDown) {
  using namespace model;
  const Expression a = cube(), b = at(0.5, 0, 0, cube()), c = at(0, 0.5, 0, cube()),
                   d = at(0, 0, 0.5, cube());
  EXPECT_EQ(lowered(a), "+0");
  EXPECT_EQ(lowered(unite({a, unite({b, unite({c, d})})})), "(u +0 +1 +2 +3)");
  EXPECT_EQ(lowered(intersect({intersect({a, b}), intersect({c, d})})), "(i +0 +1 +2 +3)");
  EXPECT_EQ(lowered(subtract({a, b, c})), "(i +0 -1 -2)");
  EXPECT_EQ(lowered(subtract({a, unite({b, c})})), "(i +0 -1 -2)");
  EXPECT_EQ(lowered(subtract({a, intersect({b, c})})), "(i +0 (u -1 -2))");
  EXPECT_EQ(lowered(subtract({a, subtract({b, c})})), "(i +0 (u -1 +2))");
  EXPECT_EQ(lowered(intersect({a, complement(complement(b))})), "(i +0 +1)");
  EXPECT_EQ(lowered(symmetric_difference({a, symmetric_difference({b, c})})), "(d +0 +1 +2)");
  EXPECT_EQ(lowered(intersect({a, complement(symmetric_difference({b, c}))})), "(i +0 (d -1 +2))");
  EXPECT_EQ(lowered(unite({intersect({a, b}), intersect({c, d})})), "(u (i +0 +1) (i +2 +3))");
  EXPECT_EQ(lowered(unite({at(1, 0, 0, unite({a, b})), c})), "(u +0 +1 +2)");
}

TEST(Lowering, MapsGoToTheProducers) {
  const auto e = at(10, 0, 0,
                    model::transform(std::vector<double>{2, 0, 0, 0, 0, 2, 0, 0, 0, 0, -2, 0, 0, 0, 0, 1},
                                     at(1, 1, 1, cube())));
  const Net network = compile<3>(e, {});
  ASSERT_EQ(network.producers.size(), 1U);
  const std::array<double, 3> lower{12, 2, -4}, upper{14, 4, -2};
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(network.producers[0].lower[i], lower[i], 1e-12);
    EXPECT_NEAR(network.producers[0].upper[i], upper[i], 1e-12);
    EXPECT_LE(network.producers[0].lower[i], lower[i]);  // rounded outward
    EXPECT_GE(network.producers[0].upper[i], upper[i]);
  }
}

TEST(Lowering, TakesExpressionsNestedTenThousandDeep) {
  model::Expression e = cube(), f = cube();
  for (int i = 0; i < 10000; ++i) {
    e = model::subtract({cube(2), e});
    f = model::unite({f, cube()});
  }
  EXPECT_NEAR(volume<3>(e), 1, 1e-12);  // an even number of times
  EXPECT_NEAR(volume<3>(f), 1, 1e-12);
}

TEST(Lowering, CopiesShareTheirPlanes) {
  std::vector<model::Expression> operands;
  for (int i = 0; i < 10; ++i) operands.push_back(at(i, 0, 0, cube()));  // a row of touching cubes
  EXPECT_EQ(compile<3>(model::unite(operands), {}).table.size(), 11U + 4U);
}

/// Refines one expression as a stream of tokens: each step replaces a cell by two or labels it.
template <int D>
struct Stream {
  std::uint64_t splits = 0, in = 0, out = 0;
  double volume = 0;
};

template <int D>
Stream<D> refine(const model::Expression& e, Random& random, std::uint64_t most = 20000) {
  const Network<D> network = compile<D>(e, {});
  geometry::Splitter<D> splitter(network.table);
  geometry::CellWriter<D> writer(network.table);
  Localizer<D> localizer(network, splitter);
  struct Token {
    Cell<D> cell;
    Words program;
  };
  std::vector<Token> stack;
  stack.push_back({geometry::root_cell(network.table), Words(network.program)});
  Stream<D> result;
  while (!stack.empty()) {
    const Token token = std::move(stack.back());
    stack.pop_back();
    Words simplified, again;
    typename Localizer<D>::Cut cut, other;
    const Answer answer = localizer.fire(token.program, token.cell, simplified, cut);
    // The result depends on the arguments alone.
    EXPECT_EQ(localizer.fire(token.program, token.cell, again, other).label, answer.label);
    if (answer.label != Label::fuzzy) {
      EXPECT_EQ(answer.label == Label::out ? answer.owner : no_owner, no_owner);
      const Where truth = where(e, point_in(token.cell, random), 1e-7L);
      EXPECT_TRUE(truth.doubtful || (answer.label == Label::in) == truth.inside);
      (answer.label == Label::in ? result.in : result.out)++;
      if (answer.label == Label::in) result.volume += writer.measure(token.cell).volume();
      continue;
    }
    EXPECT_EQ(again, simplified);
    EXPECT_EQ(other.hyperplane, cut.hyperplane);
    EXPECT_FALSE(localizer.undecided_operands(simplified).empty());
    // The hyperplane that would help crosses the cell; the halves refine it.
    if (++result.splits > most || splitter.classify(token.cell, cut.hyperplane) != Position::crossing) {
      ADD_FAILURE() << "no progress";
      return result;
    }
    Token negative, positive;
    splitter.split(token.cell, cut.hyperplane, &negative.cell, &positive.cell);
    const double whole = writer.measure(token.cell).volume();
    // Corners are rounded: coordinates of up to 16 move the faces of a cell, however thin it is, by 2^-50.
    EXPECT_NEAR(writer.measure(negative.cell).volume() + writer.measure(positive.cell).volume(), whole,
                1e-12 * whole + 1e-14);
    // What is said to be OUT beforehand is OUT.
    Words unused;
    if (cut.negative_is_out) {
      EXPECT_EQ(localizer.fire(simplified, negative.cell, unused, other).label, Label::out);
    }
    if (cut.positive_is_out) {
      EXPECT_EQ(localizer.fire(simplified, positive.cell, unused, other).label, Label::out);
    }
    negative.program = positive.program = simplified;
    stack.push_back(std::move(negative));
    stack.push_back(std::move(positive));
  }
  return result;
}

TEST(Producer, RefinesABoxIntoOneInCell) {
  Random random(1);
  const auto stream = refine<3>(cube(2), random);
  EXPECT_EQ(stream.in, 1U);
  EXPECT_EQ(stream.out, 6U);
  EXPECT_NEAR(stream.volume, 8, 1e-13);
}

TEST(Producer, RefinesPrismsAndSpheresIntoOneInCell) {
  Random random(2);
  for (const std::uint32_t sides : {3U, 5U, 8U, 17U}) {
    EXPECT_EQ(refine<3>(model::cylinder(1, 1, 1, sides), random).in, 1U);
    EXPECT_EQ(refine<3>(model::cylinder(1, 1, 0, sides), random).in, 1U);
    EXPECT_EQ(refine<3>(model::sphere(1, sides), random).in, 1U);
  }
}

TEST(Producer, RefinesMeshesThatAreNotConvex) {
  Random random(3);
  EXPECT_NEAR(refine<3>(l_shape(1, 1, 2), random).volume, 2 * 3, 1e-13);
  EXPECT_NEAR(refine<3>(star(5, 2, 1, 1), random).volume, 10 * std::sin(std::numbers::pi / 5), 1e-12);
  EXPECT_NEAR(refine<3>(polycube({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}}), random).volume, 4, 1e-12);
  // Cubes that touch in an edge and in a vertex only.
  EXPECT_NEAR(refine<3>(polycube({{0, 0, 0}, {1, 1, 0}}), random).volume, 2, 1e-12);
  EXPECT_NEAR(refine<3>(polycube({{0, 0, 0}, {1, 1, 1}}), random).volume, 2, 1e-12);
}

TEST(Combiner, StreamsRefineTheirInput) {
  for (int round = 0; round < samples::rounds(150); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    refine<3>(random_expression(random, 3, Kind::solids, 2), random);
    refine<2>(random_expression(random, 2, Kind::solids, 2), random);
    if (HasFailure()) return;
  }
}

/// Fires a program at the cell [0.25, 0.75]^3, as far as the root cell holds it.
Answer fire_at_middle(const model::Expression& e, std::string* left = nullptr) {
  const Network<3> network = compile<3>(e, {});
  geometry::Splitter<3> splitter(network.table);
  Cell<3> cell = geometry::root_cell(network.table);
  for (int axis = 0; axis < 3; ++axis)
    for (const double bound : {0.25, 0.75}) {
      const auto id = network.table.axis_hyperplane(axis, network.table.axis_position(axis, bound));
      if (splitter.classify(cell, id) != Position::crossing) continue;
      Cell<3> half;
      splitter.split(cell, id, bound < 0.5 ? nullptr : &half, bound < 0.5 ? &half : nullptr);
      cell = std::move(half);
    }
  Localizer<3> localizer(network, splitter);
  Words out;
  Localizer<3>::Cut cut;
  const Answer answer = localizer.fire(network.program, cell, out, cut);
  if (left != nullptr) *left = answer.label == Label::fuzzy ? text(out) : "";
  return answer;
}

TEST(Combiner, FoldsAnsweredOperandsAway) {
  using namespace model;
  const Expression in = at(-1, -1, -1, cube(3)), other_in = at(-2, -2, -2, cube(5)),
                   out = at(2, 2, 2, cube()), far = at(-2, -2, -2, cube()), cut = at(0.5, -1, -1, cube(3)),
                   cut2 = at(-1, 0.5, -1, cube(3));
  const auto answer = [](const Expression& e) { return fire_at_middle(e).label; };
  const auto left = [](const Expression& e) {
    std::string program;
    fire_at_middle(e, &program);
    return program;
  };
  EXPECT_EQ(answer(unite({cut, in, cut2})), Label::in);
  EXPECT_EQ(answer(unite({out, far})), Label::out);
  EXPECT_EQ(answer(intersect({cut, unite({out, far}), cut2})), Label::out);
  EXPECT_EQ(answer(intersect({in, other_in})), Label::in);
  EXPECT_EQ(answer(subtract({in, out})), Label::in);
  EXPECT_EQ(answer(subtract({in, other_in})), Label::out);
  EXPECT_EQ(answer(subtract({other_in, cut, in})), Label::out);
  EXPECT_EQ(answer(symmetric_difference({in, other_in})), Label::out);
  EXPECT_EQ(answer(symmetric_difference({in, other_in, in})), Label::in);
  EXPECT_EQ(left(unite({out, cut})), "+1");
  EXPECT_EQ(left(unite({out, cut, cut2})), "(u +1 +2)");
  EXPECT_EQ(left(intersect({in, subtract({cut, out}), cut2})), "(i +1 +3)");
  EXPECT_EQ(left(unite({out, intersect({in, unite({cut, cut2})})})),
            "(i (u +2 +3))");  // it has to remember an owner
  EXPECT_EQ(left(subtract({in, cut})), "(i -1)");
}

TEST(Combiner, NamesAnOwnerThatContainsTheCell) {
  using namespace model;
  const Expression in = at(-1, -1, -1, cube(3)), other_in = at(-2, -2, -2, cube(5)),
                   out = at(2, 2, 2, cube()), cut = at(0.5, -1, -1, cube(3));
  const auto owner = [](const Expression& e) { return fire_at_middle(e).owner; };
  EXPECT_EQ(owner(unite({out, in, other_in})), 1);
  EXPECT_EQ(owner(intersect({in, other_in})), 0);
  EXPECT_EQ(owner(subtract({other_in, out})), 0);
  EXPECT_EQ(owner(intersect({complement(out), other_in})), 1);
  EXPECT_EQ(owner(symmetric_difference({out, in})), 1);
  EXPECT_EQ(owner(symmetric_difference({in, other_in, in})), 0);
  EXPECT_EQ(owner(unite({out, intersect({in, complement(out)})})), 1);
  EXPECT_EQ(owner(intersect({in, unite({out, other_in, cut})})), 0);
  EXPECT_EQ(owner(intersect({unite({complement(out), in}), unite({in, complement(out)})})), 2);
}

}  // namespace
}  // namespace bsp2::dataflow
