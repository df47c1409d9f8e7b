// Points that are moved.

#include <algorithm>

#include "simplices/shape.hpp"
#include "tetrahedra/editor.hpp"

namespace bsp2::meshing {

/// The worst shape around a point if it were at x; what is not above `enough` does not matter.
double Editor::worst_with(std::uint32_t p, const Point& x, double enough) const {
  double worst = 1;
  for (const std::uint32_t t : star_[p]) {
    const std::array<std::uint32_t, 4>& q = tetrahedra_[t].point;
    const auto at = [&](int k) -> const Point& { return q[k] == p ? x : points_[q[k]]; };
    worst = std::min(worst, shape_of(at(0), at(1), at(2), at(3)));
    if (worst <= enough) return worst;
  }
  return worst;
}

bool Editor::nudge(std::uint32_t p, const Point& to) {
  double deepest = 0;
  for (const std::uint32_t t : star_[p])
    if (tetrahedra_[t].shape <= 0) deepest = std::max(deepest, depth(tetrahedra_[t].point));
  const Point from = std::exchange(points_[p], to);
  std::vector<double> shapes;
  bool is_better = false, is_worse = false;
  for (const std::uint32_t t : star_[p]) {
    const double now = shapes.emplace_back(shape(tetrahedra_[t].point));
    const bool was_right = tetrahedra_[t].shape > 0, is_right = now > 0;
    is_worse = is_worse || (was_right && !is_right) ||
               (now < hardly_turned && depth(tetrahedra_[t].point) > deepest);
    is_better = is_better || is_right != was_right;
    if (is_worse) break;
  }
  if (is_worse || !is_better) {
    points_[p] = from;
    return false;
  }
  move(p, to);
  return true;
}

bool Editor::smooth(std::uint32_t p) {
  if (kind_[p] == corner || star_[p].empty() || changed_[p] < settled_[p]) return false;
  const double before = worst_at(p);
  std::vector<std::uint32_t> towards;
  if (kind_[p] == inside) {
    towards = neighbours(p);
  } else if (kind_[p] == on_side) {
    for (const std::uint32_t t : star_[p]) {
      const Tetrahedron& tet = tetrahedra_[t];
      for (int k = 0; k < 4; ++k)
        if (tet.side[k] != inner && tet.point[k] != p)
          for (int l = 0; l < 4; ++l)
            if (l != k && tet.point[l] != p) towards.push_back(tet.point[l]);
    }
  } else if (const auto ends = ends_along(p)) {
    towards.assign(ends->begin(), ends->end());
  }
  if (towards.empty()) return false;
  Point middle{};
  for (const std::uint32_t q : towards)
    for (std::size_t k = 0; k < 3; ++k) middle[k] += points_[q][k] / static_cast<double>(towards.size());
  double best = std::max(before, 0.0);
  Point best_place{};
  bool found = false;
  const auto attempt = [&](const Point& x) {
    const double worst = worst_with(p, x, best);
    if (worst <= best * (1 + 1e-6)) return;
    best = worst;
    best_place = x;
    found = true;
  };
  const auto go_to = [&](const Point& target, double share) {
    Point x;
    for (std::size_t k = 0; k < 3; ++k) x[k] = points_[p][k] + share * (target[k] - points_[p][k]);
    attempt(x);
  };
  for (const double share : {1.0, 0.5, 0.2}) {
    if (found) break;
    go_to(middle, share);
  }
  // Towards and away from each neighbour: the worst tetrahedron may want that.
  if (!found && before < 0.35)
    for (const std::uint32_t q : towards)
      for (const double share : {0.15, -0.15}) go_to(points_[q], share);
  if (!found) {
    settled_[p] = clock_++;
    return false;
  }
  move(p, best_place);
  return true;
}

}  // namespace bsp2::meshing
