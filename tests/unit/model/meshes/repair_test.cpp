// Meshes as scanners and careless programs leave them, against the flawless ones that they were made of.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <utility>

#include "builder/polyhedron.hpp"
#include "import/imports.hpp"
#include "mesh/mesh_closing.hpp"
#include "mesh/mesh_triangulation.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"

namespace bsp2::model {
namespace {

using Random = std::mt19937;

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

/// Triangles seen from outside counter-clockwise.
struct Surface {
  std::vector<Point3> points;
  std::vector<Triangle> triangles;

  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
    triangles.insert(triangles.end(), {{a, b, c}, {a, c, d}});
  }
};

double area(const std::vector<Point3>& points, const std::vector<Triangle>& triangles) {
  double sum = 0;
  for (const Triangle& t : triangles) {
    Point3 u, v;
    for (std::size_t k = 0; k < 3; ++k)
      u[k] = points[t[1]][k] - points[t[0]][k], v[k] = points[t[2]][k] - points[t[0]][k];
    sum += std::hypot(u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]) / 2;
  }
  return sum;
}

bool is_closed(const std::vector<Triangle>& triangles) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> excess;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      excess[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  return std::all_of(excess.begin(), excess.end(), [](const auto& edge) { return edge.second == 0; });
}

Surface sphere(std::size_t facets) {
  const auto rings = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(facets) / 4)) + 1,
             sides = 2 * rings;
  Surface s;
  s.points = {{0, 0, -10}, {0, 0, 10}};
  for (std::uint32_t i = 1; i < rings; ++i)
    for (std::uint32_t j = 0; j < sides; ++j) {
      const double p = std::numbers::pi * i / rings, t = 2 * std::numbers::pi * j / sides;
      s.points.push_back({10 * std::sin(p) * std::cos(t), 10 * std::sin(p) * std::sin(t), -10 * std::cos(p)});
    }
  const auto at = [&](std::uint32_t i, std::uint32_t j) { return 2 + (i - 1) * sides + j % sides; };
  for (std::uint32_t j = 0; j < sides; ++j) {
    s.triangles.push_back({0, at(1, j + 1), at(1, j)});
    s.triangles.push_back({1, at(rings - 1, j), at(rings - 1, j + 1)});
    for (std::uint32_t i = 1; i + 1 < rings; ++i)
      s.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
  }
  return s;
}

/// What stands over a plane outline with a hole (both counter-clockwise), in layers; its ends are
/// triangulated as faces, so they are of long slivers.
Surface prism(const std::vector<std::array<double, 2>>& outline,
              const std::vector<std::array<double, 2>>& hole, double height, std::uint32_t layers) {
  Surface s;
  const auto n = static_cast<std::uint32_t>(outline.size()), m = static_cast<std::uint32_t>(hole.size());
  for (std::uint32_t i = 0; i <= layers; ++i) {
    for (const auto& p : outline) s.points.push_back({p[0], p[1], height * i / layers});
    for (const auto& p : hole) s.points.push_back({p[0], p[1], height * i / layers});
  }
  for (std::uint32_t i = 0; i < layers; ++i) {
    const std::uint32_t low = i * (n + m), high = low + n + m;
    for (std::uint32_t j = 0; j < n; ++j) s.quad(low + j, low + (j + 1) % n, high + (j + 1) % n, high + j);
    for (std::uint32_t j = 0; j < m; ++j)
      s.quad(low + n + (j + 1) % m, low + n + j, high + n + j, high + n + (j + 1) % m);
  }
  // The end from above: around the outline, along a bridge to the nearest corner of the hole, around that
  // one, and back.
  std::uint32_t nearest = 0;
  const auto distance = [&](std::uint32_t j) {
    return std::hypot(hole[j][0] - outline[0][0], hole[j][1] - outline[0][1]);
  };
  for (std::uint32_t j = 1; j < m; ++j)
    if (distance(j) < distance(nearest)) nearest = j;
  std::vector<std::uint32_t> cycle;
  const std::uint32_t top = layers * (n + m);
  for (std::uint32_t j = 0; j <= n; ++j) cycle.push_back(top + j % n);
  for (std::uint32_t j = 0; j <= m && m > 0; ++j) cycle.push_back(top + n + (nearest + m - j % m) % m);
  if (m == 0) cycle.pop_back();
  std::vector<Triangle> end;
  Triangulator(s.points).triangulate(cycle, end);
  for (const Triangle& t : end) {
    s.triangles.push_back(t);
    s.triangles.push_back({t[0] - top, t[2] - top, t[1] - top});
  }
  return s;
}

