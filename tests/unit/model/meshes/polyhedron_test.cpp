#include "builder/polyhedron.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "mesh/mesh_repair.hpp"
#include "model/helpers.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

using Point = std::array<double, 3>;
using Face = std::vector<std::uint32_t>;

struct Faces {
  std::vector<Point> points;
  std::vector<Face> faces;  ///< clockwise seen from outside

  Expression solid() const { return polyhedron(points, faces); }
  void add(const Faces& other) {
    const auto base = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), other.points.begin(), other.points.end());
    for (Face face : other.faces) {
      for (std::uint32_t& i : face) i += base;
      faces.push_back(face);
    }
  }
  void reverse() {
    for (Face& face : faces) std::reverse(face.begin(), face.end());
  }
};

Faces box(const Point& low, const Point& high) {
  Faces result;
  for (int i = 0; i < 8; ++i)
    result.points.push_back({(i & 1 ? high : low)[0], (i & 2 ? high : low)[1], (i & 4 ? high : low)[2]});
  result.faces = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
  return result;
}

/// A prism over a counter-clockwise polygon, from z = 0 to `height`.
Faces prism(const std::vector<std::array<double, 2>>& polygon, double height) {
  Faces result;
  const auto n = static_cast<std::uint32_t>(polygon.size());
  for (const double z : {0.0, height})
    for (const auto& [x, y] : polygon) result.points.push_back({x, y, z});
  Face bottom, top;
  for (std::uint32_t i = 0; i < n; ++i) {
    bottom.push_back(i);
    top.push_back(2 * n - 1 - i);
    const std::uint32_t next = (i + 1) % n;
    result.faces.push_back({i, i + n, next + n, next});
  }
  result.faces.push_back(bottom);
  result.faces.push_back(top);
  return result;
}

double area(const std::vector<std::array<double, 2>>& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    sum += a[0] * b[1] - a[1] * b[0];
  }
  return sum / 2;
}

/// A polygon that is star-shaped about the origin and far from convex.
std::vector<std::array<double, 2>> random_star(std::mt19937& random, int corners) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<std::array<double, 2>> star;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.8 * unit(random)) / corners,
                 radius = 0.2 + 3 * unit(random);
    star.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  }
  return star;
}

Faces turned(Faces faces, std::mt19937& random, double scale) {
  std::normal_distribution<double> normal;
  double q[4], length = 0;
  for (double& x : q) x = normal(random), length += x * x;
  for (double& x : q) x /= std::sqrt(length);
  const auto [w, x, y, z] = std::to_array(q);
  const double m[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  for (Point& p : faces.points) {
    const Point old = p;
    for (int i = 0; i < 3; ++i) p[i] = scale * (m[i][0] * old[0] + m[i][1] * old[1] + m[i][2] * old[2]);
  }
  return faces;
}

/// As a text of six significant digits gives them.
void round_to_six_digits(Faces& faces) {
  for (Point& p : faces.points)
    for (double& x : p) {
      char text[32];
      const auto end = std::to_chars(text, text + sizeof text, x, std::chars_format::general, 6).ptr;
      std::from_chars(text, end, x);
    }
}

/// Puts points into edges of one face each, where the neighbour has none.
void add_t_vertices(Faces& faces, std::mt19937& random) {
  for (Face& face : faces.faces) {
    Face with;
    for (std::size_t i = 0; i < face.size(); ++i) {
      const std::uint32_t from = face[i], to = face[(i + 1) % face.size()];
      with.push_back(from);
      const int count = random() % 4 == 0 ? 1 + static_cast<int>(random() % 2) : 0;
      for (int k = 1; k <= count; ++k) {
        Point p;
        for (int axis = 0; axis < 3; ++axis) {
          const double a = faces.points[from][axis], b = faces.points[to][axis];
          p[axis] = a + (b - a) * k / (count + 1);
        }
        with.push_back(static_cast<std::uint32_t>(faces.points.size()));
        faces.points.push_back(p);
      }
    }
    face = with;
  }
}

void expect_solid(const Expression& solid, double expected, double tolerance) {
  const TriangleMesh& mesh = mesh_of(solid);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_NEAR(volume(mesh), expected, tolerance);
}

TEST(Polyhedron, BoxIsASolidWhicheverWayItIsWound) {
  Faces faces = box({1, 2, 3}, {2, 4, 6});
  expect_solid(faces.solid(), 6, 1e-14);
  EXPECT_EQ(mesh_of(faces.solid()).triangles.size(), 12u);
  faces.reverse();
  expect_solid(faces.solid(), 6, 1e-14);
}

TEST(Polyhedron, NonConvexFacesKeepTheVolume) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(300); ++round) {
    const auto star = random_star(random, 5 + static_cast<int>(random() % 90));
    Faces faces = prism(star, 2);
    for (Face& face : faces.faces)
      std::rotate(face.begin(), face.begin() + static_cast<long>(random() % face.size()), face.end());
    expect_solid(faces.solid(), 2 * area(star), 1e-12);
    // Turned, the faces are planar only up to rounding.
    expect_solid(turned(faces, random, 10).solid(), 2000 * area(star), 1e-8);
    Faces decimal = turned(faces, random, 10);
    round_to_six_digits(decimal);
    expect_solid(decimal.solid(), 2000 * area(star), 3);
  }
}

