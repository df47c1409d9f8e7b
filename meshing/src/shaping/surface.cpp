#include "shaping/surface.hpp"

#include <algorithm>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "simplices/shape.hpp"
#include "simplices/triangle.hpp"

namespace bsp2::meshing {
namespace {

std::array<Point, 3> corners_of(const Tetrahedra& mesh, const std::array<std::uint32_t, 3>& triangle) {
  return {mesh.points[triangle[0]], mesh.points[triangle[1]], mesh.points[triangle[2]]};
}

}  // namespace

Surface::Surface(const Tetrahedra& mesh) {
  std::vector<geometry::Box3> boxes;
  for (const auto& triangle : mesh.triangles) {
    const auto& [a, b, c] = triangles_.emplace_back(corners_of(mesh, triangle));
    geometry::Box3 box{a, a};
    box.unite({b, b});
    box.unite({c, c});
    boxes.push_back(box);
  }
  if (!boxes.empty()) tree_.emplace(std::move(boxes));
}

bool Surface::is_near(const Point& place, double reach) const {
  if (!tree_) return false;
  geometry::Box3 around{place, place};
  for (std::size_t k = 0; k < 3; ++k) {
    around.low[k] -= reach;
    around.high[k] += reach;
  }
  return tree_->visit_meeting(around, [&](std::uint32_t i) {
    const Point nearest = point_at(triangles_[i], nearest_weights(triangles_[i], place));
    return squared_distance(nearest, place) <= reach * reach;
  });
}

bool Surface::is_near_all_of(const Tetrahedra& other, double reach) const {
  constexpr double third = 1.0 / 3;
  return std::ranges::all_of(other.triangles, [&](const auto& triangle) {
    geometry::Interruption::check();
    const std::array<Point, 3> corners = corners_of(other, triangle);
    return std::ranges::all_of(corners, [&](const Point& p) { return is_near(p, reach); }) &&
           is_near(point_at(corners, {third, third, third}), reach);
  });
}

}  // namespace bsp2::meshing
