// Coincidence, decided once.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

#include "geometry/oracle.hpp"
#include "support/dimension_types.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

using oracle::Rational;

/// Whether two hyperplanes are one: exactly proportional. @return the sign, or 0 if they are not.
template <int D>
int same(const oracle::Plane<D>& a, const oracle::Plane<D>& b) {
  int pivot = 0;
  while (a.normal[pivot].is_zero()) ++pivot;
  if (b.normal[pivot].is_zero()) return 0;
  const Rational factor = b.normal[pivot] / a.normal[pivot];
  for (int i = 0; i < D; ++i)
    if (a.normal[i] * factor != b.normal[i]) return 0;
  return a.offset * factor == b.offset ? factor.sign() : 0;
}

template <typename T>
class Merge : public testing::Test {};
TYPED_TEST_SUITE(Merge, samples::FirstDimensions);

/// A hyperplane as a table rounds it that has no other. @param table an empty one.
template <int D>
Hyperplane<D> rounded_alone(HyperplaneTable<D> table, const Covector<D>& covector, const Matrix<D>& matrix) {
  const std::uint32_t map = table.add_map(matrix);
  table.add_occurrence(map, table.add_covectors(std::span(&covector, 1)));
  table.merge(0);
  return table.rounded(0);
}

/// Boxes under integer maps: sheared, mirrored, stretched by different factors, so that equal planes have
/// different multiples; some turned by next to nothing.
template <int D>
std::vector<typename Model<D>::Placed> boxes_on_a_grid(Random& random, int count) {
  std::vector<typename Model<D>::Placed> boxes;
  for (int k = 0; k < count; ++k) {
    Matrix<D> m = identity<D>();
    for (int i = 0; i < D; ++i) {
      for (int j = i + 1; j < D; ++j) m[i][j] = pick(random, -1, 1);
      m[i][i] = pick(random, 1, 3) * (pick(random, 0, 1) == 0 ? 1 : -1);
      m[i][D] = pick(random, -2, 2);
    }
    if constexpr (D > 1)
      if (k % 6 == 5) m = product<D>(rotation<D>(0, 1, std::pow(10.0L, -pick(random, 15, 25))), m);
    boxes.push_back({m, unit_box<D>().covectors});
  }
  return boxes;
}

TYPED_TEST(Merge, WithoutToleranceMergesExactlyWhatIsEqual) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::uint64_t merged = 0, flipped = 0;
  for (int round = 0; round < (D <= 3 ? 60 : 15); ++round) {
    std::array<double, D> lower, upper;
    lower.fill(-4);
    upper.fill(4);
    const Model<D> model(lower, upper, 16, boxes_on_a_grid<D>(random, 6), 0);
    for (std::size_t i = 0; i < model.planes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const int expected = same<D>(model.planes[i], model.planes[j]);
        ASSERT_EQ(model.codes[i].id() == model.codes[j].id(), expected != 0);
        if (expected == 0) continue;
        ASSERT_EQ(model.codes[i].flipped() != model.codes[j].flipped(), expected < 0);
        ++merged;
        flipped += expected < 0;
      }
  }
  EXPECT_GT(merged, 0U);
  EXPECT_GT(flipped, 0U);
}

/// What a large tolerance has merged is taken back, in any order, of few hyperplanes and of many: as if there
/// had been no tolerance.
TYPED_TEST(Merge, TakenBackLeavesExactlyWhatIsEqual) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::uint64_t merged = 0, parted = 0;
  for (int round = 0; round < (D <= 3 ? 12 : 6); ++round) {
    std::array<double, D> lower, upper;
    lower.fill(-4);
    upper.fill(4);
    Model<D> model(lower, upper, 16, boxes_on_a_grid<D>(random, pick(random, 2, 24)), 0.25);
    std::vector<std::uint32_t> order(model.planes.size());
    std::iota(order.begin(), order.end(), 0U);
    std::shuffle(order.begin(), order.end(), random);
    std::vector<OrientedHyperplane> codes(order.size());
    typename HyperplaneTable<D>::Unmerging unmerge(model.table);
    for (const std::uint32_t i : order) codes[i] = unmerge({i / (2 * D), i});
    for (std::size_t i = 0; i < codes.size(); ++i)
      for (std::size_t j = 0; j < i; ++j) {
        const int expected = same<D>(model.planes[i], model.planes[j]);
        ASSERT_EQ(codes[i].id() == codes[j].id(), expected != 0);
        if (expected != 0) {
          ASSERT_EQ(codes[i].flipped() != codes[j].flipped(), expected < 0);
        }
        merged += expected != 0 ? 1 : 0;
        parted += expected == 0 && model.codes[i].id() == model.codes[j].id() ? 1 : 0;
      }
  }
  EXPECT_GT(merged, 0U);
  EXPECT_GT(parted, 0U);
}

