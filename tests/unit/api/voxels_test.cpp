#include "viewer/voxels.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "serving/gaze.hpp"
#include "support/rounds.hpp"
#include "viewed.hpp"
#include "viewer/levels.hpp"
#include "viewer/packing.hpp"

namespace bsp2::api {
namespace {

using Triangle = std::array<Point, 3>;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point mixed(const Triangle& t, double u, double v) {
  Point p{};
  for (std::size_t k = 0; k < 3; ++k) p[k] = t[0][k] + u * (t[1][k] - t[0][k]) + v * (t[2][k] - t[0][k]);
  return p;
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Of a point from a segment, and from a triangle: at a place within it, or on its border.
double distance(const Point& p, const Point& a, const Point& b) {
  const Point along = minus(b, a);
  const double length = dot(along, along);
  const double t = length > 0 ? std::clamp(dot(minus(p, a), along) / length, 0.0, 1.0) : 0;
  const Point off = minus(p, {a[0] + t * along[0], a[1] + t * along[1], a[2] + t * along[2]});
  return std::sqrt(dot(off, off));
}
double distance(const Point& p, const Triangle& t) {
  const Point u = minus(t[1], t[0]), v = minus(t[2], t[0]), w = minus(p, t[0]);
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), wu = dot(w, u), wv = dot(w, v);
  const double determinant = uu * vv - uv * uv;
  double best = std::min({distance(p, t[0], t[1]), distance(p, t[1], t[2]), distance(p, t[2], t[0])});
  if (determinant <= 0) return best;
  const double s = (vv * wu - uv * wv) / determinant, r = (uu * wv - uv * wu) / determinant;
  if (s < 0 || r < 0 || s + r > 1) return best;
  const Point off = minus(p, mixed(t, s, r));
  return std::min(best, std::sqrt(dot(off, off)));
}
double distance(const Point& p, const std::vector<Triangle>& triangles) {
  double best = 1e300;
  for (const Triangle& triangle : triangles) best = std::min(best, distance(p, triangle));
  return best;
}

/// Triangles on whole places, and whose they are.
struct Crowd {
  std::vector<std::uint32_t> places, corners, owners;
  void add(const Triangle& triangle, std::uint32_t owner) {
    for (const Point& corner : triangle) {
      corners.push_back(static_cast<std::uint32_t>(places.size() / 3));
      for (const double x : corner) places.push_back(static_cast<std::uint32_t>(std::clamp(x, 0.0, 65535.0)));
    }
    owners.push_back(owner);
  }
  void add_box(const Point& low, const Point& high, std::uint32_t owner) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool is_high : {false, true}) {
        std::array<Point, 4> quad{};
        for (std::size_t i = 0; i < 4; ++i) {
          quad[i][axis] = (is_high ? high : low)[axis];
          quad[i][(axis + 1) % 3] = (i == 1 || i == 2 ? high : low)[(axis + 1) % 3];
          quad[i][(axis + 2) % 3] = (i >= 2 ? high : low)[(axis + 2) % 3];
        }
        if (!is_high) std::swap(quad[1], quad[3]);
        add({quad[0], quad[1], quad[2]}, owner);
        add({quad[0], quad[2], quad[3]}, owner);
      }
  }
  [[nodiscard]] Triangle triangle(std::size_t i) const {
    Triangle t{};
    for (std::size_t k = 0; k < 9; ++k) t[k / 3][k % 3] = places[3 * corners[3 * i + k / 3] + k % 3];
    return t;
  }
  [[nodiscard]] std::vector<Triangle> all() const {
    std::vector<Triangle> triangles;
    for (std::size_t i = 0; i < owners.size(); ++i) triangles.push_back(triangle(i));
    return triangles;
  }
};

/// Small boxes, sheets without thickness, needles with some, and single triangles anywhere, in a corner or in
/// all of the room.
/// @param kinds the first so many of these. @param thickness of boxes, at most, along one axis at least.
Crowd random_crowd(std::mt19937& random, unsigned kinds = 4, double thickness = 65535) {
  std::uniform_real_distribution<double> unit(0, 1);
  Crowd crowd;
  const double room = 65535 * std::pow(unit(random), 3), size = room * std::pow(10, -3 * unit(random));
  const auto count = 1 + random() % 60;
  for (std::uint32_t owner = 0; owner < count; ++owner) {
    Point low{}, high{};
    const auto kind = random() % kinds;
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::floor(room * unit(random));
      const bool is_thin = (kind == 1 && k == 0) || (kind == 2 && k != owner % 3);
      high[k] =
          std::min(65535.0, low[k] + (is_thin ? kind - 1 + random() % 2 : std::ceil(size * unit(random))));
    }
    if (kind == 0) high[owner % 3] = std::min(high[owner % 3], low[owner % 3] + thickness);
    if (kind < 3) crowd.add_box(low, high, owner);
    if (kind == 3) crowd.add({low, {high[0], low[1], low[2]}, {low[0], high[1], high[2]}}, owner);
  }
  return crowd;
}

