#pragma once

// What the tests of constructs of any dimension share: volumes as intervals, random solids, points asked of
// an oracle.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "bsp2/dataflow/regions/measure.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "dataflow/intervals.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::dataflow {

using geometry::Label;
using model::Expression;
inline constexpr double pi = std::numbers::pi;

template <int D>
VolumeInterval volume_in(const Expression& e, const EvaluateOptions& how) {
  const auto totals = measure<D>(e, how);
  return {totals.in.value().volume(), totals.fuzzy.value().volume(), totals.in_cells + totals.fuzzy_cells};
}

inline VolumeInterval volume_interval(const Expression& e, double tolerance = 0) {
  EvaluateOptions how;
  if (tolerance > 0) how.tolerance = tolerance;
  return geometry::in_dimension(e.dimension(),
                                [&](auto dimension) { return volume_in<dimension()>(e, how); });
}

inline double volume_of(const Expression& e) {
  const VolumeInterval interval = volume_interval(e);
  EXPECT_EQ(interval.fuzzy, 0);
  return interval.in;
}

inline void expect_contains(const VolumeInterval& interval, double truth, double share) {
  EXPECT_LE(interval.in, truth * (1 + 1e-9));
  EXPECT_GE(interval.in + interval.fuzzy, truth * (1 - 1e-9));
  EXPECT_LT(interval.fuzzy, share * truth);
}

inline double ball_volume(int d) { return std::pow(pi, d / 2.0) / std::tgamma(d / 2.0 + 1); }

inline double determinant(std::vector<double> m) {
  const auto n = static_cast<std::size_t>(std::lround(std::sqrt(static_cast<double>(m.size()))));
  double result = 1;
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k; i < n; ++i)
      if (std::fabs(m[i * n + k]) > std::fabs(m[pivot * n + k])) pivot = i;
    if (m[pivot * n + k] == 0) return 0;
    if (pivot != k) result = -result;
    for (std::size_t j = 0; j < n; ++j) std::swap(m[k * n + j], m[pivot * n + j]);
    result *= m[k * n + k];
    for (std::size_t i = k + 1; i < n; ++i)
      for (std::size_t j = n; j-- > k;) m[i * n + j] -= m[i * n + k] / m[k * n + k] * m[k * n + j];
  }
  return result;
}

/// The linear part of a (d+1) x (d+1) matrix.
inline std::vector<double> linear_part(const std::vector<double>& m, int d) {
  std::vector<double> linear;
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j) linear.push_back(m[static_cast<std::size_t>(i * (d + 1) + j)]);
  return linear;
}

struct Seeded {
  std::uint64_t seed = new_seed();
  Random random{seed};
  testing::ScopedTrace trace{__FILE__, __LINE__, testing::Message() << "BSP2_SEED=" << seed};
};

inline std::vector<double> random_lengths(Random& random, int d) {
  std::vector<double> lengths;
  for (int i = 0; i < d; ++i) lengths.push_back(uniform(random, 0.5, 2));
  return lengths;
}

inline Expression random_polytope(Random& random, int d, int extra) {
  std::vector<double> points;
  for (int i = 0; i < (d + 1 + extra) * d; ++i) points.push_back(uniform(random, -1, 1));
  return model::convex_hull(d, points);
}

/// Labels of the cells of a construct, at points in them. @param inside the oracle.
template <int D, typename Inside>
void check_labels(const Expression& e, double tolerance, Random& random, Inside&& inside) {
  const Network<D> network = compile<D>(e, {});
  EvaluateOptions how = keep_everything();
  if (tolerance > 0) how.tolerance = tolerance;
  const auto result = evaluate_all(network, 0, how);
  std::size_t in = 0, out = 0;
  for (const auto& refinement : result.refinements)
    for (std::size_t cell = 0; cell < refinement->cells.size(); ++cell) {
      const Label label = refinement->cells.label[cell];
      if (label == Label::fuzzy) continue;
      const auto corners = refinement->cells.cell_points(cell);
      Point x(D, 0);
      Real sum = 0;
      for (std::size_t i = 0; i < corners.size(); i += D) {
        const Real weight = -std::log(uniform(random, 1e-3, 1));
        sum += weight;
        for (std::size_t k = 0; k < D; ++k) x[k] += weight * corners[i + k];
      }
      for (Real& c : x) c /= sum;
      const Where truth = inside(x, 1e-8L);
      ASSERT_TRUE(truth.doubtful || truth.inside == (label == Label::in))
          << "cell " << cell << " at level " << refinement->cells.level[cell] << ", volume "
          << refinement->cells.volume[cell] << ", at " << static_cast<double>(x[0]) << ", "
          << static_cast<double>(x[1]) << ", doubtful within 1e-6: " << inside(x, 1e-6L).doubtful
          << ", 1e-3: " << inside(x, 1e-3L).doubtful;
      ++(label == Label::in ? in : out);
    }
  EXPECT_GT(in, 0U);
  EXPECT_GT(out, 0U);
}

}  // namespace bsp2::dataflow
