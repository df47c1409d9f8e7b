// Splitting cells in D = 1..6: whatever the hyperplanes, halves are polytopes again and fill the whole.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <set>

#include "bsp2/geometry/cells/measures.hpp"
#include "bsp2/geometry/cells/splitter.hpp"
#include "geometry/oracle.hpp"
#include "support/dimension_types.hpp"
#include "support/rounds.hpp"

namespace bsp2::geometry {
namespace {

template <int D>
std::set<std::uint16_t> vertices_of(const Cell<D>& cell, int k, std::size_t face) {
  if (k == 0) return {static_cast<std::uint16_t>(face)};
  std::set<std::uint16_t> all;
  for (const std::uint16_t sub : cell.subfaces(k, face)) all.merge(vertices_of(cell, k - 1, sub));
  return all;
}

/// Euler's relation, the diamond property, and no two faces with the same vertices.
template <int D>
void check_lattice(const Cell<D>& cell) {
  long euler = 0;
  for (int k = 0; k < D; ++k) euler += (k % 2 == 0 ? 1 : -1) * static_cast<long>(cell.face_count(k));
  ASSERT_EQ(euler, D % 2 == 0 ? 0 : 2);
  for (int k = 1; k < D; ++k) {
    std::set<std::set<std::uint16_t>> distinct;
    for (std::size_t face = 0; face < cell.face_count(k); ++face) {
      const auto vertices = vertices_of(cell, k, face);
      ASSERT_GE(vertices.size(), static_cast<std::size_t>(k) + 1);
      ASSERT_TRUE(distinct.insert(vertices).second) << "two " << k << "-faces on the same vertices";
      if (k < 2) continue;
      std::map<std::uint16_t, int> uses;  // of each (k-2)-face by the (k-1)-faces
      for (const std::uint16_t sub : cell.subfaces(k, face))
        for (const std::uint16_t ridge : cell.subfaces(k - 1, sub)) ++uses[ridge];
      for (const auto& [ridge, count] : uses)
        ASSERT_EQ(count, 2) << k << "-face " << face << ", its subface " << ridge;
    }
  }
  if constexpr (D >= 2) {  // the cell itself
    std::map<std::uint16_t, int> uses;
    for (std::size_t facet = 0; facet < cell.facet_count(); ++facet)
      for (const std::uint16_t ridge : cell.subfaces(D - 1, facet)) ++uses[ridge];
    for (const auto& [ridge, count] : uses) ASSERT_EQ(count, 2);
    ASSERT_EQ(uses.size(), cell.face_count(D - 2));
  }
}

/// Facets' hyperplanes carry their own vertices and have all others inside; every face lies on its
/// hyperplanes.
template <int D>
void check_sides(const Cell<D>& cell, const Model<D>& model, bool in_rationals) {
  Splitter<D> splitter(model.table);
  std::vector<std::array<oracle::Rational, D>> exact;
  std::map<HyperplaneId, oracle::Plane<D>> planes;
  if (in_rationals)
    for (const auto& vertex : cell.vertices()) exact.push_back(*model.vertex(vertex.hyperplanes));
  const auto side = [&](std::size_t vertex, HyperplaneId id) {
    if (!in_rationals) return splitter.side(cell.vertices()[vertex], id, model.table.rounded(id));
    const auto [entry, is_new] = planes.try_emplace(id);
    if (is_new) entry->second = model.plane(id);
    return entry->second.side(exact[vertex]);
  };
  if constexpr (D > 1) {
    for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
      const OrientedHyperplane plane = cell.facet_hyperplane(facet);
      const auto own = vertices_of(cell, D - 1, facet);
      for (std::size_t v = 0; v < cell.vertices().size(); ++v) {
        const int s = plane.flipped() ? -side(v, plane.id()) : side(v, plane.id());
        ASSERT_EQ(s, own.count(static_cast<std::uint16_t>(v)) != 0 ? 0 : -1)
            << "vertex " << v << " of facet " << facet;
      }
    }
    for (int k = 1; k + 1 < D; ++k)
      for (std::size_t face = 0; face < cell.face_count(k); ++face)
        for (const std::uint32_t id : cell.hyperplanes(k, face))
          for (const std::uint16_t v : vertices_of(cell, k, face)) ASSERT_EQ(side(v, id), 0);
  } else {
    ASSERT_EQ(cell.vertices().size(), 2U);
    ASSERT_NE(cell.vertices()[0].x[0], cell.vertices()[1].x[0]);
  }
  std::set<std::array<oracle::Rational, D>> points(exact.begin(), exact.end());
  ASSERT_EQ(points.size(), exact.size()) << "two vertices in one point";
}

/// A flattened cell is the same cell: its facets around it, its volume by the divergence theorem.
template <int D>
void check_batch(const Cell<D>& cell, const Model<D>& model, CellWriter<D>& writer) {
  CellBatch batch;
  const Moments<D> moments = writer.append(cell, batch);
  writer.append(cell, batch);
  ASSERT_EQ(batch.point_offset.size(), 3U);
  ASSERT_EQ(batch.point_count(1), cell.vertices().size());
  ASSERT_EQ(batch.facet_count(1), cell.facet_count());
  ASSERT_EQ(batch.volume[1], moments.volume());
  ASSERT_EQ(writer.measure(cell).integral, moments.integral);
  const auto points = batch.cell_points(1);
  for (std::size_t v = 0; v < cell.vertices().size(); ++v)
    for (int i = 0; i < D; ++i)
      ASSERT_EQ(points[v * D + static_cast<std::size_t>(i)], cell.vertices()[v].x[i]);
  const double slack = 1e-11 * model.table.radius();
  double divergence = 0;
  std::map<std::pair<std::uint16_t, std::uint16_t>, int> edges;
  for (std::uint32_t facet = batch.facet_offset[1]; facet < batch.facet_offset[2]; ++facet) {
    const auto own = batch.vertices_of_facet(facet);
    const std::int32_t code = batch.facet_hyperplane[facet];
    const auto h = model.table.rounded(static_cast<HyperplaneId>(code < 0 ? ~code : code));
    std::set<std::uint16_t> on(own.begin(), own.end());
    ASSERT_EQ(on.size(), own.size());
    if constexpr (D > 1) {
      ASSERT_EQ(on, vertices_of(cell, D - 1, facet - batch.facet_offset[1]));
    }
    for (std::size_t v = 0; v < cell.vertices().size(); ++v) {
      const double value = h.at(cell.vertices()[v].x);
      if (on.count(static_cast<std::uint16_t>(v)) != 0)
        ASSERT_LE(std::fabs(value), slack);
      else
        ASSERT_LE(code < 0 ? -value : value, slack);
    }
    if constexpr (D == 3) {
      const auto at = [&](std::size_t i) { return points.data() + 3 * std::size_t{own[i]}; };
      for (std::size_t i = 0; i < own.size(); ++i) ++edges[{own[i], own[(i + 1) % own.size()]}];
      const double* a = at(0);
      for (std::size_t i = 1; i + 1 < own.size(); ++i) {
        const double *b = at(i), *c = at(i + 1);
        divergence += (a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                       a[2] * (b[0] * c[1] - b[1] * c[0])) /
                      6;
      }
    }
  }
  if constexpr (D == 3) {
    const double unit = std::pow(model.table.radius(), 3);
    ASSERT_NEAR(divergence, moments.volume(), 1e-11 * unit);
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1);
      ASSERT_EQ(edges.count({edge.second, edge.first}), 1U) << "an edge that is used in one direction only";
    }
  }
}

