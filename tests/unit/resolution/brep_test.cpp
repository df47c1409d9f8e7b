// Faces, edges, shells and solids of the boundary, against the triangles and against what the cells tell.

#include "bsp2/geometry/surface/brep.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "resolution/resolved.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::Brep;
using Point3 = std::array<double, 3>;

struct Found {
  Resolved resolved;
  Brep brep;
};

Found found(const model::Expression& e, bool with_interfaces, unsigned depth = 0) {
  Resolved r = resolved(e, {}, depth);
  Brep brep = geometry::brep_of(r.network.table, skin_of(r.network, r.batches, nullptr, with_interfaces));
  return {std::move(r), std::move(brep)};
}

/// Of the corners of a loop, or a triangle: twice the area vector.
template <typename Corners>
Point3 twice_area(const Brep& brep, const Corners& corners) {
  Point3 sum{};
  const Point3& o = brep.points[corners[0]];
  for (std::size_t i = 1; i + 1 < corners.size(); ++i) {
    const Point3 &p = brep.points[corners[i]], &q = brep.points[corners[i + 1]];
    for (std::size_t k = 0; k < 3; ++k) {
      const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
      sum[k] += (p[l] - o[l]) * (q[m] - o[m]) - (p[m] - o[m]) * (q[l] - o[l]);
    }
  }
  return sum;
}
double along(const Point3& a, const Point3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Loops are closed, simple, and turn the right way round; faces are plane; what loops bound is what
/// triangles cover.
void check_faces(const Brep& brep, double radius) {
  std::vector<double> covered(brep.faces.size(), 0.0);
  ASSERT_EQ(brep.triangles.size(), brep.face_of_triangle.size());
  ASSERT_TRUE(std::is_sorted(brep.face_of_triangle.begin(), brep.face_of_triangle.end()));
  for (std::size_t i = 0; i < brep.triangles.size(); ++i) {
    const std::uint32_t face = brep.face_of_triangle[i];
    covered[face] += along(twice_area(brep, brep.triangles[i]), brep.faces[face].normal) / 2;
  }
  std::uint32_t next_loop = 0, next_use = 0;
  for (std::uint32_t f = 0; f < brep.faces.size(); ++f) {
    const Brep::Face& face = brep.faces[f];
    ASSERT_NEAR(along(face.normal, face.normal), 1, 1e-12);
    ASSERT_NE(face.part, Brep::outside);
    ASSERT_NE(face.part, face.other);
    ASSERT_EQ(face.first_loop, next_loop);
    ASSERT_GT(face.loops, 0U);
    double area = 0;
    for (const Brep::Loop& loop : brep.loops_of(face)) {
      ++next_loop;
      ASSERT_EQ(loop.first_use, next_use);
      ASSERT_GE(loop.uses, 3U);
      next_use += loop.uses;
      std::vector<std::uint32_t> corners;
      const auto uses = brep.uses_of(loop);
      for (std::size_t i = 0; i < uses.size(); ++i) {
        ASSERT_EQ(uses[i].face, f);
        const auto& ends = brep.edges.at(uses[i].edge).ends;
        ASSERT_LT(ends[0], ends[1]);
        ASSERT_EQ(ends[uses[i].forward ? 1 : 0], brep.from(uses[(i + 1) % uses.size()]));
        corners.push_back(brep.from(uses[i]));
        ASSERT_NEAR(along(face.normal, brep.points[corners.back()]) + face.offset, 0, 1e-12 * radius);
      }
      ASSERT_EQ(std::min_element(corners.begin(), corners.end()), corners.begin());
      ASSERT_EQ(std::set(corners.begin(), corners.end()).size(), corners.size());
      const double of_loop = along(twice_area(brep, corners), face.normal) / 2;
      const bool is_hole = &loop != brep.loops_of(face).data();
      ASSERT_LE(is_hole ? of_loop : -of_loop, 1e-12 * radius * radius);
      area += of_loop;
    }
    ASSERT_NEAR(area, covered[f], 1e-11 * radius * radius);
  }
  ASSERT_EQ(next_loop, brep.loops.size());
  ASSERT_EQ(next_use, brep.uses.size());
}

/// About each edge faces lie in order: what is between two of them is the same for both, and the angles make
/// one turn.
void check_edges(const Brep& brep) {
  std::vector<bool> is_seen(brep.uses.size(), false);
  for (std::uint32_t e = 0; e < brep.edges.size(); ++e) {
    const Brep::Edge& edge = brep.edges[e];
    ASSERT_GE(edge.count, 2U);
    double turn = 0;
    for (std::uint32_t i = 0; i < edge.count; ++i) {
      const std::uint32_t number = brep.uses_of_edges[edge.first + i],
                          next = brep.uses_of_edges[edge.first + (i + 1) % edge.count];
      ASSERT_FALSE(is_seen[number]);
      is_seen[number] = true;
      const Brep::Use &use = brep.uses[number], &after = brep.uses[next];
      ASSERT_EQ(use.edge, e);
      const Brep::Face &face = brep.faces[use.face], &face_after = brep.faces[after.face];
      ASSERT_EQ(use.forward ? face.other : face.part, after.forward ? face_after.part : face_after.other);
      ASSERT_GE(use.angle, 0);
      turn += use.angle;
    }
    ASSERT_NEAR(turn, 2 * std::numbers::pi, 1e-6);
  }
  ASSERT_EQ(std::count(is_seen.begin(), is_seen.end(), false), 0);
}

/// What of a part is connected, as cells and their contacts tell.
struct Piece {
  std::int32_t part = 0;
  double volume = 0, largest = 0;
  Point3 inside{};  ///< the middle of its largest cell
};
std::vector<Piece> pieces_of_cells(const Resolved& r, bool by_part) {
  std::vector<Piece> cells;
  for (const auto& batch : r.batches)
    for (std::size_t i = 0; i < batch->size(); ++i) {
      Piece& cell = cells.emplace_back();
      cell.part = by_part ? batch->part[i] : 0;
      cell.volume = cell.largest = batch->volume[i];
      const std::uint32_t first = batch->point_offset[i], end = batch->point_offset[i + 1];
      for (std::uint32_t point = first; point < end; ++point)
        for (std::size_t k = 0; k < 3; ++k) cell.inside[k] += batch->points[3 * point + k] / (end - first);
    }
  std::vector<std::size_t> parent(cells.size());
  std::iota(parent.begin(), parent.end(), std::size_t{0});
  const auto find = [&](std::size_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const geometry::Contact& contact : r.contacts)
    if (cells[contact.cell[0]].part == cells[contact.cell[1]].part)
      parent[find(contact.cell[0])] = find(contact.cell[1]);
  std::map<std::size_t, Piece> pieces;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    Piece& piece = pieces[find(i)];
    piece.part = cells[i].part;
    piece.volume += cells[i].volume;
    if (cells[i].largest <= piece.largest) continue;
    piece.largest = cells[i].largest;
    piece.inside = cells[i].inside;
  }
  std::vector<Piece> all;
  for (const auto& [root, piece] : pieces) all.push_back(piece);
  return all;
}

