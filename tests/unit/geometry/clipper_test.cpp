// A chain of cuts in place gives the very cells that one split after the other gives.

#include "bsp2/geometry/cells/clipper.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "geometry/oracle.hpp"
#include "support/dimension_types.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

template <int D>
void expect_same(const Cell<D>& a, const Cell<D>& b) {
  ASSERT_EQ(a.vertices().size(), b.vertices().size());
  for (std::size_t v = 0; v < a.vertices().size(); ++v) {
    ASSERT_EQ(a.vertices()[v].x, b.vertices()[v].x);
    ASSERT_EQ(a.vertices()[v].error, b.vertices()[v].error);
    ASSERT_EQ(a.vertices()[v].hyperplanes, b.vertices()[v].hyperplanes);
  }
  for (int k = 1; k < D; ++k) {
    ASSERT_EQ(a.face_count(k), b.face_count(k));
    for (std::size_t face = 0; face < a.face_count(k); ++face) {
      ASSERT_TRUE(std::ranges::equal(a.hyperplanes(k, face), b.hyperplanes(k, face)));
      ASSERT_TRUE(std::ranges::equal(a.subfaces(k, face), b.subfaces(k, face))) << k << "-face " << face;
    }
  }
}

/// Cuts the root cell by the planes in turn, both ways. @return the number of cuts.
template <int D>
int clip_and_compare(const Model<D>& model, const std::vector<OrientedHyperplane>& planes) {
  Splitter<D> splitter(model.table), own(model.table);
  Clipper<D> clipper(own);
  Cell<D> cell = root_cell(model.table);
  clipper.load(cell);
  int cuts = 0;
  for (const OrientedHyperplane plane : planes) {
    const Position where = splitter.classify(cell, plane.id());
    Cell<D> rest;
    const Position found = clipper.cut(plane, cuts % 3 == 2 ? nullptr : &rest);
    if (where != Position::crossing) {
      EXPECT_EQ(found,
                (where == Position::negative) != plane.flipped() ? Position::negative : Position::positive);
      continue;
    }
    EXPECT_EQ(found, Position::crossing);
    std::array<Cell<D>, 2> halves;
    splitter.split(cell, plane.id(), &halves[0], &halves[1]);
    if (plane.flipped()) std::swap(halves[0], halves[1]);
    cell = std::move(halves[0]);
    if (cuts % 3 != 2) expect_same(rest, halves[1]);
    if (cuts % 2 == 0) expect_same(clipper.cell(), cell);
    if (testing::Test::HasFatalFailure()) return cuts;
    const auto centre = clipper.centre();
    for (int i = 0; i < D; ++i) {
      double sum = 0;
      for (const auto& vertex : cell.vertices()) sum += vertex.x[i];
      EXPECT_EQ(centre[i], sum / static_cast<double>(cell.vertices().size()));
    }
    ++cuts;
  }
  expect_same(clipper.cell(), cell);
  EXPECT_EQ(own.counts().splits, splitter.counts().splits);
  EXPECT_EQ(own.counts().vertices, splitter.counts().vertices);
  return cuts;
}

template <typename T>
class Clip : public testing::Test {};
TYPED_TEST_SUITE(Clip, samples::Dimensions);

TYPED_TEST(Clip, GivesTheCellsOfSplitsWhereHyperplanesMeetVerticesAndEdges) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int cuts = 0;
  for (int round = 0; round < (D == 3 ? 200 : D < 5 ? 30 : 3); ++round) {
    std::array<double, D> lower, upper;
    lower.fill(-2);
    upper.fill(2);
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 4;
         ++k) {  // normals with entries -1, 0, 1 through grid points, and some in general position
      Matrix<D> m = identity<D>();
      for (int i = 0; i < D; ++i) {
        for (int j = i + 1; j < D; ++j) m[i][j] = k == 3 ? uniform(random, -1, 1) : pick(random, -1, 1);
        m[i][D] = pick(random, -1, 0);
      }
      boxes.push_back({m, unit_box<D>().covectors});
    }
    const Model<D> model(lower, upper, 8 * D, boxes, 0);
    std::vector<OrientedHyperplane> planes;
    for (HyperplaneId id = 0; id < model.table.size(); ++id)
      planes.push_back(oriented(id, pick(random, 0, 1) == 1));
    std::shuffle(planes.begin(), planes.end(), random);
    cuts += clip_and_compare(model, planes);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(cuts, 0);
}

/// A ball of rings and a cone: up to as many planes through one corner as there are sides.
Model<3> lathes(Random& random, std::uint32_t sides) {
  const std::array<double, 4> ball{0.5, 1, 1, 0.5}, ball_z{0, 0.3, 0.7, 1};
  const std::array<double, 2> cone{1, 0}, cone_z{0, 1};
  Matrix<3> turned = rotation<3>(0, 2, uniform(random, 0, 6));
  turned[0][3] = uniform(random, -0.3, 0.3);
  return Model<3>(
      {-2, -2, -2}, {2, 2, 2}, 24,
      {{turned, lathe(sides, ball, ball_z).covectors}, {identity<3>(), lathe(sides, cone, cone_z).covectors}},
      0);
}

TEST(Clipper, CutsALatheOutOfARoomAsSplitsDo) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(10); ++round) {
    const Model<3> model = lathes(random, static_cast<std::uint32_t>(pick(random, 3, 60)));
    std::vector<OrientedHyperplane> planes;
    for (const auto& own : model.codes_of) planes.insert(planes.end(), own.begin(), own.end());
    std::shuffle(planes.begin(), planes.end(), random);
    EXPECT_GT(clip_and_compare(model, planes), 3);
    if (HasFailure()) return;
  }
}

TEST(Predicate, AgreesWithRationalsOnFourPlanesOfOneLathe) {
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int on = 0, asked = 0;
  for (int round = 0; round < samples::all_rounds(6); ++round) {
    const Model<3> model = lathes(random, static_cast<std::uint32_t>(pick(random, 3, 9)));
    Splitter<3> splitter(model.table);
    for (int k = 0; k < 150; ++k) {
      const auto& own = model.codes_of[k % 5 == 0 ? 0 : 1];
      const auto any = [&] {
        return own[static_cast<std::size_t>(pick(random, 0, static_cast<int>(own.size()) - 1))].id();
      };
      const std::array<HyperplaneId, 3> ids{any(), any(), any()};
      const auto point = model.vertex(ids);
      if (!point) continue;
      std::uint64_t exact = 0;
      auto vertex = make_vertex<3>(model.table, ids, exact);
      vertex.error = 1e3;  // the filter knows nothing
      const HyperplaneId id = any();
      const int expected = model.plane(id).side(*point);
      ASSERT_EQ(splitter.side(vertex, id, model.table.rounded(id)), expected);
      on += expected == 0 && std::find(ids.begin(), ids.end(), id) == ids.end();
      ++asked;
    }
  }
  EXPECT_GT(on, 0);
  EXPECT_GT(asked, on);
}

}  // namespace
}  // namespace bsp2::geometry
