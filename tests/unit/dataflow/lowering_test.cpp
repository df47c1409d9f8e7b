// What compilation makes of an expression before anything is evaluated.

#include "lowering/lowering.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "bsp2/model/builder/builder.hpp"

namespace bsp2::dataflow {
namespace {

using model::Expression;

Expression moved(const Expression& solid, double x) {
  const double matrix[] = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  return model::transform(matrix, solid);
}

std::vector<std::int32_t> numbers_of(const Lowered<3>& lowered) {
  std::vector<std::int32_t> numbers;
  for (const auto& occurrence : lowered.occurrences) numbers.push_back(occurrence.number);
  return numbers;
}

/// Such an operand changes nothing, but its primitives keep their numbers: those behind it must not move up.
TEST(Lowering, TakesAnOperandThatIsRepeatedOnce) {
  const Expression box = model::cuboid({1, 1, 1}), pair = model::unite({moved(box, 3), moved(box, 5)});
  EXPECT_EQ(numbers_of(lower<3>(model::unite({box, pair, box, pair, moved(box, 9)}))),
            (std::vector<std::int32_t>{0, 1, 2, 6}));
  EXPECT_EQ(numbers_of(lower<3>(model::subtract({box, box, pair, box, pair}))),
            (std::vector<std::int32_t>{0, 1, 2, 3}));
  EXPECT_EQ(numbers_of(lower<3>(model::symmetric_difference({box, box, box}))),
            (std::vector<std::int32_t>{0, 1, 2}))
      << "which are not the same as one";
  // A single one that is left needs no combiner.
  const Lowered<3> one = lower<3>(model::unite({model::intersect({box, box}), box}));
  EXPECT_EQ(numbers_of(one), (std::vector<std::int32_t>{0, 2}));
  EXPECT_EQ(lower<3>(model::intersect({box, box})).program.size(), lower<3>(box).program.size());
}

TEST(Lowering, TakesOneOfManyOperands) {
  const Expression box = model::cuboid({1, 1, 1});
  std::vector<Expression> operands(100000, box);
  operands.push_back(moved(box, 1));
  EXPECT_EQ(numbers_of(lower<3>(model::unite(operands))), (std::vector<std::int32_t>{0, 100000}));
}

}  // namespace
}  // namespace bsp2::dataflow
