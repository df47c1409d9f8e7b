#include "bsp2/geometry/cells/point_query.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>

#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::geometry {
namespace {

template <int D>
std::vector<HalfSpace<D>> random_half_spaces(std::mt19937& random, int count,
                                             const std::array<double, D>& inside) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> room(0, 1);
  std::vector<HalfSpace<D>> half_spaces(static_cast<std::size_t>(count));
  for (auto& h : half_spaces) {
    double length = 0;
    for (double& x : h.normal) x = normal(random), length += x * x;
    h.offset = -room(random);
    for (int i = 0; i < D; ++i) h.normal[i] /= std::sqrt(length), h.offset -= h.normal[i] * inside[i];
  }
  return half_spaces;
}

template <int D>
double dot(const std::array<double, D>& a, const std::array<double, D>& b) {
  double sum = 0;
  for (int i = 0; i < D; ++i) sum += a[i] * b[i];
  return sum;
}

template <int D>
bool contains(const std::vector<HalfSpace<D>>& half_spaces, const std::array<double, D>& point,
              double slack) {
  for (const auto& h : half_spaces)
    if (h.offset + dot<D>(h.normal, point) > slack) return false;
  return true;
}

/// The point nearest to the origin in which some hyperplanes meet, by Gauss' elimination of their Gram
/// matrix.
template <int D>
std::optional<std::array<double, D>> corner_of(const std::vector<HalfSpace<D>>& chosen) {
  const std::size_t n = chosen.size();
  std::vector<std::vector<double>> m(n, std::vector<double>(n + 1));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) m[i][j] = dot<D>(chosen[i].normal, chosen[j].normal);
    m[i][n] = -chosen[i].offset;
  }
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k; i < n; ++i)
      if (std::fabs(m[i][k]) > std::fabs(m[pivot][k])) pivot = i;
    if (std::fabs(m[pivot][k]) < 1e-9) return std::nullopt;
    std::swap(m[k], m[pivot]);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t j = n + 1; i != k && j-- > k;) m[i][j] -= m[i][k] / m[k][k] * m[k][j];
  }
  std::array<double, D> point{};
  for (std::size_t i = 0; i < n; ++i)
    for (int axis = 0; axis < D; ++axis) point[axis] += m[i][n] / m[i][i] * chosen[i].normal[axis];
  return point;
}

/// Of all points in which at most D hyperplanes meet, the nearest one that is in all half-spaces.
template <int D>
double nearest_of_all(const std::vector<HalfSpace<D>>& half_spaces) {
  double nearest = std::numeric_limits<double>::infinity();
  for (unsigned subset = 0; subset < 1U << half_spaces.size(); ++subset) {
    std::vector<HalfSpace<D>> chosen;
    for (std::size_t i = 0; i < half_spaces.size(); ++i)
      if (subset >> i & 1) chosen.push_back(half_spaces[i]);
    if (chosen.size() > D) continue;
    const auto point = corner_of<D>(chosen);
    if (point && contains<D>(half_spaces, *point, 1e-9))
      nearest = std::min(nearest, std::sqrt(dot<D>(*point, *point)));
  }
  return nearest;
}

template <int D>
void compare_with_all_subsets() {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "dimension " << D << ", seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-4, 4);
  for (int round = 0; round < samples::rounds(100); ++round) {
    std::array<double, D> inside;
    for (double& x : inside) x = place(random);
    const auto half_spaces = random_half_spaces<D>(random, 1 + round % 9, inside);
    const auto point = nearest_to_origin<D>(half_spaces, std::numeric_limits<double>::infinity());
    const double distance = std::sqrt(dot<D>(point, point)), expected = nearest_of_all<D>(half_spaces);
    EXPECT_NEAR(distance, expected, 1e-8 * (1 + expected));
    EXPECT_TRUE(contains<D>(half_spaces, point, 1e-9));
    const auto cut_short = nearest_to_origin<D>(half_spaces, expected / 2);
    if (expected > 0) {
      EXPECT_GE(std::sqrt(dot<D>(cut_short, cut_short)), expected / 2 * (1 - 1e-9));
    }
  }
}

TEST(NearestToOrigin, AgreesWithAllSubsetsOfTheHyperplanes) {
  compare_with_all_subsets<1>();
  compare_with_all_subsets<2>();
  compare_with_all_subsets<3>();
  compare_with_all_subsets<4>();
#if BSP2_DIMENSIONS > 4
  compare_with_all_subsets<6>();
#endif
}