TYPED_TEST(Merge, WithinTheToleranceMergesAndBeyondItDoesNot) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(300); ++round) {
    const double size = std::pow(10.0, uniform(random, -6, 6)),
                 tolerance = std::pow(10.0, -pick(random, 3, 9));
    std::array<double, D> lower, upper;
    lower.fill(-size / 2);
    upper.fill(size / 2);
    Matrix<D> m{};
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) m[i][j] = uniform(random, -0.2, 0.2) * size + (i == j ? size / 2 : 0);
      m[i][D] = uniform(random, -0.3, 0.3) * size;
    }
    const auto covectors = unit_box<D>().covectors;
    const HyperplaneTable<D> alone(lower, upper, 4 * D * size);
    HyperplaneTable<D> table = alone;
    const std::uint32_t first = table.add_covectors(covectors),
                        facet = static_cast<std::uint32_t>(pick(random, 0, 2 * D - 1));
    table.add_occurrence(table.add_map(m), first + facet);
    const Hyperplane<D> original = rounded_alone<D>(alone, covectors[facet], m);
    // Moved along its normal by a share of the tolerance; every other time mirrored, which turns its facets
    // around.
    const std::array<double, 4> shares{0.9, 1.1, -0.9, -1.1};
    for (const double share : shares) {
      Matrix<D> moved = m;
      for (int i = 0; i < D; ++i)
        moved[i][D] +=
            static_cast<Float128>(share * tolerance * size) * static_cast<Float128>(original.normal[i]);
      table.add_occurrence(table.add_map(moved), first + facet);
    }
    const auto codes = table.merge(tolerance);
    EXPECT_EQ(codes[1], codes[0]);
    EXPECT_NE(codes[2].id(), codes[0].id());
    EXPECT_EQ(codes[3], codes[0]);
    EXPECT_NE(codes[4].id(), codes[0].id());
    EXPECT_NE(codes[4].id(), codes[2].id());
    EXPECT_EQ(table.size(), 3U);
  }
}

/// A hyperplane and the bounds of the primitive that it is of.
template <int D>
struct Bounded {
  Hyperplane<D> hyperplane;
  std::array<double, D> centre, half;
};

/// What HyperplaneTable::merge promises, with all pairs compared. @return the codes, and how many of them
/// there are.
template <int D>
std::pair<std::vector<OrientedHyperplane>, std::size_t> merged_by_pairs(const std::vector<Bounded<D>>& all,
                                                                        double distance_limit) {
  std::vector<std::size_t> order(all.size()), representatives;
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto size = [&](std::size_t i) { return *std::max_element(all[i].half.begin(), all[i].half.end()); };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return size(a) > size(b); });
  std::vector<OrientedHyperplane> codes(all.size());
  for (const std::size_t i : order) {
    const auto& [h, centre, half] = all[i];
    auto best = static_cast<std::uint32_t>(representatives.size());
    bool opposite = false;
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t id = 0; id < representatives.size(); ++id) {
      const Hyperplane<D>& r = all[representatives[id]].hyperplane;
      double dot = 0, turn = 0, apart = 0;
      for (int k = 0; k < D; ++k) dot += h.normal[k] * r.normal[k];
      const double sign = dot < 0 ? -1 : 1;
      apart = std::fabs(h.at(centre) - sign * r.at(centre));
      for (int k = 0; k < D; ++k) {
        turn += std::fabs(h.normal[k] - sign * r.normal[k]);
        apart += half[k] * std::fabs(h.normal[k] - sign * r.normal[k]);
      }
      if (turn > 0x1p-10 || apart > distance_limit || apart >= least) continue;
      best = id;
      opposite = dot < 0;
      least = apart;
    }
    if (best == representatives.size()) representatives.push_back(i);
    codes[i] = oriented(best, opposite);
  }
  return {codes, representatives.size()};
}