std::vector<std::array<double, 2>> circle(double x, double y, double r, std::size_t sides) {
  std::vector<std::array<double, 2>> points;
  for (std::size_t j = 0; j < sides; ++j) {
    const double t = 2 * std::numbers::pi * static_cast<double>(j) / static_cast<double>(sides);
    points.push_back({x + r * std::cos(t), y + r * std::sin(t)});
  }
  return points;
}

/// An angle with a bore, of edges of about the same length along the outline.
Surface bracket(std::size_t facets) {
  const auto step = static_cast<std::size_t>(std::max(4.0, std::sqrt(static_cast<double>(facets) / 40)));
  const std::vector<std::array<double, 2>> corners{{0, 0}, {20, 0}, {20, 6}, {6, 6}, {6, 20}, {0, 20}};
  std::vector<std::array<double, 2>> outline;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto &p = corners[i], &q = corners[(i + 1) % corners.size()];
    for (std::size_t j = 0; j < step; ++j) {
      const double t = static_cast<double>(j) / static_cast<double>(step);
      outline.push_back({p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])});
    }
  }
  const auto hole = circle(3, 3, 2, 3 * step);
  const auto layers =
      static_cast<std::uint32_t>(std::max<std::size_t>(1, facets / (2 * (outline.size() + hole.size()))));
  return prism(outline, hole, 9, layers);
}

Surface gear(std::size_t facets) {
  const auto teeth = static_cast<std::size_t>(std::max(8.0, std::sqrt(static_cast<double>(facets) / 30)));
  std::vector<std::array<double, 2>> outline;
  for (std::size_t i = 0; i < teeth; ++i)
    for (const auto& [at, r] : {std::pair(0.0, 9.0), {0.45, 9.0}, {0.55, 10.0}, {0.75, 10.2}, {0.95, 10.0}}) {
      const double t = 2 * std::numbers::pi * (static_cast<double>(i) + at) / static_cast<double>(teeth);
      outline.push_back({r * std::cos(t), r * std::sin(t)});
    }
  const auto hole = circle(0, 0, 3, 2 * teeth);
  const auto layers =
      static_cast<std::uint32_t>(std::max<std::size_t>(1, facets / (2 * (outline.size() + hole.size()))));
  return prism(outline, hole, 5, layers);
}

Surface height_field(std::size_t facets) {
  const auto n = static_cast<std::uint32_t>(std::sqrt(static_cast<double>(facets) / 4)) + 1;
  Surface s;
  const auto height = [&](std::uint32_t x, std::uint32_t y) {
    return 3 + std::sin(9.0 * x / n) * std::cos(7.0 * y / n);
  };
  for (const bool top : {false, true})
    for (std::uint32_t y = 0; y <= n; ++y)
      for (std::uint32_t x = 0; x <= n; ++x)
        s.points.push_back({20.0 * x / n, 20.0 * y / n, top ? height(x, y) : 0});
  const std::uint32_t up = (n + 1) * (n + 1);
  const auto at = [&](std::uint32_t x, std::uint32_t y) { return y * (n + 1) + x; };
  for (std::uint32_t i = 0; i < n; ++i) {
    for (std::uint32_t j = 0; j < n; ++j) {
      s.quad(up + at(i, j), up + at(i + 1, j), up + at(i + 1, j + 1), up + at(i, j + 1));
      s.quad(at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j));
    }
    s.quad(at(i, 0), at(i + 1, 0), up + at(i + 1, 0), up + at(i, 0));
    s.quad(at(i + 1, n), at(i, n), up + at(i, n), up + at(i + 1, n));
    s.quad(at(0, i + 1), at(0, i), up + at(0, i), up + at(0, i + 1));
    s.quad(at(n, i), at(n, i + 1), up + at(n, i + 1), up + at(n, i));
  }
  return s;
}

double size_of(const Surface& s) {
  Point3 low = s.points[0], high = low;
  for (const Point3& p : s.points)
    for (std::size_t k = 0; k < 3; ++k) low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
  return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
}

