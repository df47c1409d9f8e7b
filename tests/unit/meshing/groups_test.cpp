// Faces of meshes: which are used, and by what names they go.

#include "bsp2/meshing/groups/groups.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "meshing/mesh_checks.hpp"
#include "support/rounds.hpp"
#include "tetrahedra/face_checks.hpp"

namespace bsp2::meshing {
namespace {

/// Any tetrahedra over few points: by the list of those on each face, and on which side of it their points
/// are.
TEST(FaceUse, IsThatOfAListOfEachFace) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::array<int, 5> met{};
  for (int round = 0; round < samples::all_rounds(200); ++round) {
    Tetrahedra mesh;
    std::vector<std::uint32_t> some{0, 1, 2, 3, 4, 5, 6, 7};
    for (std::size_t i = 0; i < some.size(); ++i) {
      mesh.points.emplace_back();
      for (double& x : mesh.points.back()) x = dataflow::pick(random, -2, 2);
    }
    std::map<std::array<std::uint32_t, 3>, std::vector<std::uint32_t>> apexes;
    for (int i = dataflow::pick(random, 1, 8); i > 0; --i) {
      std::shuffle(some.begin(), some.end(), random);
      mesh.tetrahedra.push_back({some[0], some[1], some[2], some[3]});
      for (std::size_t k = 0; k < 4; ++k) {
        std::array face{some[(k + 1) % 4], some[(k + 2) % 4], some[(k + 3) % 4]};
        if (k == 0) mesh.triangles.push_back({some[3], some[1], some[4]});
        std::sort(face.begin(), face.end());
        apexes[face].push_back(some[k]);
      }
    }
    std::array<std::uint64_t, 5> expected{};
    for (const auto& [face, points] : apexes) {
      ++expected[std::min<std::size_t>(points.size(), 3) - 1];
      const auto side = [&, f = face](std::uint32_t apex) {
        return exact_sign(mesh.points[f[0]], mesh.points[f[1]], mesh.points[f[2]], mesh.points[apex]);
      };
      if (points.size() == 2 && side(points[0]) * side(points[1]) > 0) ++expected[3];
    }
    for (auto triangle : mesh.triangles) {
      std::sort(triangle.begin(), triangle.end());
      expected[4] += 1 - apexes.count(triangle);
    }
    const FaceUse use = face_use(mesh);
    ASSERT_EQ((std::array{use.once, use.twice, use.more, use.folded, use.strange}), expected);
    for (std::size_t i = 0; i < met.size(); ++i) met[i] += expected[i] > 0 ? 1 : 0;
  }
  for (const int times : met) EXPECT_GT(times, 0);
}

TEST(Quality, AspectIsOneOfRegularTetrahedraAndNoneOfFlatOnes) {
  Tetrahedra mesh;
  mesh.points = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}, {-1, -1, -1}, {1, 1, -1}};
  mesh.tetrahedra = {{0, 2, 1, 3}};
  EXPECT_NEAR(quality_of(mesh).smallest_aspect, 1, 1e-12);
  mesh.tetrahedra = {{4, 1, 2, 3}};  // a corner of a cube
  EXPECT_NEAR(quality_of(mesh).smallest_aspect, 2 * std::sqrt(3.0) / (3 + std::sqrt(3.0)), 1e-12);
  mesh.tetrahedra.push_back({4, 1, 2, 5});
  mesh.part.resize(2);
  const Quality quality = quality_of(mesh);
  EXPECT_EQ(quality.smallest_aspect, 0);
  EXPECT_EQ(quality.turned, 1U);
  EXPECT_NEAR(quality.mean_aspect, std::sqrt(3.0) / (3 + std::sqrt(3.0)), 1e-12);
}

/// Tetrahedra around an edge, some of them in one part, then some in another or in the same beyond a
/// triangle: by the angles they were made with.
TEST(Quality, SmallAnglesAreOfTheSolidWhereItIsAsSharp) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  constexpr std::array limits{1, 5, 10};
  std::array<std::uint64_t, 3> met{}, met_not{};
  for (int round = 0; round < samples::all_rounds(300); ++round) {
    Tetrahedra mesh;
    mesh.points = {{0, 0, -1}, {0, 0, 1}, {1, 0, 0}};
    std::array<std::uint64_t, 3> below{}, of_solid{};
    double turned_by = 0;
    const bool has_parts = dataflow::pick(random, 0, 1) == 1;
    for (int wedge = 0; wedge < 3; ++wedge) {
      std::vector<double> angles(static_cast<std::size_t>(dataflow::pick(random, 1, 5)));
      double all = 0;
      const int most = dataflow::pick(random, 0, 1) == 1 ? 30 : 150;  // tenths of degrees
      for (double& angle : angles)
        all += angle = 0.1 * dataflow::pick(random, 1, most) + 0.0437;  // no sum is a limit
      for (const double angle : angles) {
        turned_by += angle * std::numbers::pi / 180;
        const auto last = static_cast<std::uint32_t>(mesh.points.size());
        mesh.points.push_back({std::cos(turned_by), std::sin(turned_by), 0});
        mesh.tetrahedra.push_back({0, last - 1, last, 1});
        mesh.part.push_back(has_parts ? wedge : 0);
        for (std::size_t i = 0; i < limits.size(); ++i) {
          if (angle >= limits[i]) continue;
          ++below[i];
          if (all < limits[i]) ++of_solid[i];
        }
      }
      if (!has_parts) mesh.triangles.push_back({1, static_cast<std::uint32_t>(mesh.points.size() - 1), 0});
    }
    const Quality quality = quality_of(mesh);
    ASSERT_EQ(quality.turned, 0U);
    ASSERT_EQ(quality.tetrahedra_below, below);
    ASSERT_EQ(quality.of_solid, of_solid);
    for (std::size_t i = 0; i < limits.size(); ++i) {
      met[i] += of_solid[i];
      met_not[i] += below[i] - of_solid[i];
    }
  }
  for (std::size_t i = 0; i < limits.size(); ++i) EXPECT_GT(met[i] * met_not[i], 0U);
}