/// How often the shells of a solid wind around a point.
double winding(const Brep& brep, const Brep::Solid& solid, const Point3& x) {
  std::map<std::uint32_t, double> sign;  // of its faces
  for (std::uint32_t i = 0; i < solid.shells; ++i)
    for (const Brep::Side& side : brep.sides_of(brep.shells[solid.first_shell + i]))
      sign[side.face] = side.is_front ? -1 : 1;
  double sum = 0;
  for (std::size_t i = 0; i < brep.triangles.size(); ++i) {
    const auto of_face = sign.find(brep.face_of_triangle[i]);
    if (of_face == sign.end()) continue;
    std::array<Point3, 3> p;
    std::array<double, 3> length;
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t k = 0; k < 3; ++k) p[c][k] = brep.points[brep.triangles[i][c]][k] - x[k];
      length[c] = std::sqrt(along(p[c], p[c]));
    }
    const double determinant = p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) -
                               p[0][1] * (p[1][0] * p[2][2] - p[1][2] * p[2][0]) +
                               p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
    sum += of_face->second *
           std::atan2(determinant, length[0] * length[1] * length[2] + along(p[0], p[1]) * length[2] +
                                       along(p[1], p[2]) * length[0] + along(p[2], p[0]) * length[1]);
  }
  return sum / (2 * std::numbers::pi);
}

