#include "render/section.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace bsp2::supersteps {
namespace {

bool is_left(const Vector& p, const PictureSection& section) {
  const double x = p[static_cast<std::size_t>(section.axis)];
  return section.keeps_upper ? x >= section.at : x <= section.at;
}

}  // namespace

std::vector<Vector> part_of(const std::vector<Vector>& polygon, const PictureSection& section,
                            std::vector<Vector>& cut) {
  const auto axis = static_cast<std::size_t>(section.axis);
  std::vector<Vector> part;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vector &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    if (is_left(p, section)) part.push_back(p);
    if (is_left(p, section) == is_left(q, section)) continue;
    // The same from both ends, since the edge is one of two facets.
    const auto& [a, b] = std::minmax(p, q);
    const double t = (section.at - a[axis]) / (b[axis] - a[axis]);
    Vector at;
    for (std::size_t k = 0; k < 3; ++k) at[k] = a[k] + t * (b[k] - a[k]);
    at[axis] = section.at;
    part.push_back(at);
    cut.push_back(at);
  }
  return part;
}

std::vector<Vector> around(std::vector<Vector> points, const PictureSection& section) {
  auto u = static_cast<std::size_t>((section.axis + 1) % 3),
       v = static_cast<std::size_t>((section.axis + 2) % 3);
  if (section.keeps_upper) std::swap(u, v);
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  Vector middle{};
  for (const Vector& p : points)
    for (std::size_t k = 0; k < 3; ++k) middle[k] += p[k] / static_cast<double>(points.size());
  const auto angle = [&](const Vector& p) { return std::atan2(p[v] - middle[v], p[u] - middle[u]); };
  std::sort(points.begin(), points.end(),
            [&](const Vector& a, const Vector& b) { return angle(a) < angle(b); });
  return points;
}

}  // namespace bsp2::supersteps