template <int D>
struct Checks {
  bool rational;
  std::uint64_t splits = 0, cells = 0;
};

/// The faces of a half, one by one in their order, from those of the whole: what is kept, then what the
/// hyperplane's cuts of the faces one dimension up are. Written for any dimension, by names instead of
/// numbers.
template <int D>
class ExpectedHalf {
 public:
  ExpectedHalf(const Cell<D>& cell, HyperplaneId id, bool is_positive, Splitter<D>& splitter)
      : cell_(cell),
        id_(id),
        positive_(is_positive),
        other_(is_positive ? below : above),
        splitter_(splitter) {
    const auto rounded = splitter.table().rounded(id);
    for (const auto& vertex : cell.vertices()) {
      const int side = splitter.side(vertex, id, rounded);
      mask_[0].push_back(side < 0 ? below : side > 0 ? above : 0);
    }
    for (int k = 1; k < D; ++k)
      for (std::size_t face = 0; face < cell.face_count(k); ++face) {
        mask_[k].push_back(0);
        for (const std::uint16_t sub : cell.subfaces(k, face)) mask_[k].back() |= mask_[k - 1][sub];
      }
    for (int k = 0; k < D; ++k) {
      for (std::size_t face = 0; face < cell.face_count(k); ++face)
        if (mask_[k][face] != other_) kept_[k].emplace(face, count_[k]++);
      if (k + 1 == D) continue;
      for (std::size_t face = 0; face < cell.face_count(k + 1); ++face)
        if (mask_[k + 1][face] == both) common_[k].emplace(face, count_[k]++);
    }
    ++count_[D - 1];  // the facet that the halves have in common
  }

