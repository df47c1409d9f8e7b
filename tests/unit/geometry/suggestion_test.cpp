#include "bsp2/geometry/support/suggestion.hpp"

#include <gtest/gtest.h>

#include <random>

namespace bsp2::model {
namespace {

constexpr std::string_view words[] = {"union", "difference", "cube", "cylinder", "sphere", "ball"};

TEST(Suggestion, IsTheNearestWord) {
  EXPECT_EQ(suggestion("cubee", words), "; did you mean 'cube'?");
  EXPECT_EQ(suggestion("cylnider", words), "; did you mean 'cylinder'?");
  EXPECT_EQ(suggestion("sphear", words), "; did you mean 'sphere'?");
  EXPECT_EQ(suggestion("diffrence", words), "; did you mean 'difference'?");
  EXPECT_EQ(suggestion("tetrahedron", words), "");
  EXPECT_EQ(suggestion("", words), "");
  EXPECT_EQ(suggestion("x", words), "");
}

/// A word changed in n places is at a distance of n at most, and as far from the first as the first from it.
TEST(Suggestion, DistanceCountsSlips) {
  const unsigned seed = 20260;
  SCOPED_TRACE(seed);
  std::mt19937 random(seed);
  const auto letter = [&] { return static_cast<char>('a' + random() % 5); };
  for (int trial = 0; trial < 500; ++trial) {
    std::string word;
    for (unsigned i = 0; i < 4 + random() % 8; ++i) word += letter();
    std::string changed = word;
    const std::size_t slips = random() % 4;
    for (std::size_t slip = 0; slip < slips; ++slip) {
      const std::size_t at = random() % (changed.size() - 1);
      switch (random() % 3) {
        case 0:
          changed[at] = letter();
          break;
        case 1:
          changed.insert(at, 1, letter());
          break;
        default:
          changed.erase(at, 1);
      }
    }
    EXPECT_LE(edit_distance(word, changed), slips) << word << ' ' << changed;
    EXPECT_EQ(edit_distance(word, changed), edit_distance(changed, word));
    EXPECT_EQ(edit_distance(word, changed) == 0, word == changed);
  }
  EXPECT_EQ(edit_distance("edges", "egdes"), 1U);
  EXPECT_EQ(edit_distance("abcd", ""), 4U);
}

}  // namespace
}  // namespace bsp2::model
