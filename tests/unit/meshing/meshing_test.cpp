// Meshes for solvers, of random solids: what must hold of any, against the cells themselves.

#include <gtest/gtest.h>
#include <time.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/multiprecision/cpp_int.hpp>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numbers>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/complex/complex_share.hpp"
#include "bsp2/meshing/groups/groups.hpp"
#include "bsp2/meshing/simplices/orientation.hpp"
#include "bsp2/meshing/tetrahedra/dual.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"
#include "tetrahedra/face_checks.hpp"
#include "tetrahedra/pieces.hpp"

namespace bsp2::meshing {
namespace {

using dataflow::Kind;
using dataflow::Random;
using Rational = boost::multiprecision::cpp_rational;

dataflow::Resolved solid_of(const model::Expression& e, unsigned threads = 1, double coincidence = 1e-9) {
  dataflow::EvaluateOptions options;
  options.threads = threads;
  return dataflow::resolved(e, options, 0, coincidence);
}

/// By fractions, which round nothing.
int exact_sign(const Point& a, const Point& b, const Point& c, const Point& d) {
  std::array<std::array<Rational, 3>, 3> m;
  for (std::size_t k = 0; k < 3; ++k) {
    m[0][k] = Rational(b[k]) - Rational(a[k]);
    m[1][k] = Rational(c[k]) - Rational(a[k]);
    m[2][k] = Rational(d[k]) - Rational(a[k]);
  }
  Rational sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
  return sum.sign();
}

long double cone(const Point& eye, const Point& a, const Point& b, const Point& c) {
  std::array<std::array<long double, 3>, 3> m;
  for (std::size_t k = 0; k < 3; ++k) {
    m[0][k] = static_cast<long double>(a[k]) - eye[k];
    m[1][k] = static_cast<long double>(b[k]) - eye[k];
    m[2][k] = static_cast<long double>(c[k]) - eye[k];
  }
  long double sum = 0;
  for (std::size_t k = 0; k < 3; ++k)
    sum += m[0][k] * (m[1][(k + 1) % 3] * m[2][(k + 2) % 3] - m[1][(k + 2) % 3] * m[2][(k + 1) % 3]);
  return sum / 6;
}

double area(const Point& a, const Point& b, const Point& c) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    const double n = (b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l]);
    sum += n * n;
  }
  return std::sqrt(sum) / 2;
}

/// Above 0 if it is counter-clockwise seen from where the unit normal points to. @pre it is across the
/// normal.
double signed_area(const Point& a, const Point& b, const Point& c, const Point& normal) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    sum += normal[k] * ((b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l]));
  }
  return sum / 2;
}

/// Each cell is closed: its faces' edges pair, and it is a ball. Volume and surface are those of the solid.
void check_complex(const Complex& complex, const dataflow::Resolved& solid) {
  std::vector<std::map<std::pair<std::uint32_t, std::uint32_t>, int>> edges(complex.cells());
  std::vector<std::set<std::uint32_t>> corners(complex.cells());
  std::vector<int> faces(complex.cells(), 0);
  std::set<std::pair<std::int32_t, std::int32_t>> pairs;
  long double volume = 0;
  double outer_area = 0;
  for (std::size_t face = 0; face < complex.faces(); ++face) {
    const auto cycle = complex.points_of(face);
    ASSERT_GE(cycle.size(), 3U);
    ASSERT_EQ(std::set(cycle.begin(), cycle.end()).size(), cycle.size());
    const std::int32_t owner = complex.owner[face], neighbour = complex.neighbour[face];
    ASSERT_TRUE(neighbour == Complex::outside || neighbour > owner);
    if (neighbour != Complex::outside) {
      ASSERT_TRUE(pairs.emplace(owner, neighbour).second) << "two cells meet in two faces";
    }
    for (const std::int32_t cell : {owner, neighbour}) {
      if (cell == Complex::outside) continue;
      ++faces[static_cast<std::size_t>(cell)];
      for (std::size_t k = 0; k < cycle.size(); ++k) {
        std::uint32_t from = cycle[k], to = cycle[(k + 1) % cycle.size()];
        ASSERT_NE(from, to);
        if (cell != owner) std::swap(from, to);
        corners[static_cast<std::size_t>(cell)].insert(from);
        ++edges[static_cast<std::size_t>(cell)][{from, to}];
      }
    }
    for (std::size_t k = 1; k + 1 < cycle.size(); ++k) {
      const Point &a = complex.points[cycle[0]], &b = complex.points[cycle[k]],
                  &c = complex.points[cycle[k + 1]];
      if (neighbour == Complex::outside) {
        volume += cone(complex.points[0], a, b, c);
        outer_area += area(a, b, c);
      }
    }
  }
  for (std::size_t cell = 0; cell < complex.cells(); ++cell) {
    for (const auto& [edge, count] : edges[cell]) {
      ASSERT_EQ(count, 1) << "an edge is used twice in one direction";
      ASSERT_EQ(edges[cell].count({edge.second, edge.first}), 1U) << "a cell is not closed";
    }
    ASSERT_EQ(static_cast<int>(corners[cell].size()) - static_cast<int>(edges[cell].size() / 2) + faces[cell],
              2);
  }
  EXPECT_NEAR(static_cast<double>(volume), solid.volume, 1e-9 * (1 + solid.volume));
  EXPECT_NEAR(outer_area, solid.surface.area(), 1e-9 * (1 + outer_area));
}