  void check(const Cell<D>& half) {
    for (int k = 0; k < D; ++k) ASSERT_EQ(half.face_count(k), count_[k]);
    for (const auto& [face, number] : kept_[0]) check_vertex(half.vertices()[number], cell_.vertices()[face]);
    for (const auto& [edge, number] : common_[0]) {
      std::array<HyperplaneId, D> ids;
      const auto own = cell_.hyperplanes(1, edge);
      for (int i = 0; i + 1 < D; ++i) ids[i] = D == 2 ? own[i] >> 1 : own[i];
      ids[D - 1] = id_;
      std::uint64_t exact = 0;
      check_vertex(half.vertices()[number], make_vertex<D>(splitter_.table(), ids, exact));
    }
    for (int k = 1; k < D; ++k) {
      for (const auto& [face, number] : kept_[k]) {
        const auto own = cell_.hyperplanes(k, face);
        check_face(half, k, number, kept_subfaces(k, face), {own.begin(), own.end()});
      }
      if (k + 1 == D) continue;
      for (const auto& [face, number] : common_[k]) {
        std::vector<std::uint32_t> ids;
        for (const std::uint32_t code : cell_.hyperplanes(k + 1, face))
          ids.push_back(k + 2 == D ? code >> 1 : code);
        ids.push_back(id_);
        const auto subfaces = cell_.subfaces(k + 1, face);
        check_face(half, k, number, common_subfaces(k, {subfaces.begin(), subfaces.end()}), ids);
      }
    }
    std::vector<std::uint16_t> facets;
    for (std::size_t facet = 0; facet < cell_.facet_count(); ++facet)
      facets.push_back(static_cast<std::uint16_t>(facet));
    check_face(half, D - 1, count_[D - 1] - 1, common_subfaces(D - 1, facets),
               {oriented(id_, positive_).code});
  }

 private:
  static constexpr std::uint8_t below = 1, above = 2, both = 3;
  using Numbers = std::map<std::size_t, std::size_t>;
  const Cell<D>& cell_;
  HyperplaneId id_;
  bool positive_;
  std::uint8_t other_;
  Splitter<D>& splitter_;
  std::array<std::vector<std::uint8_t>, D> mask_;
  std::array<Numbers, D> kept_, common_;  // common: by the (k+1)-face
  std::array<std::size_t, D> count_{};

