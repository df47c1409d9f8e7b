// Points that are moved.

#include <algorithm>
#include <cmath>
#include <utility>

#include "editing/editor.hpp"
#include "editing/star.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {

namespace {

constexpr double good_enough = 0.5;  // is left by itself where the middle of what is around is no better

}  // namespace

/// Whether no face on a side is turned over if a point of it goes there, but for those at another point.
/// Where the solid is a flake volumes do not tell: a point on the one side of it can go astray above the
/// other one.
bool Editor::keeps_faces(std::uint32_t p, const Point& to, std::uint32_t but) const {
  for (const std::uint32_t t : star_[p]) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int at_other = but == none ? -1 : tet.place_of(but);
    for (int k = 0; k < 4; ++k) {
      if (tet.side[k] == inner || tet.point[k] == p || (at_other >= 0 && k != at_other)) continue;
      const PlaneSide& side = sides_[static_cast<std::size_t>(tet.side[k])];
      const auto corners = face_opposite(t, k);
      const auto faces_out = [&](const Point& x) {
        const auto at = [&](std::size_t i) { return corners[i] == p ? x : points_[corners[i]]; };
        const double out = dot(side.outward, cross(at(1) - at(0), at(2) - at(0)));
        return (side.part == tet.part ? out : -out) > 0;
      };
      if (!faces_out(to) && faces_out(points_[p])) return false;
    }
  }
  return true;
}

/// The worst first. @return its shape.
double Editor::look_at_star(std::uint32_t p, Star& star) const {
  const auto add = [&](std::uint32_t t) {
    const auto face = face_opposite(t, tetrahedra_[t].place_of(p));
    star.add(points_[face[1]], points_[face[0]], points_[face[2]]);
  };
  const std::uint32_t worst = *std::min_element(
      star_[p].begin(), star_[p].end(),
      [&](std::uint32_t s, std::uint32_t t) { return tetrahedra_[s].shape < tetrahedra_[t].shape; });
  star.clear();
  add(worst);
  for (const std::uint32_t t : star_[p])
    if (t != worst) add(t);
  return tetrahedra_[worst].shape;
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

bool Editor::put(std::uint32_t p, const Point& to, double least) {
  const Point from = std::exchange(points_[p], to);
  for (const std::uint32_t t : star_[p]) {
    const double now = shape(tetrahedra_[t].point);
    if (now > 0 && now >= std::min(least, tetrahedra_[t].shape)) continue;
    points_[p] = from;
    return false;
  }
  move(p, to);
  return true;
}

void Editor::find_planes(std::uint32_t p, std::vector<std::uint32_t>& planes) const {
  planes.clear();
  for (const std::uint32_t t : star_[p])
    for (std::size_t k = 0; k < 4; ++k)
      if (const std::int32_t side = tetrahedra_[t].side[k]; side != inner && tetrahedra_[t].point[k] != p)
        planes.push_back(sides_[static_cast<std::size_t>(side)].plane);
  std::sort(planes.begin(), planes.end());
  planes.erase(std::unique(planes.begin(), planes.end()), planes.end());
}

/// What a point of the surface may be drawn to: its neighbours in all that it is on, some of them twice.
void Editor::find_along(std::uint32_t p) {
  along_.clear();
  if (kind_[p] == on_edge) {
    if (const auto ends = ends_along(p)) along_.assign(ends->begin(), ends->end());
    return;
  }
  for (const std::uint32_t t : star_[p]) {
    const Tetrahedron& tet = tetrahedra_[t];
    for (int k = 0; k < 4; ++k)
      if (tet.side[k] != inner && tet.point[k] != p)
        for (int l = 0; l < 4; ++l)
          if (l != k && tet.point[l] != p) along_.push_back(tet.point[l]);
  }
}

Point Editor::middle_of(const std::vector<std::uint32_t>& points) const {
  Point sum{};
  for (const std::uint32_t p : points)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += points_[p][k] / static_cast<double>(points.size());
  return sum;
}

/// Whether all that a point is on goes straight on that way: corners that were moved may have bent it.
bool Editor::leads_along(std::uint32_t p, const Point& way) const {
  constexpr double rounding = 1e-8;
  const double most = rounding * std::sqrt(dot(way, way));
  for (const std::uint32_t t : star_[p])
    for (std::size_t k = 0; k < 4; ++k)
      if (const std::int32_t side = tetrahedra_[t].side[k]; side != inner && tetrahedra_[t].point[k] != p)
        if (std::fabs(dot(sides_[static_cast<std::size_t>(side)].outward, way)) > most) return false;
  return true;
}

bool Editor::smooth(std::uint32_t p) {
  if (kind_[p] <= corner || star_[p].empty() || changed_[p] < settled_[p]) return false;
  const double before = look_at_star(p, star_here_);
  double best = std::max(before, 0.0);
  Point place = points_[p];
  const auto attempt = [&](Point x, const Point& way, double share) {
    for (std::size_t k = 0; k < 3; ++k) x[k] += share * way[k];
    const double worst = star_here_.worst(x, best * (1 + 1e-6));
    if (worst <= best * (1 + 1e-6) || (kind_[p] != inside && !keeps_faces(p, x))) return false;
    best = worst;
    place = x;
    return true;
  };
  const auto attempt_some = [&](const Point& x, const Point& way, double half, double little) {
    return attempt(x, way, 1) || attempt(x, way, half) || attempt(x, way, little);
  };
  const Point here = points_[p];
  if (kind_[p] == inside) {
    attempt_some(here, star_here_.middle() - here, 0.5, 0.2);
    for (int step = 0; step < 4 && best < good_enough; ++step) {
      const auto ascent = star_here_.ascent(place);
      if (!ascent || !attempt_some(place, *ascent, 0.3, 0.1)) break;
    }
  } else if (find_along(p); !along_.empty()) {
    attempt_some(here, middle_of(along_) - here, 0.5, 0.2);
    // Towards and away from each neighbour: the worst tetrahedron may want that. Between two points of the
    // surface it is no farther off than these; beyond one of them it may be.
    if (place == here && before < 0.35)
      for (const std::uint32_t q : along_) {
        const Point way = points_[q] - here;
        attempt(here, way, 0.15);
        if (leads_along(p, way)) attempt(here, way, -0.15);
      }
  }
  if (place == here) {
    settled_[p] = clock_++;
    return false;
  }
  move(p, place);
  return true;
}

}  // namespace bsp2::meshing