/// Right side out, each face once or twice, and what is once is what the triangles say.
void check_tetrahedra(const Tetrahedra& mesh, double volume, double tolerance) {
  std::map<std::array<std::uint32_t, 3>, std::vector<std::int32_t>> faces;
  long double sum = 0;
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const auto& t = mesh.tetrahedra[i];
    const Point &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]],
                &d = mesh.points[t[3]];
    ASSERT_EQ(exact_sign(a, b, c, d), 1);
    sum += cone(a, b, c, d);
    for (int k = 0; k < 4; ++k) {
      std::array<std::uint32_t, 3> face{t[(k + 1) % 4], t[(k + 2) % 4], t[(k + 3) % 4]};
      std::sort(face.begin(), face.end());
      faces[face].push_back(mesh.part[i]);
    }
  }
  EXPECT_NEAR(static_cast<double>(sum), volume, tolerance);
  std::map<std::array<std::uint32_t, 3>, int> triangles;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    auto face = mesh.triangles[i];
    std::sort(face.begin(), face.end());
    ASSERT_EQ(++triangles[face], 1);
    const PlaneSide& side = mesh.sides[mesh.side[i]];
    const auto& parts = faces.at(face);
    if (side.other == PlaneSide::nothing) {
      ASSERT_EQ(parts, std::vector{side.part});
    } else {
      ASSERT_EQ(parts.size(), 2U);
      ASSERT_EQ(std::minmax(parts[0], parts[1]), std::minmax(side.part, side.other));
    }
  }
  for (const auto& [face, parts] : faces) {
    ASSERT_LE(parts.size(), 2U);
    ASSERT_EQ(triangles.count(face) == 1, parts.size() == 1 || parts[0] != parts[1]);
  }
}