/// The facets of a prism over a polygon of very many sides are nearly parallel.
TEST(NearestToOrigin, EndsAmongNearlyParallelHyperplanes) {
  constexpr int sides = 2000;
  for (const double away : {1.5, 10.0, 1e6}) {
    std::vector<HalfSpace<2>> disc;
    for (int i = 0; i < sides; ++i) {
      const double angle = 2 * std::acos(-1.0) * i / sides;
      disc.push_back({{std::cos(angle), std::sin(angle)}, -1 - away * std::cos(angle)});
    }
    const auto point = nearest_to_origin<2>(disc, std::numeric_limits<double>::infinity());
    EXPECT_NEAR(std::hypot(point[0], point[1]), away - 1, 1e-6 * away);
  }
}

/// The cube [1, 2]^D in a table's root cell, cut off by 2 D hyperplanes parallel to the axes.
template <int D>
void measure_a_cube() {
  std::array<double, D> zero{}, three;
  three.fill(3);
  const HyperplaneTable<D> table(zero, three, 3);
  BspTree tree;
  tree.dimension = D;
  std::array<double, D> low, high;
  for (int axis = 0; axis < D; ++axis)
    for (const double x : {1.0, 2.0}) {
      const std::uint32_t position = table.axis_position(axis, x);
      const HyperplaneId id = HyperplaneTable<D>::axis_hyperplane(axis, position);
      (x == 1 ? low : high)[axis] = table.axis_value(axis, position);
      const auto h = table.rounded(id);
      const auto next = static_cast<std::int32_t>(tree.nodes.size()) + 1;
      tree.nodes.push_back({static_cast<std::uint32_t>(next - 1), x == 1 ? BspTree::empty_leaf : next,
                            x == 1 ? next : BspTree::empty_leaf});
      tree.ids.push_back(id);
      tree.hyperplanes.push_back(h.offset);
      tree.hyperplanes.insert(tree.hyperplanes.end(), h.normal.begin(), h.normal.end());
    }
  tree.nodes.back().negative = ~1;
  tree.root = 0;
  const PointQuery<D> query(table, tree, {Label::in});
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "dimension " << D << ", seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-3, 6), within(1, 2);
  for (int round = 0; round < samples::rounds(200); ++round) {
    std::array<double, D> point;
    for (double& x : point) x = round % 2 == 0 ? place(random) : within(random);
    double outside = 0, inside = std::numeric_limits<double>::infinity();
    for (int i = 0; i < D; ++i) {
      outside += std::pow(std::max({low[i] - point[i], point[i] - high[i], 0.0}), 2);
      inside = std::min({inside, point[i] - low[i], high[i] - point[i]});
    }
    const auto answer = query.ask(point);
    EXPECT_EQ(answer.label, inside > 0 ? Label::in : Label::out);
    EXPECT_NEAR(answer.distance, inside > 0 ? inside : std::sqrt(outside), 1e-12);
    double length = 0;
    for (int i = 0; i < D; ++i) length += std::pow(answer.nearest[i] - point[i], 2);
    EXPECT_NEAR(std::sqrt(length), answer.distance, 1e-12);
  }
}

TEST(PointQuery, MeasuresACubeInAnyDimension) {
  measure_a_cube<1>();
  measure_a_cube<2>();
  measure_a_cube<3>();
  measure_a_cube<4>();
#if BSP2_DIMENSIONS > 4
  measure_a_cube<5>();
  measure_a_cube<6>();
#endif
}

TEST(PointQuery, FuzzyIsNeitherInNorOut) {
  const HyperplaneTable<1> table({0}, {1}, 1);
  BspTree tree{1, 0, {}, {}, {}};
  const double at[] = {0.25, 0.5};
  std::array<double, 2> cut;
  for (const int i : {0, 1}) {
    const std::uint32_t position = table.axis_position(0, at[i]);
    cut[i] = table.axis_value(0, position);
    tree.ids.push_back(HyperplaneTable<1>::axis_hyperplane(0, position));
    tree.hyperplanes.insert(tree.hyperplanes.end(), {-cut[i], 1});
  }
  tree.nodes = {{0, ~1, 1}, {1, ~2, BspTree::empty_leaf}};
  const PointQuery<1> query(table, tree, {Label::in, Label::fuzzy});
  EXPECT_EQ(query.ask({0.1}).label, Label::in);
  EXPECT_NEAR(query.ask({0.2}).distance, cut[0] - 0.2, 1e-15);
  EXPECT_EQ(query.ask({0.3}).label, Label::fuzzy);
  EXPECT_EQ(query.ask({0.3}).distance, 0);
  EXPECT_EQ(query.ask({0.9}).label, Label::out);
  EXPECT_NEAR(query.ask({0.9}).distance, 0.9 - cut[1], 1e-15);
  const BspTree empty{1, BspTree::empty_leaf, {}, {}, {}};
  const PointQuery<1> nothing(table, empty, {});
  EXPECT_EQ(nothing.ask({0.5}).distance, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace bsp2::geometry
