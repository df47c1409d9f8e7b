// Meshes for solvers, of random solids: what must hold of any, against the cells themselves.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/complex/complex_share.hpp"
#include "bsp2/meshing/tetrahedra/dual.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "meshing/mesh_checks.hpp"
#include "shaping/pieces.hpp"
#include "support/rounds.hpp"

namespace bsp2::meshing {
namespace {

class RandomMeshes : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Of, RandomMeshes, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& parameter) {
                           return parameter.param == Kind::grid_boxes ? "Boxes" : "Solids";
                         });

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
    for (std::size_t i = 0; i < count; ++i) pieces[i].mesh.points = {{static_cast<double>(i), 0, 0}};
    const auto failing = static_cast<double>(static_cast<std::size_t>(round) % count);
    std::atomic<unsigned> working{0}, ended{0};
    const auto work = [&](const Piece& piece) -> Piece {
      ++working;
      while (working < count) std::this_thread::yield();
      if (piece.mesh.points[0][0] == failing) throw std::runtime_error("this one");
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
    EXPECT_LE(report.largest_move, 1.02 * options.clean);
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

}  // namespace
}  // namespace bsp2::meshing
