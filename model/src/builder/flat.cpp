#include "bsp2/model/builder/flat.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "builder/convex_hull.hpp"

namespace bsp2::model {
namespace {

using Corners = std::vector<std::vector<double>>;

/// Each point once.
Corners distinct(std::size_t d, std::span<const double> points) {
  Corners all;
  for (std::size_t i = 0; i + d <= points.size(); i += d)
    all.emplace_back(points.begin() + i, points.begin() + i + d);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

double area(const std::vector<std::array<double, 2>>& polygon) {
  double twice = 0;
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const auto &o = polygon[0], &p = polygon[i], &q = polygon[i + 1];
    twice += (p[0] - o[0]) * (q[1] - o[1]) - (p[1] - o[1]) * (q[0] - o[0]);
  }
  return twice / 2;
}

/// Of points in a plane in space, the corners of their hull: seen from the side from which it is largest.
/// Nothing where they lie on a line.
Corners corners_in_space(const Corners& points) {
  std::vector<std::array<double, 2>> largest;
  std::size_t first = 0, second = 1;
  for (const auto& [i, j] : {std::pair<std::size_t, std::size_t>{0, 1}, {1, 2}, {2, 0}}) {
    std::vector<std::array<double, 2>> seen;
    for (const auto& point : points) seen.push_back({point[i], point[j]});
    auto hull = hull_corners(seen);
    if (hull.size() < 3 || (!largest.empty() && area(hull) <= area(largest))) continue;
    largest = std::move(hull);
    first = i;
    second = j;
  }
  std::sort(largest.begin(), largest.end());
  Corners corners;
  std::copy_if(
      points.begin(), points.end(), std::back_inserter(corners), [&](const std::vector<double>& point) {
        return std::binary_search(largest.begin(), largest.end(), std::array{point[first], point[second]});
      });
  return corners;
}

}  // namespace

Polytope flat_polytope(int dimension, std::span<const double> points, bool undecided) {
  Corners all = distinct(static_cast<std::size_t>(dimension), points);
  Corners corners;
  if (dimension == 3) corners = corners_in_space(all);
  // In the order of their coordinates, whatever lies on a line lies between the first and the last one.
  if (corners.empty() && dimension <= 3 && all.size() > 2) corners = {all.front(), all.back()};
  if (corners.empty()) corners = std::move(all);
  Polytope flat;
  for (const auto& corner : corners) flat.corners.insert(flat.corners.end(), corner.begin(), corner.end());
  flat.undecided = undecided;
  return flat;
}

bool is_flat(const Primitive& primitive) {
  const auto* polytope = std::get_if<Polytope>(&primitive);
  return polytope != nullptr && polytope->half_spaces.empty();
}

const char* flat_place(int dimension) {
  return dimension == 3 ? "in one plane" : dimension == 2 ? "on one line" : "in one hyperplane";
}

}  // namespace bsp2::model
