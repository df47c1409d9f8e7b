#pragma once

// What the tests of whole models share.

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "bsp2/supersteps/loop/run.hpp"
#include "dataflow/oracle.hpp"

namespace bsp2::models {

using model::Expression;

/// Files that are not the project's own, if they are at hand; else an empty path.
inline std::filesystem::path shared() {
  std::filesystem::path path = std::filesystem::path(BSP2_SOURCE_DIR) / ".." / "shared";
  if (const char* given = std::getenv("BSP2_SHARED")) path = given;
  return std::filesystem::is_directory(path) ? path : std::filesystem::path();
}

/// Inputs that once went wrong, each with what is right in cases.tsv.
inline std::filesystem::path cases() { return std::filesystem::path(BSP2_SOURCE_DIR) / "tests" / "cases"; }

inline supersteps::RunReport run_file(const std::filesystem::path& path, unsigned threads = 2,
                                      double coincidence = 1e-9) {
  supersteps::RunOptions options;
  options.model = path;
  options.threads = threads;
  options.coincidence = coincidence;
  options.collect_cells = false;
  return supersteps::run(options).report;
}

/// 4 x 4 matrices, row-major.
inline std::vector<double> translation(double x, double y, double z) {
  return {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z, 0, 0, 0, 1};
}
inline std::vector<double> rotation_about_z(double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  return {c, -s, 0, 0, s, c, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
}
inline Expression move(double x, double y, double z, const Expression& e) {
  return model::transform(translation(x, y, z), e);
}
inline Expression turn(double angle, const Expression& e) {
  return model::transform(rotation_about_z(angle), e);
}
inline Expression cube(double size, bool center = false) { return model::cuboid({size, size, size}, center); }

/// The cells of an evaluation and its sums.
struct Solid {
  dataflow::Evaluated<3> result;
  [[nodiscard]] double volume() const { return result.evaluation.totals.in.value().volume(); }
  [[nodiscard]] std::uint64_t cells() const { return result.evaluation.totals.in_cells; }
};

inline Solid evaluate(const Expression& e, double coincidence = 1e-9, unsigned threads = 2) {
  const auto network = dataflow::compile<3>(e, {.coincidence = coincidence});
  dataflow::EvaluateOptions options;
  options.threads = threads;
  return {dataflow::evaluate_all(network, 0, options)};
}

/// The smallest width of an IN cell along the normals of its own facets: an upper bound of its thickness.
inline double thinnest(const Solid& solid) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& refinement : solid.result.refinements) {
    const auto& batch = refinement->cells;
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      const auto p = batch.cell_points(cell);
      for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
        const auto on = batch.vertices_of_facet(facet);
        std::array<double, 3> n{};  // Newell's normal
        for (std::size_t i = 0; i < on.size(); ++i) {
          const double *a = &p[3 * on[i]], *b = &p[3 * on[(i + 1) % on.size()]];
          n[0] += (a[1] - b[1]) * (a[2] + b[2]);
          n[1] += (a[2] - b[2]) * (a[0] + b[0]);
          n[2] += (a[0] - b[0]) * (a[1] + b[1]);
        }
        const double length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        if (length == 0) return 0;
        double width = 0;
        for (std::size_t i = 0; i < p.size(); i += 3) {
          double value = 0;
          for (std::size_t k = 0; k < 3; ++k) value += n[k] / length * (p[i + k] - p[3 * on[0] + k]);
          width = std::max(width, -value);
        }
        least = std::min(least, width);
      }
    }
  }
  return least;
}

/// Whether the boundary closes: over every hyperplane, what the IN cells show on one side and do not cover on
/// the other is the solid's skin, and the skin's area vectors add up to nothing. @return the length of their
/// sum.
inline double gap(const Solid& solid) {
  std::array<long double, 3> sum{};
  for (const auto& refinement : solid.result.refinements) {
    const auto& batch = refinement->cells;
    for (std::size_t cell = 0; cell < batch.size(); ++cell) {
      const auto p = batch.cell_points(cell);
      for (std::uint32_t facet = batch.facet_offset[cell]; facet < batch.facet_offset[cell + 1]; ++facet) {
        const auto on = batch.vertices_of_facet(facet);
        for (std::size_t i = 0; i < on.size(); ++i) {
          const double *a = &p[3 * on[i]], *b = &p[3 * on[(i + 1) % on.size()]];
          for (std::size_t k = 0; k < 3; ++k)
            sum[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
        }
      }
    }
  }
  return static_cast<double>(std::sqrt(sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]));
}

/// An octahedron or icosahedron whose triangles are quartered `times` times, corners moved onto the unit
/// sphere.
struct Ball {
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::uint32_t>> faces;  // clockwise seen from outside
};
inline Ball icosphere(int times) {
  const double g = std::numbers::phi;
  Ball ball;
  ball.points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<std::array<std::uint32_t, 3>> t = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                                 {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                                 {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                                 {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  const auto onto = [](std::array<double, 3> p) {
    const double length = std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]);
    for (double& x : p) x /= length;
    return p;
  };
  for (auto& p : ball.points) p = onto(p);
  for (; times > 0; --times) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
    const auto middle = [&](std::uint32_t a, std::uint32_t b) {
      const auto [entry, is_new] = middles.try_emplace({std::min(a, b), std::max(a, b)},
                                                       static_cast<std::uint32_t>(ball.points.size()));
      if (is_new) {
        const auto p = ball.points[a], q = ball.points[b];
        ball.points.push_back(onto({p[0] + q[0], p[1] + q[1], p[2] + q[2]}));
      }
      return entry->second;
    };
    std::vector<std::array<std::uint32_t, 3>> next;
    for (const auto& [a, b, c] : t) {
      const std::uint32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      next.insert(next.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    t = std::move(next);
  }
  for (const auto& [a, b, c] : t) ball.faces.push_back({a, c, b});
  return ball;
}

/// Signed volume of a skin (faces clockwise seen from outside), by the divergence theorem.
inline double skin_volume(const Ball& ball) {
  long double sum = 0;
  for (const auto& face : ball.faces)
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      const auto &a = ball.points[face[0]], &c = ball.points[face[i]], &b = ball.points[face[i + 1]];
      sum += static_cast<long double>(a[0]) *
                 (static_cast<long double>(b[1]) * c[2] - static_cast<long double>(b[2]) * c[1]) +
             static_cast<long double>(a[1]) *
                 (static_cast<long double>(b[2]) * c[0] - static_cast<long double>(b[0]) * c[2]) +
             static_cast<long double>(a[2]) *
                 (static_cast<long double>(b[0]) * c[1] - static_cast<long double>(b[1]) * c[0]);
    }
  return static_cast<double>(sum / 6);
}

inline Expression menger(int level) {
  if (level == 0) return cube(1);
  const Expression smaller = menger(level - 1);
  std::vector<Expression> operands;
  for (int x = 0; x < 3; ++x)
    for (int y = 0; y < 3; ++y)
      for (int z = 0; z < 3; ++z)
        if ((x == 1) + (y == 1) + (z == 1) < 2) {
          const double size = std::pow(3.0, level - 1);
          operands.push_back(move(x * size, y * size, z * size, smaller));
        }
  return model::unite(operands);
}

}  // namespace bsp2::models