/// Solids are what cells that touch make together. Pieces that touch in an edge are one solid where a face
/// goes on across it. @param joined counts the pieces that are not solids of their own.
void check_solids(const Found& f, bool by_part, std::size_t& joined) {
  const Brep& brep = f.brep;
  std::vector<int> sides(2 * brep.faces.size(), 0);
  std::uint32_t next_shell = 0;
  for (std::uint32_t i = 0; i < brep.solids.size(); ++i) {
    const Brep::Solid& solid = brep.solids[i];
    ASSERT_EQ(solid.first_shell, next_shell);
    for (; next_shell < solid.first_shell + solid.shells; ++next_shell) {
      const Brep::Shell& shell = brep.shells[next_shell];
      ASSERT_EQ(shell.solid, i);
      ASSERT_EQ(shell.part, solid.part);
      ASSERT_EQ(shell.is_cavity, next_shell > solid.first_shell);
      for (const Brep::Side& side : brep.sides_of(shell)) {
        const Brep::Face& face = brep.faces[side.face];
        ASSERT_EQ(side.is_front ? face.other : face.part, solid.part);
        ++sides[2 * side.face + (side.is_front ? 1 : 0)];
      }
    }
  }
  for (std::uint32_t face = 0; face < brep.faces.size(); ++face) {
    ASSERT_EQ(sides[2 * face], 1);
    ASSERT_EQ(sides[2 * face + 1], brep.faces[face].other == Brep::outside ? 0 : 1);
  }
  const double scale = std::pow(f.resolved.network.table.radius(), 3);
  std::vector<double> left;
  for (const Brep::Solid& solid : brep.solids) left.push_back(solid.volume);
  std::vector<std::size_t> pieces(brep.solids.size(), 0);
  for (const Piece& piece : pieces_of_cells(f.resolved, by_part)) {
    if (piece.largest < 1e-9 * scale) continue;  // where winding numbers are not well known
    std::size_t holders = 0;
    for (std::size_t i = 0; i < brep.solids.size(); ++i) {
      if (by_part && brep.solids[i].part != piece.part) continue;
      if (std::fabs(winding(brep, brep.solids[i], piece.inside) - 1) > 1e-3) continue;
      ++holders;
      left[i] -= piece.volume;
      if (++pieces[i] > 1) ++joined;
    }
    ASSERT_EQ(holders, 1U);
  }
  for (const double volume : left) ASSERT_NEAR(volume, 0, 1e-8 * scale);
}

void check(const Found& f, std::size_t& joined, bool by_part = false) {
  ASSERT_TRUE(f.brep.is_closed);
  ASSERT_NO_FATAL_FAILURE(check_faces(f.brep, f.resolved.network.table.radius()));
  ASSERT_NO_FATAL_FAILURE(check_edges(f.brep));
  ASSERT_NO_FATAL_FAILURE(check_solids(f, by_part, joined));
}
void check(const Found& f, bool by_part = false) {
  std::size_t joined = 0;
  ASSERT_NO_FATAL_FAILURE(check(f, joined, by_part));
  ASSERT_EQ(joined, 0U);
}

model::Expression cube(double x, double y, double z, double size) {
  return model::transform(std::vector<double>{size, 0, 0, x, 0, size, 0, y, 0, 0, size, z, 0, 0, 0, 1},
                          model::cuboid(std::vector<double>{1, 1, 1}));
}