/// Each cell is closed. Cells of one part meet in faces of no triangle, all others in those of one; volumes
/// of parts and areas of sides are those of the tetrahedra.
void check_dual(const Tetrahedra& mesh) {
  std::vector<std::int32_t> group;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) group.push_back(static_cast<std::int32_t>(i % 3));
  const Dual dual = dual_of(mesh, group);
  const Complex& complex = dual.complex;
  ASSERT_GE(complex.cells(), mesh.points.size());
  std::vector<std::map<std::pair<std::uint32_t, std::uint32_t>, int>> edges(complex.cells());
  std::map<std::int32_t, long double> volume, volume_of_tetrahedra;
  std::map<std::pair<std::uint32_t, std::int32_t>, double> areas, areas_of_triangles;  // by side and group
  std::pair<std::int32_t, std::int32_t> last{-1, -1};
  for (std::size_t face = 0; face < complex.faces(); ++face) {
    const auto cycle = complex.points_of(face);
    ASSERT_GE(cycle.size(), 3U);
    ASSERT_EQ(std::set(cycle.begin(), cycle.end()).size(), cycle.size());
    const std::int32_t owner = complex.owner[face], neighbour = complex.neighbour[face];
    ASSERT_TRUE(neighbour == Complex::outside || neighbour > owner);
    ASSERT_LE(last.first, owner) << "in the order of owners";
    last = {owner, neighbour};
    const std::uint32_t triangle = dual.triangle_of_face[face];
    const std::int32_t part = complex.part[static_cast<std::size_t>(owner)];
    if (triangle == Dual::no_triangle) {
      ASSERT_NE(neighbour, Complex::outside);
      ASSERT_EQ(part, complex.part[static_cast<std::size_t>(neighbour)]);
    } else {
      const PlaneSide& side = mesh.sides[mesh.side[triangle]];
      const std::int32_t other = neighbour == Complex::outside
                                     ? PlaneSide::nothing
                                     : complex.part[static_cast<std::size_t>(neighbour)];
      ASSERT_EQ(std::minmax(part, other), std::minmax(side.part, side.other));
    }
    for (std::size_t k = 0; k < cycle.size(); ++k) {
      const std::uint32_t from = cycle[k], to = cycle[(k + 1) % cycle.size()];
      ASSERT_NE(from, to);
      ++edges[static_cast<std::size_t>(owner)][{from, to}];
      if (neighbour != Complex::outside) ++edges[static_cast<std::size_t>(neighbour)][{to, from}];
    }
    for (std::size_t k = 1; k + 1 < cycle.size(); ++k) {
      const Point &a = complex.points[cycle[0]], &b = complex.points[cycle[k]],
                  &c = complex.points[cycle[k + 1]];
      const long double six = cone(complex.points[0], a, b, c);
      volume[part] += six;
      if (neighbour != Complex::outside) volume[complex.part[static_cast<std::size_t>(neighbour)]] -= six;
      if (triangle != Dual::no_triangle)
        areas[{mesh.side[triangle], group[triangle]}] += signed_area(a, b, c, complex.outward[face]);
    }
  }
  for (const auto& edges_of_cell : edges)
    for (const auto& [edge, count] : edges_of_cell) {
      const auto back = edges_of_cell.find({edge.second, edge.first});
      ASSERT_TRUE(back != edges_of_cell.end() && back->second == count) << "a cell is not closed";
    }
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const auto& [a, b, c, d] = mesh.tetrahedra[i];
    volume_of_tetrahedra[mesh.part[i]] +=
        cone(mesh.points[a], mesh.points[b], mesh.points[c], mesh.points[d]);
  }
  for (const auto& [part, content] : volume_of_tetrahedra)
    EXPECT_NEAR(static_cast<double>(volume[part] - content), 0, 1e-9 * (1 + static_cast<double>(content)));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    areas_of_triangles[{mesh.side[i], group[i]}] += area(mesh.points[a], mesh.points[b], mesh.points[c]);
  }
  for (const auto& [name, size] : areas_of_triangles) EXPECT_NEAR(areas[name], size, 1e-9 * (1 + size));
}

class RandomMeshes : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Of, RandomMeshes, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& parameter) {
                           return parameter.param == Kind::grid_boxes ? "Boxes" : "Solids";
                         });

/// A solid of one or two parts.
model::Expression random_solid(Random& random, Kind kind) {
  const auto one = dataflow::random_expression(random, 3, kind, 2);
  if (dataflow::chance(random, 0.5)) return one;
  return model::unite(
      {model::part("a", one), model::part("b", dataflow::random_expression(random, 3, kind, 1))});
}

TEST_P(RandomMeshes, CellsMeetFaceToFace) {
  for (int round = 0; round < samples::rounds(50); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = solid_of(random_solid(random, GetParam()), 1, round % 5 == 0 ? 0 : 1e-9);
    check_complex(conforming_complex(solid.network.table, solid.batches), solid);
    if (testing::Test::HasFailure()) return;
  }
}