struct Damage {
  double jitter = 1e-4;  ///< of the size, either way along each axis
  double missing = 0.01, turned = 0.01, doubled = 0.01;
};

/// The facets as an STL file has them, each with corners of its own. The faces are clockwise, as
/// repaired_mesh takes them.
struct Soup {
  std::vector<Point3> points;
  FaceCycles faces;
};

Soup damaged(const Surface& s, const Damage& damage, Random& random) {
  Soup soup;
  const double jitter = damage.jitter * size_of(s);
  const auto add = [&](const Triangle& t, bool turned) {
    for (std::size_t k = 0; k < 3; ++k) {
      Point3 p = s.points[t[turned ? k : 2 - k]];
      for (double& x : p) x += uniform(random, -jitter, jitter);
      soup.faces.corners.push_back(static_cast<std::uint32_t>(soup.points.size()));
      soup.points.push_back(p);
    }
    soup.faces.end_face();
  };
  for (const Triangle& t : s.triangles) {
    if (uniform(random, 0, 1) < damage.missing) continue;
    add(t, uniform(random, 0, 1) < damage.turned);
    if (uniform(random, 0, 1) < damage.doubled) add(t, uniform(random, 0, 1) < damage.turned);
  }
  return soup;
}

using Make = Surface (*)(std::size_t);
constexpr std::pair<const char*, Make> makers[] = {
    {"sphere", sphere}, {"bracket", bracket}, {"gear", gear}, {"height field", height_field}};

/// What comes out is the flawless part, whatever is wrong with it and with all of it wrong at once.
void expect_the_same_part(const char* name, Make make, std::size_t facets, const Damage& damage,
                          Random& random) {
  const Surface flawless = make(facets);
  ASSERT_TRUE(is_closed(flawless.triangles));
  const Soup soup = damaged(flawless, damage, random);
  std::vector<std::string> warnings;
  const auto mesh = repaired_mesh(soup.points, soup.faces, Holes::cap,
                                  [&](const std::string& text) { warnings.push_back(text); });
  SCOPED_TRACE(testing::Message() << name << " of " << flawless.triangles.size() << " facets; "
                                  << (warnings.empty() ? "" : warnings[0]));
  ASSERT_TRUE(mesh.has_value());
  EXPECT_TRUE(is_closed(mesh->triangles));
  const double volume = signed_volume(flawless.points, flawless.triangles),
               surface = area(flawless.points, flawless.triangles);
  EXPECT_NEAR(signed_volume(mesh->points, mesh->triangles), volume, 0.01 * volume);
  EXPECT_NEAR(area(mesh->points, mesh->triangles), surface, 0.01 * surface);
}

TEST(Repair, IsTheSamePartWhateverIsWrong) {
  const std::uint32_t seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  std::size_t most = 6000;
  if (const char* given = std::getenv("BSP2_MOST_FACETS")) most = std::strtoul(given, nullptr, 10);
  for (int round = 0; round < samples::rounds(1); ++round)
    for (const auto& [name, make] : makers) {
      const auto facets =
          static_cast<std::size_t>(1000 * std::pow(static_cast<double>(most) / 1000, uniform(random, 0, 1)));
      expect_the_same_part(name, make, facets, {}, random);
      for (const Damage& alone : {Damage{1e-4, 0, 0, 0},
                                  {0, 0.01, 0, 0},
                                  {0, 0, 0.01, 0},
                                  {0, 0, 0, 0.01},
                                  {1e-4, 0.003, 0, 0},
                                  {0, 0.01, 0.01, 0.01}})
        expect_the_same_part(name, make, 1000, alone, random);
    }
}