using Condition = GroupRule::Condition;

TEST(Groups, AreNamedByPartAndByRule) {
  const std::vector<Point> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  const Rgba red{255, 0, 0, 255}, clear_red{255, 0, 0, 51}, blue{0, 0, 255, 255};
  const Condition lowest{Condition::Sign::equal, Condition::Bound::least, {0, 0, 1}},
      before{Condition::Sign::at_most, Condition::Bound::given, {1, 2, 0}, 0.5};
  Groups groups({"a", "b", "c"}, {{0, clear_red}, {2, blue}},
                {{"floor", {lowest}, {}, {}},
                 {"low", {before}, {}, {}},
                 {"glass", {}, {clear_red}, {}},
                 {"both", {}, {red, blue}, {}},
                 {"blue", {}, {blue}, {}}},
                points, 1e-9);
  const std::array<std::uint32_t, 3> floor{0, 1, 2}, slope{1, 2, 3};
  const auto name = [&](std::int32_t part, std::int32_t other, const auto& corners) {
    return groups.groups()[static_cast<std::size_t>(groups.group_of(part, other, corners, points))];
  };
  EXPECT_EQ(name(0, PlaneSide::nothing, floor), "floor");
  EXPECT_EQ(name(1, PlaneSide::nothing, slope), "b|outside");
  EXPECT_EQ(name(0, 1, slope), "glass");
  EXPECT_EQ(name(1, 2, slope), "blue");
  EXPECT_EQ(groups.empty_rules(), (std::vector<std::string>{"low", "both"}));
}

/// Of points of whole numbers, all of which are exact.
TEST(Groups, HalfSpacesHoldTheirPoints) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const std::array<std::uint32_t, 1> corner{0};
  for (int round = 0; round < samples::rounds(500); ++round) {
    const auto some = [&] { return Point{0., 0., 0. + dataflow::pick(random, 1, 3)}; };
    Condition condition{static_cast<Condition::Sign>(dataflow::pick(random, 0, 2)),
                        static_cast<Condition::Bound>(dataflow::pick(random, 0, 2)), some()};
    std::vector<Point> points(4);
    for (Point& point : points)
      for (double& x : point) x = dataflow::pick(random, -3, 3);
    for (std::size_t k = 0; k < 2; ++k) condition.normal[k] = dataflow::pick(random, -3, 3);
    condition.value = dataflow::pick(random, -5, 5);
    std::vector<double> heights;
    for (const Point& p : points)
      heights.push_back(p[0] * condition.normal[0] + p[1] * condition.normal[1] + p[2] * condition.normal[2]);
    const double bound = condition.bound == Condition::Bound::given ? condition.value
                         : condition.bound == Condition::Bound::least
                             ? *std::min_element(heights.begin(), heights.end())
                             : *std::max_element(heights.begin(), heights.end());
    const bool is_there = condition.sign == Condition::Sign::equal     ? heights[0] == bound
                          : condition.sign == Condition::Sign::at_most ? heights[0] <= bound
                                                                       : heights[0] >= bound;
    Groups groups({}, {}, {{"rule", {condition}, {}, {}}}, points, 1e-9);
    groups.group_of(0, PlaneSide::nothing, corner, points);
    ASSERT_EQ(groups.groups()[0] == "rule", is_there);
  }
}

/// The sides of a prism of n meet at 360/n degrees, its ends and sides at 90.
TEST(Groups, AreDividedWhereFacesMeetAtLargerAngles) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    const auto n = static_cast<std::uint32_t>(dataflow::pick(random, 3, 24));
    const double step = 360.0 / n, angle = dataflow::uniform(random, 0, 180);
    std::vector<std::vector<std::uint32_t>> cycles(2);
    std::vector<Point> outward{{0, 0, 1}, {0, 0, -1}}, points(2 * std::size_t{n});
    for (std::uint32_t i = 0; i < n; ++i) {
      cycles[0].push_back(i);
      cycles[1].push_back(2 * n - 1 - i);
      cycles.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
      const double turn = i * step * std::acos(-1.0) / 180;
      outward.push_back({std::cos(turn), std::sin(turn), 0});
    }
    std::vector<std::size_t> order(cycles.size());
    for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
    std::shuffle(order.begin(), order.end(), random);
    std::vector<GroupFace> faces;
    for (const std::size_t i : order) faces.push_back({cycles[i], outward[i]});
    Groups groups({}, {}, {{"skin", {}, {}, angle}}, points, 0);
    std::vector<std::int32_t> group;
    for (const GroupFace& face : faces)
      group.push_back(groups.group_of(0, PlaneSide::nothing, face.corners, points));
    groups.divide(faces, group);
    const bool are_sides_one = step <= angle;
    const std::size_t pieces = angle >= 90 ? 1 : are_sides_one ? 3 : n + 2;
    ASSERT_EQ(groups.groups().size(), pieces) << n << " at " << angle;
    std::int32_t most = -1;  // numbered in the order of first faces
    for (const std::int32_t g : group) {
      ASSERT_LE(g, most + 1);
      most = std::max(most, g);
    }
    for (std::size_t i = 0; i < pieces; ++i) EXPECT_EQ(groups.groups()[i], "skin_" + std::to_string(i + 1));
    EXPECT_TRUE(groups.empty_rules().empty());
  }
}

}  // namespace
}  // namespace bsp2::meshing