std::vector<Triangle> triangles_of(const Voxels::Hull& hull) {
  std::vector<Triangle> all;
  for (std::size_t i = 0; i < hull.triangles.size(); i += 3)
    all.push_back({hull.points.at(hull.triangles[i]), hull.points.at(hull.triangles[i + 1]),
                   hull.points.at(hull.triangles[i + 2])});
  return all;
}

Voxels voxels_of(const Crowd& crowd, int exponent) {
  return {crowd.places, crowd.corners, crowd.owners, exponent};
}

TEST(Voxels, NothingIsDrawnFarFromATriangle) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < samples::rounds(40); ++round) {
    const Crowd crowd = random_crowd(random);
    const auto model = crowd.all();
    const int first = Voxels::first_exponent(crowd.places, crowd.corners);
    for (int exponent = first; exponent <= 16; exponent += 1 + static_cast<int>(random() % 3)) {
      SCOPED_TRACE("round " + std::to_string(round) + ", exponent " + std::to_string(exponent));
      const double edge = std::exp2(exponent);
      const auto drawn = triangles_of(voxels_of(crowd, exponent).hull({}));
      ASSERT_FALSE(drawn.empty());
      for (int i = 0; i < 30; ++i) {
        const double u = unit(random), v = (1 - u) * unit(random);
        const Point p = mixed(drawn[random() % drawn.size()], u, v);
        ASSERT_LE(distance(p, model), 1.5 * std::sqrt(3) * edge * 1.000001);
      }
    }
  }
}

/// From each face of what is closed and thinner than a voxel one comes, straight ahead, to what is drawn,
/// with voxels all the way.
TEST(Voxels, NothingIsLostThatIsThinnerThanTheyAre) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  for (int round = 0; round < samples::rounds(60); ++round) {
    const int exponent = 6 + static_cast<int>(random() % 10);
    const double edge = std::exp2(exponent);
    const Crowd crowd = random_crowd(random, 3, edge);
    if (exponent < Voxels::first_exponent(crowd.places, crowd.corners)) continue;
    const auto model = crowd.all(), drawn = triangles_of(voxels_of(crowd, exponent).hull({}));
    for (int i = 0; i < 20; ++i) {
      const Triangle& triangle = model[random() % model.size()];
      const double u = unit(random), v = (1 - u) * unit(random);
      const Point p = mixed(triangle, u, v), a = minus(triangle[1], triangle[0]),
                  b = minus(triangle[2], triangle[0]);
      Point ahead{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
      const double length = std::sqrt(dot(ahead, ahead));
      if (length == 0) continue;
      double beyond = 0;  // at most so far there are voxels: any of them is near a triangle
      const auto at = [&](double far) {
        return Point{p[0] + far * ahead[0] / length, p[1] + far * ahead[1] / length,
                     p[2] + far * ahead[2] / length};
      };
      while (distance(at(beyond), model) <= 2 * edge) beyond += edge / 4;
      ASSERT_LE(distance(p, drawn), 2 * std::sqrt(3) * edge + beyond) << "round " << round;
    }
  }
}

/// What stands alone, apart from all others, is drawn as the box that it is.
TEST(Voxels, ABoxInAVoxelIsDrawnAsItIs) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(100); ++round) {
    const int exponent = 2 + static_cast<int>(random() % 12);
    const double edge = std::exp2(exponent);
    Crowd crowd;
    Point low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = static_cast<double>(random() % static_cast<unsigned>(edge - 1));
      high[k] = low[k] + 1 + static_cast<double>(random() % static_cast<unsigned>(edge - low[k]));
      const double voxel = edge * static_cast<double>(random() % 4);
      low[k] += voxel;
      high[k] += voxel;
    }
    crowd.add_box(low, high, 5);
    const Voxels::Hull hull = voxels_of(crowd, exponent).hull({});
    ASSERT_EQ(hull.points.size(), 8U);
    EXPECT_EQ(hull.triangles.size(), 36U);
    EXPECT_EQ(std::set<std::uint32_t>(hull.owners.begin(), hull.owners.end()), std::set<std::uint32_t>{5});
    double volume = 0;
    for (const Triangle& t : triangles_of(hull)) volume += six_volumes(t[0], t[1], t[2]) / 6;
    EXPECT_EQ(std::round(volume), (high[0] - low[0]) * (high[1] - low[1]) * (high[2] - low[2]));
  }
}

