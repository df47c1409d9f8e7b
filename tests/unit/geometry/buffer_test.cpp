// A buffer does what a vector does, but for the values that resize adds.

#include "bsp2/geometry/support/buffer.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <utility>
#include <vector>

#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

TEST(Buffer, HoldsWhatAVectorHolds) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  Buffer<std::uint32_t> buffer, other{1, 2, 3};
  std::vector<std::uint32_t> expected, expected_other{1, 2, 3};
  for (int step = 0; step < 20000; ++step) {
    const std::uint32_t a = random(), b = random(), c = random();
    switch (random() % 9) {
      case 0:
        buffer.push(a);
        expected.push_back(a);
        break;
      case 1:
        buffer.push(a, b, c);
        expected.insert(expected.end(), {a, b, c});
        break;
      case 2:
        buffer.append(other);
        expected.insert(expected.end(), expected_other.begin(), expected_other.end());
        break;
      case 3:
        buffer.assign(expected_other);
        expected = expected_other;
        break;
      case 4:
        other = buffer;
        expected_other = expected;
        break;
      case 5:
        buffer.swap(other);
        expected.swap(expected_other);
        break;
      case 6:
        other = Buffer<std::uint32_t>(buffer);
        expected_other = expected;
        break;
      case 7: {
        const std::size_t before = expected.size(), size = random() % 200;
        buffer.resize(size);
        expected.resize(size, a);
        if (size > before) std::fill(buffer.begin() + before, buffer.end(), a);
        break;
      }
      default:
        if (random() % 8 == 0) {
          buffer.clear();
          expected.clear();
        }
    }
    if (expected.size() > 3000) {
      buffer.resize(7);
      expected.resize(7);
    }
    ASSERT_EQ(buffer.size(), expected.size()) << "step " << step;
    ASSERT_TRUE(std::equal(buffer.begin(), buffer.end(), expected.begin(), expected.end()))
        << "step " << step;
    ASSERT_TRUE(std::equal(other.begin(), other.end(), expected_other.begin(), expected_other.end()))
        << "step " << step;
    ASSERT_EQ(buffer == other, expected == expected_other);
  }
}

}  // namespace
}  // namespace bsp2::geometry
