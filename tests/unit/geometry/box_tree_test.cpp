#include "bsp2/geometry/support/box_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>
#include <utility>

#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

TEST(BoxTree, FindsEachPairThatMeetsOnce) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(::testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    std::vector<Box3> boxes(std::uniform_int_distribution<std::size_t>(0, 60)(random));
    for (Box3& box : boxes)
      for (std::size_t k = 0; k < 3; ++k) {
        box.low[k] = std::uniform_int_distribution<int>(0, 9)(random);
        box.high[k] = box.low[k] + std::uniform_int_distribution<int>(0, 3)(random);
      }
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> expected, found;
    for (std::uint32_t j = 0; j < boxes.size(); ++j)
      for (std::uint32_t i = 0; i < j; ++i)
        if (boxes[i].meets(boxes[j])) expected[{i, j}] = 1;
    const BoxTree tree(boxes);
    const auto branches = tree.branches(std::uniform_int_distribution<std::size_t>(1, 20)(random));
    for (std::size_t k = 0; k < branches.size(); ++k)
      EXPECT_FALSE(tree.visit_meeting_pairs(branches, k, [&](std::uint32_t i, std::uint32_t j) {
        ++found[std::minmax(i, j)];
        return false;
      }));
    ASSERT_EQ(found, expected);
  }
}

}  // namespace
}  // namespace bsp2::geometry