TEST(Brep, OfACubeHasSixFacesTwelveRightAnglesAndOneSolid) {
  const Found f = found(cube(1, 2, 3, 2), false);
  ASSERT_NO_FATAL_FAILURE(check(f));
  EXPECT_EQ(f.brep.points.size(), 8U);
  EXPECT_EQ(f.brep.edges.size(), 12U);
  EXPECT_EQ(f.brep.faces.size(), 6U);
  EXPECT_EQ(f.brep.loops.size(), 6U);
  for (const Brep::Edge& edge : f.brep.edges) {
    const Brep::Use& use = f.brep.uses[f.brep.uses_of_edges[edge.first]];
    EXPECT_NEAR(use.angle, (use.forward ? 3 : 1) * std::numbers::pi / 2, 1e-12);
  }
  ASSERT_EQ(f.brep.solids.size(), 1U);
  EXPECT_NEAR(f.brep.solids[0].volume, 8, 1e-12);
}

TEST(Brep, OfAFrameHasHolesInItsFaces) {
  const Found f = found(
      model::subtract({cube(0, 0, 0, 3),
                       model::transform(std::vector<double>{1, 0, 0, 1, 0, 1, 0, 1, 0, 0, 5, -1, 0, 0, 0, 1},
                                        model::cuboid(std::vector<double>{1, 1, 1}))}),
      false);
  ASSERT_NO_FATAL_FAILURE(check(f));
  EXPECT_EQ(f.brep.faces.size(), 10U);
  EXPECT_EQ(f.brep.loops.size(), 12U);
  EXPECT_EQ(f.brep.points.size(), 16U);
  EXPECT_EQ(f.brep.shells.size(), 1U);
}

TEST(Brep, KnowsCavitiesAndWhatIsInThem) {
  // A box with a cavity, in which there is another one with a cavity.
  const Found f =
      found(model::unite({model::subtract({cube(0, 0, 0, 9), cube(1, 1, 1, 7)}),
                          model::subtract({cube(2, 2, 2, 5), cube(3, 3, 3, 1), cube(5, 5, 5, 1)})}),
            false);
  ASSERT_NO_FATAL_FAILURE(check(f));
  ASSERT_EQ(f.brep.solids.size(), 2U);
  EXPECT_EQ(f.brep.shells.size(), 5U);
  std::map<double, std::uint32_t> shells;
  for (const Brep::Solid& solid : f.brep.solids) shells[std::round(solid.volume)] = solid.shells;
  EXPECT_EQ(shells, (std::map<double, std::uint32_t>{{729 - 343, 2}, {125 - 2, 3}}));
}

TEST(Brep, TakesSolidsApartThatTouchInAnEdgeOrAVertex) {
  const Found edge = found(model::unite({cube(0, 0, 0, 1), cube(1, 1, 0, 1)}), false);
  ASSERT_NO_FATAL_FAILURE(check(edge));
  EXPECT_EQ(edge.brep.solids.size(), 2U);
  EXPECT_EQ(edge.brep.points.size(), 14U);
  EXPECT_EQ(edge.brep.edges.size(), 23U);
  const Found vertex = found(model::unite({cube(0, 0, 0, 1), cube(1, 1, 1, 1)}), false);
  ASSERT_NO_FATAL_FAILURE(check(vertex));
  EXPECT_EQ(vertex.brep.solids.size(), 2U);
  EXPECT_EQ(vertex.brep.points.size(), 15U);
}

TEST(Brep, HasInterfacesWherePartsMeet) {
  const Found f =
      found(model::unite({model::part("a", cube(0, 0, 0, 2)), model::part("b", cube(2, 0, 0, 1))}), true);
  ASSERT_NO_FATAL_FAILURE(check(f, true));
  std::size_t interfaces = 0;
  for (const Brep::Face& face : f.brep.faces)
    if (face.other != Brep::outside) {
      ++interfaces;
      EXPECT_EQ(std::abs(face.part - face.other), 1);
    }
  EXPECT_EQ(interfaces, 1U);
  EXPECT_EQ(f.brep.faces.size(), 12U);
  EXPECT_EQ(f.brep.solids.size(), 2U);
}

