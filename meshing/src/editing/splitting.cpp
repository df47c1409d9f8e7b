// Points that are added.

#include <algorithm>

#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {

void Editor::replace_with_middle(const Ring& ring, std::uint32_t u, std::uint32_t v, std::uint32_t m) {
  for (const std::uint32_t t : ring.tetrahedra) {
    const Tetrahedron tet = tetrahedra_[t];
    const auto iu = static_cast<std::size_t>(tet.place_of(u)), iv = static_cast<std::size_t>(tet.place_of(v));
    remove(t);
    std::array<std::uint32_t, 4> at_u = tet.point, at_v = tet.point;
    std::array<std::int32_t, 4> side_u = tet.side, side_v = tet.side;
    at_u[iv] = m;
    side_u[iu] = inner;
    at_v[iu] = m;
    side_v[iv] = inner;
    add(at_u, side_u, tet.part);
    add(at_v, side_v, tet.part);
  }
}

Point Editor::middle_between(std::uint32_t u, std::uint32_t v) const {
  Point middle;
  for (std::size_t k = 0; k < 3; ++k) middle[k] = points_[u][k] + (points_[v][k] - points_[u][k]) / 2;
  return middle;
}

std::uint32_t Editor::split(std::uint32_t u, std::uint32_t v, double least) {
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.empty() || is_fixed(u, v, ring)) return none;
  const std::uint32_t m = add_point(middle_between(u, v), ring.kind_on_edge());
  for (const std::uint32_t t : ring.tetrahedra)
    for (const std::uint32_t end : {u, v}) {
      std::array<std::uint32_t, 4> p = tetrahedra_[t].point;
      p[static_cast<std::size_t>(tetrahedra_[t].place_of(end))] = m;
      const double now = shape(p);
      if (now <= 0 || now < std::min(least, tetrahedra_[t].shape / 2)) {
        drop_last_point();
        return none;
      }
    }
  replace_with_middle(ring, u, v, m);
  return m;
}

/// The worst shape of what a point makes of the tetrahedra around an edge; or one that is no more than
/// `enough`.
double Editor::worst_with_middle(const Ring& ring, std::uint32_t u, std::uint32_t v, std::uint32_t m,
                                 double enough) const {
  double worst = 1;
  for (const std::uint32_t t : ring.tetrahedra)
    for (const std::uint32_t end : {u, v}) {
      if (worst <= enough) return worst;
      std::array<std::uint32_t, 4> p = tetrahedra_[t].point;
      p[static_cast<std::size_t>(tetrahedra_[t].place_of(end))] = m;
      worst = std::min(worst, shape(p));
    }
  return worst;
}

bool Editor::split_better(std::uint32_t u, std::uint32_t v) {
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.empty() || is_fixed(u, v, ring)) return false;
  double before = 1;
  Point centre{};
  for (const std::uint32_t t : ring.tetrahedra) {
    before = std::min(before, tetrahedra_[t].shape);
    for (const std::uint32_t p : tetrahedra_[t].point)
      for (std::size_t k = 0; k < 3; ++k)
        centre[k] += points_[p][k] / static_cast<double>(4 * ring.tetrahedra.size());
  }
  const Point middle = middle_between(u, v);
  const std::uint32_t m = add_point(middle, ring.kind_on_edge());
  double best = before;
  Point best_place{};
  for (const double share : {0.0, 0.5, 1.0}) {
    if (share < 1 && !ring.is_inside()) continue;
    for (std::size_t k = 0; k < 3; ++k)
      points_[m][k] = share < 1 ? centre[k] + share * (middle[k] - centre[k]) : middle[k];
    const double worst = worst_with_middle(ring, u, v, m, best);
    if (worst > best) {
      best = worst;
      best_place = points_[m];
    }
  }
  if (best <= before || best <= 0) {
    drop_last_point();
    return false;
  }
  points_[m] = best_place;
  replace_with_middle(ring, u, v, m);
  return true;
}