/// Made at once, or of smaller ones; and counted before they are drawn.
TEST(Voxels, OfTwiceTheEdgeAreMadeOfSmallerOnes) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(10); ++round) {
    Crowd crowd;  // on places whose voxels do not depend on rounding
    for (std::uint32_t i = 0; i < 20; ++i) {
      Point low{}, high{};
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = static_cast<double>(random() % 4000);
        high[k] = low[k] + 1 + static_cast<double>(random() % 200);
      }
      crowd.add_box(low, high, i);
    }
    Voxels voxels = voxels_of(crowd, 6);
    for (int exponent = 7; exponent < 16; ++exponent) {
      const std::size_t before = voxels.count();
      EXPECT_EQ(voxels.hull({}).owners.size(), before);
      voxels.coarsen();
      EXPECT_EQ(voxels.count(), voxels_of(crowd, exponent).count()) << "round " << round;
      EXPECT_EQ(voxels.exponent(), exponent);
    }
    EXPECT_TRUE(voxels.is_one());
    EXPECT_EQ(voxels.count(), 12U);
  }
}

/// Thin sheets have both of their sides, whole; a front alone has no back.
TEST(Voxels, ASheetIsSeenFromBothSidesAndAPatchFromItsFront) {
  const std::uint32_t seed = seed_of_test();
  SCOPED_TRACE("BSP2_SEED=" + std::to_string(seed));
  std::mt19937 random(seed);
  for (int round = 0; round < samples::rounds(50); ++round) {
    const std::size_t axis = random() % 3;
    const int exponent = 7 + static_cast<int>(random() % 7);
    Point low{}, high{};
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = static_cast<double>(random() % 9000);
      high[k] = low[k] + (k == axis ? random() % 2 : 1000 + random() % 9000);
    }
    Crowd sheet, patch;
    sheet.add_box(low, high, 0);
    const std::size_t side = 2 * axis + random() % 2;
    for (const std::size_t i : {2 * side, 2 * side + 1}) patch.add(sheet.triangle(i), 0);
    for (const Crowd& crowd : {sheet, patch}) {
      std::array<double, 6> areas{};  // to each side
      for (const Triangle& t : triangles_of(voxels_of(crowd, exponent).hull({})))
        for (std::size_t k = 0; k < 3; ++k) {
          const Point a = minus(t[1], t[0]), b = minus(t[2], t[0]);
          const double area = (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]) / 2;
          areas[2 * k + (area > 0 ? 1 : 0)] += std::abs(area);
        }
      const double whole =
          (high[(axis + 1) % 3] - low[(axis + 1) % 3]) * (high[(axis + 2) % 3] - low[(axis + 2) % 3]);
      const bool is_patch = &crowd != &sheet && crowd.owners.size() == 2;
      SCOPED_TRACE(nlohmann::json({low, high, exponent, side, is_patch}).dump());
      // A border that lies between two voxels is rounded a little.
      EXPECT_NEAR(areas[side], whole, 5e-3 * whole);
      EXPECT_NEAR(areas[side ^ 1U], is_patch ? 0 : whole, 5e-3 * whole);
    }
  }
}

/// Of a ball what is drawn faces where the ball does, on the whole; of voxels as they are two thirds would.
TEST(Voxels, ABallStaysRound) {
  constexpr int around = 64;
  constexpr double radius = 30000, middle = 32000;
  Crowd crowd;
  const auto at = [](int i, int j) {
    const double a = 2 * M_PI * i / around, b = M_PI * (2.0 * j / around - 0.5);
    return Point{middle + radius * std::cos(a) * std::cos(b), middle + radius * std::sin(a) * std::cos(b),
                 middle + radius * std::sin(b)};
  };
  for (int i = 0; i < around; ++i)
    for (int j = 0; j < around / 2; ++j) {
      crowd.add({at(i, j), at(i + 1, j), at(i + 1, j + 1)}, 0);
      crowd.add({at(i, j), at(i + 1, j + 1), at(i, j + 1)}, 0);
    }
  double area = 0, aligned = 0;
  for (const Triangle& t : triangles_of(voxels_of(crowd, 12).hull({}))) {
    const Point a = minus(t[1], t[0]), b = minus(t[2], t[0]);
    const Point normal{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    Point out = minus(mixed(t, 1. / 3, 1. / 3), {middle, middle, middle});
    area += std::sqrt(dot(normal, normal));
    aligned += dot(normal, out) / std::sqrt(dot(out, out));
  }
  EXPECT_GT(aligned / area, 0.9);
}

}  // namespace
}  // namespace bsp2::api
