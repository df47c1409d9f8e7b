// The boundary and the contacts of random solids: what must hold of any, against the cells themselves.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>

#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "dataflow/oracle.hpp"
#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::CellBatch;
using geometry::Contact;
using geometry::Skin;
using geometry::TriangleSurface;

Resolved resolve(const model::Expression& e, unsigned depth = 0, unsigned threads = 1,
                 double coincidence = 1e-9) {
  EvaluateOptions options;
  options.threads = threads;
  return resolved(e, options, depth, coincidence);
}

double polygon_area(const CellBatch& batch, std::size_t cell, std::size_t facet) {
  const auto p = batch.cell_points(cell);
  const auto loop = batch.vertices_of_facet(facet);
  std::array<double, 3> sum{};
  for (std::size_t i = 1; i + 1 < loop.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      const auto at = [&](std::size_t corner, std::size_t axis) {
        return p[3 * loop[corner] + axis] - p[3 * loop[0] + axis];
      };
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
      facets += left[{i, static_cast<std::uint16_t>(facet - batch->facet_offset[cell])}] =
          polygon_area(*batch, cell, facet);
  }
  std::set<std::pair<std::uint64_t, std::uint64_t>> pairs;
  for (const Contact& contact : r.contacts) {
    ASSERT_NE(contact.cell[0], contact.cell[1]);
    ASSERT_TRUE(
        pairs.emplace(std::min(contact.cell[0], contact.cell[1]), std::max(contact.cell[0], contact.cell[1]))
            .second);
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

std::array<double, 3> minus(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
std::array<double, 3> cross_product(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double scalar(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
double length(const std::array<double, 3>& a) { return std::sqrt(scalar(a, a)); }

/// Closed; encloses the volume of the cells; each part shows as much area as its cells have that touch
/// no other cell.
void check_surface(const Resolved& r) {
  const TriangleSurface& surface = r.surface;
  ASSERT_TRUE(surface.is_closed());
  ASSERT_EQ(surface.owner.size(), surface.triangles.size());
  const double radius = r.network.table.radius();
  EXPECT_NEAR(surface.volume(), r.volume, 1e-12 * std::pow(radius, 3) + 1e-10 * r.volume);

  std::map<std::int32_t, double> area;
  std::vector<std::int32_t> part_of_cell;
  for (const auto& batch : r.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      part_of_cell.push_back(batch->part[cell]);
      for (std::uint32_t facet = batch->facet_offset[cell]; facet < batch->facet_offset[cell + 1]; ++facet)
        area[batch->part[cell]] += polygon_area(*batch, cell, facet);
    }
  for (const Contact& contact : r.contacts)
    for (const std::uint64_t cell : contact.cell) area[part_of_cell[cell]] -= contact.area;
  std::set<std::uint32_t> used;
  for (std::size_t i = 0; i < surface.triangles.size(); ++i) {
    const auto& [a, b, c] = surface.triangles[i];
    ASSERT_TRUE(a != b && b != c && c != a);
    used.insert({a, b, c});
    const auto& p = surface.points;
    area[surface.owner[i]] -= length(cross_product(minus(p[b], p[a]), minus(p[c], p[a]))) / 2;
  }
  EXPECT_EQ(used.size(), surface.points.size());
  for (const auto& [part, rest] : area) EXPECT_NEAR(rest, 0, 1e-9 * radius * radius) << "part " << part;
}

/// No vertex lies inside an edge, no triangle is a line, and no two points are one: in integer arithmetic.
void check_round_surface(const TriangleSurface& surface) {
  using geometry::Int128;
  using IntegerPoint = std::array<Int128, 3>;
  std::vector<IntegerPoint> points;
  for (const auto& p : surface.points) {
    auto& point = points.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      const double x = std::ldexp(p[k], 44);
      ASSERT_TRUE(std::fabs(p[k]) < 32 && x == std::nearbyint(x)) << p[k];
      point[k] = static_cast<Int128>(x);
    }
  }
  EXPECT_EQ(std::set<IntegerPoint>(points.begin(), points.end()).size(), points.size());
  const auto difference = [](const IntegerPoint& a, const IntegerPoint& b) {
    return IntegerPoint{a[0] - b[0], a[1] - b[1], a[2] - b[2]};
  };
  const auto are_parallel = [](const IntegerPoint& a, const IntegerPoint& b) {
    return a[1] * b[2] == a[2] * b[1] && a[2] * b[0] == a[0] * b[2] && a[0] * b[1] == a[1] * b[0];
  };
  for (const auto& triangle : surface.triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &a = points[triangle[k]], &b = points[triangle[(k + 1) % 3]],
                 &c = points[triangle[(k + 2) % 3]];
      const IntegerPoint along = difference(b, a);
      ASSERT_FALSE(are_parallel(along, difference(c, a)));
      for (const auto& p : points) {
        const IntegerPoint to = difference(p, a), rest = difference(b, p);
        if (!are_parallel(along, to)) continue;
        ASSERT_FALSE(to[0] * rest[0] + to[1] * rest[1] + to[2] * rest[2] > 0) << "a T-vertex";
      }
    }
}

/// How often the way from one point to another leaves the surface, less how often it enters it; nothing where
/// it comes too close to an edge.
std::optional<int> exits(const TriangleSurface& surface, const Point& from, const Point& to) {
  using Vector = std::array<Real, 3>;
  const auto determinant = [](const Vector& a, const Vector& b, const Vector& c) {
    return dot(a, cross(b, c));
  };
  const Vector way{to[0] - from[0], to[1] - from[1], to[2] - from[2]};
  const Real clear = 1e-11L * std::sqrt(dot(way, way));
  int count = 0;
  for (const auto& triangle : surface.triangles) {
    std::array<Vector, 3> before, after;  // the corners, from either end
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        before[i][k] = surface.points[triangle[i]][k] - from[k];
        after[i][k] = surface.points[triangle[i]][k] - to[k];
      }
    int left = 0, right = 0;  // edges that the line of the way clearly passes on this side
    for (std::size_t i = 0; i < 3; ++i) {
      const Real turn = determinant(way, before[i], before[(i + 1) % 3]);
      left += turn > clear;
      right += turn < -clear;
    }
    const Real start = determinant(before[0], before[1], before[2]),
               end = determinant(after[0], after[1], after[2]);
    const bool passes =
        (left > 0 && right > 0) || (start > 1e-16L && end > 1e-16L) || (start < -1e-16L && end < -1e-16L);
    if (passes) continue;
    if (left + right < 3 || std::fabs(start) < 1e-16L || std::fabs(end) < 1e-16L) return {};
    count += start > 0 ? 1 : -1;
  }
  return count;
}

/// A way through a triangle leaves the solid as often as the surface says. (Mostly once. Nearly coincident
/// planes are all real if they are not taken for one: what is between them is thinner than any step.) The
/// point is anywhere: through the middle, models on a grid may have an edge that only touches the triangle.
/// The number of ways that could be told.
std::size_t check_sides(const model::Expression& e, const TriangleSurface& surface, Random& random) {
  constexpr double step = 1e-5;
  std::size_t told = 0;
  for (int sample = 0; sample < 10 && !surface.triangles.empty(); ++sample) {
    const auto& triangle = surface.triangles[static_cast<std::size_t>(
        pick(random, 0, static_cast<int>(surface.triangles.size()) - 1))];
    const auto &a = surface.points[triangle[0]], &b = surface.points[triangle[1]],
               &c = surface.points[triangle[2]];
    const auto normal = cross_product(minus(b, a), minus(c, a));
    if (length(normal) < 1e-3) continue;
    const double to_b = uniform(random, 0.2, 0.4), to_c = uniform(random, 0.2, 0.4);
    Point inside, outside;
    for (std::size_t k = 0; k < 3; ++k) {
      const Real at = static_cast<Real>(a[k]) + to_b * (static_cast<Real>(b[k]) - a[k]) +
                      to_c * (static_cast<Real>(c[k]) - a[k]),
                 out = step * normal[k] / length(normal);
      inside.push_back(at - out);
      outside.push_back(at + out);
    }
    const Where in = where(e, inside, 1e-7L), out = where(e, outside, 1e-7L);
    const auto count = exits(surface, inside, outside);
    if (in.doubtful || out.doubtful || !count) continue;
    EXPECT_EQ(*count, int{in.inside} - int{out.inside});
    ++told;
  }
  return told;
}

class RandomResolution : public testing::TestWithParam<Kind> {};

INSTANTIATE_TEST_SUITE_P(Of, RandomResolution, testing::Values(Kind::grid_boxes, Kind::solids),
                         [](const auto& parameter) {
                           return parameter.param == Kind::grid_boxes ? "Boxes" : "Solids";
                         });

TEST_P(RandomResolution, ContactsAndBoundaryCoverAllFacets) {
  std::size_t told = 0;
  for (int round = 0; round < samples::rounds(400); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, GetParam(), 2);
    const auto r = resolve(e, round % 3 == 0 ? 2 : 0, 1, round % 5 == 0 ? 0 : 1e-9);
    check_contacts(r);
    check_surface(r);
    if (round % 10 == 1 && GetParam() == Kind::grid_boxes) check_round_surface(r.surface);
    if (is_positive(e)) told += check_sides(e, r.surface, random);
    if (testing::Test::HasFailure()) return;
  }
  if (std::getenv("BSP2_SEED") == nullptr) {  // else all rounds are of one expression
    EXPECT_GT(told, samples::rounds(1000U));
  }
}

/// The search in space against asking each point about each edge.
TEST_P(RandomResolution, DividedEdgesHaveNoVertexInside) {
  std::size_t divided = 0;
  for (int round = 0; round < samples::all_rounds(40); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto r = resolve(random_expression(random, 3, GetParam(), 2), 1, 1, round % 2 == 0 ? 0 : 1e-9);
    Skin skin = skin_of(r.network, r.batches, nullptr);
    geometry::ExactPoints exact(r.network.table);
    geometry::PointSet points;
    for (std::size_t i = 0; i < skin.vertices.size(); ++i)
      points.add(
          geometry::canonical_vertex(r.network.table, skin.vertices[i]),
          std::span(skin.incident)
              .subspan(skin.incident_offset[i], skin.incident_offset[i + 1] - skin.incident_offset[i]));
    const auto map = exact.unify(points);
    for (auto& edge : skin.edges) {
      edge.from = map[edge.from];
      edge.to = map[edge.to];
    }
    const std::size_t before = skin.edges.size();
    geometry::EdgeSplitter(exact).split(points, skin.faces, skin.edges);
    divided += skin.edges.size() - before;
    std::set<std::uint32_t> ends;
    for (const auto& edge : skin.edges) ends.insert({edge.from, edge.to});
    geometry::Splitter<3> kernel(r.network.table);
    const auto is_on = [&](std::uint32_t point, geometry::HyperplaneId id) {
      return kernel.side(points.vertices[point], id, r.network.table.rounded(id)) == 0;
    };
    for (const auto& edge : skin.edges)
      for (const std::uint32_t point : ends) {
        if (point == edge.from || point == edge.to || !is_on(point, skin.faces[edge.face].outward.id()) ||
            !is_on(point, edge.across))
          continue;
        ASSERT_FALSE(exact.is_between(points, edge.from, point, edge.to));
      }
    if (testing::Test::HasFailure()) return;
  }
  EXPECT_GT(divided, 0U);
}

TEST_P(RandomResolution, BoundaryIsTheSameForAnyPartitionAndAnyThreads) {
  for (int round = 0; round < samples::rounds(40); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const auto e = random_expression(random, 3, GetParam(), 2);
    const auto one = resolve(e);
    const auto threads = resolve(e, 0, 3);
    EXPECT_EQ(threads.surface.points, one.surface.points);
    EXPECT_EQ(threads.surface.triangles, one.surface.triangles);
    EXPECT_EQ(threads.surface.owner, one.surface.owner);
    for (const unsigned depth : {1U, 4U}) {
      const auto parted = resolve(e, depth, 2);
      EXPECT_EQ(parted.surface.points, one.surface.points);
      EXPECT_EQ(parted.surface.triangles, one.surface.triangles);
      EXPECT_EQ(parted.surface.owner, one.surface.owner);
    }
    if (testing::Test::HasFailure()) return;
  }
}

model::Expression cube_at(double x, double y, double z, double size = 1) {
  return model::transform(std::vector<double>{1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1},
                          model::cuboid({size, size, size}, false));
}

struct Expected {
  double area;
  std::size_t points, triangles, contacts;
};

void expect_surface(const model::Expression& e, const Expected& expected) {
  const auto r = resolve(e);
  check_contacts(r);
  check_surface(r);
  check_round_surface(r.surface);
  EXPECT_NEAR(r.surface.area(), expected.area, 1e-12 * expected.area);
  EXPECT_EQ(r.surface.points.size(), expected.points);
  EXPECT_EQ(r.surface.triangles.size(), expected.triangles);
  EXPECT_EQ(r.contacts.size(), expected.contacts);
}

TEST(Resolution, OfCubesThatTouch) {
  expect_surface(cube_at(0, 0, 0), {6, 8, 12, 0});
  expect_surface(model::unite({cube_at(0, 0, 0), cube_at(1, 1, 1)}), {12, 15, 24, 0});  // in a vertex
  expect_surface(model::unite({cube_at(0, 0, 0), cube_at(1, 1, 0)}), {12, 14, 24, 0});  // in an edge
  expect_surface(model::unite({cube_at(0, 0, 0), cube_at(1, 0, 0)}), {10, 8, 12, 1});   // in a face
  expect_surface(model::unite({cube_at(0, 0, 0, 2), cube_at(2, 1, 1, 2)}),
                 {46, 18, 32, 1});  // in a part of a face
  // An edge of the small one lies on one of the large one: its ends are vertices of the large one too.
  const auto r = resolve(model::unite({cube_at(0, 0, 0, 3), cube_at(3, 3, 1)}));
  check_surface(r);
  check_round_surface(r.surface);
  EXPECT_EQ(r.surface.points.size(), 16U);
}

TEST(Resolution, OfASolidMinusItselfIsEmpty) {
  const auto e = model::transform(
      std::vector<double>{0.8, -0.6, 0, 1, 0.6, 0.8, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1}, model::sphere(2, 12));
  const auto r = resolve(model::subtract({e, e}));
  EXPECT_TRUE(r.surface.triangles.empty());
  EXPECT_TRUE(r.surface.is_closed());
  EXPECT_TRUE(r.contacts.empty());
}

TEST(Resolution, OfNearlyCoincidentCubes) {
  // Turned by so little that corners are closer than they can be rounded; without a tolerance every one is
  // real.
  for (const double angle : {1e-3, 1e-6, 1e-9, 1e-12, 1e-15}) {
    SCOPED_TRACE(angle);
    std::vector<model::Expression> cubes;
    for (int i = 0; i < 4; ++i) {
      const double c = std::cos(i * angle), s = std::sin(i * angle);
      cubes.push_back(model::transform(std::vector<double>{c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                       model::cuboid({2, 2, 2}, true)));
    }
    for (const double coincidence : {0.0, 1e-9}) {
      const auto r = resolve(model::unite(cubes), 0, 1, coincidence);
      ASSERT_TRUE(r.surface.is_closed());
      EXPECT_NEAR(r.surface.volume(), r.volume, 1e-12 * r.volume);
    }
  }
}

/// A cube without its tunnels: 20 smaller ones of 27, again and again.
model::Expression sponge(int level, double x, double y, double z) {
  if (level == 0) return cube_at(x, y, z);
  const double size = std::pow(3, level - 1);
  std::vector<model::Expression> cubes;
  for (int i = 0; i < 27; ++i) {
    const int a = i % 3, b = i / 3 % 3, c = i / 9;
    if ((a == 1) + (b == 1) + (c == 1) < 2)
      cubes.push_back(sponge(level - 1, x + a * size, y + b * size, z + c * size));
  }
  return model::unite(cubes);
}

TEST(Resolution, OfMengersSponge) {
  // Twenty smaller ones, which touch in 24 faces; a face is a carpet of 8^(n-1) unit squares.
  double area = 6;
  for (int level = 1; level <= 2; ++level) {
    area = 20 * area - 48 * std::pow(8, level - 1);
    const auto r = resolve(sponge(level, 0, 0, 0));
    check_contacts(r);
    check_surface(r);
    EXPECT_NEAR(r.surface.area(), area, 1e-9 * area);
    EXPECT_NEAR(r.surface.volume(), std::pow(20, level), 1e-9);
  }
}

}  // namespace
}  // namespace bsp2::dataflow