/// Volumes by OpenSCAD 2021.01: one corner of the top, then of a side, of a box 2 x 2 x 2 is moved out by 1;
/// a regular hexagonal prism with one corner raised by 1/2. The corners of these faces lie on a circle, so no
/// diagonal is Delaunay's choice.
TEST(Polyhedron, UnevenFacesAreCutAsByOpenScad) {
  const auto moved = [](Faces faces, std::size_t corner, int axis, double by) {
    faces.points[corner][static_cast<std::size_t>(axis)] += by;
    return std::fabs(volume(mesh_of(faces.solid())));
  };
  const Faces cube = prism({{0, 0}, {2, 0}, {2, 2}, {0, 2}}, 2);
  const std::array<std::array<double, 2>, 4> top{
      {{4, 26.0 / 3}, {5, 28.0 / 3}, {6, 26.0 / 3}, {7, 28.0 / 3}}};
  for (const auto& [corner, expected] : top)
    EXPECT_NEAR(moved(cube, static_cast<std::size_t>(corner), 2, 1), expected, 1e-12) << corner;
  const std::array<std::array<double, 2>, 4> side{
      {{1, 26.0 / 3}, {2, 28.0 / 3}, {5, 28.0 / 3}, {6, 26.0 / 3}}};
  for (const auto& [corner, expected] : side)
    EXPECT_NEAR(moved(cube, static_cast<std::size_t>(corner), 0, 1), expected, 1e-12) << corner;
  std::vector<std::array<double, 2>> hexagon;
  for (int i = 0; i < 6; ++i)
    hexagon.push_back({std::cos(std::numbers::pi * i / 3), std::sin(std::numbers::pi * i / 3)});
  EXPECT_NEAR(moved(prism(hexagon, 2), 7, 2, 0.5), 5.412658773652743, 1e-6);
}

TEST(Polyhedron, UnevenFacesDoNotDependOnWhereTheyStart) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < samples::rounds(300); ++round) {
    // On a circle, some turned and stretched.
    std::vector<std::array<double, 2>> polygon;
    const int n = 4 + static_cast<int>(random() % 9);
    const double turn = round % 3 == 0 ? 0 : unit(random), stretch = round % 2 == 0 ? 1 : 1 + unit(random);
    for (int i = 0; i < n; ++i)
      polygon.push_back({stretch * std::cos(turn + 2 * std::numbers::pi * i / n),
                         std::sin(turn + 2 * std::numbers::pi * i / n)});
    Faces faces = prism(polygon, 2);
    for (int i = 0; i < n; ++i)
      faces.points[static_cast<std::size_t>(n + i)][2] += 0.25 * static_cast<double>(random() % 4);
    const double first = volume(mesh_of(faces.solid()));
    for (int start = 1; start < n; ++start) {
      std::rotate(faces.faces.back().begin(), faces.faces.back().begin() + 1, faces.faces.back().end());
      EXPECT_NEAR(volume(mesh_of(faces.solid())), first, 1e-12) << n << " corners, from " << start;
    }
  }
}

TEST(Polyhedron, TriangulationHasNoFlippedTriangleInAPlane) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    const Expression solid = prism(random_star(random, 5 + static_cast<int>(random() % 300)), 1).solid();
    const TriangleMesh& mesh = mesh_of(solid);
    for (const auto& [i, j, k] : mesh.triangles) {
      const Point &a = mesh.points[i], &b = mesh.points[j], &c = mesh.points[k];
      if (a[2] != b[2] || b[2] != c[2]) continue;
      const double twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      EXPECT_GT(a[2] == 0 ? -twice : twice, 0);
    }
  }
}