void expect_equal(const Complex& a, const Complex& b) {
  EXPECT_EQ(a.points, b.points);
  EXPECT_EQ(a.face_offset, b.face_offset);
  EXPECT_EQ(a.face_points, b.face_points);
  EXPECT_EQ(a.owner, b.owner);
  EXPECT_EQ(a.neighbour, b.neighbour);
  EXPECT_EQ(a.plane, b.plane);
  EXPECT_EQ(a.outward, b.outward);
  EXPECT_EQ(a.part, b.part);
}

TEST_P(RandomMeshes, ComplexIsTheSameForAnyThreads) {
  for (int round = 0; round < samples::rounds(10); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_solid(random, GetParam());
    const auto one = solid_of(e), three = solid_of(e, 3);
    const Complex a = conforming_complex(one.network.table, one.batches);
    const Complex b = conforming_complex(three.network.table, three.batches, 3);
    expect_equal(a, b);
    if (testing::Test::HasFailure()) return;
  }
}

/// Shares by themselves, each with what the others tell it.
Complex shared_complex(const geometry::HyperplaneTable<3>& table, const std::vector<dataflow::Batches>& cells,
                       unsigned threads) {
  const auto count = static_cast<unsigned>(cells.size());
  std::vector<std::unique_ptr<ComplexShare>> shares;
  std::vector<ComplexShare::Beginning> beginnings;
  for (unsigned i = 0; i < count; ++i) {
    shares.push_back(std::make_unique<ComplexShare>(table, cells[i], i, count, threads));
    beginnings.push_back(shares[i]->beginning());
  }
  std::vector<std::vector<geometry::CertainBox>> boxes;
  for (const auto& share : shares) boxes.push_back(share->boxes(beginnings));
  for (const bool is_first : {true, false}) {
    std::vector<std::vector<NeighbourCells>> given;
    for (const auto& share : shares) given.push_back(share->neighbours(boxes));
    for (unsigned from = 0; from < count; ++from)
      for (unsigned to = 0; to < count; ++to) shares[to]->take_neighbours(std::move(given[from][to]));
    if (!is_first) break;
    for (unsigned i = 0; i < count; ++i) boxes[i] = shares[i]->boxes_of_neighbours();
  }
  std::vector<ComplexPiece> pieces;
  for (const auto& share : shares) pieces.push_back(share->piece());
  return joined(table, pieces);
}

/// Cells by cells, or by where they are.
std::vector<dataflow::Batches> dealt_out(const dataflow::Batches& batches, Random& random, unsigned count) {
  std::vector<std::shared_ptr<geometry::CellBatch>> shares(count);
  for (auto& share : shares) share = std::make_shared<geometry::CellBatch>();
  const bool is_by_place = dataflow::chance(random, 0.6);
  const Point direction{dataflow::uniform(random, -1, 1), dataflow::uniform(random, -1, 1),
                        dataflow::uniform(random, -1, 1)};
  const auto along = [&](const geometry::CellBatch& batch, std::size_t cell) {
    double sum = 0;
    const auto points = batch.cell_points(cell);
    for (std::size_t i = 0; i < points.size(); ++i) sum += direction[i % 3] * points[i];
    return sum / static_cast<double>(points.size());
  };
  std::vector<double> places;
  for (const auto& batch : batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) places.push_back(along(*batch, cell));
  std::sort(places.begin(), places.end());
  for (const auto& batch : batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      const auto place = std::lower_bound(places.begin(), places.end(), along(*batch, cell)) - places.begin();
      const std::size_t share =
          is_by_place ? static_cast<std::size_t>(place) * count / places.size()
                      : static_cast<std::size_t>(dataflow::pick(random, 0, static_cast<int>(count) - 1));
      shares[share]->append(*batch, cell, 1);
    }
  std::vector<dataflow::Batches> result(count);
  for (unsigned i = 0; i < count; ++i) result[i].push_back(shares[i]);
  return result;
}

TEST_P(RandomMeshes, ComplexIsTheSameHoweverCellsAreDealtOut) {
  for (int round = 0; round < samples::rounds(30); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = solid_of(random_solid(random, GetParam()), 1, round % 5 == 0 ? 0 : 1e-9);
    const auto count = static_cast<unsigned>(dataflow::pick(random, 2, 7));
    const auto cells = dealt_out(solid.batches, random, count);
    expect_equal(conforming_complex(solid.network.table, solid.batches),
                 shared_complex(solid.network.table, cells, 1 + static_cast<unsigned>(round) % 2));
    if (testing::Test::HasFailure()) return;
  }
}