bool Editor::divide_face(std::uint32_t t, double least) {
  const Tetrahedron& tet = tetrahedra_[t];
  if (tet.shape <= 0 || std::ranges::count(tet.side, inner) != 3) return false;
  const int place = static_cast<int>(
      std::ranges::find_if(tet.side, [](std::int32_t side) { return side != inner; }) - tet.side.begin());
  const std::uint32_t m = tet.point[static_cast<std::size_t>(place)];
  const std::int32_t side = tet.side[static_cast<std::size_t>(place)];
  const auto face = face_opposite(t, place);
  // What pieces share stays as it is.
  if (kind_[m] != inside || sides_[static_cast<std::size_t>(side)].other != PlaneSide::nothing ||
      std::ranges::all_of(face, [&](std::uint32_t p) { return kind_[p] == shared; }))
    return false;
  const Point from = points_[m], &a = points_[face[0]];
  const Point normal = cross(points_[face[1]] - a, points_[face[2]] - a);
  const double share = dot(from - a, normal) / dot(normal, normal);
  Point to;
  for (std::size_t k = 0; k < 3; ++k) to[k] = from[k] - share * normal[k];
  // Beyond an edge where the solid's sides meet inwards all around it could be right side out.
  constexpr double least_share = 0.01;  // of the face
  for (std::size_t i = 0; i < 3; ++i) {
    const Point to_next = cross(points_[face[i]] - to, points_[face[(i + 1) % 3]] - to);
    if (!(dot(to_next, normal) > least_share * dot(normal, normal))) return false;
  }
  points_[m] = to;
  const bool is_good = std::ranges::all_of(
      star_[m], [&](std::uint32_t s) { return s == t || shape(tetrahedra_[s].point) >= least; });
  points_[m] = from;
  if (!is_good) return false;
  move(m, to);
  if (peel(t)) return true;
  move(m, from);
  return false;
}

/// From a tetrahedron on, all whose faces a point does not see well enough give way to what is over them.
bool Editor::insert(std::uint32_t t, const Point& x, double least) {
  constexpr std::size_t most = 48;  // are taken out
  // What is right side out all over is a ball that the point sees from inside: nothing else can change.
  const auto is_right = [this](std::uint32_t own) { return tetrahedra_[own].shape > 0; };
  if (!is_right(t)) return false;
  Change change;
  change.removed.push_back(t);
  const auto is_removed = [&change](std::uint32_t other) {
    return std::find(change.removed.begin(), change.removed.end(), other) != change.removed.end();
  };
  const std::uint32_t m = add_point(x, inside);
  const auto is_grown = [&] {
    for (std::size_t i = 0; i < change.removed.size(); ++i)
      for (int k = 0; k < 4; ++k) {
        const std::uint32_t own = change.removed[i];
        const auto [a, b, c] = face_opposite(own, k);
        if (shape({b, a, c, m}) > least) continue;
        const std::uint32_t other = tetrahedra_[own].side[k] == inner ? beyond(own, k) : none;
        if (other == none || !is_right(other)) return false;
        if (is_removed(other)) continue;
        if (change.removed.size() >= most) return false;
        change.removed.push_back(other);
      }
    return true;
  };
  if (!is_grown()) {
    drop_last_point();
    return false;
  }
  for (const std::uint32_t own : change.removed)
    for (int k = 0; k < 4; ++k) {
      const std::int32_t side = tetrahedra_[own].side[k];
      if (side == inner && is_removed(beyond(own, k))) continue;
      const auto [a, b, c] = face_opposite(own, k);
      change.added.push_back({{b, a, c, m}, {inner, inner, inner, side}, tetrahedra_[own].part});
    }
  for (const std::uint32_t own : change.removed) remove(own);
  for (const New& tet : change.added) add(tet.point, tet.side, tet.part);
  return true;
}

}  // namespace bsp2::meshing
