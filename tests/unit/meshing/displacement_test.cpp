// What is known of where places went, against places that are moved one by one.

#include "shaping/displacement.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "meshing/mesh_checks.hpp"
#include "support/rounds.hpp"

namespace bsp2::meshing {
namespace {

/// Where places have gone, each, and what is known of them.
struct Places {
  std::vector<Point> gone{Point{}};
  Displacement known;

  [[nodiscard]] double farthest() const {
    double most = 0;
    for (const Point& by : gone) most = std::max(most, std::sqrt(dot(by, by)));
    return most;
  }
  void go(const Point& step, double share_of_first, double share_of_last) {
    for (std::size_t i = 0; i < gone.size(); ++i) {
      const double share = i % 2 == 0 ? share_of_first : share_of_last;
      for (std::size_t k = 0; k < 3; ++k) gone[i][k] += share * step[k];
    }
  }
};

TEST(Displacement, IsNeverLessThanWherePlacesWent) {
  for (int round = 0; round < samples::rounds(300); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto number = [&] { return dataflow::uniform(random, -1, 1); };
    std::array<Places, 3> of;
    for (int step = 0; step < 12; ++step) {
      Places& places = of[static_cast<std::size_t>(step % 3)];
      const Places& others = of[static_cast<std::size_t>((step + 1) % 3)];
      const Point way{number(), number(), number()};
      switch (static_cast<int>(dataflow::uniform(random, 0, 4))) {
        case 0:
          places.known = places.known.then(way);
          places.go(way, 1, 1);
          break;
        case 1:
          places.known = places.known.then_up_to(way);
          places.go(way, 0, 1);
          break;
        case 2: {
          const double size = std::sqrt(dot(way, way));
          places.known = places.known.then_within(size);
          places.go(way, 1, -1);
          break;
        }
        default:
          places.known.unite(others.known);
          places.gone.insert(places.gone.end(), others.gone.begin(), others.gone.end());
      }
      ASSERT_GE(places.known.length(), places.farthest() * (1 - 1e-12));
    }
    const double a = dataflow::uniform(random, 0, 1), b = dataflow::uniform(random, 0, 1 - a);
    const std::array<double, 3> weight{a, b, 1 - a - b};
    const double known = Displacement::mean({of[0].known, of[1].known, of[2].known}, weight).length();
    for (const Point& x : of[0].gone)
      for (const Point& y : of[1].gone)
        for (const Point& z : of[2].gone) {
          Point mean{};
          for (std::size_t k = 0; k < 3; ++k)
            mean[k] = weight[0] * x[k] + weight[1] * y[k] + weight[2] * z[k];
          ASSERT_LE(std::sqrt(dot(mean, mean)), known * (1 + 1e-12));
        }
  }
}

/// There and back: places are where they were, and so it is known.
TEST(Displacement, TakesBackWhatGoesBack) {
  const Displacement there = Displacement().then({0.5, 0, 0});
  EXPECT_EQ(there.length(), 0.5);
  EXPECT_EQ(there.then({-0.5, 0, 0}).length(), 0);
  EXPECT_EQ(there.then({-0.75, 0, 0}).length(), 0.25);
  Displacement some = there;
  some.unite({});  // one that has not gone
  EXPECT_EQ(some.then({-0.5, 0, 0}).length(), 0.5);
}

}  // namespace
}  // namespace bsp2::meshing