  std::vector<std::uint16_t> kept_subfaces(int k, std::size_t face) {
    std::vector<std::size_t> all;
    for (const std::uint16_t sub : cell_.subfaces(k, face)) {
      if (mask_[k - 1][sub] != other_)
        all.push_back(kept_[k - 1].at(sub));
      else if (k == 1)
        all.push_back(common_[0].at(face));
    }
    if (k > 1 && mask_[k][face] == both) all.push_back(common_[k - 1].at(face));
    return {all.begin(), all.end()};
  }
  /// Of the k-face in which a (k+1)-face with these k-faces meets the hyperplane.
  std::vector<std::uint16_t> common_subfaces(int k, const std::vector<std::uint16_t>& subfaces) {
    std::vector<std::size_t> all;
    for (const std::uint16_t sub : subfaces) {
      if (mask_[k][sub] == both) all.push_back(common_[k - 1].at(sub));
      if (mask_[k][sub] != below) continue;
      for (const std::uint16_t ridge : cell_.subfaces(k, sub))
        if (mask_[k - 1][ridge] == 0) all.push_back(kept_[k - 1].at(ridge));
    }
    if (k == 1) std::sort(all.begin(), all.end());
    return {all.begin(), all.end()};
  }
  static void check_vertex(const Vertex<D>& vertex, const Vertex<D>& expected) {
    ASSERT_EQ(vertex.x, expected.x);
    ASSERT_EQ(vertex.error, expected.error);
    ASSERT_EQ(vertex.hyperplanes, expected.hyperplanes);
  }
  static void check_face(const Cell<D>& half, int k, std::size_t face,
                         const std::vector<std::uint16_t>& subfaces,
                         const std::vector<std::uint32_t>& hyperplanes) {
    const auto own = half.subfaces(k, face);
    ASSERT_EQ(std::vector<std::uint16_t>(own.begin(), own.end()), subfaces) << k << "-face " << face;
    const auto codes = half.hyperplanes(k, face);
    ASSERT_EQ(std::vector<std::uint32_t>(codes.begin(), codes.end()), hyperplanes) << k << "-face " << face;
  }
};

/// Splits all cells by all hyperplanes that cross them and checks every cell that appears.
template <int D>
void split_and_check(const Model<D>& model, const std::vector<HyperplaneId>& cuts, std::size_t most_cells,
                     Random& random, Checks<D>& checks) {
  Splitter<D> splitter(model.table);
  CellWriter<D> writer(model.table);
  std::vector<Cell<D>> cells;
  cells.push_back(root_cell(model.table));
  const Moments<D> whole = writer.measure(cells[0]);
  for (const HyperplaneId id : cuts) {
    std::vector<Cell<D>> next;
    for (Cell<D>& cell : cells) {
      const auto rounded = model.table.rounded(id);
      const Position where = splitter.classify(cell, id);
      ASSERT_EQ(splitter.position(cell, id, rounded), where);
      int seen = 0;
      for (const auto& vertex : cell.vertices()) {
        const int s = splitter.side(vertex, id, rounded);
        seen |= s < 0 ? 1 : s > 0 ? 2 : 0;
      }
      ASSERT_EQ(seen, where == Position::crossing ? 3 : where == Position::positive ? 2 : 1);
      if (where != Position::crossing) {
        next.push_back(std::move(cell));
        continue;
      }
      ++checks.splits;
      Cell<D> negative, positive, alone;
      splitter.split(cell, id, &negative, &positive);
      splitter.split(cell, id, nullptr, &alone);
      ASSERT_EQ(alone.bytes(), positive.bytes());
      if constexpr (D > 1) {
        ExpectedHalf<D>(cell, id, false, splitter).check(negative);
        ExpectedHalf<D>(cell, id, true, splitter).check(positive);
        ExpectedHalf<D>(cell, id, true, splitter).check(alone);
        if (testing::Test::HasFatalFailure()) return;
      }
      ASSERT_EQ(writer.measure(alone).integral, writer.measure(positive).integral);
      ASSERT_EQ(splitter.classify(negative, id), Position::negative);
      ASSERT_EQ(splitter.classify(positive, id), Position::positive);
      const Moments<D> sum = writer.measure(cell), a = writer.measure(negative), b = writer.measure(positive);
      for (int i = 0; i < Moments<D>::size; ++i)
        ASSERT_NEAR(a.integral[i] + b.integral[i], sum.integral[i],
                    1e-12 * std::max(std::fabs(whole.integral[i]),
                                     whole.volume() * std::pow(model.table.radius(), i == 0   ? 0
                                                                                     : i <= D ? 1
                                                                                              : 2)));
      if constexpr (D > 1) {  // the common facet, oriented outward for both
        const auto faces = [&](const Cell<D>& half, OrientedHyperplane code) {
          std::size_t count = 0;
          for (std::size_t f = 0; f < half.facet_count(); ++f) count += half.facet_hyperplane(f) == code;
          return count;
        };
        ASSERT_EQ(faces(negative, oriented(id)), 1U);
        ASSERT_EQ(faces(positive, oriented(id, true)), 1U);
      }
      for (Cell<D>* half : {&negative, &positive}) {
        ++checks.cells;
        check_lattice(*half);
        check_sides(*half, model, checks.rational);
        check_batch(half->copy(), model, writer);
        if (testing::Test::HasFatalFailure()) return;
        next.push_back(std::move(*half));
      }
    }
    if (next.size() > most_cells) {
      std::shuffle(next.begin(), next.end(), random);
      next.resize(most_cells);
    }
    cells = std::move(next);
  }
}