/// Nobody goes on with work that is lost.
TEST(Pieces, WhereOneFailsTheOthersEnd) {
  for (int round = 0; round < samples::rounds(5); ++round) {
    constexpr std::size_t count = 3;
    std::vector<Piece> pieces(count);
    for (std::size_t i = 0; i < count; ++i) pieces[i].moved = {static_cast<double>(i)};
    const auto failing = static_cast<double>(static_cast<std::size_t>(round) % count);
    std::atomic<unsigned> working{0}, ended{0};
    const auto work = [&](const Piece& piece) -> Piece {
      ++working;
      while (working < count) std::this_thread::yield();
      if (piece.moved[0] == failing) throw std::runtime_error("this one");
      try {
        // Longer than any test takes.
        for (int i = 0; i < 600'000; ++i) {
          geometry::Interruption::check();
          std::this_thread::sleep_for(std::chrono::milliseconds(1));
        }
      } catch (const geometry::Interrupted&) {
        ++ended;
        throw;
      }
      return {};
    };
    try {
      replace_all(pieces, count, work);
      FAIL() << "nothing is passed on";
    } catch (const std::runtime_error& error) {
      EXPECT_STREQ(error.what(), "this one");
    }
    EXPECT_EQ(ended, count - 1);
  }
}

/// So many facets that threads share them.
TEST(ConformingComplex, ThreadsMakeTheSameOfManyFacets) {
  for (int round = 0; round < samples::rounds(2); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> bars;
    for (int i = 0; i < 60; ++i)
      bars.push_back(
          model::transform(dataflow::free_matrix(random, 3, 4), model::cuboid({8, 0.5, 0.5}, true)));
    const auto solid = solid_of(model::unite(bars));
    const Complex one = conforming_complex(solid.network.table, solid.batches);
    ASSERT_GT(one.faces(), 2048U);
    check_complex(one, solid);
    for (const unsigned threads : {2U, 5U})
      expect_equal(one, conforming_complex(solid.network.table, solid.batches, threads));
    const auto cells = dealt_out(solid.batches, random, 3);
    expect_equal(one, shared_complex(solid.network.table, cells, 2));
    if (testing::Test::HasFailure()) return;
  }
}

TEST_P(RandomMeshes, TetrahedraAreValid) {
  for (int round = 0; round < samples::rounds(6); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto solid = solid_of(random_solid(random, GetParam()));
    const Complex complex = conforming_complex(solid.network.table, solid.batches);
    if (complex.cells() == 0) continue;
    Tetrahedra mesh = tetrahedra_of(complex);
    const double area = solid.surface.area();
    ShapeOptions options;
    options.clean = 1e-6;
    options.size = round % 3 == 0 ? 0 : dataflow::uniform(random, 0.8, 2);
    const ShapeReport report = shape(mesh, options);
    EXPECT_EQ(report.turned, 0U);
    EXPECT_LE(report.largest_move, options.clean);
    check_tetrahedra(mesh, solid.volume, 1e-9 * (1 + solid.volume) + report.largest_move * area);
    EXPECT_EQ(quality_of(mesh).turned, 0U);
    check_dual(mesh);
    if (testing::Test::HasFailure()) return;
  }
}

