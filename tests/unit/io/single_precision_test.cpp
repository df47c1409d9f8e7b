// Surfaces in single precision, read back by a reader that knows nothing but the bytes of the file.
#include <gtest/gtest.h>

#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <random>

#include "bsp2/io/outputs/surface.hpp"
#include "support/rounds.hpp"
#include "support/seeds.hpp"
#include "support/temporary_folder.hpp"

namespace bsp2::io {
namespace {

namespace fs = std::filesystem;
using geometry::TriangleSurface;
using Point = std::array<double, 3>;
using Corner = std::array<float, 3>;
using Facet = std::array<Corner, 3>;

/// The facets of a binary STL file.
std::vector<Facet> read_stl(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, sizeof count);
  EXPECT_EQ(bytes.size(), 84 + 50 * std::size_t{count});
  std::vector<Facet> facets(count);
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(&facets[i], bytes.data() + 84 + 50 * i + 12, sizeof(Facet));
  return facets;
}

/// In units of 2^-149: every float is a whole number of them.
boost::multiprecision::cpp_int whole(float x) {
  int exponent = 0;
  const float fraction = std::frexp(x, &exponent);
  boost::multiprecision::cpp_int number(static_cast<std::int64_t>(std::ldexp(fraction, 24)));
  return exponent + 125 >= 0 ? boost::multiprecision::cpp_int(number << (exponent + 125))
                             : boost::multiprecision::cpp_int(number >> -(exponent + 125));
}

bool has_area(const Facet& facet) {
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3;
    const auto along = [&](std::size_t corner, std::size_t axis) {
      return boost::multiprecision::cpp_int(whole(facet[corner][axis]) - whole(facet[0][axis]));
    };
    if (along(1, k) * along(2, l) != along(1, l) * along(2, k)) return true;
  }
  return false;
}

double volume_of(const std::vector<Facet>& facets) {
  long double six = 0;
  for (const Facet& f : facets) {
    std::array<std::array<long double, 3>, 3> v;
    for (std::size_t i = 0; i < 3; ++i)
      for (std::size_t k = 0; k < 3; ++k) v[i][k] = static_cast<long double>(f[i][k]) - facets[0][0][k];
    for (std::size_t k = 0; k < 3; ++k)
      six += v[0][k] * (v[1][(k + 1) % 3] * v[2][(k + 2) % 3] - v[1][(k + 2) % 3] * v[2][(k + 1) % 3]);
  }
  return static_cast<double>(six / 6);
}

void expect_sound(const std::vector<Facet>& facets) {
  std::map<std::pair<Corner, Corner>, int> uses;
  std::size_t flat = 0;
  for (const Facet& facet : facets) {
    flat += !has_area(facet);
    for (std::size_t k = 0; k < 3; ++k) {
      const Corner &a = facet[k], &b = facet[(k + 1) % 3];
      if (a < b)
        ++uses[{a, b}];
      else
        --uses[{b, a}];
    }
  }
  EXPECT_EQ(flat, 0U) << "of " << facets.size();
  for (const auto& [edge, difference] : uses)
    ASSERT_EQ(difference, 0) << "an edge is not used equally often in both directions";
}

/// A closed grid of n x m quadrangles, each two triangles, bent around a ring; `place` says where each point
/// is.
void add_ring(TriangleSurface& surface, std::uint32_t n, std::uint32_t m,
              const std::function<Point(double, double)>& place) {
  const auto first = static_cast<std::uint32_t>(surface.points.size());
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < m; ++j)
      surface.points.push_back(place(static_cast<double>(i) / n, static_cast<double>(j) / m));
  for (std::uint32_t i = 0; i < n; ++i)
    for (std::uint32_t j = 0; j < m; ++j) {
      const std::uint32_t a = first + i * m + j, b = first + (i + 1) % n * m + j,
                          c = first + (i + 1) % n * m + (j + 1) % m, d = first + i * m + (j + 1) % m;
      surface.triangles.insert(surface.triangles.end(), {{a, b, c}, {a, c, d}});
      surface.owner.insert(surface.owner.end(), {0, 0});
    }
}

