// Coincidence, decided once.

#include <gtest/gtest.h>

#include <algorithm>

#include "geometry_oracle.hpp"

namespace bsp2::geometry {
namespace {

using oracle::Rational;

/// The same hyperplane: exactly proportional. @return its sign, or 0 if it is another one.
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

template <int D>
struct Dimension {
  static constexpr int value = D;
};
template <typename T>
class Merge : public testing::Test {};
using Dimensions = testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>>;
TYPED_TEST_SUITE(Merge, Dimensions);

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
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 6; ++k) {
      // Integer maps: sheared, mirrored, stretched by different factors, so that equal planes have different
      // multiples; some turned by next to nothing.
      Matrix<D> m = identity<D>();
      for (int i = 0; i < D; ++i) {
        for (int j = i + 1; j < D; ++j) m[i][j] = pick(random, -1, 1);
        m[i][i] = pick(random, 1, 3) * (pick(random, 0, 1) == 0 ? 1 : -1);
        m[i][D] = pick(random, -2, 2);
      }
      if constexpr (D > 1)
        if (k == 5) m = product<D>(rotation<D>(0, 1, std::pow(10.0L, -pick(random, 15, 25))), m);
      boxes.push_back({m, unit_box<D>().covectors});
    }
    const Model<D> model(lower, upper, 16, boxes, 0);
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

TYPED_TEST(Merge, WithinTheToleranceMergesAndBeyondItDoesNot) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < 300; ++round) {
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
    HyperplaneTable<D> table(lower, upper, 4 * D * size);
    const std::uint32_t first = table.add_covectors(covectors),
                        facet = static_cast<std::uint32_t>(pick(random, 0, 2 * D - 1));
    table.add_occurrence(table.add_map(m), first + facet);
    const Hyperplane<D> original = table.rounded(0);
    // Moved along its normal by a share of the tolerance; every other time mirrored, which turns its facets
    // around.
    const std::array<double, 4> shares{0.9, 1.1, -0.9, -1.1};
    for (const double share : shares) {
      Matrix<D> moved = m;
      for (int i = 0; i < D; ++i)
        moved[i][D] += static_cast<Quad>(share * tolerance * size) * static_cast<Quad>(original.normal[i]);
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

TEST(MergeInSpace, OppositeFacesOfTouchingBoxesShareAnId) {
  // Two boxes that touch after different rotations: what doubles make of it differs in the last bit.
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < 200; ++round) {
    const long double angle = uniform(random, 0, 6);
    const Matrix<3> turn = rotation<3>(0, 1, angle);
    Matrix<3> detour = identity<3>();  // the same rotation in three rounded steps
    for (int i = 0; i < 3; ++i) {
      detour = product<3>(rotation<3>(0, 1, angle / 3), detour);
      for (auto& row : detour)
        for (Quad& x : row) x = static_cast<double>(x);
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
