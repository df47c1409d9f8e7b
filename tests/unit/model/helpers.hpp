#pragma once

// Oracles of the model's tests: simple, slow, and independent of the code they check.

#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

inline bool is_empty(const Expression& e) {
  const auto* boolean = std::get_if<Boolean>(&e.node().value);
  return boolean && boolean->operation == Operation::unite && boolean->children.empty();
}

inline const TriangleMesh& mesh_of(const Expression& e) {
  return std::get<TriangleMesh>(std::get<Primitive>(e.node().value));
}

/// By the divergence theorem.
inline double volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& [i, j, k] : mesh.triangles) {
    const auto &a = mesh.points[i], &b = mesh.points[j], &c = mesh.points[k];
    sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
  }
  return sum / 6;
}

/// Frustums of regular polygons, one on the other.
inline double volume(const Lathe& lathe) {
  const double unit = lathe.sides / 2.0 * std::sin(2 * std::numbers::pi / lathe.sides);
  double sum = 0;
  for (std::size_t i = 1; i < lathe.rings.size(); ++i) {
    const auto &a = lathe.rings[i - 1], &b = lathe.rings[i];
    sum += unit * (b.z - a.z) / 3 * (a.radius * a.radius + a.radius * b.radius + b.radius * b.radius);
  }
  return sum;
}

inline double volume(const Cuboid& cuboid) {
  double product = 1;
  for (const double size : cuboid.size) product *= size;
  return product;
}

inline double volume(const RegularPolygon& polygon) {
  return polygon.sides / 2.0 * std::sin(2 * std::numbers::pi / polygon.sides) * polygon.radius *
         polygon.radius;
}

/// Its area; also the volume of the prism of height 1.
inline double volume(const ConvexPolygon& polygon) {
  double twice = 0;
  for (std::size_t i = 0; i < polygon.points.size(); ++i) {
    const auto &p = polygon.points[i], &q = polygon.points[(i + 1) % polygon.points.size()];
    twice += p[0] * q[1] - p[1] * q[0];
  }
  return twice / 2;
}

/// Of a ball, a cylinder or a cone of up to three dimensions.
inline double volume(const Round& round) {
  const double r = round.bottom, s = round.top;
  if (round.lengths.empty()) return 4 * std::numbers::pi / 3 * r * r * r;
  return std::numbers::pi / 3 * (r * r + r * s + s * s) * round.lengths[0];
}

inline double volume(const Torus& torus) {
  return 2 * std::numbers::pi * std::numbers::pi * torus.major * torus.minor * torus.minor;
}

inline double volume(const Polytope& polytope) { return polytope.content; }
inline double volume(const TellsOfItself auto&) { throw std::logic_error("it has a test of its own"); }
inline double volume(const Spline&) { throw std::logic_error("no volume of a spline is known"); }
inline double volume(const Preimage&) { throw std::logic_error("no volume of a preimage is known"); }
inline double volume(const SubdivisionSurface&) {
  throw std::logic_error("no volume of a subdivision surface is known");
}

/// Of a primitive, or of nothing.
inline double volume(const Expression& e) {
  if (is_empty(e)) return 0;
  return std::visit([](const auto& shape) { return volume(shape); }, std::get<Primitive>(e.node().value));
}

/// Whether every directed edge is used as often as its opposite.
inline bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> excess;
  for (const auto& triangle : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t from = triangle[k], to = triangle[(k + 1) % 3];
      if (from == to || from >= mesh.points.size() || to >= mesh.points.size()) return false;
      from < to ? ++excess[{from, to}] : --excess[{to, from}];
    }
  for (const auto& [edge, count] : excess)
    if (count != 0) return false;
  return true;
}

/// Number of occurrences of primitives in the expanded tree, for expressions whose tree is small.
inline std::size_t count_primitives(const Expression& e) {
  if (const auto* boolean = std::get_if<Boolean>(&e.node().value)) {
    std::size_t sum = 0;
    for (const Expression& child : boolean->children) sum += count_primitives(child);
    return sum;
  }
  if (const auto* coloured = std::get_if<Coloured>(&e.node().value)) return count_primitives(coloured->child);
  if (const auto* transform = std::get_if<Transform>(&e.node().value))
    return count_primitives(transform->child);
  return 1;
}

}  // namespace bsp2::model