template <typename T>
class Split : public testing::Test {};
TYPED_TEST_SUITE(Split, samples::Dimensions);

template <int D>
std::vector<HyperplaneId> random_cuts(const Model<D>& model, Random& random, std::size_t count) {
  std::vector<HyperplaneId> cuts;
  for (HyperplaneId id = 0; id < model.table.size(); ++id) cuts.push_back(id);
  for (int i = 0; i < 2; ++i)
    cuts.push_back(model.table.axis_hyperplane(pick(random, 0, D - 1),
                                               static_cast<std::uint32_t>(pick(random, 1, (1 << 27) - 2))));
  std::shuffle(cuts.begin(), cuts.end(), random);
  if (cuts.size() > count) cuts.resize(count);
  return cuts;
}

TYPED_TEST(Split, YieldsPolytopesForRandomlyPlacedBoxes) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Checks<D> checks{false};
  const int rounds = samples::rounds(D <= 2 ? 60 : D == 3 ? 20 : D == 4 ? 12 : D == 5 ? 3 : 1);
  for (int round = 0; round < rounds; ++round) {
    checks.rational = D <= 3 && round % 4 == 0;
    std::array<double, D> lower, upper;
    lower.fill(-1);
    upper.fill(1);
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 3; ++k) {
      Matrix<D> m{};
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) m[i][j] = uniform(random, -1, 1);
        m[i][D] = uniform(random, -0.7, 0.7);
      }
      boxes.push_back({m, unit_box<D>().covectors});
    }
    const Model<D> model(lower, upper, 8 * D, boxes, round % 2 == 0 ? 0 : 1e-9);
    split_and_check(model,
                    random_cuts(model, random,
                                D <= 3   ? 8
                                : D == 4 ? 7
                                         : 6),
                    D <= 3   ? 30
                    : D == 4 ? 10
                             : 4,
                    random, checks);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(checks.splits, 0U);
}

