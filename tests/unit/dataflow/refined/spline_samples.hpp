#pragma once

// What the tests of splines share: an oracle by basis functions, random pieces, NURBS of circles, and the
// check that FUZZY cells hold sampled points.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "bsp2/geometry/cells/point_query.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "dataflow/intervals.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

using geometry::Label;
using model::Expression;
using Piece = model::Spline::Piece;
inline constexpr double pi = std::numbers::pi;

// --- splines by their basis functions, as an oracle ---

/// N_i of this degree at t, by the recursion of Cox and de Boor. The last span of the domain is closed.
inline double basis(const std::vector<double>& knots, std::size_t i, std::size_t degree, double t) {
  if (degree == 0) {
    const bool is_last = knots[i] < knots[i + 1] && knots[i + 1] == t &&
                         std::none_of(knots.begin(), knots.end(), [&](double k) { return k > t; });
    return (knots[i] <= t && t < knots[i + 1]) || is_last ? 1 : 0;
  }
  double sum = 0;
  if (knots[i + degree] > knots[i])
    sum += (t - knots[i]) / (knots[i + degree] - knots[i]) * basis(knots, i, degree - 1, t);
  if (knots[i + degree + 1] > knots[i + 1])
    sum += (knots[i + degree + 1] - t) / (knots[i + degree + 1] - knots[i + 1]) *
           basis(knots, i + 1, degree - 1, t);
  return sum;
}

template <int D>
std::array<double, D> value_at(const Piece& piece, const std::vector<double>& t) {
  std::array<double, D + 1> sum{};
  const std::size_t count = piece.points.size() / (D + 1);
  std::vector<std::vector<double>> weights;
  for (std::size_t j = 0; j < t.size(); ++j)
    for (std::size_t i = 0; i + piece.degrees[j] + 1 < piece.knots[j].size(); ++i) {
      if (i == 0) weights.emplace_back();
      weights[j].push_back(basis(piece.knots[j], i, piece.degrees[j], t[j]));
    }
  for (std::size_t p = 0; p < count; ++p) {
    double weight = piece.points[p * (D + 1) + D];
    for (std::size_t j = t.size(), rest = p; j-- > 0; rest /= weights[j].size())
      weight *= weights[j][rest % weights[j].size()];
    for (std::size_t c = 0; c < D; ++c) sum[c] += weight * piece.points[p * (D + 1) + c];
    sum[D] += weight;
  }
  std::array<double, D> point;
  for (std::size_t c = 0; c < D; ++c) point[c] = sum[c] / sum[D];
  return point;
}

/// Random points of the piece, at random parameters and some at knots. Of solids, of the faces at the ends of
/// parameters.
template <int D>
std::vector<std::array<double, D>> points_of(const Piece& piece, std::size_t count, Random& random) {
  std::vector<std::array<double, D>> points;
  for (std::size_t i = 0; i < count; ++i) {
    std::vector<double> t;
    for (std::size_t j = 0; j < piece.degrees.size(); ++j) {
      const auto& knots = piece.knots[j];
      const std::size_t first = piece.degrees[j], last = knots.size() - piece.degrees[j] - 1;
      const bool is_end = piece.degrees.size() == D && j == i % D;
      t.push_back(
          is_end ? knots[chance(random, 0.5) ? first : last]
          : chance(random, 0.02)
              ? knots[static_cast<std::size_t>(pick(random, static_cast<int>(first), static_cast<int>(last)))]
              : uniform(random, knots[first], knots[last]));
    }
    points.push_back(value_at<D>(piece, t));
  }
  return points;
}

// --- the checks ---

