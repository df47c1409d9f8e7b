#include "bsp2/geometry/cells/bsp_tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>

#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

/// The line [0, 1] cut at random places into leaves 1..n in a random order of cuts.
BspTree random_line_tree(std::mt19937& random, const std::vector<double>& cuts) {
  BspTree tree;
  tree.dimension = 1;
  const std::function<std::int32_t(std::size_t, std::size_t)> build = [&](std::size_t first,
                                                                          std::size_t last) -> std::int32_t {
    if (first == last) return ~static_cast<std::int32_t>(first + 1);
    const std::size_t cut = std::uniform_int_distribution<std::size_t>(first, last - 1)(random);
    const auto node = static_cast<std::int32_t>(tree.nodes.size());
    tree.nodes.push_back({static_cast<std::uint32_t>(tree.hyperplanes.size() / 2), 0, 0});
    tree.hyperplanes.insert(tree.hyperplanes.end(), {-cuts[cut], 1.0});
    const std::int32_t negative = build(first, cut), positive = build(cut + 1, last);
    tree.nodes[node].negative = negative;
    tree.nodes[node].positive = positive;
    return node;
  };
  tree.root = build(0, cuts.size());
  return tree;
}

TEST(BspTree, LocatesPointsAndVisitsLeavesBackToFront) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < samples::rounds(100); ++round) {
    std::vector<double> cuts(1 + round % 20);
    for (double& cut : cuts) cut = unit(random);
    std::sort(cuts.begin(), cuts.end());
    const BspTree tree = random_line_tree(random, cuts);
    for (int i = 0; i < 20; ++i) {
      const std::array<double, 1> point{unit(random)};
      const auto expected = std::upper_bound(cuts.begin(), cuts.end(), point[0]) - cuts.begin() + 1;
      EXPECT_EQ(tree.locate(point), expected);
    }
    std::vector<std::int32_t> seen;
    tree.visit_back_to_front(std::array<double, 1>{2.0}, false,
                             [&](std::int32_t leaf) { seen.push_back(leaf); });
    ASSERT_EQ(seen.size(), cuts.size() + 1);
    EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));  // the nearest to 2 is the last
    std::vector<std::int32_t> along;
    tree.visit_back_to_front(std::array<double, 1>{1.0}, true,
                             [&](std::int32_t leaf) { along.push_back(leaf); });
    EXPECT_TRUE(std::is_sorted(along.rbegin(), along.rend()));  // looking along +x, the nearest is the lowest
  }
}

}  // namespace
}  // namespace bsp2::geometry