/// A box of which each side is a grid of n x n squares: many corners on a line. Six sides, points shared.
void add_box(TriangleSurface& surface, int n, const Point& low, const Point& size) {
  std::map<std::array<int, 3>, std::uint32_t> numbers;
  const auto point = [&](const std::array<int, 3>& at) {
    const auto [found, is_new] = numbers.try_emplace(at, static_cast<std::uint32_t>(surface.points.size()));
    if (is_new)
      surface.points.push_back(
          {low[0] + size[0] * at[0] / n, low[1] + size[1] * at[1] / n, low[2] + size[2] * at[2] / n});
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const int side : {0, n})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          std::array<std::uint32_t, 4> around;
          for (int corner = 0; corner < 4; ++corner) {
            std::array<int, 3> at;
            at[axis] = side;
            at[(axis + 1) % 3] = i + (corner == 1 || corner == 2);
            at[(axis + 2) % 3] = j + (corner >= 2);
            around[side == 0 ? 3 - corner : corner] = point(at);
          }
          surface.triangles.insert(surface.triangles.end(),
                                   {{around[0], around[1], around[2]}, {around[0], around[2], around[3]}});
          surface.owner.insert(surface.owner.end(), {0, 0});
        }
}

class SinglePrecision : public ::testing::Test {
 protected:
  samples::TemporaryFolder folder;
  std::string warning;

  std::vector<Facet> written(const TriangleSurface& surface) {
    EXPECT_TRUE(surface.is_closed());
    const fs::path file = folder.path() / "a.stl";
    warning = write_surface(file, surface).warning;
    return read_stl(file);
  }
};

/// What all formats promise, however much of it single precision spoils: closed by the coordinates, no
/// triangle without area, and around the volume that the rounded corners have.
TEST_F(SinglePrecision, RandomSurfacesStayClosedWithoutFlatTriangles) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  const auto number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto whole_number = [&](int low, int high) {
    return std::uniform_int_distribution<int>(low, high)(random);
  };
  int spoiled = 0;
  for (int round = 0; round < samples::rounds(300); ++round) {
    SCOPED_TRACE("round " + std::to_string(round));
    TriangleSurface surface;
    for (int part = whole_number(1, 3); part > 0; --part) {
      const double size = std::pow(10, number(-3, 3));
      const Point thickness{std::pow(10, -number(0, 7) * whole_number(0, 1)),
                            std::pow(10, -number(0, 7) * whole_number(0, 1)), 1};
      Point middle;
      for (double& x : middle) x = size * number(-1, 1) * std::pow(10, number(0, 9) * whole_number(0, 1));
      if (whole_number(0, 1) == 0) {
        add_box(surface, whole_number(1, 12), middle, {size * thickness[0], size * thickness[1], size});
        continue;
      }
      const double bore = number(0.1, 0.9), turn = number(0, 6.3);
      add_ring(
          surface, static_cast<std::uint32_t>(whole_number(3, 40)),
          static_cast<std::uint32_t>(whole_number(3, 20)), [&](double u, double v) -> Point {
            const double a = 2 * std::numbers::pi * u, b = 2 * std::numbers::pi * v,
                         r = 1 + bore * std::cos(b);
            const Point p{r * std::cos(a) * thickness[0], r * std::sin(a) * thickness[1], bore * std::sin(b)};
            return {middle[0] + size * (std::cos(turn) * p[0] - std::sin(turn) * p[2]),
                    middle[1] + size * p[1],
                    middle[2] + size * (std::sin(turn) * p[0] + std::cos(turn) * p[2])};
          });
    }
    const std::vector<Facet> facets = written(surface);
    expect_sound(facets);
    spoiled += facets.size() < surface.triangles.size();
    std::vector<Facet> rounded;
    for (const auto& t : surface.triangles) {
      Facet& facet = rounded.emplace_back();
      for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t k = 0; k < 3; ++k) facet[i][k] = static_cast<float>(surface.points[t[i]][k]);
    }
    double reach = 0, span = 0;  // what rounding errors of the sum are relative to
    for (const Facet& f : rounded)
      for (std::size_t k = 0; k < 3; ++k)
        span = std::max(span, std::fabs(static_cast<double>(f[0][k]) - rounded[0][0][k]));
    reach = span * span * span * static_cast<double>(rounded.size());
    EXPECT_NEAR(facets.empty() ? 0 : volume_of(facets), volume_of(rounded), 1e-16 * reach);
  }
  EXPECT_GT(spoiled, samples::rounds(30)) << "too few surfaces that single precision cannot hold";
}