TYPED_TEST(Merge, EqualsTheComparisonOfAllPairs) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::size_t merged = 0, kept = 0;
  for (int round = 0; round < samples::rounds(24); ++round) {
    const double size = std::pow(10.0, uniform(random, -3, 3)), away = round % 3 == 0 ? 1000 * size : 0;
    const double tolerance = std::pow(10.0, -pick(random, 3, 10));
    std::array<double, D> lower, upper;
    lower.fill(away - size / 2);
    upper.fill(away + size / 2);
    HyperplaneTable<D> table(lower, upper, 2 * away + 4 * D * size);
    const HyperplaneTable<D> alone = table;
    const auto covectors = unit_box<D>().covectors;
    const std::uint32_t first = table.add_covectors(covectors);
    std::vector<Matrix<D>> directions;  // some along the axes, some turned
    for (int k = 0; k < 3; ++k) {
      Matrix<D> direction = identity<D>();
      if constexpr (D > 1)
        if (k > 0) direction = rotation<D>(0, D - 1, uniform(random, 0, 6));
      directions.push_back(direction);
    }
    std::vector<double> places;  // near each other, and all over the model
    for (int k = 0; k < 40; ++k) places.push_back(uniform(random, -0.5, 0.5) * size);
    for (int k = 0; k < 40; ++k) places.push_back(places[0] + uniform(random, -1, 1) * 0x1p-9 * size);
    std::vector<Bounded<D>> all;
    for (int k = 0; k < 700; ++k) {
      Matrix<D> m = directions[static_cast<std::size_t>(pick(random, 0, 2))];
      if constexpr (D > 1)
        if (pick(random, 0, 2) == 0)
          m = product<D>(rotation<D>(0, 1, std::pow(10.0L, -uniform(random, 2, 17))), m);
      const int facet = pick(random, 0, 2) == 0 ? pick(random, 0, 2 * D - 1) : 0;
      const double place = places[static_cast<std::size_t>(pick(random, 0, 79))] +
                           pick(random, -6, 6) * 0.4 * tolerance * size;
      for (auto& row : m)
        row[D] = away + place * static_cast<double>(row[0]);  // along the normal of the first two facets
      if (pick(random, 0, 3) == 0)
        for (auto& row : m) row[0] = -row[0];  // turns them around
      Bounded<D> one;
      const bool is_thin = pick(random, 0, 3) == 0;
      std::array<double, D> low, high;
      for (int i = 0; i < D; ++i) {
        const double half =
            size * (is_thin ? std::pow(10.0, -uniform(random, 1, 12)) : uniform(random, 0.01, 0.3));
        const double centre = away + uniform(random, -0.5, 0.5) * size;
        low[i] = centre - half;
        high[i] = centre + half;
        one.centre[i] = (low[i] + high[i]) / 2;
        one.half[i] = (high[i] - low[i]) / 2;
      }
      table.add_occurrence(table.add_map(m, low, high), first + static_cast<std::uint32_t>(facet));
      one.hyperplane = rounded_alone<D>(alone, covectors[static_cast<std::size_t>(facet)], m);
      all.push_back(one);
    }
    double extent = 0;  // as the table computes it
    for (int i = 0; i < D; ++i) extent = std::max(extent, upper[i] - lower[i]);
    const auto [expected, count] = merged_by_pairs<D>(all, tolerance * extent);
    const auto codes = table.merge(tolerance);
    ASSERT_EQ(table.size(), count);
    for (std::size_t i = 0; i < codes.size(); ++i)
      ASSERT_EQ(codes[i], expected[i]) << "occurrence " << i << " of round " << round;
    merged += codes.size() - count;
    kept += count;
  }
  EXPECT_GT(merged, samples::rounds(1000U));
  EXPECT_GT(kept, samples::rounds(1000U));
}

TYPED_TEST(Merge, WithoutToleranceTellsManyOfOneDirectionApart) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::array<double, D> lower, upper;
  lower.fill(-1);
  upper.fill(1);
  HyperplaneTable<D> table(lower, upper, 4);
  const std::uint32_t first = table.add_covectors(unit_box<D>().covectors);
  constexpr int count = 6000;
  std::vector<std::pair<int, int>> places;  // 2^-10 apart, or 2^-70: one double
  for (int k = 0; k < count; ++k) {
    places.emplace_back(pick(random, -1000, 1000), pick(random, 0, 1));
    Matrix<D> m = identity<D>();
    m[0][D] = static_cast<Float128>(std::ldexp(places.back().first, -10)) +
              static_cast<Float128>(std::ldexp(places.back().second, -70));
    table.add_occurrence(table.add_map(m), first);
  }
  const auto codes = table.merge(0);
  std::map<std::pair<int, int>, OrientedHyperplane> code_of;
  for (std::size_t i = 0; i < places.size(); ++i)
    ASSERT_EQ(code_of.try_emplace(places[i], codes[i]).first->second, codes[i]);
  EXPECT_EQ(table.size(), code_of.size());
}

