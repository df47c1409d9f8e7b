#include "shaping/moves.hpp"

#include <algorithm>
#include <cmath>

#include "simplices/shape.hpp"

namespace bsp2::meshing {

Displacement Moves::since_at(std::uint32_t p) const {
  Displacement moved = of_point(moved_, p);
  moved.unite(of_point(bent_through_, p));
  return moved;
}
Displacement Moves::since_along(std::uint32_t u, std::uint32_t v, const Point& place) const {
  if (Displacement bent = bent_along(u, v); !bent.is_none()) {
    bent.unite(since_at(u));
    bent.unite(since_at(v));
    return bent;
  }
  const double to_u = std::sqrt(squared_distance(place, editor_->point(u))),
               all = to_u + std::sqrt(squared_distance(place, editor_->point(v)));
  const double share = all > 0 ? to_u / all : 0;
  return Displacement::mean({since_at(u), since_at(v), {}}, {1 - share, share, 0});
}
Displacement Moves::in_all(const Displacement& since, const Point& place) const {
  return before_.at(place).then_as(since);
}
Displacement Moves::bent_along(std::uint32_t u, std::uint32_t v) const {
  const auto bent = bent_.find({std::min(u, v), std::max(u, v)});
  return bent == bent_.end() ? Displacement() : bent->second;
}
void Moves::bend(std::uint32_t u, std::uint32_t v, const Displacement& since) {
  bent_[{std::min(u, v), std::max(u, v)}].unite(since);
}

void Moves::raise(std::vector<Displacement>& of_points, std::uint32_t p, const Displacement& moved) const {
  if (p >= of_points.size()) of_points.resize(editor_->point_count());
  of_points[p].unite(moved);
}

void Moves::remember(double reach) {
  std::vector<Displacement> moved(editor_->point_count());
  for (std::uint32_t p = 0; p < moved.size(); ++p)
    if (!editor_->star(p).empty() && editor_->kind(p) != Editor::inside)
      moved[p] = in_all(since_at(p), editor_->point(p));
  before_ = SurfaceMoves(*editor_, moved, reach);
  moved_.clear();
  bent_.clear();
  bent_through_.clear();
}

}  // namespace bsp2::meshing