TYPED_TEST(Split, YieldsPolytopesWhereHyperplanesMeetVerticesAndEdges) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  Checks<D> checks{false};
  const int rounds = samples::rounds(D <= 2 ? 80 : D == 3 ? 40 : D == 4 ? 12 : D == 5 ? 3 : 1);
  for (int round = 0; round < rounds; ++round) {
    checks.rational = D <= 3 && round % 4 == 0;
    std::array<double, D> lower, upper;
    lower.fill(-2);
    upper.fill(2);
    // Unimodular shears of the grid: normals with entries -1, 0, 1 through grid points, so that many of them
    // meet in one point, and boxes turned about a common corner by less than a double can tell.
    std::vector<typename Model<D>::Placed> boxes;
    for (int k = 0; k < 4; ++k) {
      Matrix<D> m = identity<D>();
      for (int i = 0; i < D; ++i) {
        for (int j = i + 1; j < D; ++j) m[i][j] = pick(random, -1, 1);
        m[i][D] = pick(random, -1, 0);
        if (pick(random, 0, 3) == 0) m[i][i] = -1;
      }
      if constexpr (D > 1)
        if (k == 3) m = product<D>(rotation<D>(0, 1, std::pow(10.0L, -pick(random, 8, 28))), m);
      boxes.push_back({m, unit_box<D>().covectors});
    }
    const Model<D> model(lower, upper, 8 * D, boxes, 0);
    split_and_check(model,
                    random_cuts(model, random,
                                D <= 3   ? 10
                                : D == 4 ? 8
                                         : 6),
                    D <= 3   ? 30
                    : D == 4 ? 10
                             : 4,
                    random, checks);
    if (testing::Test::HasFatalFailure()) return;
  }
  EXPECT_GT(checks.splits, 0U);
}

TYPED_TEST(Split, CutsAPlacedBoxOutOfTheRootCellWithTheMomentsOfTheFormula) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const int rounds = samples::rounds(D <= 3 ? 100 : D == 4 ? 20 : D == 5 ? 4 : 1);
  for (int round = 0; round < rounds; ++round) {
    Matrix<D> m{};
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) m[i][j] = uniform(random, -1, 1) + (i == j ? 1.5 : 0);
      m[i][D] = uniform(random, -1, 1);
    }
    std::array<double, D> lower, upper;
    lower.fill(-2.0 - D);
    upper.fill(3.0 + D);
    const Model<D> model(lower, upper, 8 * D, {{m, unit_box<D>().covectors}}, 0);
    Splitter<D> splitter(model.table);
    CellWriter<D> writer(model.table);
    Cell<D> cell = root_cell(model.table);
    for (const OrientedHyperplane plane : model.codes_of[0]) {
      if (splitter.classify(cell, plane.id()) != Position::crossing)
        continue;  // the box has been reached already
      Cell<D> half;
      splitter.split(cell, plane.id(), plane.flipped() ? nullptr : &half, plane.flipped() ? &half : nullptr);
      cell = std::move(half);
    }
    check_lattice(cell);
    ASSERT_EQ(cell.vertices().size(), std::size_t{1} << D);
    // x = A y + t over the unit box: E y = 1/2, E y_i y_j = 1/4, and 1/3 for i = j.
    std::array<std::array<long double, D>, D> a, lu;
    std::array<long double, D> t, mean;
    for (int i = 0; i < D; ++i) {
      for (int j = 0; j < D; ++j) a[i][j] = lu[i][j] = static_cast<long double>(m[i][j]);
      t[i] = mean[i] = static_cast<long double>(m[i][D]);
      for (int j = 0; j < D; ++j) mean[i] += a[i][j] / 2;
    }
    long double determinant = 1;
    for (int k = 0; k < D; ++k) {
      int pivot = k;
      for (int i = k + 1; i < D; ++i)
        if (std::fabs(lu[i][k]) > std::fabs(lu[pivot][k])) pivot = i;
      std::swap(lu[k], lu[pivot]);
      determinant *= lu[k][k];
      for (int i = k + 1; i < D; ++i)
        for (int j = D - 1; j >= k; --j) lu[i][j] -= lu[i][k] / lu[k][k] * lu[k][j];
    }
    const long double volume = std::fabs(determinant);
    const Moments<D> moments = writer.measure(cell);
    EXPECT_NEAR(moments.volume(), static_cast<double>(volume), 1e-12 * std::pow(2.5, D));
    for (int i = 0; i < D; ++i) {
      EXPECT_NEAR(moments.integral[Moments<D>::index(0, i + 1)], static_cast<double>(volume * mean[i]),
                  1e-11 * std::pow(2.5, D + 1));
      for (int j = i; j < D; ++j) {
        long double second = mean[i] * mean[j];
        for (int k = 0; k < D; ++k) second += a[i][k] * a[j][k] / 12;  // the variance of y_k
        EXPECT_NEAR(moments.integral[Moments<D>::index(i + 1, j + 1)], static_cast<double>(volume * second),
                    1e-11 * std::pow(2.5, D + 2));
      }
    }
  }
}

