#include "constructs/erosion.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <variant>

#include "bsp2/model/builder/builder.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

namespace {

/// How far points reach in a direction, at least and at most.
std::array<double, 2> extent(std::span<const double> direction, const Points& points) {
  std::array<double, 2> reach{std::numeric_limits<double>::infinity(),
                              -std::numeric_limits<double>::infinity()};
  for (std::size_t p = 0; p < points.size(); p += direction.size()) {
    double at = 0;
    for (std::size_t k = 0; k < direction.size(); ++k) at += direction[k] * points[p + k];
    reach = {std::min(reach[0], at), std::max(reach[1], at)};
  }
  return reach;
}

Points middle_of(const Points& corners, std::size_t d) {
  Points middle(d);
  const std::size_t count = corners.size() / d;
  for (std::size_t i = 0; i < corners.size(); ++i) middle[i % d] += corners[i] / static_cast<double>(count);
  return middle;
}

/// Of a half-space, normal and constant, at a point: below 0 inside.
double value_at(const double* half_space, const Points& point) {
  double value = half_space[point.size()];
  for (std::size_t k = 0; k < point.size(); ++k) value += half_space[k] * point[k];
  return value;
}

/// A point far inside of half-spaces of unit normals, if there is one: away from the nearest of them, in
/// shorter and shorter steps.
Points deepest_found(std::span<const double> half_spaces, Points point, double width) {
  constexpr int steps = 1000;
  const std::size_t d = point.size();
  Points deepest = point;
  double least = std::numeric_limits<double>::infinity();
  for (int step = 1; step <= steps; ++step) {
    const double* nearest = nullptr;
    double value = -std::numeric_limits<double>::infinity();
    for (std::size_t at = 0; at < half_spaces.size(); at += d + 1)
      if (const double here = value_at(half_spaces.data() + at, point); here > value) {
        value = here;
        nearest = half_spaces.data() + at;
      }
    if (value < least) {
      least = value;
      deepest = point;
    }
    for (std::size_t k = 0; k < d; ++k) point[k] -= nearest[k] * width / (4 * step);
  }
  return deepest;
}

const model::Polytope* polytope_of(const model::Expression& hull) {
  const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
  return primitive != nullptr ? std::get_if<model::Polytope>(primitive) : nullptr;
}

/// The corners of an intersection of half-spaces around a point: the facets of the hull of their normals,
/// each divided by its distance from there.
Points corners_by_duality(const Points& normals_by_distance, const Points& inner) {
  const std::size_t d = inner.size();
  const model::Expression hull = model::convex_hull(static_cast<int>(d), normals_by_distance);
  const model::Polytope* dual = polytope_of(hull);
  if (dual == nullptr) return {};
  Points corners;
  for (std::size_t at = 0; at < dual->half_spaces.size(); at += d + 1)
    for (std::size_t k = 0; k < d; ++k)
      corners.push_back(inner[k] - dual->half_spaces[at + k] / dual->half_spaces[at + d]);
  return corners;
}

}  // namespace

std::optional<model::Expression> eroded(int dimension, const Points& points, const Points& set) {
  const std::size_t d = size(dimension);
  const model::Expression hull = model::convex_hull(dimension, points);
  const model::Polytope* polytope = polytope_of(hull);
  if (polytope == nullptr) return std::nullopt;
  std::vector<double> half_spaces = polytope->half_spaces;
  double least_width = std::numeric_limits<double>::infinity();
  for (std::size_t at = 0; at < half_spaces.size(); at += d + 1) {
    const std::span normal(half_spaces.data() + at, d);
    const auto wide = extent(normal, polytope->corners), moved = extent(normal, set);
    if (moved[1] - moved[0] > wide[1] - wide[0]) return united(dimension, {});
    half_spaces[at + d] += moved[1];
    least_width = std::min(least_width, wide[1] - wide[0]);
  }
  const Points inner = deepest_found(half_spaces, middle_of(polytope->corners, d), least_width);
  Points normals_by_distance;
  for (std::size_t at = 0; at < half_spaces.size(); at += d + 1) {
    const double distance = -value_at(half_spaces.data() + at, inner);
    if (!(distance > 1e-9 * least_width)) return std::nullopt;
    for (std::size_t k = 0; k < d; ++k) normals_by_distance.push_back(half_spaces[at + k] / distance);
  }
  const Points corners = corners_by_duality(normals_by_distance, inner);
  if (corners.empty()) return std::nullopt;
  return model::convex_hull(dimension, corners);
}

}  // namespace bsp2::dataflow