TEST(Polyhedron, TVerticesClose) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(300); ++round) {
    Faces exact = box({0, 0, 0}, {6, 12, 6});
    add_t_vertices(exact, random);
    expect_solid(exact.solid(), 432, 1e-10);
    const auto star = random_star(random, 5 + static_cast<int>(random() % 10));
    const double scale = std::pow(10.0, static_cast<int>(random() % 7) - 3);
    Faces decimal = turned(prism(star, 2), random, scale);
    add_t_vertices(decimal, random);
    round_to_six_digits(decimal);
    const double expected = 2 * area(star) * std::pow(scale, 3);
    expect_solid(decimal.solid(), expected, 1e-3 * expected);
  }
}

TEST(Polyhedron, AnOpenEdgeIsNamed) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    Faces faces = prism(random_star(random, 4 + static_cast<int>(random() % 20)), 2);
    faces.faces.erase(faces.faces.begin() + static_cast<long>(random() % faces.faces.size()));
    try {
      faces.solid();
      FAIL() << "an open polyhedron was taken";
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("not closed: the edge from point"), std::string::npos);
    }
  }
  Faces faces = box({0, 0, 0}, {1, 1, 1});
  faces.faces.pop_back();
  try {
    faces.solid();
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(),
                 "polyhedron: not closed: the edge from point 1 (1, 0, 0) to point 3 (1, 1, 0) has no "
                 "matching face on its "
                 "other side; 3 more edges are open");
  }
}

TEST(Polyhedron, OneFaceWoundWronglyIsOpen) {
  Faces faces = box({0, 0, 0}, {1, 1, 1});
  std::reverse(faces.faces[2].begin(), faces.faces[2].end());
  EXPECT_THROW(faces.solid(), Error);
}

TEST(Polyhedron, ShellsAndCavities) {
  Faces faces = box({0, 0, 0}, {4, 4, 4});
  Faces inner = box({1, 1, 1}, {3, 3, 3});
  inner.reverse();
  faces.add(inner);
  faces.add(box({5, 0, 0}, {6, 1, 1}));
  expect_solid(faces.solid(), 64 - 8 + 1, 1e-12);
}

TEST(Polyhedron, BoxesThatShareAFaceAnEdgeOrAVertex) {
  for (const Point& corner : {Point{1, 0, 0}, Point{1, 1, 0}, Point{1, 1, 1}}) {
    Faces faces = box({0, 0, 0}, {1, 1, 1});
    faces.add(box(corner, {corner[0] + 1, corner[1] + 1, corner[2] + 1}));
    expect_solid(faces.solid(), 2, 1e-14);
  }
  // The two coincident faces of opposite sense bound nothing.
  Faces faces = box({0, 0, 0}, {1, 1, 1});
  faces.add(box({1, 0, 0}, {2, 1, 1}));
  EXPECT_EQ(mesh_of(faces.solid()).triangles.size(), 20u);
}

TEST(Polyhedron, FaceWithAHoleByABridge) {
  // A square frame: the outer cycle goes in to the inner one along a bridge and comes back on it.
  std::vector<std::array<double, 2>> frame{{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0},
                                           {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}};
  expect_solid(prism(frame, 3).solid(), 3 * 12, 1e-12);
}

TEST(Polyhedron, FlatFacesVanishAndTheirNeighboursClose) {
  // The top is cut at the middle of an edge; a triangle without area fills the gap, as mesh exporters write
  // it.
  Faces faces = box({0, 0, 0}, {2, 2, 2});
  faces.points.push_back({1, 0, 2});
  faces.faces[1] = {4, 6, 7, 5, 8};
  faces.faces.push_back({4, 8, 5});
  const Expression solid = faces.solid();
  expect_solid(solid, 8, 1e-12);
  for (const auto& [i, j, k] : mesh_of(solid).triangles) {
    const auto& p = mesh_of(solid).points;
    double largest = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      largest = std::max(largest, std::fabs((p[j][u] - p[i][u]) * (p[k][v] - p[i][v]) -
                                            (p[j][v] - p[i][v]) * (p[k][u] - p[i][u])));
    }
    EXPECT_GT(largest, 0);
  }
}

TEST(Polyhedron, WhatEnclosesNothingIsEmpty) {
  EXPECT_TRUE(is_empty(polyhedron({}, {})));
  EXPECT_TRUE(is_empty(polyhedron({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}, {2, 1, 0}})));
  EXPECT_TRUE(is_empty(polyhedron({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}, {0, 0, 1}, {2, 1}, {}})));
}