/// What parts share fits together again, however they touch, and whoever shaped them.
TEST_P(RandomMeshes, PartsMayBeShapedByThemselves) {
  for (int round = 0; round < samples::rounds(3); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> parts;
    for (const char* name : {"a", "b", "c"})
      parts.push_back(model::part(name, dataflow::random_expression(random, 3, GetParam(), 1)));
    const auto solid = solid_of(model::unite(parts));
    const Complex complex = conforming_complex(solid.network.table, solid.batches);
    if (complex.cells() == 0) continue;
    ShapeOptions options{.clean = 1e-6, .size = dataflow::uniform(random, 0.8, 2), .by_parts_from = 0};
    Tetrahedra mesh = tetrahedra_of(complex), same = mesh;
    const ShapeReport report = shape(mesh, options);
    EXPECT_EQ(report.turned, 0U);
    check_tetrahedra(mesh, solid.volume,
                     1e-9 * (1 + solid.volume) + report.largest_move * solid.surface.area());
    options.threads = 3;
    shape(same, options);
    EXPECT_EQ(mesh.points, same.points);
    EXPECT_EQ(mesh.tetrahedra, same.tetrahedra);
    EXPECT_EQ(mesh.triangles, same.triangles);
    if (testing::Test::HasFailure()) return;
  }
}

