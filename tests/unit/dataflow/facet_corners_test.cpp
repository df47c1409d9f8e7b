// Meshes whose corners are rounded, so that the facets of a flat face are nearly, but not quite, in one
// plane.

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include "bsp2/model/builder/builder.hpp"
#include "dataflow/oracle.hpp"
#include "support/rounds.hpp"

namespace bsp2::dataflow {
namespace {

using Vector = std::array<double, 3>;

struct Blocks {
  std::vector<Vector> points;
  std::vector<std::vector<std::uint32_t>> faces;
};

double rounded(double x, int digits) {
  const double unit = std::pow(10.0, digits);
  return std::nearbyint(x * unit) / unit;
}

/// Random columns of unit cubes on a grid, turned at random: each square of their surface is two triangles.
class RandomBlocks {
 public:
  using Cube = std::array<int, 3>;
  using Turn = std::array<Vector, 3>;

  /// @param moved where the first column is.
  RandomBlocks(Random& random, const Turn& turn, const Cube& moved) : turn_(turn), moved_(moved) {
    for (auto& row : height_)
      for (int& height : row) height = pick(random, 0, most);
    height_[0][0] = most;  // of which one is there
  }

  [[nodiscard]] std::set<Cube> cubes() const {
    std::set<Cube> result;
    for (int x = 0; x < side; ++x)
      for (int y = 0; y < side; ++y)
        for (int z = 0; z < height_[x][y]; ++z) result.insert({x + moved_[0], y + moved_[1], z + moved_[2]});
    return result;
  }

  /// @param digits behind the point that are left of the corners' coordinates.
  Blocks make(int digits) {
    for (int x = 0; x < side; ++x)
      for (int y = 0; y < side; ++y)
        for (int z = 0; z < height_[x][y]; ++z)
          for (int axis = 0; axis < 3; ++axis)
            for (const int step : {-1, 1}) add_square({x, y, z}, axis, step);
    for (auto& point : blocks_.points)
      for (double& x : point) x = rounded(x, digits);
    return std::move(blocks_);
  }

 private:
  static constexpr int side = 4, most = 3;
  std::array<std::array<int, side>, side> height_{};
  Turn turn_;
  Cube moved_;
  Blocks blocks_;
  std::map<Cube, std::uint32_t> number_;  // of a corner

  [[nodiscard]] bool is_in(const Cube& cube) const {
    return cube[0] >= 0 && cube[0] < side && cube[1] >= 0 && cube[1] < side && cube[2] >= 0 &&
           cube[2] < height_[cube[0]][cube[1]];
  }
  std::uint32_t corner(const Cube& at) {
    const auto [known, is_new] = number_.emplace(at, static_cast<std::uint32_t>(blocks_.points.size()));
    if (is_new) {
      auto& point = blocks_.points.emplace_back();
      for (int i = 0; i < 3; ++i) {
        point[i] = 1;
        for (int axis = 0; axis < 3; ++axis) point[i] += turn_[axis][i] * (at[axis] + moved_[axis]);
      }
    }
    return known->second;
  }
  /// A cube's side, if the cube beside it is not there. Faces go round as builder's polyhedra do.
  void add_square(Cube cube, int axis, int step) {
    auto beside = cube;
    beside[axis] += step;
    if (is_in(beside)) return;
    if (step > 0) ++cube[axis];
    std::array<std::uint32_t, 4> corners{};
    for (int k = 0; k < 4; ++k) {
      auto at = cube;
      at[(axis + 1) % 3] += k == 1 || k == 2 ? 1 : 0;
      at[(axis + 2) % 3] += k >= 2 ? 1 : 0;
      corners[step > 0 ? 3 - k : k] = corner(at);
    }
    const auto [a, b, c, d] = corners;
    blocks_.faces.push_back({a, b, c});
    blocks_.faces.push_back({a, c, d});
  }
};

RandomBlocks::Turn random_turn(Random& random) {
  const double a = uniform(random, 0.1, 1.4), b = uniform(random, 0.1, 1.4);
  const Vector u{std::cos(a), std::sin(a), 0},
      v{-std::sin(a) * std::cos(b), std::cos(a) * std::cos(b), std::sin(b)};
  return {u, v, {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]}};
}

double volume_inside(const Blocks& blocks) {
  long double sum = 0;
  for (const auto& face : blocks.faces) {
    const auto &a = blocks.points[face[0]], &b = blocks.points[face[1]], &c = blocks.points[face[2]];
    sum += a[0] * (static_cast<long double>(b[1]) * c[2] - static_cast<long double>(b[2]) * c[1]) +
           a[1] * (static_cast<long double>(b[2]) * c[0] - static_cast<long double>(b[0]) * c[2]) +
           a[2] * (static_cast<long double>(b[0]) * c[1] - static_cast<long double>(b[1]) * c[0]);
  }
  return static_cast<double>(std::fabs(sum) / 6);
}

/// The solid has the bounds of its corners and the volume that its facets enclose, whichever digits are left.
TEST(FacetCorners, StayWhereTheyAre) {
  const std::uint64_t seed = new_seed();
  Random random(seed);
  for (int round = 0; round < samples::rounds(60); ++round) {
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed << " round " << round);
    const int digits = pick(random, 6, 16);
    const Blocks blocks = RandomBlocks(random, random_turn(random), {}).make(digits);
    Vector lower = blocks.points[0], upper = lower;
    for (const auto& point : blocks.points)
      for (int i = 0; i < 3; ++i) {
        lower[i] = std::min(lower[i], point[i]);
        upper[i] = std::max(upper[i], point[i]);
      }
    const auto result = evaluate_all(compile<3>(model::polyhedron(blocks.points, blocks.faces), {}), 0, {});
    const auto& totals = result.evaluation.totals;
    EXPECT_NEAR(totals.in.value().volume(), volume_inside(blocks), 1e-7) << digits << " digits";
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(totals.lower[i], lower[i], 2e-6) << digits << " digits";
      EXPECT_NEAR(totals.upper[i], upper[i], 2e-6) << digits << " digits";
    }
  }
}

/// Two that touch or overlap, with the same turn, have the volume of the cubes in one or the other.
TEST(FacetCorners, LetTwoMeshesTouch) {
  const std::uint64_t seed = new_seed();
  Random random(seed);
  for (int round = 0; round < samples::rounds(40); ++round) {
    SCOPED_TRACE(testing::Message() << "BSP2_SEED=" << seed << " round " << round);
    const int digits = pick(random, 6, 16);
    const auto turn = random_turn(random);
    RandomBlocks a(random, turn, {}),
        b(random, turn, {pick(random, 1, 4), pick(random, 0, 3), pick(random, 0, 2)});
    auto cubes = a.cubes();
    const auto others = b.cubes();
    cubes.insert(others.begin(), others.end());
    const auto solid = [&](RandomBlocks& blocks) {
      const Blocks made = blocks.make(digits);
      return model::polyhedron(made.points, made.faces);
    };
    const auto both = model::unite({solid(a), solid(b)});
    const auto result = evaluate_all(compile<3>(both, {}), 0, {});
    EXPECT_NEAR(result.evaluation.totals.in.value().volume(), static_cast<double>(cubes.size()),
                1e-7 + 100 * std::pow(10.0, -digits))
        << digits << " digits";
  }
}

}  // namespace
}  // namespace bsp2::dataflow