TEST(Polyhedron, BadIndicesAndNumbersAreErrors) {
  Faces faces = box({0, 0, 0}, {1, 1, 1});
  faces.faces[3][2] = 8;
  EXPECT_THROW(faces.solid(), Error);
  faces = box({0, 0, 0}, {1, 1, std::nan("")});
  EXPECT_THROW(faces.solid(), Error);
  faces = box({0, 0, 0}, {1, 1, 1e200});
  EXPECT_THROW(faces.solid(), Error);
}

TEST(Polyhedron, SmallModelsKeepTheirDetails) {
  // Far below the 2^-20 of OpenSCAD's grid, and closed as it stands.
  expect_solid(box({0, 0, 0}, {1e-8, 1e-8, 1e-12}).solid(), 1e-28, 1e-40);
  // A detail next to something large.
  Faces faces = box({0, 0, 0}, {1000, 1000, 1000});
  faces.add(box({2000, 0, 0}, {2000 + 1e-9, 1, 1}));
  EXPECT_EQ(mesh_of(faces.solid()).triangles.size(), 24u);
}

TEST(Polyhedron, NearlyEqualPointsMergeOnlyIfThatClosesTheMesh) {
  // As exporters write it: no shared points, and sin(180) = 1.22e-16 instead of 0 in some of them.
  std::mt19937 random(7);
  Faces soup;
  const Faces original = box({0, 0, 0}, {3, 3, 3});
  for (const Face& face : original.faces) {
    Face copy;
    for (const std::uint32_t i : face) {
      copy.push_back(static_cast<std::uint32_t>(soup.points.size()));
      Point p = original.points[i];
      for (double& x : p) x += static_cast<double>(random() % 3) * 1.22e-16;
      soup.points.push_back(p);
    }
    soup.faces.push_back(copy);
  }
  expect_solid(soup.solid(), 27, 1e-9);
  EXPECT_EQ(mesh_of(soup.solid()).points.size(), 8u);
}

/// An octahedron, each triangle cut into four `levels` times, on the unit sphere.
Faces sphere_mesh(int levels) {
  Faces mesh;
  mesh.points = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  mesh.faces = {{4, 2, 0}, {4, 1, 2}, {4, 3, 1}, {4, 0, 3}, {5, 0, 2}, {5, 2, 1}, {5, 1, 3}, {5, 3, 0}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, fresh] =
          middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(mesh.points.size()));
      if (fresh) {
        Point p;
        for (int k = 0; k < 3; ++k) p[k] = mesh.points[a][k] + mesh.points[b][k];
        const double length = std::hypot(p[0], p[1], p[2]);
        for (double& x : p) x /= length;
        mesh.points.push_back(p);
      }
      return entry->second;
    };
    std::vector<Face> faces;
    for (const Face& f : mesh.faces) {
      const std::uint32_t a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      faces.insert(faces.end(), {{f[0], a, c}, {a, f[1], b}, {c, b, f[2]}, {a, b, c}});
    }
    mesh.faces = faces;
  }
  return mesh;
}

TEST(Polyhedron, LargeMeshes) {
  const Expression ball = sphere_mesh(7).solid();  // 131072 triangles
  EXPECT_EQ(mesh_of(ball).triangles.size(), 131072u);
  expect_solid(ball, 4 * std::numbers::pi / 3, 1e-3);
  // A soup of the same triangles that shares no point, rounded: vertices merge.
  Faces soup;
  const Faces original = sphere_mesh(4);
  for (const Face& face : original.faces)
    soup.add({{original.points[face[0]], original.points[face[1]], original.points[face[2]]}, {{0, 1, 2}}});
  round_to_six_digits(soup);
  expect_solid(soup.solid(), 4 * std::numbers::pi / 3, 0.03);
}