/// A cell about a point of an edge that leads inwards would have faces that are turned: it is divided.
TEST(Dual, HasNoFacesThatSolversRefuseWhereEdgesLeadInwards) {
  int divided = 0;
  std::size_t wrong = 0;
  for (int round = 0; round < samples::all_rounds(12); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto length = [&] { return dataflow::uniform(random, 0.5, 2); };
    const auto solid = solid_of(dataflow::l_shape(length(), length(), length()));
    Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
    ShapeOptions options;
    options.size = dataflow::uniform(random, 0.3, 1.5);
    shape(mesh, options);
    check_dual(mesh);
    const Dual dual = dual_of(mesh, std::vector<std::int32_t>(mesh.triangles.size()));
    EXPECT_EQ(dual.wrong_faces, wrong_faces(dual.complex).size());
    wrong += dual.wrong_faces;
    divided += dual.complex.cells() > mesh.points.size();
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(divided, 0);
  EXPECT_EQ(wrong, 0U);
}

/// A thin box, many times turned by next to nothing: cells and gaps as thin as corners are rounded.
TEST(Shape, LayersThinnerThanRoundingAreMended) {
  std::uint64_t turned = 0;
  int refused = 0;
  for (int round = 0; round < samples::rounds(6); ++round) {
    const std::uint64_t seed = dataflow::new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    std::vector<model::Expression> boxes;
    for (int i = 0; i < 4; ++i) {
      const double a = 0.3 + dataflow::pick(random, -2, 2) * std::ldexp(1, -dataflow::pick(random, 44, 50));
      const double shift = dataflow::pick(random, -2, 2) * std::ldexp(1, -dataflow::pick(random, 44, 50));
      const std::vector<double> turn{std::cos(a), -std::sin(a),
                                     0,           7 + shift,
                                     std::sin(a), std::cos(a),
                                     0,           5,
                                     0,           0,
                                     1,           shift,
                                     0,           0,
                                     0,           1};
      boxes.push_back(model::transform(turn, model::cuboid({2, 1, 1 + shift}, true)));
    }
    const auto solid = solid_of(model::unite(boxes), 1, 0);
    const Complex complex = conforming_complex(solid.network.table, solid.batches);
    if (complex.cells() == 0) continue;
    Tetrahedra mesh = tetrahedra_of(complex);
    const double area = solid.surface.area();
    const ShapeReport report = shape(mesh, {.clean = 1e-6, .size = round % 5 == 4 ? 1.0 : 0.0});
    turned += report.turned_at_first;
    if (report.turned > 0) {  // it is told: hardly ever, of one in some hundreds
      ++refused;
      continue;
    }
    EXPECT_LE(report.largest_move, 1e-6);
    check_tetrahedra(mesh, solid.volume, 1e-9 * (1 + solid.volume) + report.largest_move * area);
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(turned, 0U);
  EXPECT_LE(refused, 1);
}

TEST(Orientation, IsThatOfFractions) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  int flat = 0;
  for (int round = 0; round < samples::rounds(2000); ++round) {
    std::array<Point, 4> p;
    for (Point& point : p)
      for (double& x : point)
        x = dataflow::uniform(random, -1, 1) * std::ldexp(1, dataflow::pick(random, -30, 3));
    if (round % 2 == 0) {  // nearly or truly flat
      for (std::size_t k = 0; k < 3; ++k) {
        p[3][k] = p[0][k] + (p[1][k] - p[0][k]) / 2 + (p[2][k] - p[0][k]) / 4;
        if (round % 4 == 0) p[0][k] = p[1][k] = p[2][k] = 0.125 * dataflow::pick(random, -4, 4);
      }
    }
    const int sign = exact_sign(p[0], p[1], p[2], p[3]);
    flat += sign == 0 ? 1 : 0;
    ASSERT_EQ(orientation(p[0], p[1], p[2], p[3]), sign);
    ASSERT_EQ(orientation(p[1], p[0], p[2], p[3]), -sign);
  }
  EXPECT_GT(flat, 0);
}

TEST(Shape, ABlockOfOneSizeIsGood) {
  const std::vector<double> middle{1, 0, 0, 5, 0, 1, 0, 3, 0, 0, 1, -1, 0, 0, 0, 1};
  const auto hole = model::transform(middle, model::cylinder(4, 1, 1, 16, false));
  const auto solid = solid_of(model::subtract({model::cuboid({10, 6, 2}, false), hole}));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  shape(mesh, {.clean = 1e-6, .size = 1});
  check_tetrahedra(mesh, solid.volume, 1e-9 * solid.volume);
  const Quality quality = quality_of(mesh);
  EXPECT_GT(quality.smallest_angle, 8);
  EXPECT_EQ(quality.tetrahedra_below[2], 0U);
  EXPECT_GT(quality.mean_aspect, 0.5);
}

/// The side of a cylinder of facets becomes round: nearly all points come to where they belong.
TEST(Shape, PointsGoToTheirTruePlace) {
  const auto solid = solid_of(model::cylinder(2, 1, 1, 12, false));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  ShapeOptions options{.clean = 1e-6, .size = 0.2};
  options.true_place = [&](std::span<const std::uint32_t>, const Point& p) -> std::optional<Point> {
    const double r = std::hypot(p[0], p[1]);
    if (r < 0.9) return std::nullopt;  // within the lids
    return Point{p[0] / r, p[1] / r, p[2]};
  };
  const ShapeReport report = shape(mesh, options);
  EXPECT_GT(report.placed, 0U);
  EXPECT_LE(report.largest_placing, 1 - std::cos(std::numbers::pi / 12) + 1e-12);
  check_tetrahedra(mesh, std::numbers::pi * 2, 0.1);
  double volume = 0;
  for (const double content : volumes_of(mesh, 0)) volume += content;
  EXPECT_GT(volume, solid.volume * 1.02) << "rounder than the facets";
  std::size_t on_side = 0, there = 0;
  for (const Point& p : mesh.points) {
    const double r = std::hypot(p[0], p[1]);
    if (r < 0.97) continue;
    ++on_side;
    there += std::fabs(r - 1) < 1e-12 ? 1 : 0;
  }
  EXPECT_GT(there, on_side * 95 / 100);
}

/// Runs a phase that is asked to end at the n-th question. @return how often it asked, or 0 if it did end.
template <typename Phase>
std::uint64_t questions(std::uint64_t n, const Phase& phase) {
  std::uint64_t asked = 0;
  const geometry::Interruption stop([&] { return ++asked == n; }, std::chrono::milliseconds(0));
  try {
    phase();
  } catch (const geometry::Interrupted&) {
    EXPECT_EQ(asked, n);
    return 0;
  }
  return asked;
}

/// Each phase asks for each thing that it goes through, and ends at whichever question it is told to.
TEST(Interruption, EndsEachPhase) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const auto place = model::cuboid({2, 2, 2}, true);  // so that it is not empty
  const auto solid = solid_of(model::unite({place, random_solid(random, Kind::solids)}));
  const Complex complex = conforming_complex(solid.network.table, solid.batches);
  const Tetrahedra mesh = tetrahedra_of(complex);
  const auto check = [&](const char* name, std::size_t things, const auto& phase) {
    SCOPED_TRACE(name);
    const std::uint64_t all = questions(0, phase);
    EXPECT_GE(all, things);
    ASSERT_GT(all, 0U);
    EXPECT_EQ(questions(1 + random() % all, phase), 0U);
  };
  check("complex", complex.faces(), [&] { (void)conforming_complex(solid.network.table, solid.batches); });
  check("cones", complex.faces() + complex.cells(), [&] { (void)tetrahedra_of(complex); });
  check("quality", mesh.tetrahedra.size(), [&] { (void)quality_of(mesh); });
  for (const double size : {0.0, 1.0})
    check("shape", mesh.tetrahedra.size(), [&] {
      Tetrahedra copy = mesh;
      (void)shape(copy, {.clean = 1e-6, .size = size});
    });
  check("cells", 2 * mesh.tetrahedra.size(), [&] {
    std::vector<std::uint32_t> triangles;
    (void)complex_of(mesh, triangles);
  });
}

