// The boundary and the contacts of random solids: what must hold of any, against the cells themselves.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "bsp2/geometry/boundary.hpp"
#include "bsp2/geometry/contact.hpp"
#include "dataflow_oracle.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::CellBatch;
using geometry::Contact;
using geometry::FacetIndex;
using geometry::FacetMatcher;
using geometry::FacetSet;
using geometry::Skin;
using geometry::TriangleSurface;

using Batches = std::vector<std::shared_ptr<const CellBatch>>;

struct Resolved {
  Network<3> network;
  Batches batches;
  std::vector<Contact> contacts;
  TriangleSurface surface;
  double volume = 0;
};

Resolved resolve(const model::Expression& e, unsigned depth = 0, unsigned threads = 1, double coincidence = 1e-9) {
  Resolved result{compile<3>(e, {.coincidence = coincidence}), {}, {}, {}, 0};
  EvaluateOptions options;
  options.threads = threads;
  const auto evaluated = evaluate_all(result.network, depth, options);
  for (const auto& refinement : evaluated.refinements) result.batches.emplace_back(refinement, &refinement->cells);
  result.volume = evaluated.evaluation.totals.in.value().volume();
  FacetIndex index(result.network.table, result.batches);
  FacetMatcher matcher(result.network.table);
  FacetSet facets;
  Skin skin;
  for (std::size_t i = 0; i < index.size(); ++i) {
    facets.clear(index.hyperplane(i));
    index.append(i, facets);
    matcher.match(facets, &result.contacts, &skin);
  }
  result.surface = triangulate(result.network.table, std::move(skin));
  return result;
}

double polygon_area(const CellBatch& batch, std::size_t cell, std::size_t facet) {
  const auto p = batch.cell_points(cell);
  const auto loop = batch.vertices_of_facet(facet);
  std::array<double, 3> sum{};
  for (std::size_t i = 1; i + 1 < loop.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      const auto at = [&](std::size_t corner, std::size_t axis) { return p[3 * loop[corner] + axis] - p[3 * loop[0] + axis]; };
      sum[k] += at(i, l) * at(i + 1, m) - at(i, m) * at(i + 1, l);
    }
  return std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]) / 2;
}

/// No contact twice, each on one facet of both cells, and none larger than it.
void check_contacts(const Resolved& r) {
  std::vector<std::pair<const CellBatch*, std::size_t>> cells;
  for (const auto& batch : r.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) cells.emplace_back(batch.get(), cell);
  std::map<std::pair<std::uint64_t, std::uint16_t>, double> left;  // of each facet
  double facets = 0, touching = 0;
  for (std::uint64_t i = 0; i < cells.size(); ++i) {
    const auto& [batch, cell] = cells[i];
    for (std::uint32_t facet = batch->facet_offset[cell]; facet < batch->facet_offset[cell + 1]; ++facet)
      facets += left[{i, static_cast<std::uint16_t>(facet - batch->facet_offset[cell])}] = polygon_area(*batch, cell, facet);
  }
  std::set<std::pair<std::uint64_t, std::uint64_t>> pairs;
  for (const Contact& contact : r.contacts) {
    ASSERT_NE(contact.cell[0], contact.cell[1]);
    ASSERT_TRUE(pairs.emplace(std::min(contact.cell[0], contact.cell[1]), std::max(contact.cell[0], contact.cell[1])).second);
    ASSERT_GE(contact.area, 0);
    touching += contact.area;
    for (std::size_t side = 0; side < 2; ++side) {
      const auto& [batch, cell] = cells.at(contact.cell[side]);
      const std::int32_t code = batch->facet_hyperplane[batch->facet_offset[cell] + contact.facet[side]];
      const auto id = static_cast<geometry::HyperplaneId>(code < 0 ? ~code : code);
      if (id < r.network.table.size()) {  // an axis-parallel cut may go by another name
        ASSERT_EQ(id, contact.hyperplane);
        ASSERT_EQ(code < 0, side == 1);
      }
      left[{contact.cell[side], contact.facet[side]}] -= contact.area;
    }
  }
  for (const auto& [facet, area] : left) ASSERT_GE(area, -1e-9) << "a facet is covered more than once";
  // What no cell covers is boundary.
  EXPECT_NEAR(facets - 2 * touching, r.surface.area(), 1e-9 * (1 + facets));
}

void check_surface(const Resolved& r) {
  ASSERT_TRUE(r.surface.is_closed());
  const double scale = std::pow(r.network.table.radius(), 3);
  EXPECT_NEAR(r.surface.volume(), r.volume, 1e-12 * scale + 1e-10 * r.volume);
  EXPECT_EQ(r.surface.part.size(), r.surface.triangles.size());
}


TEST(Resolution, OfRandomBoxesOnTheGrid) {
  for (int round = 0; round < 300; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, Kind::grid_boxes, 2);
    const auto r = resolve(e);
    check_contacts(r);
    check_surface(r);
    if (testing::Test::HasFailure()) return;
  }
}

TEST(Resolution, OfRandomSolids) {
  for (int round = 0; round < 300; ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, Kind::solids, 2);
    const auto r = resolve(e);
    check_contacts(r);
    check_surface(r);
    if (testing::Test::HasFailure()) return;
  }
}

}  // namespace
}  // namespace bsp2::dataflow
