#include "erosion.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>
#include <variant>

#include "bsp2/model/builder.hpp"
#include "placed_parts.hpp"

namespace bsp2::dataflow {

namespace {

/// How far points reach in a direction, at least and at most.
std::array<double, 2> extent(std::span<const double> direction, const Points& points) {
  std::array<double, 2> reach{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (std::size_t p = 0; p < points.size(); p += direction.size()) {
    double at = 0;
    for (std::size_t k = 0; k < direction.size(); ++k) at += direction[k] * points[p + k];
    reach = {std::min(reach[0], at), std::max(reach[1], at)};
  }
  return reach;
}

Points middle_of(const Points& corners, std::size_t d) {
  Points middle(d);
  for (std::size_t i = 0; i < corners.size(); ++i) middle[i % d] += corners[i] / static_cast<double>(corners.size() / d);
  return middle;
}

const model::Polytope* polytope_of(const model::Expression& hull) {
  const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
  return primitive != nullptr ? std::get_if<model::Polytope>(primitive) : nullptr;
}

/// The corners of an intersection of half-spaces around `middle`: the facets of the hull of their normals, each divided by its distance from there.
Points corners_by_duality(const Points& normals_by_distance, const Points& middle) {
  const std::size_t d = middle.size();
  const model::Expression hull = model::convex_hull(static_cast<int>(d), normals_by_distance);
  const model::Polytope* dual = polytope_of(hull);
  if (dual == nullptr) return {};
  Points corners;
  for (std::size_t at = 0; at < dual->half_spaces.size(); at += d + 1)
    for (std::size_t k = 0; k < d; ++k) corners.push_back(middle[k] - dual->half_spaces[at + k] / dual->half_spaces[at + d]);
  return corners;
}

}  // namespace

std::optional<model::Expression> eroded(int dimension, const Points& points, const Points& set) {
  const std::size_t d = size(dimension);
  const model::Expression hull = model::convex_hull(dimension, points);
  const model::Polytope* polytope = polytope_of(hull);
  if (polytope == nullptr) return std::nullopt;
  const Points middle = middle_of(polytope->corners, d);
  Points normals_by_distance;
  bool is_inside = true;
  for (std::size_t at = 0; at < polytope->half_spaces.size(); at += d + 1) {
    const std::span normal(polytope->half_spaces.data() + at, d);
    const auto wide = extent(normal, polytope->corners), moved = extent(normal, set);
    const double width = wide[1] - wide[0];
    if (moved[1] - moved[0] > width) return united(dimension, {});
    const double distance = -polytope->half_spaces[at + d] - moved[1] - extent(normal, middle)[1];
    is_inside = is_inside && distance > 1e-9 * width;
    for (const double x : normal) normals_by_distance.push_back(x / distance);
  }
  if (!is_inside) return std::nullopt;
  const Points corners = corners_by_duality(normals_by_distance, middle);
  if (corners.empty()) return std::nullopt;
  return model::convex_hull(dimension, corners);
}

}  // namespace bsp2::dataflow
