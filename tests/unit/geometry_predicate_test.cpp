// The one predicate and its filters against rational arithmetic, on hyperplanes that meet exactly, or almost,
// in one point. The oracle starts from the original maps and covectors and shares no code with the kernel.

#include <gtest/gtest.h>

#include <algorithm>

#include "bsp2/geometry/cell.hpp"
#include "bsp2/geometry/splitter.hpp"
#include "geometry_oracle.hpp"

namespace bsp2::geometry {
namespace {

/// What a round has seen, so that a test can show that it has tested something.
struct Seen {
  std::uint64_t sides = 0, exact = 0, on = 0, exact_vertices = 0;
};

/// Vertices of random D-tuples of hyperplanes: error bounds, and sides of other hyperplanes.
template <int D>
void check_vertices(const Model<D>& model, Random& random, int tuples, int others, Seen& seen) {
  using oracle::Rational;
  Splitter<D> splitter(model.table);
  const int count = static_cast<int>(model.table.size());
  const auto any_id = [&]() -> HyperplaneId {
    if (pick(random, 0, 9) == 0)
      return model.table.axis_hyperplane(pick(random, 0, D - 1),
                                         static_cast<std::uint32_t>(pick(random, 0, (1 << 27) - 1)));
    return static_cast<HyperplaneId>(pick(random, 0, count - 1));
  };
  const Rational radius = oracle::rational(model.table.radius());
  for (int i = 0; i < tuples; ++i) {
    std::array<HyperplaneId, D> ids;
    for (HyperplaneId& id : ids) id = any_id();
    if (i % 4 != 0 && model.codes_of[0].size() == 2 * D)  // one facet of a box for each axis: seldom parallel
      for (int axis = 0; axis < D; ++axis) {
        const auto& box = model.codes_of[static_cast<std::size_t>(
            pick(random, 0, static_cast<int>(model.codes_of.size()) - 1))];
        if (!box.empty())
          ids[axis] = box[static_cast<std::size_t>(2 * axis) + (i % 4 == 3 ? pick(random, 0, 1) : 0)].id();
      }
    const auto exact = model.vertex(ids);
    if (!exact) continue;  // parallel
    // The filters' promise is for points within the table's bounds only.
    if (std::any_of(exact->begin(), exact->end(), [&](const Rational& x) { return abs(x) > radius; }))
      continue;
    const Vertex<D> vertex = make_vertex<D>(model.table, ids, seen.exact_vertices);
    Rational square = 0;
    for (int k = 0; k < D; ++k) {
      const Rational difference = oracle::rational(vertex.x[k]) - (*exact)[k];
      square += difference * difference;
    }
    const Rational error = oracle::rational(vertex.error);
    ASSERT_LE(square, error * error) << "vertex error " << vertex.error << ", true error "
                                     << std::sqrt(square.convert_to<double>());
    for (int k = 0; k < others; ++k) {
      const HyperplaneId id = any_id();
      const int expected = model.plane(id).side(*exact);
      const std::uint64_t before = splitter.counts().exact_predicates;
      ASSERT_EQ(splitter.side(vertex, id, model.table.rounded(id)), expected) << "hyperplane " << id;
      ++seen.sides;
      seen.on += expected == 0;
      seen.exact += splitter.counts().exact_predicates - before;
    }
  }
}

/// The rounded copies, at random points of the root cell and at its corners.
template <int D>
void check_rounded(const Model<D>& model, Random& random, int points) {
  const auto value = [&](int axis, double share) {
    return model.table.axis_value(axis, static_cast<std::uint32_t>(share * model.table.axis_steps));
  };
  for (HyperplaneId id = 0; id < model.table.size(); ++id) {
    const auto exact = model.plane(id);
    const auto length = exact.length();
    const Hyperplane<D> rounded = model.table.rounded(id);
    for (int i = 0; i < points; ++i) {
      std::array<double, D> x;
      for (int axis = 0; axis < D; ++axis)
        x[axis] = value(axis, i % 2 == 0 ? uniform(random, 0, 1) : static_cast<double>(pick(random, 0, 1)));
      const oracle::Real truth = oracle::real(exact.at(oracle::point<D>(x))) / length;
      ASSERT_LE(abs(oracle::Real(rounded.at(x)) - truth), oracle::Real(rounded.error)) << "hyperplane " << id;
    }
  }
}

/// Random boxes: nothing special.
template <int D>
typename Model<D>::Placed random_box(Random& random, double size) {
  Matrix<D> m{};
  for (int i = 0; i < D; ++i) {
    for (int j = 0; j < D; ++j) m[i][j] = uniform(random, -size, size);
    m[i][D] = uniform(random, -size, size);
  }
  return {m, unit_box<D>().covectors};
}

template <int D>
struct Dimension {
  static constexpr int value = D;
};

template <typename T>
class Predicate : public testing::Test {};
using Dimensions =
    testing::Types<Dimension<1>, Dimension<2>, Dimension<3>, Dimension<4>, Dimension<5>, Dimension<6>>;
TYPED_TEST_SUITE(Predicate, Dimensions);

TYPED_TEST(Predicate, AgreesWithRationalsOnBoxesTurnedByTinyAngles) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Seen seen;
  const int rounds = D <= 3 ? 40 : D == 4 ? 16 : D == 5 ? 6 : 3;
  for (int round = 0; round < rounds; ++round) {
    // All boxes have a corner in one common point p; they are turned about it by 1e-3 ... 1e-30 and scaled by
    // powers of two, some mirrored: D + many hyperplanes pass almost, or exactly, through p.
    const double size = std::ldexp(1.0, pick(random, -30, 30));
    std::array<double, D> p, lower, upper;
    for (int i = 0; i < D; ++i) {
      p[i] = round % 3 == 0 ? 0 : size * pick(random, -64, 64) / 64;
      lower[i] = -2 * size;
      upper[i] = 2 * size;
    }
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 6; ++k) {
      Matrix<D> m = identity<D>();
      if constexpr (D > 1) {
        if (k > 0)
          for (int turn = 0; turn < 2; ++turn) {
            const int a = pick(random, 0, D - 1), b = (a + pick(random, 1, D - 1)) % D;
            m = product<D>(rotation<D>(a, b, std::pow(10.0L, -pick(random, 3, 30)) * pick(random, 1, 9)), m);
          }
      }
      Matrix<D> scale = identity<D>();
      for (int i = 0; i < D; ++i)
        scale[i][i] = std::ldexp(size, pick(random, -8, 0)) * (pick(random, 0, 1) == 0 ? -1 : 1);
      boxes.push_back({product<D>(translation<D>(p), product<D>(m, scale)), unit_box<D>().covectors});
    }
    boxes.push_back(random_box<D>(random, size));
    const Model<D> model(lower, upper, 4 * D * size, boxes, 0);
    check_vertices(model, random, D <= 3 ? 40 : 15, 8, seen);
    check_rounded(model, random, 3);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(seen.sides, 50U);
  if (D > 1) {
    EXPECT_GT(seen.exact, seen.sides / 50);
    EXPECT_GT(seen.on, 0U);
  }
}

/// Points that no filter tells apart, each held first against each other one: a cache that takes nothing for an answer is found out.
TEST(PredicateOnALine, TellsNeighboursApart) {
  std::vector<Model<1>::Placed> boxes;
  for (const double x : {0.3, 0.1 + 0.2, 0.7, 0.1 + 0.6}) {
    Matrix<1> m{};
    m[0][0] = 1 - x;
    m[0][1] = x;
    boxes.push_back({m, unit_box<1>().covectors});
  }
  const Model<1> model({0}, {1}, 4, boxes, 0);
  for (HyperplaneId a = 0; a < model.table.size(); ++a)
    for (HyperplaneId b = 0; b < model.table.size(); ++b) {
      Splitter<1> splitter(model.table);  // with empty caches
      std::uint64_t exact = 0;
      const Vertex<1> vertex = make_vertex<1>(model.table, {a}, exact);
      EXPECT_LE(vertex.error, largest_vertex_error * model.table.radius());
      EXPECT_EQ(splitter.side(vertex, b, model.table.rounded(b)), model.plane(b).side(*model.vertex({a}))) << a << " against " << b;
    }
}

TYPED_TEST(Predicate, AgreesWithRationalsOnRandomBoxesOfAllSizes) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Seen seen;
  const int rounds = D <= 3 ? 30 : D == 4 ? 12 : D == 5 ? 5 : 2;
  for (int round = 0; round < rounds; ++round) {
    const double size = std::pow(10.0, uniform(random, -12, 12));
    std::array<double, D> lower, upper;
    lower.fill(-2 * size);
    upper.fill(2 * size);
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 5; ++k)
      boxes.push_back(random_box<D>(random, size * std::pow(10.0, -pick(random, 0, 9))));
    const Model<D> model(lower, upper, 4 * D * size, boxes, 0);
    check_vertices(model, random, D <= 3 ? 30 : 10, 6, seen);
    check_rounded(model, random, 3);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(seen.sides, 20U);
}

