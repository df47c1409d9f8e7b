// Points that are moved.

#include <algorithm>
#include <utility>

#include "simplices/shape.hpp"
#include "tetrahedra/editor.hpp"
#include "tetrahedra/star.hpp"

namespace bsp2::meshing {

namespace {

constexpr double good_enough = 0.5;  // is left by itself where the middle of what is around is no better

}  // namespace

/// The worst first.
void Editor::look_at_star(std::uint32_t p, Star& star) const {
  std::vector<std::uint32_t> order(star_[p]);
  std::sort(order.begin(), order.end(), [&](std::uint32_t s, std::uint32_t t) {
    return std::pair(tetrahedra_[s].shape, s) < std::pair(tetrahedra_[t].shape, t);
  });
  for (const std::uint32_t t : order) {
    const auto face = face_opposite(t, tetrahedra_[t].place_of(p));
    star.add(points_[face[1]], points_[face[0]], points_[face[2]]);
  }
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

/// What a point may be drawn to: its neighbours in all that it is on.
std::vector<std::uint32_t> Editor::neighbours_along(std::uint32_t p) const {
  std::vector<std::uint32_t> along;
  if (kind_[p] == inside) {
    along = neighbours(p);
  } else if (kind_[p] == on_side) {
    for (const std::uint32_t t : star_[p]) {
      const Tetrahedron& tet = tetrahedra_[t];
      for (int k = 0; k < 4; ++k)
        if (tet.side[k] != inner && tet.point[k] != p)
          for (int l = 0; l < 4; ++l)
            if (l != k && tet.point[l] != p) along.push_back(tet.point[l]);
    }
  } else if (const auto ends = ends_along(p)) {
    along.assign(ends->begin(), ends->end());
  }
  return along;
}

bool Editor::smooth(std::uint32_t p) {
  if (kind_[p] == corner || star_[p].empty() || changed_[p] < settled_[p]) return false;
  const std::vector<std::uint32_t> along = neighbours_along(p);
  if (along.empty()) return false;
  Star star;
  look_at_star(p, star);
  const double before = worst_at(p);
  double best = std::max(before, 0.0);
  Point place = points_[p];
  const auto attempt = [&](Point x, const Point& way, double share) {
    for (std::size_t k = 0; k < 3; ++k) x[k] += share * way[k];
    const double worst = star.worst(x, best * (1 + 1e-6));
    if (worst <= best * (1 + 1e-6)) return false;
    best = worst;
    place = x;
    return true;
  };
  Point middle{};
  for (const std::uint32_t q : along)
    for (std::size_t k = 0; k < 3; ++k) middle[k] += points_[q][k] / static_cast<double>(along.size());
  const Point here = points_[p], way = middle - here;
  attempt(here, way, 1) || attempt(here, way, 0.5) || attempt(here, way, 0.2);
  if (kind_[p] == inside) {
    for (int step = 0; step < 4 && best < good_enough; ++step) {
      const auto ascent = star.ascent(place);
      if (!ascent ||
          !(attempt(place, *ascent, 1) || attempt(place, *ascent, 0.3) || attempt(place, *ascent, 0.1)))
        break;
    }
  } else if (place == points_[p] && before < 0.35) {
    // Towards and away from each neighbour: the worst tetrahedron may want that.
    for (const std::uint32_t q : along)
      for (const double share : {0.15, -0.15}) attempt(here, points_[q] - here, share);
  }
  if (place == points_[p]) {
    settled_[p] = clock_++;
    return false;
  }
  move(p, place);
  return true;
}

}  // namespace bsp2::meshing