TEST(Polyhedron, FacesOfManyCorners) {
  std::mt19937 random(11);
  const auto star = random_star(random, 20'000);
  expect_solid(prism(star, 1).solid(), area(star), 1e-8);
  std::vector<std::array<double, 2>> comb{{20'000, -1}, {20'000, 0}};
  for (int i = 19'999; i >= 0; --i) comb.push_back({static_cast<double>(i), i % 2 ? 100.0 : 1.0});
  comb.push_back({0, -1});
  expect_solid(prism(comb, 1).solid(), area(comb), 1e-4);
}

TEST(Polyhedron, AnyFacesAreAClosedMeshOrAnError) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  int solids = 0;
  for (int round = 0; round < samples::rounds(5000); ++round) {
    // Few positions on a grid, so that coincidences of all kinds are the rule.
    Faces faces;
    const auto coordinate = [&] { return static_cast<double>(random() % 3) * (round % 2 ? 1 : 0.1); };
    for (int i = 0; i < 12; ++i) faces.points.push_back({coordinate(), coordinate(), coordinate()});
    for (std::size_t i = 1 + random() % 4; i > 0; --i) {
      Face face;
      for (std::size_t k = 3 + random() % 6; k > 0; --k)
        face.push_back(static_cast<std::uint32_t>(random() % 12));
      faces.faces.push_back(face);
      // Now and then its opposite, cut at one more diagonal, so that the whole is closed.
      if (random() % 4 == 0) continue;
      std::reverse(face.begin(), face.end());
      faces.faces.emplace_back(face.begin(), face.begin() + 3);
      face.erase(face.begin() + 1);
      faces.faces.push_back(face);
    }
    try {
      const Expression solid = faces.solid();
      if (is_empty(solid)) continue;
      ++solids;
      EXPECT_TRUE(is_closed(mesh_of(solid)));
      EXPECT_GE(volume(solid), -1e-15);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("not closed"), std::string::npos);
    }
  }
  EXPECT_GT(solids, 0);
}

// --- faces that bound no solid ---

struct Repaired {
  std::optional<TriangleMesh> mesh;
  std::vector<std::string> warnings;
};

Repaired repaired(const Faces& faces, Holes holes = Holes::cap) {
  FaceCycles cycles;
  for (const Face& face : faces.faces) {
    cycles.corners.insert(cycles.corners.end(), face.begin(), face.end());
    cycles.end_face();
  }
  Repaired result;
  result.mesh = repaired_mesh(faces.points, cycles, holes,
                              [&](const std::string& text) { result.warnings.push_back(text); });
  return result;
}

TEST(Repair, LeavesSolidsAlone) {
  const Repaired box_again = repaired(box({0, 0, 0}, {1, 2, 3}));
  EXPECT_TRUE(box_again.warnings.empty());
  EXPECT_EQ(volume(*box_again.mesh), 6);
}

/// Prisms over stars with a face too many, too few, or the wrong way round are the prisms again: every face
/// is flat.
TEST(Repair, MakesAPrismAgain) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(150); ++round) {
    Faces faces = prism(random_star(random, 4 + static_cast<int>(random() % 20)), 2);
    const double expected = volume(*repaired(faces).mesh);
    const auto which = faces.faces.begin() + static_cast<long>(random() % faces.faces.size());
    constexpr std::array<const char*, 3> repairs{"Repaired: 1 face that was there already is left out",
                                                 "Repaired: 1 face wound unlike its neighbours is turned",
                                                 "open edges are closed by caps"};
    const int fault = round % 3;
    const char* const repair = repairs[static_cast<std::size_t>(fault)];
    if (fault == 0) faces.faces.push_back(std::vector(*which));
    if (fault == 1) std::reverse(which->begin(), which->end());
    if (fault == 2) faces.faces.erase(which);
    const Repaired result = repaired(faces);
    ASSERT_EQ(result.warnings.size(), 1U) << repair;
    EXPECT_NE(result.warnings[0].find("not closed: the edge from point"), std::string::npos)
        << result.warnings[0];
    EXPECT_NE(result.warnings[0].find(repair), std::string::npos) << result.warnings[0];
    ASSERT_TRUE(result.mesh.has_value());
    EXPECT_TRUE(is_closed(*result.mesh));
    EXPECT_NEAR(volume(*result.mesh), expected, 1e-12 * expected) << repair;
  }
}

/// Closed faces that bound no solid: prisms inside out, and ones of which every face is there several times.
TEST(Repair, NamesClosedMeshesThatAreInsideOutOrThereTwice) {
  const unsigned seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    Faces faces = prism(random_star(random, 4 + static_cast<int>(random() % 20)), 2);
    const double expected = volume(*repaired(faces).mesh);
    const std::size_t own = faces.faces.size();
    std::string said = "inside out: the shell with the corner (";
    if (round % 2 == 0) {
      faces.reverse();
    } else {
      said = "Repaired: " + std::to_string(2 * own) + " faces that were there already are left out";
      for (std::size_t i = 0; i < 2 * own; ++i) {
        faces.faces.push_back(faces.faces[i % own]);
        std::rotate(faces.faces.back().begin(), faces.faces.back().begin() + 1, faces.faces.back().end());
      }
      std::shuffle(faces.faces.begin(), faces.faces.end(), random);
    }
    const Repaired result = repaired(faces);
    ASSERT_EQ(result.warnings.size(), 1U) << said;
    EXPECT_NE(result.warnings[0].find(said), std::string::npos) << result.warnings[0];
    ASSERT_TRUE(result.mesh.has_value());
    EXPECT_NEAR(volume(*result.mesh), expected, 1e-12 * expected);
    if (round % 2 == 0) {
      const Repaired quiet = repaired(faces, Holes::refuse);
      EXPECT_TRUE(quiet.warnings.empty()) << "OpenSCAD does not speak of a polyhedron that is inside out";
      EXPECT_NEAR(volume(*quiet.mesh), expected, 1e-12 * expected);
    }
  }
}