/// A random solid with two edges that are less apart than their ends are rounded by.
TEST(Brep, KeepsEdgesApartThatRoundToOne) {
  Random random(615215507);
  const Found f = found(random_expression(random, 3, Kind::solids, 2), false);
  std::size_t joined = 0;
  ASSERT_NO_FATAL_FAILURE(check(f, joined));
  std::map<std::array<std::uint32_t, 2>, int> times;
  for (const Brep::Edge& edge : f.brep.edges) ++times[edge.ends];
  EXPECT_TRUE(std::ranges::any_of(times, [](const auto& edge) { return edge.second == 2; }));
}

/// Every second operand is a part of its own.
model::Expression with_parts(Random& random, Kind kind) {
  std::vector<model::Expression> operands;
  for (int i = 0; i < 4; ++i) {
    const auto operand = random_expression(random, 3, kind, 1);
    operands.push_back(i % 2 == 0 ? model::part("part " + std::to_string(i), operand) : operand);
  }
  return model::unite(operands);
}

/// Likewise with parts: one of the two edges is of an interface.
TEST(Brep, KeepsEdgesOfPartsApartThatRoundToOne) {
  Random random(1675350822);
  const Found f = found(with_parts(random, Kind::solids), true);
  std::size_t joined = 0;
  ASSERT_NO_FATAL_FAILURE(check(f, joined, true));
  std::map<std::array<std::uint32_t, 2>, int> times;
  for (const Brep::Edge& edge : f.brep.edges) ++times[edge.ends];
  EXPECT_TRUE(std::ranges::any_of(times, [](const auto& edge) { return edge.second == 2; }));
}

class RandomBrep : public testing::TestWithParam<Kind> {};
INSTANTIATE_TEST_SUITE_P(Of, RandomBrep, testing::Values(Kind::grid_boxes, Kind::solids), [](const auto& p) {
  return std::string(p.param == Kind::solids ? "solids" : "boxes");
});

TEST_P(RandomBrep, IsWhatTrianglesAndCellsTell) {
  std::size_t solids = 0, crowded = 0, joined = 0;
  for (int round = 0; round < samples::rounds(150); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Found f = found(random_expression(random, 3, GetParam(), 2 + round % 2), false,
                          static_cast<unsigned>(round % 3));
    ASSERT_NO_FATAL_FAILURE(check(f, joined));
    auto mine = f.brep.triangles, all = f.resolved.surface.triangles;
    std::sort(mine.begin(), mine.end());
    std::sort(all.begin(), all.end());
    ASSERT_EQ(mine, all);
    ASSERT_EQ(f.brep.points, f.resolved.surface.points);
    solids += f.brep.solids.size();
    for (const Brep::Edge& edge : f.brep.edges) crowded += edge.count > 2;
  }
  if (std::getenv("BSP2_SEED") != nullptr) return;
  EXPECT_GT(2 * solids, samples::rounds(150U));
  EXPECT_LT(joined, solids / 10);
  if (GetParam() == Kind::grid_boxes && samples::rounds(150) >= 150) {
    EXPECT_GT(crowded, 0U);  // a few of a hundred have one
  }
}

TEST_P(RandomBrep, BoundsEachPartWithItsInterfaces) {
  std::size_t interfaces = 0, joined = 0;
  for (int round = 0; round < samples::rounds(80); ++round) {
    const std::uint64_t seed = new_seed();
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
    Random random(seed);
    const Found f = found(with_parts(random, GetParam()), true, static_cast<unsigned>(round % 3));
    ASSERT_NO_FATAL_FAILURE(check(f, joined, true));
    for (const Brep::Face& face : f.brep.faces) interfaces += face.other != Brep::outside;
  }
  if (std::getenv("BSP2_SEED") != nullptr) return;
  EXPECT_GT(interfaces, samples::rounds(50U));
}

}  // namespace
}  // namespace bsp2::dataflow
