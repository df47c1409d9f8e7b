#include "shaping/surface_moves.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "simplices/shape.hpp"
#include "simplices/triangle.hpp"

namespace bsp2::meshing {
namespace {

constexpr double flat = 1e-3;  // of the reach: what is thinner is rounding

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
    if (squared_distance(point_at(triangle.corner, weight), place) <= reach_ * reach_)
      all.unite(Displacement::mean(triangle.moved, weight));
    return false;
  });
  return all;
}

}  // namespace bsp2::meshing