/// None of the points is in a cell that is IN or OUT. @return the interval of the volume.
template <int D>
VolumeInterval check_points(const Expression& e, const std::vector<std::array<double, D>>& points,
                            const EvaluateOptions& given) {
  const Network<D> network = compile<D>(e, {});
  EvaluateOptions options = given;
  options.record_tree = true;
  auto [evaluation, refinements] = evaluate_all(network, 0, options);
  std::vector<Label> labels;
  for (const auto& refinement : refinements)
    labels.insert(labels.end(), refinement->cells.label.begin(), refinement->cells.label.end());
  evaluation.tree.root = evaluation.region_roots[0];
  const geometry::PointQuery<D> query(network.table, evaluation.tree, labels);
  std::size_t wrong = 0;
  for (const auto& point : points) wrong += query.ask(point).label != Label::fuzzy ? 1 : 0;
  EXPECT_EQ(wrong, 0U) << "of " << points.size() << " points";
  EXPECT_GT(points.size(), 99'999U);
  return {evaluation.totals.in.value().volume(), evaluation.totals.fuzzy.value().volume(), labels.size()};
}

template <int D>
Piece random_piece(Random& random, const std::vector<std::uint32_t>& degrees,
                   const std::vector<std::size_t>& counts, bool rational) {
  Piece piece{degrees, {}, {}};
  std::size_t count = 1;
  for (std::size_t j = 0; j < degrees.size(); ++j) {
    count *= counts[j];
    auto& knots = piece.knots.emplace_back(model::clamped_knots(degrees[j], counts[j]));
    for (std::size_t i = degrees[j] + 1; i + degrees[j] + 1 < knots.size(); ++i)
      knots[i] += uniform(random, -0.4, 0.4);
  }
  for (std::size_t p = 0; p < count; ++p) {
    for (int c = 0; c < D; ++c) piece.points.push_back(uniform(random, -2, 2));
    piece.points.push_back(rational ? uniform(random, 0.2, 3) : 1);
  }
  return piece;
}

/// A net over a grid, moved about a little: an embedded surface or solid.
template <int D>
Piece waved_piece(Random& random, const std::vector<std::uint32_t>& degrees,
                  const std::vector<std::size_t>& counts, bool rational) {
  Piece piece = random_piece<D>(random, degrees, counts, rational);
  for (std::size_t p = 0; p < piece.points.size() / (D + 1); ++p)
    for (std::size_t j = counts.size(), rest = p; j-- > 0; rest /= counts[j]) {
      double& x = piece.points[p * (D + 1) + j];
      x = static_cast<double>(rest % counts[j]) + 0.1 * x;
    }
  return piece;
}

class Seeded : public testing::Test {
 protected:
  std::uint64_t seed = new_seed();
  Random random{seed};
  testing::ScopedTrace trace{__FILE__, __LINE__, testing::Message() << "BSP2_SEED=" << seed};
};

// --- circles ---

/// The circle by nine points of degree 2 in the plane of two axes, as pairs and weights.
inline std::vector<std::array<double, 3>> circle_points() {
  const double h = std::sqrt(0.5);
  return {{1, 0, 1},   {1, 1, h},  {0, 1, 1},  {-1, 1, h}, {-1, 0, 1},
          {-1, -1, h}, {0, -1, 1}, {1, -1, h}, {1, 0, 1}};
}
inline std::vector<double> circle_knots() { return {0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4}; }

inline Piece nurbs_circle(double radius) {
  Piece piece{{2}, {circle_knots()}, {}};
  for (const auto& [x, y, w] : circle_points())
    piece.points.insert(piece.points.end(), {radius * x, radius * y, w});
  return piece;
}

/// A circle in the half-plane (rho, z) around (major, 0), or with major = 0 a half of it, turned around z.
inline Piece turned(const std::vector<std::array<double, 3>>& profile, std::vector<double> knots,
                    double major, double minor) {
  Piece piece{{2, 2}, {circle_knots(), std::move(knots)}, {}};
  for (const auto& [x, y, w] : circle_points())
    for (const auto& [rho, z, v] : profile)
      piece.points.insert(piece.points.end(),
                          {x * (major + minor * rho), y * (major + minor * rho), minor * z, w * v});
  return piece;
}
inline Piece nurbs_sphere(double radius) {
  const double h = std::sqrt(0.5);
  return turned({{0, -1, 1}, {1, -1, h}, {1, 0, 1}, {1, 1, h}, {0, 1, 1}}, {0, 0, 0, 1, 1, 2, 2, 2}, 0,
                radius);
}

}  // namespace bsp2::dataflow
