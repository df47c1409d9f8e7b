#pragma once

// What must hold of any mesh for solvers, against the cells that it is made of.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/tetrahedra/dual.hpp"
#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"
#include "dataflow/oracle.hpp"
#include "resolution/resolved.hpp"

namespace bsp2::meshing {

using dataflow::Kind;
using dataflow::Random;
using Rational = boost::multiprecision::cpp_rational;

inline dataflow::Resolved solid_of(const model::Expression& e, unsigned threads = 1,
                                   double coincidence = 1e-9) {
  dataflow::EvaluateOptions options;
  options.threads = threads;
  return dataflow::resolved(e, options, 0, coincidence);
}

/// By fractions, which round nothing.
inline int exact_sign(const Point& a, const Point& b, const Point& c, const Point& d) {
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

inline long double cone(const Point& eye, const Point& a, const Point& b, const Point& c) {
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

inline double area(const Point& a, const Point& b, const Point& c) {
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
inline double signed_area(const Point& a, const Point& b, const Point& c, const Point& normal) {
  double sum = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    sum += normal[k] * ((b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l]));
  }
  return sum / 2;
}

/// Each cell is closed: its faces' edges pair, and it is a ball. Volume and surface are those of the solid.
inline void check_complex(const Complex& complex, const dataflow::Resolved& solid) {
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
inline void check_tetrahedra(const Tetrahedra& mesh, double volume, double tolerance) {
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
inline void check_dual(const Tetrahedra& mesh) {
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
/// A solid of one or two parts.
inline model::Expression random_solid(Random& random, Kind kind) {
  const auto one = dataflow::random_expression(random, 3, kind, 2);
  if (dataflow::chance(random, 0.5)) return one;
  return model::unite(
      {model::part("a", one), model::part("b", dataflow::random_expression(random, 3, kind, 1))});
}

}  // namespace bsp2::meshing