/// Two neighbours are missing, within a plane or across an edge of the box: the box comes out as it was.
TEST(Repair, AnEdgeGoesOnThroughAHole) {
  const std::uint32_t seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const Surface box = prism({{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}, {}, 2, 2);
  const double volume = signed_volume(box.points, box.triangles), surface = area(box.points, box.triangles);
  for (int round = 0; round < samples::rounds(200); ++round) {
    const auto first = random() % box.triangles.size();
    FaceCycles faces;
    bool is_second_out = false;
    const std::size_t start = random() % box.triangles.size();
    for (std::size_t i = 0; i < box.triangles.size(); ++i) {
      const std::size_t at = (start + i) % box.triangles.size();
      const Triangle &t = box.triangles[at], &u = box.triangles[first];
      const auto shared = std::count_if(t.begin(), t.end(), [&](std::uint32_t corner) {
        return std::find(u.begin(), u.end(), corner) != u.end();
      });
      if (at == first || (shared == 2 && !is_second_out)) {
        is_second_out |= at != first;
        continue;
      }
      faces.corners.insert(faces.corners.end(), t.rbegin(), t.rend());
      faces.end_face();
    }
    const auto mesh = repaired_mesh(box.points, faces, Holes::cap, [](const std::string&) {});
    ASSERT_TRUE(mesh.has_value());
    EXPECT_TRUE(is_closed(mesh->triangles));
    EXPECT_NEAR(signed_volume(mesh->points, mesh->triangles), volume, 1e-12) << round;
    EXPECT_NEAR(area(mesh->points, mesh->triangles), surface, 1e-12) << round;
  }
}

/// Of whatever triangles, in a heap or far apart, with corners on a grid or not, a closed mesh is made, or
/// nothing.
TEST(Repair, AHeapOfTrianglesIsClosedOrLeftOut) {
  const std::uint32_t seed = samples::new_seed();
  SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed);
  Random random(seed);
  const std::clock_t start = std::clock();
  for (int round = 0; round < samples::rounds(80); ++round) {
    Soup soup;
    const double reach = std::pow(10, uniform(random, -5, 1)),
                 grid = random() % 2 == 0 ? 0 : uniform(random, 2, 30), far = random() % 5 == 0 ? 1e30 : 1;
    const std::size_t count = 1 + random() % 200;
    for (std::size_t f = 0; f < count; ++f) {
      const Point3 centre{uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0, 1)};
      for (int k = 0; k < 3; ++k) {
        Point3 p = centre;
        for (double& x : p) {
          x += uniform(random, -reach, reach);
          if (grid > 0) x = std::floor(x * grid) / grid;
          if (random() % 50 == 0) x *= far;
        }
        soup.faces.corners.push_back(static_cast<std::uint32_t>(soup.points.size()));
        soup.points.push_back(p);
      }
      soup.faces.end_face();
    }
    std::string warning;
    const auto mesh =
        repaired_mesh(soup.points, soup.faces, Holes::cap, [&](const std::string& text) { warning = text; });
    if (mesh) {
      EXPECT_FALSE(warning.empty()) << "no heap is closed by itself";
      EXPECT_TRUE(is_closed(mesh->triangles)) << warning;
    }
  }
  EXPECT_LT(std::clock() - start, 60 * CLOCKS_PER_SEC)
      << "of the processor; 2 s are right, and corners at 1e30 once multiplied without end";
}

ImportedMesh case_file(const std::string& name) {
  return import_mesh(std::filesystem::path(BSP2_SOURCE_DIR) / "tests" / "cases" / name);
}

TEST(Repair, ASphereOfLooseCornersWithAHoleIsThatSphere) {
  const ImportedMesh file = case_file("sphere-jitter-hole.stl");
  std::vector<std::string> warnings;
  const auto mesh = repaired_mesh(file.points, file.faces, Holes::cap,
                                  [&](const std::string& text) { warnings.push_back(text); });
  ASSERT_TRUE(mesh.has_value());
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("Repaired: 362 corners that are up to 1.73e-05 apart from others are merged "
                             "with these. 3 open edges are closed by caps"),
            std::string::npos)
      << warnings[0];
  EXPECT_TRUE(is_closed(mesh->triangles));
  EXPECT_NEAR(area(mesh->points, mesh->triangles), 1003.4, 0.1);
}

/// 700 facets, some of them with corners at 1e36, took 17 s.
TEST(Repair, ADamagedFileTakesNoTime) {
  const ImportedMesh file = case_file("stl-damaged-slow.stl");
  const std::clock_t start = std::clock();
  const auto mesh = repaired_mesh(file.points, file.faces, Holes::cap, [](const std::string&) {});
  EXPECT_LT(std::clock() - start, (samples::is_sanitized ? 60 : 5) * CLOCKS_PER_SEC) << "of the processor";
  if (mesh) {
    EXPECT_TRUE(is_closed(mesh->triangles));
  }
}

}  // namespace
}  // namespace bsp2::model