double own_seconds() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// No long work goes on without a question: by time of this thread, which does not pass while others work.
TEST(Interruption, IsAskedForAllTheTime) {
  const auto solid =
      solid_of(model::subtract({model::cuboid({10, 6, 2}, false), model::cylinder(9, 3, 3, 24, false)}));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  const double begin = own_seconds();
  double last = begin, longest = 0;
  const auto note = [&] {
    const double now = own_seconds();
    longest = std::max(longest, now - last);
    last = now;
    return false;
  };
  const geometry::Interruption stop(note, std::chrono::milliseconds(0));
  shape(mesh, {.clean = 1e-6, .size = 0.5});
  note();
  EXPECT_LT(longest, (last - begin) / 4);
}

TEST(SizeField, IsThatOfTheNearestPoint) {
  const std::uint64_t seed = dataflow::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  EXPECT_EQ(SizeField().at({1, 2, 3}), std::numeric_limits<double>::infinity());
  for (int round = 0; round < samples::rounds(50); ++round) {
    std::vector<SizeField::Entry> entries;
    const auto place = [&]() -> Point {  // on a grid, so that several are as near, or the same
      return {1.0 * dataflow::pick(random, -3, 3), 1.0 * dataflow::pick(random, -3, 3),
              0.5 * dataflow::pick(random, -3, 3)};
    };
    for (int i = dataflow::pick(random, 1, 60); i > 0; --i)
      entries.push_back({place(), 0.125 * dataflow::pick(random, 1, 9)});
    const SizeField field(entries);
    for (int i = 0; i < 20; ++i) {
      const Point at = place();
      std::pair<double, double> nearest{1e300, 0};
      for (const auto& [p, size] : entries) {
        double squared = 0;
        for (std::size_t k = 0; k < 3; ++k) squared += (p[k] - at[k]) * (p[k] - at[k]);
        nearest = std::min(nearest, {squared, size});
      }
      ASSERT_EQ(field.at(at), nearest.second);
    }
  }
}

TEST(Shape, EdgesAreAsLongAsTheFieldSays) {
  const auto solid = solid_of(model::cuboid({8, 2, 2}, false));
  Tetrahedra mesh = tetrahedra_of(conforming_complex(solid.network.table, solid.batches));
  const SizeField field({{{0, 1, 1}, 0.4}, {{8, 1, 1}, 1.0}});
  shape(mesh, {.clean = 1e-6, .size = 1, .field = field});
  check_tetrahedra(mesh, solid.volume, 1e-9 * solid.volume);
  std::array<double, 2> sum{};
  std::array<int, 2> count{};
  for (const auto& t : mesh.tetrahedra) {
    const Point &a = mesh.points[t[0]], &b = mesh.points[t[1]];
    if (std::fabs(a[0] - 4) < 2.5) continue;  // in between, where sizes go over
    sum[a[0] > 4] += std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    ++count[a[0] > 4];
  }
  EXPECT_NEAR(sum[0] / count[0], 0.4, 0.15);
  EXPECT_NEAR(sum[1] / count[1], 1.0, 0.35);
}

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
  const Quality quality = quality_of(mesh);
  EXPECT_EQ(quality.smallest_aspect, 0);
  EXPECT_EQ(quality.turned, 1U);
  EXPECT_NEAR(quality.mean_aspect, std::sqrt(3.0) / (3 + std::sqrt(3.0)), 1e-12);
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
