#include "shaping/surface_moves.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

constexpr double flat = 1e-3;  // of the reach: what is thinner is rounding

/// The weights of the corners in the point of a triangle that is nearest to a place.
/// Source: Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
std::array<double, 3> nearest_weights(const std::array<Point, 3>& corner, const Point& place) {
  const Point ab = corner[1] - corner[0], ac = corner[2] - corner[0];
  const Point from_a = place - corner[0], from_b = place - corner[1], from_c = place - corner[2];
  const double a1 = dot(ab, from_a), a2 = dot(ac, from_a);
  if (a1 <= 0 && a2 <= 0) return {1, 0, 0};
  const double b1 = dot(ab, from_b), b2 = dot(ac, from_b);
  if (b1 >= 0 && b2 <= b1) return {0, 1, 0};
  const double c1 = dot(ab, from_c), c2 = dot(ac, from_c);
  if (c2 >= 0 && c1 <= c2) return {0, 0, 1};
  const double of_a = b1 * c2 - c1 * b2, of_b = c1 * a2 - a1 * c2, of_c = a1 * b2 - b1 * a2;
  if (of_c <= 0 && a1 >= 0 && b1 <= 0) return {1 - a1 / (a1 - b1), a1 / (a1 - b1), 0};
  if (of_b <= 0 && a2 >= 0 && c2 <= 0) return {1 - a2 / (a2 - c2), 0, a2 / (a2 - c2)};
  if (of_a <= 0 && b2 - b1 >= 0 && c1 - c2 >= 0) {
    const double share = (b2 - b1) / ((b2 - b1) + (c1 - c2));
    return {0, 1 - share, share};
  }
  const double sum = of_a + of_b + of_c;
  return {of_a / sum, of_b / sum, of_c / sum};
}

}  // namespace

SurfaceMoves::SurfaceMoves(const Editor& editor, const std::vector<Displacement>& moved, double reach)
    : reach_(reach) {
  /// How far points of a side lie along its normal.
  struct Extent {
    double low = std::numeric_limits<double>::infinity(), high = -low;
  };
  std::vector<Extent> extents(editor.side_count());
  const auto for_each_face = [&](const auto& visit) {
    for (std::uint32_t t = 0; t < editor.size(); ++t) {
      const Editor::Tetrahedron& tet = editor.at(t);
      for (std::size_t face = 0; face < 4 && !tet.is_gone(); ++face) {
        if (tet.side[face] == Editor::inner) continue;
        Triangle triangle;
        for (std::size_t k = 0, n = 0; k < 4; ++k) {
          if (k == face) continue;
          const std::uint32_t p = tet.point[k];
          triangle.corner[n] = editor.point(p);
          triangle.moved[n++] = p < moved.size() ? moved[p] : Displacement();
        }
        visit(tet.side[face], extents[static_cast<std::size_t>(tet.side[face])], triangle);
      }
    }
  };
  for_each_face([&](std::int32_t side, Extent& extent, const Triangle& triangle) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double height = dot(editor.side(side).outward, triangle.corner[k]);
      extent.low = std::min(extent.low, height);
      extent.high = std::max(extent.high, height);
    }
  });
  std::vector<geometry::Box3> boxes;
  for_each_face([&](std::int32_t, const Extent& extent, Triangle triangle) {
    if (std::ranges::all_of(triangle.moved, &Displacement::is_none)) return;
    if (extent.high - extent.low > flat * reach) {
      Displacement of_any = triangle.moved[0];
      of_any.unite(triangle.moved[1]);
      of_any.unite(triangle.moved[2]);
      triangle.moved.fill(of_any);
    }
    geometry::Box3 box{triangle.corner[0], triangle.corner[0]};
    box.unite({triangle.corner[1], triangle.corner[1]});
    box.unite({triangle.corner[2], triangle.corner[2]});
    boxes.push_back(box);
    triangles_.push_back(triangle);
  });
  if (!boxes.empty()) tree_.emplace(std::move(boxes));
}

Displacement SurfaceMoves::at(const Point& place) const {
  if (!tree_) return {};
  geometry::Box3 around{place, place};
  for (std::size_t k = 0; k < 3; ++k) {
    around.low[k] -= reach_;
    around.high[k] += reach_;
  }
  Displacement all;
  tree_->visit_meeting(around, [&](std::uint32_t i) {
    const Triangle& triangle = triangles_[i];
    const std::array<double, 3> weight = nearest_weights(triangle.corner, place);
    Point nearest{};
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t axis = 0; axis < 3; ++axis) nearest[axis] += weight[k] * triangle.corner[k][axis];
    if (squared_distance(nearest, place) <= reach_ * reach_)
      all.unite(Displacement::mean(triangle.moved, weight));
    return false;
  });
  return all;
}

}  // namespace bsp2::meshing
