#include "builder/polytope.hpp"

#include <libqhull_r/qhull_ra.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/counted.hpp"

namespace bsp2::model {
namespace {

/// Whether the points lie within rounding of a hyperplane: elimination with full pivoting on their
/// differences.
bool is_flat(int dimension, std::span<const double> points) {
  const auto d = static_cast<std::size_t>(dimension);
  std::vector<double> rows;
  double far = 0;
  for (std::size_t i = d; i < points.size(); ++i) {
    rows.push_back(points[i] - points[i % d]);
    far = std::max({far, std::fabs(points[i]), std::fabs(points[i % d])});
  }
  const std::size_t count = rows.size() / d;
  if (count < d) return true;
  for (std::size_t step = 0; step < d; ++step) {
    std::size_t row = step, column = step;
    for (std::size_t i = step; i < count; ++i)
      for (std::size_t j = step; j < d; ++j)
        if (std::fabs(rows[i * d + j]) > std::fabs(rows[row * d + column])) row = i, column = j;
    if (!(std::fabs(rows[row * d + column]) > far * 0x1p-44)) return true;
    for (std::size_t j = 0; j < d; ++j) std::swap(rows[step * d + j], rows[row * d + j]);
    for (std::size_t i = 0; i < count; ++i) std::swap(rows[i * d + step], rows[i * d + column]);
    for (std::size_t i = step + 1; i < count; ++i) {
      const double factor = rows[i * d + step] / rows[step * d + step];
      for (std::size_t j = step; j < d; ++j) rows[i * d + j] -= factor * rows[step * d + j];
    }
  }
  return false;
}

struct HullNotFound : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A run of Qhull, whose memory goes with it.
class QhullRun {
 public:
  /// @param command of Qhull; Pp: no words about precision.
  QhullRun(int dimension, std::vector<double> points, std::string command)
      : points_(std::move(points)), messages_(std::fopen("/dev/null", "w"), &std::fclose) {
    qh_zero(&state_, messages_.get());
    const int error = qh_new_qhull(&state_, dimension, static_cast<int>(points_.size()) / dimension,
                                   points_.data(), False, command.data(), nullptr, messages_.get());
    if (error != qh_ERRnone) {
      release();
      throw HullNotFound("the convex hull of " +
                         counted(points_.size() / static_cast<std::size_t>(dimension), "# point[s] in ") +
                         counted(dimension, "# dimension[s]") + " was not found (qhull: error " +
                         std::to_string(error) + ")");
    }
  }
  ~QhullRun() { release(); }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  [[nodiscard]] Polytope polytope() {
    Polytope result;
    qhT* qh = &state_;  // the names that Qhull's macros want
    facetT* facet = nullptr;
    vertexT* vertex = nullptr;
    FORALLfacets {
      result.half_spaces.insert(result.half_spaces.end(), facet->normal, facet->normal + qh->hull_dim);
      result.half_spaces.push_back(facet->offset);
    }
    qh_getarea(qh, qh->facet_list);
    result.content = qh->totvol;
    FORALLvertices {
      const double* given =
          points_.data() + qh_pointid(qh, vertex->point) * qh->hull_dim;  // joggling moves copies
      result.corners.insert(result.corners.end(), given, given + qh->hull_dim);
    }
    return result;
  }

 private:
  std::vector<double> points_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> messages_;
  qhT state_{};

  void release() {
    int current = 0, total = 0;
    qh_freeqhull(&state_, !qh_ALL);
    qh_memfreeshort(&state_, &current, &total);
  }
};

/// Moves half-spaces outwards until all points are in them.
void take_in(int dimension, std::span<const double> points, std::vector<double>& half_spaces) {
  const auto d = static_cast<std::size_t>(dimension);
  for (std::size_t at = 0; at < half_spaces.size(); at += d + 1) {
    double most = 0;
    for (std::size_t p = 0; p < points.size(); p += d) {
      double value = half_spaces[at + d];
      for (std::size_t k = 0; k < d; ++k) value += half_spaces[at + k] * points[p + k];
      most = std::max(most, value);
    }
    half_spaces[at + d] -= most;
  }
}

/// Coplanar facets are merged. Where that would make a facet too wide, the points are joggled instead, by
/// some 1e-11 of their size.
Polytope hull_of(int dimension, const std::vector<double>& points) {
  try {
    return QhullRun(dimension, points, "qhull Pp").polytope();
  } catch (const HullNotFound&) {
    Polytope result = QhullRun(dimension, points, "qhull Pp QJ").polytope();
    take_in(dimension, points, result.half_spaces);
    return result;
  }
}

}  // namespace

std::optional<Polytope> hull_polytope(int dimension, std::span<const double> points) {
  if (is_flat(dimension, points)) return std::nullopt;
  // Qhull compares with the size of coordinates, so what is far from the origin is moved there.
  const auto d = static_cast<std::size_t>(dimension);
  const auto largest = [](std::span<const double> numbers) {
    double size = 0;
    for (const double x : numbers) size = std::max(size, std::fabs(x));
    return size;
  };
  std::vector<double> moved(points.begin(), points.end());
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] -= points[i % d];
  if (largest(points) <= 1024 * largest(moved)) return hull_of(dimension, {points.begin(), points.end()});
  Polytope result = hull_of(dimension, moved);
  for (std::size_t i = 0; i < result.corners.size(); ++i) result.corners[i] += points[i % d];
  for (std::size_t i = 0; i < result.half_spaces.size(); i += d + 1)
    for (std::size_t k = 0; k < d; ++k) result.half_spaces[i + d] -= result.half_spaces[i + k] * points[k];
  return result;
}

}  // namespace bsp2::model