TEST(PredicateInSpace, IsZeroForAllFacetsAroundAMeshVertexUnderAnyMap) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Seen seen;
  for (int round = 0; round < 100; ++round) {
    // A fan of triangles around one corner, all its coordinates arbitrary 53-bit numbers.
    const auto coordinate = [&](int bits) {
      return std::uniform_int_distribution<std::int64_t>(-(std::int64_t{1} << bits),
                                                         std::int64_t{1} << bits)(random);
    };
    const std::array<std::int64_t, 3> apex{coordinate(53), coordinate(53), coordinate(53)};
    const int narrow = pick(random, 1, 40);  // fans from wide open to almost degenerate
    std::vector<std::array<std::int64_t, 3>> rim;
    for (int k = 0; k < 7; ++k) {
      auto& p = rim.emplace_back(apex);
      for (auto& x : p)
        x = std::clamp<std::int64_t>(x + coordinate(53 - narrow), -(std::int64_t{1} << 53),
                                     std::int64_t{1} << 53);
    }
    std::vector<Covector<3>> covectors;
    for (int k = 0; k < 7; ++k) {
      const auto plane = triangle_covector({apex, rim[k], rim[(k + 1) % 7]});
      if (!plane.exact[0].is_zero() || !plane.exact[1].is_zero() || !plane.exact[2].is_zero())
        covectors.push_back(plane);
    }
    Matrix<3> m = random_box<3>(random, 1).matrix;
    m = product<3>(rotation<3>(0, 1, uniform(random, 0, 6)), m);
    const Model<3> model({-4, -4, -4}, {4, 4, 4}, 16, {{m, covectors}}, 0);
    if (model.table.size() < 4) continue;
    Splitter<3> splitter(model.table);
    const auto size = static_cast<HyperplaneId>(model.table.size());
    for (HyperplaneId a = 0; a + 2 < size; ++a) {
      const std::array<HyperplaneId, 3> ids{a, a + 1, a + 2};
      if (!model.vertex(ids)) continue;
      const Vertex<3> vertex = make_vertex<3>(model.table, ids, seen.exact_vertices);
      for (HyperplaneId id = 0; id < size; ++id)
        ASSERT_EQ(splitter.side(vertex, id, model.table.rounded(id)), 0);
    }
    seen.exact += splitter.counts().exact_predicates;
    check_vertices(model, random, 10, 5, seen);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(seen.exact, 1000U);
}

