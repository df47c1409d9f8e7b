#include "constructs/convex_sum.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/vectors.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

namespace {

/// With fewer pairs, all sums are as fast.
constexpr std::size_t few_pairs = 10'000;

using Vector = std::array<Real, 3>;

using geometry::dot;
Real length(const Vector& a) { return std::sqrt(dot(a, a)); }

/// The corners of a convex polyhedron with what is around them.
struct GaussMap {
  /// A normal of a facet, and how long the product of the sides is that it comes from: by that its rounding
  /// is known.
  struct Normal {
    Vector direction;
    Real scale;
  };
  struct Corner {
    std::vector<Normal> normals;
    std::vector<Vector> edges;  // to its neighbours
  };
  std::vector<std::array<double, 3>> points;
  std::vector<Corner> corners;

  /// @return false if it is flat.
  bool build(const Points& of) {
    const model::Expression hull = model::convex_hull(3, of);
    const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
    const auto* mesh = primitive != nullptr ? std::get_if<model::TriangleMesh>(primitive) : nullptr;
    if (mesh == nullptr) return false;
    points = mesh->points;
    corners.resize(points.size());
    for (const auto& triangle : mesh->triangles) {
      const Vector u = between(triangle[0], triangle[1]), v = between(triangle[0], triangle[2]);
      const Normal normal{{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]},
                          length(u) * length(v)};
      for (std::size_t i = 0; i < 3; ++i) {
        corners[triangle[i]].normals.push_back(normal);
        corners[triangle[i]].edges.push_back(
            between(triangle[i], triangle[(i + 1) % 3]));  // each edge has a triangle on either side
      }
    }
    return true;
  }

 private:
  [[nodiscard]] Vector between(std::uint32_t from, std::uint32_t to) const {
    Vector edge;
    for (std::size_t i = 0; i < 3; ++i)
      edge[i] = static_cast<Real>(points[to][i]) - static_cast<Real>(points[from][i]);
    return edge;
  }
};

/// Whether an edge of a goes farther in all directions between the normals of b. What rounding leaves open is
/// not.
bool is_beaten(const GaussMap::Corner& a, const GaussMap::Corner& b) {
  constexpr Real rounding = 0x1p-40L;  // far above that of products of three
  return std::any_of(a.edges.begin(), a.edges.end(), [&](const Vector& edge) {
    const Real long_edge = rounding * length(edge);
    return std::all_of(b.normals.begin(), b.normals.end(), [&](const GaussMap::Normal& normal) {
      return dot(normal.direction, edge) > long_edge * normal.scale;
    });
  });
}

Points all_sums(const Points& a, const Points& b, std::size_t d) {
  Points sums;
  sums.reserve(a.size() * (b.size() / d));
  for (std::size_t i = 0; i < a.size(); i += d)
    for (std::size_t j = 0; j < b.size(); ++j) sums.push_back(a[i + j % d] + b[j]);
  return sums;
}

}  // namespace

Points sums_of_corners(int dimension, const Points& a, const Points& b) {
  const std::size_t d = size(dimension);
  if (dimension != 3 || (a.size() / d) * (b.size() / d) < few_pairs) return all_sums(a, b, d);
  GaussMap of_a, of_b;
  if (!of_a.build(a) || !of_b.build(b)) return all_sums(a, b, d);
  Points sums;
  for (std::size_t i = 0; i < of_a.points.size(); ++i)
    for (std::size_t j = 0; j < of_b.points.size(); ++j) {
      if (is_beaten(of_a.corners[i], of_b.corners[j]) || is_beaten(of_b.corners[j], of_a.corners[i]))
        continue;
      for (std::size_t k = 0; k < d; ++k) sums.push_back(of_a.points[i][k] + of_b.points[j][k]);
    }
  return sums;
}

}  // namespace bsp2::dataflow
