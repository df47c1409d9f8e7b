// Edges that become a point.

#include <algorithm>
#include <iterator>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {

/// Whether u stays in all that it is on if it goes to v.
bool Editor::may_go_along(std::uint32_t u, std::uint32_t v, const Ring& ring) const {
  switch (kind_[u]) {
    case inside:
      return true;
    case on_side:
      return ring.is_flat();
    case on_edge: {
      if (ring.is_inside() || ring.is_flat()) return false;
      const auto ends = ends_along(u);
      return ends && ((*ends)[0] == v || (*ends)[1] == v);
    }
    default:
      return false;
  }
}

/// What u and v have in common is what their edge has: points, and faces and edges of the solid. Then nothing
/// closes or opens when they become one.
/// Source: Dey, Edelsbrunner, Guha, Nekhayev, "Topology preserving edge contraction" (1999).
bool Editor::keeps_topology(std::uint32_t u, std::uint32_t v, const Ring& ring) const {
  std::vector<std::uint32_t> of_u = neighbours(u), of_v = neighbours(v), common, around;
  std::set_intersection(of_u.begin(), of_u.end(), of_v.begin(), of_v.end(), std::back_inserter(common));
  for (const std::uint32_t t : ring.tetrahedra)
    for (const std::uint32_t q : tetrahedra_[t].point)
      if (q != u && q != v) around.push_back(q);
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  if (around != common) return false;
  // A face that both see, but not across their edge.
  const auto has_third = [&](std::uint32_t a, std::uint32_t b) {
    return std::any_of(star_[v].begin(), star_[v].end(), [&](std::uint32_t t) {
      return tetrahedra_[t].place_of(a) >= 0 && tetrahedra_[t].place_of(b) >= 0 &&
             tetrahedra_[t].place_of(u) < 0;
    });
  };
  for (const std::uint32_t t : star_[u]) {
    geometry::Interruption::check();
    const Tetrahedron& tet = tetrahedra_[t];
    if (tet.place_of(v) >= 0) continue;
    const int at = tet.place_of(u);
    const std::uint32_t a = tet.point[(at + 1) % 4], b = tet.point[(at + 2) % 4], c = tet.point[(at + 3) % 4];
    const auto in_ring = [&](std::uint32_t p, std::uint32_t q) {
      return std::any_of(ring.tetrahedra.begin(), ring.tetrahedra.end(), [&](std::uint32_t r) {
        return tetrahedra_[r].place_of(p) >= 0 && tetrahedra_[r].place_of(q) >= 0;
      });
    };
    for (const auto& [p, q] : {std::pair(a, b), std::pair(b, c), std::pair(a, c)})
      if (has_third(p, q) && !in_ring(p, q)) return false;
  }
  if (kind_[u] == inside || kind_[v] == inside) return true;
  if (ring.is_inside()) return false;  // two pieces of the surface would become one
  const auto is_junction = [](const Ring& other) { return other.sides.size() > 2; };
  for (const std::uint32_t q : common) {
    if (kind_[q] == inside) continue;
    const Ring uq = ring_of(u, q), vq = ring_of(v, q);
    const bool is_face =
        std::any_of(ring.sides.begin(), ring.sides.end(), [q](const auto& face) { return face.first == q; });
    if (!uq.is_inside() && !vq.is_inside() && !is_face) return false;
    if (is_junction(uq) && is_junction(vq)) return false;
  }
  // Lines in which several pieces of the surface meet may only be shortened.
  const auto is_at_junction = [&](std::uint32_t p) {
    const auto near = neighbours(p);
    return std::any_of(near.begin(), near.end(),
                       [&](std::uint32_t q) { return kind_[q] != inside && is_junction(ring_of(p, q)); });
  };
  return is_junction(ring) || !is_at_junction(u) || !is_at_junction(v);
}

bool Editor::collapse_either(std::uint32_t u, std::uint32_t v, const CollapseLimits& limits) {
  if (kind_[u] < kind_[v]) std::swap(u, v);
  return collapse(u, v, limits) || collapse(v, u, limits);
}

bool Editor::collapse(std::uint32_t u, std::uint32_t v, const CollapseLimits& limits) {
  if (kind_[u] <= corner) return false;
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.empty()) return false;
  if (!may_go_along(u, v, ring)) return false;
  double least = 1;
  bool has_turned = false;
  double deepest = 0;
  for (const std::uint32_t t : star_[u]) {
    least = std::min(least, tetrahedra_[t].shape);
    if (tetrahedra_[t].shape > 0) continue;
    has_turned = true;
    deepest = std::max(deepest, depth(tetrahedra_[t].point));
  }
  // Of tetrahedra around u that are turned over already, as many may not be left.
  int turned_before = 0, turned_after = 0;
  const double enough = std::min(limits.shape, least);
  for (const std::uint32_t t : ring.tetrahedra) {
    const Tetrahedron& tet = tetrahedra_[t];
    if (tet.shape <= 0) ++turned_before;
    if (tet.side[tet.place_of(u)] != inner && tet.side[tet.place_of(v)] != inner) return false;
  }
  for (const std::uint32_t t : star_[u]) {
    const Tetrahedron& tet = tetrahedra_[t];
    if (tet.place_of(v) >= 0) continue;
    if (tet.shape <= 0) ++turned_before;
    std::array<std::uint32_t, 4> p = tet.point;
    p[static_cast<std::size_t>(tet.place_of(u))] = v;
    const double now = shape(p);
    if (now <= 0 && (!has_turned || (now < hardly_turned && depth(p) > deepest))) return false;
    if (now <= 0) ++turned_after;
    if (now > 0 && !has_turned && now < enough) return false;
    if (limits.length > 0)
      for (const std::uint32_t q : p)
        if (const double length = squared_distance(points_[q], points_[v]);
            q != v && length > limits.length * limits.length &&
            length > squared_distance(points_[q], points_[u]))
          return false;
  }
  if (has_turned && turned_after >= turned_before) return false;
  if (!keeps_topology(u, v, ring) || (kind_[u] != inside && !keeps_faces(u, points_[v], v))) return false;
  // What was on the one face of a tetrahedron that goes is now on the other one.
  for (const std::uint32_t t : ring.tetrahedra) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int iu = tet.place_of(u), iv = tet.place_of(v);
    std::array<std::uint32_t, 2> others{};
    for (int k = 0, n = 0; k < 4; ++k)
      if (k != iu && k != iv) others[static_cast<std::size_t>(n++)] = tet.point[k];
    const std::int32_t at_v = tet.side[iu], at_u = tet.side[iv];
    if (at_v != inner) set_side(u, others[0], others[1], at_v);
    if (at_u != inner) set_side(v, others[0], others[1], at_u);
  }
  std::vector<New> made;
  for (const std::uint32_t t : star_[u]) {
    const Tetrahedron& tet = tetrahedra_[t];
    if (tet.place_of(v) >= 0) continue;
    New copy{tet.point, tet.side, tet.part};
    copy.point[static_cast<std::size_t>(tet.place_of(u))] = v;
    made.push_back(copy);
  }
  while (!star_[u].empty()) remove(star_[u].back());
  for (const New& tet : made) add(tet.point, tet.side, tet.part);
  return true;
}

}  // namespace bsp2::meshing