/// Needles whose longest sides are as long as each other: in doubles they are flat, exactly they are not.
TEST_F(SinglePrecision, NeedlesInARingEnd) {
  TriangleSurface surface;
  surface.points = {{1, 1, 1}, {0, 0, 0}, {0, 2e-17, 0}, {0, 0, 2e-17}};
  surface.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}};
  surface.owner.assign(4, 0);
  expect_sound(written(surface));
}

/// A ridge so short that doubles find no area beside it: what replaces the two needles there is a needle,
/// too, with edges to corners that no needle had before.
TEST_F(SinglePrecision, NeedlesThatArisePassOnTheirPlace) {
  const auto seed = samples::new_seed();
  SCOPED_TRACE("seed " + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int round = 0; round < samples::rounds(200); ++round) {
    TriangleSurface surface;  // over the triangle 0 1 2 the ridge 3 4
    for (int corner = 0; corner < 3; ++corner) {
      const double angle = 2 * std::numbers::pi * (corner + 0.3 * number(random)) / 3;
      surface.points.push_back({5 * std::cos(angle), -4 + number(random), 5 * std::sin(angle)});
    }
    const double height = 3 + number(random);
    surface.points.push_back({1e-22 * number(random), height, 1e-22 * number(random)});
    surface.points.push_back({0, height, 0});
    surface.triangles = {{0, 1, 2}, {1, 0, 3}, {2, 1, 4}, {1, 3, 4}, {0, 2, 4}, {3, 0, 4}};
    surface.owner.assign(6, 0);
    const std::vector<Facet> facets = written(surface);
    expect_sound(facets);
    EXPECT_GE(facets.size(), 4U);
  }
}

/// The rim of a hole comes to lie on the rim of the plate, and its corners in the middle of edges.
TEST_F(SinglePrecision, ACornerThatComesToLieOnAnEdgeDividesIt) {
  TriangleSurface surface;  // a pyramid over a quadrangle that is nearly a triangle
  surface.points = {{0, 0, 0}, {2, 0, 0}, {1, 1e-9, 0}, {0, 2, 0}, {0, 0, 5}};
  for (auto& point : surface.points) point[1] += 64;
  surface.triangles = {{0, 2, 1}, {0, 3, 2}, {2, 3, 1}, {0, 1, 4}, {1, 3, 4}, {3, 0, 4}};
  surface.owner.assign(6, 0);
  const std::vector<Facet> facets = written(surface);
  expect_sound(facets);
  EXPECT_EQ(facets.size(), 6U) << "the side over the long edge becomes two";
  EXPECT_NEAR(volume_of(facets), 10.0 / 3, 1e-6);
}

/// Each part is told of by itself: the whole is 500 km long, and what is spoiled is 1.
TEST_F(SinglePrecision, TheLossOfEachPartCounts) {
  TriangleSurface surface;
  add_box(surface, 1, {0, 0, 0}, {1, 1, 1});
  written(surface);
  EXPECT_EQ(warning, "");
  add_box(surface, 1, {500000.25, 5400000.3, 300.1}, {1, 1, 1});
  expect_sound(written(surface));
  EXPECT_NE(warning.find("1 of the 2 connected parts"), std::string::npos) << warning;
  EXPECT_NE(warning.find("5.4e+06"), std::string::npos) << warning;
  surface = {};
  add_box(surface, 1, {0, 0, 100.3}, {100, 100, 1e-4});  // its size hardly changes, its volume does
  expect_sound(written(surface));
  EXPECT_NE(warning.find("changes the solid by"), std::string::npos) << warning;
  surface = {};
  add_box(surface, 1, {0, 0, 100.3}, {100, 100, 10});
  written(surface);
  EXPECT_EQ(warning, "");
}

/// A part that is thinner than single precision can tell encloses nothing any more, which is told.
TEST_F(SinglePrecision, WhatBecomesFlatIsTold) {
  TriangleSurface surface;
  add_box(surface, 5, {7, 8, 1000}, {1, 1, 1e-6});
  const std::vector<Facet> facets = written(surface);
  expect_sound(facets);
  EXPECT_EQ(volume_of(facets), 0);
  EXPECT_NE(warning.find("becomes 0"), std::string::npos) << warning;
}

}  // namespace
}  // namespace bsp2::io