TEST(PredicateInSpace, AgreesWithRationalsOnLathesAndMeshesUnderTheirLargestCoefficients) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Seen seen;
  for (int round = 0; round < 25; ++round) {
    const auto sides = static_cast<std::uint32_t>(pick(random, 3, 9));
    // Radii and heights with all 53 bits, so that coefficients reach the size that exact.hpp allows for.
    std::vector<double> radius{uniform(random, 0.3, 1), 1, uniform(random, 0.3, 1)},
        z{0, uniform(random, 0.4, 0.6), 1};
    const auto covectors = lathe(sides, radius, z).covectors;
    std::vector<Model<3>::Placed> placed;
    const double size = std::ldexp(uniform(random, 1, 2), pick(random, -20, 20));
    Matrix<3> m = random_box<3>(random, size).matrix;
    for (int k = 0; k < 3; ++k) {  // the same solid, moved by a little less each time
      Matrix<3> moved = m;
      if (k > 0) moved[pick(random, 0, 2)][pick(random, 0, 3)] *= 1 + std::ldexp(1.0, -pick(random, 20, 52));
      placed.push_back({moved, covectors});
    }
    const Model<3> model({-4 * size, -4 * size, -4 * size}, {4 * size, 4 * size, 4 * size}, 8 * size, placed,
                         0);
    check_vertices(model, random, 30, 6, seen);
    check_rounded(model, random, 2);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(seen.sides, 500U);
}

TEST(PredicateInSpace, SeesDifferencesOfOneGridStep) {
  // Four planes through the origin, then one of them moved by one step of the grid, which is 2^-100 of the
  // model.
  for (const int direction : {-1, 0, 1}) {
    HyperplaneTable<3> table({-1, -1, -1}, {1, 1, 1}, 1);
    Matrix<3> moved = identity<3>();
    moved[2][3] = static_cast<Quad>(direction) * static_cast<Quad>(std::ldexp(1.0L, table.grid_exponent()));
    const auto covectors = unit_box<3>().covectors;
    const std::uint32_t first = table.add_covectors(covectors);
    const std::uint32_t plain = table.add_map(rotation<3>(0, 1, 1.0L)), shifted = table.add_map(moved);
    for (const int axis : {0, 1, 2})
      table.add_occurrence(plain, first + 2 * static_cast<std::uint32_t>(axis));
    table.add_occurrence(shifted, first + 4);  // -z <= 0 shifted
    const auto codes = table.merge(0);
    std::uint64_t exact = 0;
    const Vertex<3> origin = make_vertex<3>(table, {codes[0].id(), codes[1].id(), codes[2].id()}, exact);
    Splitter<3> splitter(table);
    // -(0 - shift) = shift
    EXPECT_EQ(splitter.side(origin, codes[3].id(), table.rounded(codes[3].id())), direction);
    EXPECT_EQ(codes[3].id() == codes[2].id(), direction == 0);
  }
}

}  // namespace
}  // namespace bsp2::geometry
