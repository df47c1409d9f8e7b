#include "mesh/mesh_line.hpp"

#include <algorithm>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <limits>

namespace bsp2::model {
namespace {

using Rational = boost::multiprecision::cpp_rational;

/// The sign of orientation(a, b, p) for a p moved by (e, e^2) with an infinitesimal e > 0.
int side_beside(const Point2& a, const Point2& b, const Point2& p) {
  if (const int side = orientation(a, b, p); side != 0) return side;
  if (a.v != b.v) return b.v < a.v ? 1 : -1;
  return b.u > a.u ? 1 : b.u < a.u ? -1 : 0;
}

/// A number that is known up to an error.
struct Bounded {
  double value, error = 0;

  static Bounded rounded(double value, double error) {
    // Twice the unit roundoff, for the rounding of the bound itself; and what underflow may lose.
    return {value, error * (1 + 1e-15) + 2.3e-16 * std::fabs(value) + 1e-300};
  }
  friend Bounded operator+(const Bounded& a, const Bounded& b) {
    return rounded(a.value + b.value, a.error + b.error);
  }
  friend Bounded operator-(const Bounded& a, const Bounded& b) {
    return rounded(a.value - b.value, a.error + b.error);
  }
  friend Bounded operator*(const Bounded& a, const Bounded& b) {
    return rounded(a.value * b.value,
                   std::fabs(a.value) * b.error + std::fabs(b.value) * a.error + a.error * b.error);
  }
  friend Bounded operator/(const Bounded& a, const Bounded& b) {
    const double value = a.value / b.value, least = std::fabs(b.value) - b.error;
    return rounded(value, least > 0 ? (a.error + std::fabs(value) * b.error) / least
                                    : std::numeric_limits<double>::infinity());
  }
};

template <typename Number>
Number cross_at(const Point2& apex, const Point2& p, const Point2& q) {
  const Number u{apex.u}, v{apex.v};
  return (Number{p.u} - u) * (Number{q.v} - v) - (Number{p.v} - v) * (Number{q.u} - u);
}

template <typename Number>
Number height(const TriangleMesh& mesh, std::uint32_t triangle, int axis, const Point2& at) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const auto k = static_cast<std::size_t>(axis);
  const Point2 pa = along(axis, mesh.points[a]), pb = along(axis, mesh.points[b]),
               pc = along(axis, mesh.points[c]);
  const Number low{mesh.points[a][k]};
  return low + (cross_at<Number>(pa, at, pc) * (Number{mesh.points[b][k]} - low) +
                cross_at<Number>(pa, pb, at) * (Number{mesh.points[c][k]} - low)) /
                   cross_at<Number>(pa, pb, pc);
}

}  // namespace

std::vector<geometry::Box3> triangle_boxes(const TriangleMesh& mesh) {
  std::vector<geometry::Box3> boxes;
  boxes.reserve(mesh.triangles.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    geometry::Box3 box{mesh.points[a], mesh.points[a]};
    box.unite({mesh.points[b], mesh.points[b]});
    box.unite({mesh.points[c], mesh.points[c]});
    boxes.push_back(box);
  }
  return boxes;
}

bool are_coplanar(const TriangleMesh& mesh, std::uint32_t t, std::uint32_t u) {
  const auto& [a, b, c] = mesh.triangles[t];
  const auto& at = mesh.points;
  return std::all_of(mesh.triangles[u].begin(), mesh.triangles[u].end(),
                     [&, a = a, b = b, c = c](std::uint32_t v) {
                       return v == a || v == b || v == c || orientation(at[a], at[b], at[c], at[v]) == 0;
                     });
}

int axis_across(const TriangleMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  const auto &a = mesh.points[triangle[0]], &b = mesh.points[triangle[1]], &c = mesh.points[triangle[2]];
  int axis = 0;
  double largest = -1;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    const double normal = std::fabs((b[l] - a[l]) * (c[m] - a[m]) - (b[m] - a[m]) * (c[l] - a[l]));
    if (normal > largest) largest = normal, axis = static_cast<int>(k);
  }
  return axis;
}

Point2 along(int axis, const Point3& p) {
  const auto k = static_cast<std::size_t>(axis);
  return {p[(k + 1) % 3], p[(k + 2) % 3]};
}

std::optional<Point2> point_near(const TriangleMesh& mesh, std::uint32_t triangle, std::size_t corner,
                                 int axis) {
  Point2 p[3];
  for (std::size_t i = 0; i < 3; ++i)
    p[i] = along(axis, mesh.points[mesh.triangles[triangle][(corner + i) % 3]]);
  const auto mixed = [](double a, double b, double c) {
    return a * (27.0 / 32) + b * (3.0 / 32) + c * (2.0 / 32);
  };
  const Point2 at{mixed(p[0].u, p[1].u, p[2].u), mixed(p[0].v, p[1].v, p[2].v)};
  const int side = orientation(p[0], p[1], at);
  if (side == 0 || orientation(p[1], p[2], at) != side || orientation(p[2], p[0], at) != side)
    return std::nullopt;
  return at;
}

int meets(const TriangleMesh& mesh, std::uint32_t triangle, int axis, const Point2& at) {
  Point2 p[3];
  for (std::size_t i = 0; i < 3; ++i) p[i] = along(axis, mesh.points[mesh.triangles[triangle][i]]);
  const int side = side_beside(p[0], p[1], at);
  return side_beside(p[1], p[2], at) == side && side_beside(p[2], p[0], at) == side ? side : 0;
}

int compare_heights(const TriangleMesh& mesh, std::uint32_t u, std::uint32_t t, int axis, const Point2& at) {
  const auto range = [&](std::uint32_t triangle) {
    const auto& [a, b, c] = mesh.triangles[triangle];
    const auto k = static_cast<std::size_t>(axis);
    return std::minmax({mesh.points[a][k], mesh.points[b][k], mesh.points[c][k]});
  };
  const auto [u_low, u_high] = range(u);
  const auto [t_low, t_high] = range(t);
  // The line may pass beside u by an infinitesimal, so its height lies in the range all the same.
  if (u_high < t_low) return -1;
  if (u_low > t_high) return 1;
  const Bounded difference = height<Bounded>(mesh, u, axis, at) - height<Bounded>(mesh, t, axis, at);
  if (std::fabs(difference.value) > difference.error && std::isfinite(difference.value))
    return difference.value < 0 ? -1 : 1;
  if (are_coplanar(mesh, t, u)) return 0;
  const int order = height<Rational>(mesh, u, axis, at).compare(height<Rational>(mesh, t, axis, at));
  return (order > 0) - (order < 0);
}

}  // namespace bsp2::model