TEST(Repair, RefusesHolesOnly) {
  Faces open = box({0, 0, 0}, {1, 1, 1}), turned = open, doubled = open;
  open.faces.pop_back();
  EXPECT_THROW(repaired(open, Holes::refuse), OpenMesh);
  std::reverse(turned.faces[2].begin(), turned.faces[2].end());
  EXPECT_EQ(volume(*repaired(turned, Holes::refuse).mesh), 1);
  doubled.faces.push_back(doubled.faces[0]);
  EXPECT_EQ(volume(*repaired(doubled, Holes::refuse).mesh), 1);
}

/// Any points: the hull of what comes out holds them all.
TEST(Repair, WhatPointsSpanHasTheirHull) {
  const Primitive tetrahedron = spanned({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.1, 0.1, 0.1}});
  EXPECT_FALSE(is_flat(tetrahedron));
  EXPECT_NEAR(volume(std::get<TriangleMesh>(tetrahedron)), 1.0 / 6, 1e-15);
  const auto corners = [](const std::vector<Point3>& points) {
    const Primitive flat = spanned(points);
    EXPECT_TRUE(is_flat(flat));
    return std::get<Polytope>(flat).corners;
  };
  using Numbers = std::vector<double>;
  EXPECT_EQ(corners({{0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}, {0.5, 0.5, 1}, {0, 0, 1}}),
            (Numbers{0, 0, 1, 0, 1, 1, 1, 0, 1, 1, 1, 1}));
  EXPECT_EQ(corners({{0, 0, 0}, {3, 3, 3}, {1, 1, 1}}), (Numbers{0, 0, 0, 3, 3, 3}));
  EXPECT_EQ(corners({{2, 0, 1}, {2, 0, 1}}), (Numbers{2, 0, 1}));
}

TEST(Repair, LeavesSheetsOut) {
  Faces sheet;
  for (int y = 0; y < 5; ++y)
    for (int x = 0; x < 5; ++x)
      sheet.points.push_back({1.0 * x, 1.0 * y, std::sin(1.5 * x) * std::cos(1.1 * y)});
  for (std::uint32_t y = 0; y < 4; ++y)
    for (std::uint32_t x = 0; x < 4; ++x)
      sheet.faces.push_back({5 * y + x, 5 * y + x + 1, 5 * y + x + 6, 5 * y + x + 5});
  const Repaired alone = repaired(sheet);
  EXPECT_FALSE(alone.mesh.has_value());
  ASSERT_EQ(alone.warnings.size(), 1U);
  EXPECT_NE(alone.warnings[0].find("1 part that is an open sheet"), std::string::npos) << alone.warnings[0];
  Faces both = box({10, 0, 0}, {12, 2, 2});
  both.add(sheet);
  EXPECT_EQ(volume(*repaired(both).mesh), 8) << "what is a solid stays";
}

TEST(Repair, WindingNumbersAreSharesOfTheSphere) {
  const Repaired cube = repaired(box({-1, -1, -1}, {1, 1, 1}));
  EXPECT_NEAR(winding_number(cube.mesh->points, cube.mesh->triangles, {0.3, -0.2, 0.5}), 1, 1e-14);
  EXPECT_NEAR(winding_number(cube.mesh->points, cube.mesh->triangles, {1.3, -0.2, 0.5}), 0, 1e-14);
  std::vector<Triangle> open = cube.mesh->triangles;
  std::erase_if(open, [&](const Triangle& t) {
    return std::all_of(t.begin(), t.end(), [&](std::uint32_t i) { return cube.mesh->points[i][2] == 1; });
  });
  EXPECT_NEAR(winding_number(cube.mesh->points, open, {0, 0, 0}), 5.0 / 6, 1e-14);
}

}  // namespace
}  // namespace bsp2::model