TYPED_TEST(Split, TakesCornersOfTheBoxAsSimplices) {
  constexpr int D = TypeParam::value;
  if constexpr (D > 1) {
    // x_1 + ... + x_D <= 1 as a facet of a sheared box: x -> the sheared frame has it as x_1' <= 1.
    Matrix<D> m = identity<D>();
    for (int j = 1; j < D; ++j) m[0][j] = -1;  // x_0 = y_0 - y_1 - ..., so y_0 = x_0 + x_1 + ...
    std::array<double, D> lower, upper;
    lower.fill(0);
    upper.fill(1);
    const Model<D> model(lower, upper, 2 * D,
                         {{identity<D>(), unit_box<D>().covectors}, {m, unit_box<D>().covectors}}, 0);
    Splitter<D> splitter(model.table);
    CellWriter<D> writer(model.table);
    Cell<D> cell = root_cell(model.table);
    std::vector<OrientedHyperplane> planes = model.codes_of[0];
    planes.push_back(model.codes_of[1][1]);
    for (const OrientedHyperplane plane : planes) {
      if (splitter.classify(cell, plane.id()) != Position::crossing) continue;
      Cell<D> half;
      splitter.split(cell, plane.id(), plane.flipped() ? nullptr : &half, plane.flipped() ? &half : nullptr);
      cell = std::move(half);
    }
    check_lattice(cell);
    ASSERT_EQ(cell.vertices().size(), static_cast<std::size_t>(D) + 1);
    const Moments<D> moments = writer.measure(cell);
    double factorial = 1;
    for (int k = 2; k <= D; ++k) factorial *= k;
    EXPECT_NEAR(moments.volume() * factorial, 1, 1e-13);
    EXPECT_NEAR(moments.integral[Moments<D>::index(0, 1)] * factorial * (D + 1), 1, 1e-13);
    EXPECT_NEAR(moments.integral[Moments<D>::index(1, 1)] * factorial * (D + 1) * (D + 2), 2, 1e-12);
    EXPECT_NEAR(moments.integral[Moments<D>::index(1, 2)] * factorial * (D + 1) * (D + 2), 1, 1e-12);
  }
}

TYPED_TEST(Split, RootCellHoldsTheBoundsWithAMargin) {
  constexpr int D = TypeParam::value;
  const std::uint64_t seed = new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const double size = std::pow(10.0, uniform(random, -15, 15)),
                 offset = size * std::pow(10.0, uniform(random, -3, 6));
    std::array<double, D> lower, upper;
    for (int i = 0; i < D; ++i) {
      lower[i] = pick(random, -1, 1) * offset + uniform(random, -size, size);
      upper[i] = lower[i] + (pick(random, 0, 3) == 0 ? 0 : uniform(random, 0, size));
    }
    const HyperplaneTable<D> table(lower, upper, 2 * (size + offset));
    const Cell<D> root = root_cell(table);
    if (D <= 3) check_lattice(root);
    for (const auto& vertex : root.vertices())
      for (int i = 0; i < D; ++i) {
        ASSERT_TRUE(vertex.x[i] < lower[i] || vertex.x[i] > upper[i]) << "axis " << i;
        ASSERT_LE(std::fabs(vertex.x[i]), table.radius());
      }
    for (int i = 0; i < D; ++i) {
      const double x = uniform(random, lower[i], upper[i]);
      const std::uint32_t position = table.axis_position(i, x);
      ASSERT_LE(table.axis_value(i, position), x);
      ASSERT_GT(table.axis_value(i, position + 1), x);
    }
  }
}

}  // namespace
}  // namespace bsp2::geometry