TEST(MergeInSpace, OppositeFacesOfTouchingBoxesShareAnId) {
  // Two boxes that touch after different rotations: what doubles make of it differs in the last bit.
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const long double angle = uniform(random, 0, 6);
    const Matrix<3> turn = rotation<3>(0, 1, angle);
    Matrix<3> detour = identity<3>();  // the same rotation in three rounded steps
    for (int i = 0; i < 3; ++i) {
      detour = product<3>(rotation<3>(0, 1, angle / 3), detour);
      for (auto& row : detour)
        for (Float128& x : row) x = static_cast<double>(x);
    }
    const Matrix<3> moved = product<3>(detour, translation<3>({1, 0, 0}));
    const auto box = unit_box<3>().covectors;
    const Model<3> model({-3, -3, -3}, {3, 3, 3}, 6, {{turn, box}, {moved, box}}, 1e-9);
    // Covectors of the unit box: low and high of each axis.
    EXPECT_EQ(model.codes_of[0][1], model.codes_of[1][0].opposite());
    EXPECT_EQ(model.codes_of[0][2], model.codes_of[1][2]);
    EXPECT_EQ(model.codes_of[0][5], model.codes_of[1][5]);
    EXPECT_EQ(model.table.size(), 7U);
  }
}

/// Planes are found by residues modulo a prime: also where a plane's numbers are multiples of that one.
TEST(MergeInSpace, WithoutToleranceMultiplesOfAPrimeAreOnePlane) {
  const LocalInteger prime = (LocalInteger(1) << 61) - 1;
  std::vector<Covector<3>> covectors;
  for (const LocalInteger& factor :
       {LocalInteger(1), prime, LocalInteger(-prime), LocalInteger(prime * prime)})
    covectors.push_back(make_covector<3>({LocalInteger(2 * factor), LocalInteger(3 * factor),
                                          LocalInteger(-5 * factor), LocalInteger(7 * factor)}));
  covectors.push_back(make_covector<3>({LocalInteger(2 * prime), 3, -5, 7}));
  covectors.push_back(make_covector<3>({LocalInteger(2 * prime), LocalInteger(3 * prime), -5, 7}));
  HyperplaneTable<3> table({-4, -4, -4}, {4, 4, 4}, 16);
  const auto count = static_cast<std::uint32_t>(covectors.size());
  const std::uint32_t first = table.add_covectors(covectors);
  Matrix<3> doubled = identity<3>(), mirrored = identity<3>();
  for (int i = 0; i < 3; ++i) doubled[i][i] = 2, mirrored[i][i] = -1;
  for (const Matrix<3>& map : {identity<3>(), doubled, mirrored})
    table.add_occurrences(table.add_map(map), first, count);
  const auto codes = table.merge(0);
  ASSERT_EQ(table.size(), 9U);  // three planes at three places
  for (std::uint32_t map = 0; map < 3; ++map)
    for (std::uint32_t i = 0; i < 4; ++i) {
      EXPECT_EQ(codes[map * count + i].id(), codes[map * count].id());
      EXPECT_EQ(codes[map * count + i].flipped(), i == 2);
    }
}

TEST(MergeInSpace, ChainsDoNotCollapse) {
  // Planes 0.6 tolerances apart: the first represents those within the tolerance of itself, not their
  // neighbours' neighbours; so nothing moves by more than the tolerance.
  for (const double tolerance : {1e-9, 1e-6}) {
    HyperplaneTable<3> table({0, 0, 0}, {1, 1, 1}, 2);
    const std::uint32_t first = table.add_covectors(unit_box<3>().covectors);
    constexpr int count = 40;
    for (int i = 0; i < count; ++i)
      table.add_occurrence(table.add_map(translation<3>({0.25 + 0.6 * tolerance * i, 0, 0})), first);
    const auto codes = table.merge(tolerance);
    std::vector<int> representative(table.size(), -1);
    for (int i = 0; i < count; ++i) {
      int& r = representative[codes[static_cast<std::size_t>(i)].id()];
      if (r < 0) r = i;
      EXPECT_LE(i - r, 1);
    }
    EXPECT_EQ(table.size(), static_cast<std::size_t>(count) / 2);
  }
}

TEST(MergeInSpace, DoesNotDependOnTheTableBeingNearTheOrigin) {
  for (const double offset : {0.0, 1e3, 1e6}) {
    HyperplaneTable<3> table({offset, offset, offset}, {offset + 1, offset + 1, offset + 1}, offset + 2);
    const std::uint32_t first = table.add_covectors(unit_box<3>().covectors);
    for (const double shift : {0.0, 1e-5, 0.5e-5})
      for (std::uint32_t k = 0; k < 6; ++k)
        table.add_occurrence(table.add_map(translation<3>({offset + shift, offset + shift, offset + shift})),
                             first + k);
    EXPECT_EQ(table.merge(1e-7).size(), 18U);
    EXPECT_EQ(table.size(), 18U) << offset;
  }
}

}  // namespace
}  // namespace bsp2::geometry
