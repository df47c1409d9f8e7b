#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "bsp2/geometry/support/vectors.hpp"

/// How the winding number of a closed mesh changes along a segment.
namespace bsp2::dataflow {

using geometry::minus;

/// Sign of the determinant of three vectors whose entries are off by at most `error`; 0 where it is
/// uncertain.
inline int sign_of_determinant(const std::array<double, 3>& u, const std::array<double, 3>& v,
                               const std::array<double, 3>& w, double error) {
  const double x = u[0] * (v[1] * w[2] - v[2] * w[1]), y = u[1] * (v[2] * w[0] - v[0] * w[2]),
               z = u[2] * (v[0] * w[1] - v[1] * w[0]);
  const auto reach = [](const std::array<double, 3>& p) {
    return std::max({std::fabs(p[0]), std::fabs(p[1]), std::fabs(p[2])});
  };
  const double a = reach(u), b = reach(v), c = reach(w);
  const double bound = 6 * error * (a * b + b * c + c * a) * 1.01 + 12 * 0x1p-52 * a * b * c +
                       6 * error * error * (a + b + c + error);
  const double value = x + y + z;
  return value > bound ? 1 : value < -bound ? -1 : 0;
}

/// The sign of a determinant in the plane, of vectors whose coordinates are off by at most `error`; 0 if that
/// leaves it open.
inline int sign_of_determinant(const std::array<double, 2>& u, const std::array<double, 2>& v, double error) {
  const double value = u[0] * v[1] - u[1] * v[0], s = std::fabs(u[0]) + std::fabs(u[1]),
               t = std::fabs(v[0]) + std::fabs(v[1]);
  const double bound = 2 * error * (s + t + error) + 4 * 0x1p-52 * s * t;
  return value > bound ? 1 : value < -bound ? -1 : 0;
}

/// A segment that is held against very many facets: most of them are passed over by boxes and by how they lie
/// beside the segment seen along an axis.
class SegmentAmongFacets {
 public:
  /// @param error of differences of coordinates.
  SegmentAmongFacets(const std::array<double, 3>& p, const std::array<double, 3>& q, double error)
      : p_(p), along_(minus(q, p)), error_(error) {
    for (std::size_t i = 0; i < 3; ++i) {
      low_[i] = std::min(p[i], q[i]) - error;
      high_[i] = std::max(p[i], q[i]) + error;
    }
  }
  /// Whether it certainly misses all facets within a box: no more is passed over than facet by facet.
  [[nodiscard]] bool misses_box(const std::array<double, 3>& low, const std::array<double, 3>& high) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (high[i] < low_[i] || low[i] > high_[i]) return true;
    return is_box_beside(low, high, 0, 1) || is_box_beside(low, high, 1, 2);
  }
  /// Whether the segment certainly misses the facet.
  [[nodiscard]] bool misses(const std::array<double, 3>& a, const std::array<double, 3>& b,
                            const std::array<double, 3>& c) const {
    for (std::size_t i = 0; i < 3; ++i)
      if (std::max({a[i], b[i], c[i]}) < low_[i] || std::min({a[i], b[i], c[i]}) > high_[i]) return true;
    return is_beside(a, b, c, 0, 1) || is_beside(a, b, c, 1, 2);
  }

 private:
  std::array<double, 3> p_, along_, low_{}, high_{};
  double error_;

  [[nodiscard]] bool is_beside(const std::array<double, 3>& a, const std::array<double, 3>& b,
                               const std::array<double, 3>& c, std::size_t i, std::size_t j) const {
    const auto side = [&](const std::array<double, 3>& x) {
      return sign_of_determinant({along_[i], along_[j]}, {x[i] - p_[i], x[j] - p_[j]}, error_);
    };
    const int first = side(a);
    return first != 0 && side(b) == first && side(c) == first;
  }

  /// Whether all corners of a box are on one side: that of its middle, by more than any corner is off.
  [[nodiscard]] bool is_box_beside(const std::array<double, 3>& low, const std::array<double, 3>& high,
                                   std::size_t i, std::size_t j) const {
    const double x = low[i] / 2 + high[i] / 2 - p_[i], y = low[j] / 2 + high[j] / 2 - p_[j];
    const double half_x = high[i] / 2 - low[i] / 2, half_y = high[j] / 2 - low[j] / 2;
    const double s = std::fabs(along_[i]) + std::fabs(along_[j]),
                 t = std::fabs(x) + half_x + std::fabs(y) + half_y;
    const double spread = std::fabs(along_[i]) * half_y + std::fabs(along_[j]) * half_x;
    return std::fabs(along_[i] * y - along_[j] * x) >
           spread + 2 * error_ * (s + t + error_) + 16 * 0x1p-52 * s * t;
  }
};

/// How the winding number changes from p to q across a facet abc: -1, 0, +1, or nothing if a sign leaves it
/// open.
/// @param p_side, q_side signs of [a-p, b-p, c-p] and of the same with q.
/// @param line the signs of [q-p, a-p, b-p], [q-p, b-p, c-p], [q-p, c-p, a-p].
inline std::optional<int> crossing(int p_side, int q_side, const std::array<int, 3>& line) {
  if (p_side != 0 && p_side == q_side) return 0;
  if ((line[0] > 0 || line[1] > 0 || line[2] > 0) && (line[0] < 0 || line[1] < 0 || line[2] < 0))
    return 0;  // the line misses the facet
  if (p_side == 0 || q_side == 0 || line[0] == 0 || line[1] == 0 || line[2] == 0) return std::nullopt;
  // Seen from outside the corners turn counter-clockwise: the determinant of a facet seen from outside is
  // negative.
  return p_side < 0 ? 1 : -1;
}

/// How the winding number changes from p to q across the facet abc, by coordinates whose differences are off
/// by at most `error`.
inline std::optional<int> crossing(const std::array<double, 3>& p, const std::array<double, 3>& q,
                                   const std::array<double, 3>& a, const std::array<double, 3>& b,
                                   const std::array<double, 3>& c, double error) {
  const auto pa = minus(a, p), pb = minus(b, p), pc = minus(c, p), pq = minus(q, p);
  const auto qa = minus(a, q), qb = minus(b, q), qc = minus(c, q);
  const int p_side = sign_of_determinant(pa, pb, pc, error), q_side = sign_of_determinant(qa, qb, qc, error);
  if (p_side != 0 && p_side == q_side) return 0;
  return crossing(p_side, q_side,
                  {sign_of_determinant(pq, pa, pb, error), sign_of_determinant(pq, pb, pc, error),
                   sign_of_determinant(pq, pc, pa, error)});
}

/// How the winding number changes from p to q across the side ab of a polygon in the plane.
inline std::optional<int> crossing(const std::array<double, 2>& p, const std::array<double, 2>& q,
                                   const std::array<double, 2>& a, const std::array<double, 2>& b,
                                   double error) {
  const auto side = [&](const std::array<double, 2>& from, const std::array<double, 2>& u,
                        const std::array<double, 2>& v) {
    return sign_of_determinant({u[0] - from[0], u[1] - from[1]}, {v[0] - from[0], v[1] - from[1]}, error);
  };
  const int a_side = side(p, q, a), b_side = side(p, q, b), p_side = side(a, b, p), q_side = side(a, b, q);
  if ((a_side != 0 && a_side == b_side) || (p_side != 0 && p_side == q_side)) return 0;
  if (a_side == 0 || b_side == 0 || p_side == 0 || q_side == 0) return std::nullopt;
  return p_side > 0 ? 1 : -1;
}

}  // namespace bsp2::dataflow
