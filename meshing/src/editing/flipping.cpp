// Steps that leave the points where they are: edges and faces that give way to others.

#include <algorithm>
#include <utility>

#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

constexpr std::size_t most_around = 9;  // of an edge that is removed: more are hardly ever worth it

}  // namespace

/// Divides the ring of an edge where sides cross it. @return whether it may be removed.
bool Editor::arcs_of(std::uint32_t u, std::uint32_t v, const Ring& ring, std::vector<Arc>& arcs) const {
  if (ring.tetrahedra.size() > most_around || !(ring.is_inside() || ring.is_flat())) return false;
  struct Step {
    std::uint32_t from, to;
    std::array<std::int32_t, 2> outer;
    std::int32_t part;
  };
  std::vector<Step> steps;
  for (const std::uint32_t t : ring.tetrahedra) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int iu = tet.place_of(u), iv = tet.place_of(v);
    std::array<int, 2> rest{};
    for (int k = 0, n = 0; k < 4; ++k)
      if (k != iu && k != iv) rest[static_cast<std::size_t>(n++)] = k;
    // Even permutations of (u, v, from, to) are right side out.
    const std::array<int, 4> order{iu, iv, rest[0], rest[1]};
    int inversions = 0;
    for (int i = 0; i < 4; ++i)
      for (int k = i + 1; k < 4; ++k) inversions += order[i] > order[k] ? 1 : 0;
    if (inversions % 2 != 0) std::swap(rest[0], rest[1]);
    steps.push_back({tet.point[rest[0]], tet.point[rest[1]], {tet.side[iu], tet.side[iv]}, tet.part});
  }
  const auto is_side = [&](std::uint32_t p) {
    return std::any_of(ring.sides.begin(), ring.sides.end(), [p](const auto& f) { return f.first == p; });
  };
  std::vector<bool> used(steps.size(), false);
  for (std::size_t count = 0; count < steps.size();) {
    std::size_t first = steps.size();
    for (std::size_t i = 0; i < steps.size(); ++i)
      if (!used[i] && (ring.is_inside() || is_side(steps[i].from))) {
        first = i;
        break;
      }
    if (first == steps.size()) return false;
    Arc arc;
    arc.part = steps[first].part;
    arc.is_closed = ring.is_inside();
    arc.points.push_back(steps[first].from);
    for (std::size_t at = first; at < steps.size();) {
      used[at] = true;
      ++count;
      arc.outer.push_back(steps[at].outer);
      const std::uint32_t to = steps[at].to;
      if (arc.is_closed && to == arc.points.front()) break;
      arc.points.push_back(to);
      if (!arc.is_closed && is_side(to)) break;
      std::size_t next = 0;
      while (next < steps.size() && (used[next] || steps[next].from != to)) ++next;
      if (next == steps.size()) return false;
      at = next;
    }
    arcs.push_back(std::move(arc));
    if (arcs.back().is_closed) break;
  }
  std::size_t all = 0;
  for (const Arc& arc : arcs) all += arc.outer.size();
  return all == steps.size() && arcs.size() <= 2;
}

/// The best triangles of an arc's polygon. @return their worst tetrahedron, or less than `enough`.
/// Source: Klincsek, "Minimal triangulations of polygonal domains" (1980).
double Editor::fill(Arc& arc, std::uint32_t u, std::uint32_t v, double enough) const {
  const int n = static_cast<int>(arc.points.size());
  arc.triangles.clear();
  if (n == 2) return 1;
  std::vector<double> best(static_cast<std::size_t>(n * n), 1);
  std::vector<int> choice(static_cast<std::size_t>(n * n), -1);
  const auto at = [n](int i, int k) { return static_cast<std::size_t>(i * n + k); };
  for (int step = 2; step < n; ++step)
    for (int i = 0; i + step < n; ++i) {
      const int k = i + step;
      best[at(i, k)] = -2;
      for (int j = i + 1; j < k; ++j) {
        double worst = std::min(best[at(i, j)], best[at(j, k)]);
        if (worst <= std::max(enough, best[at(i, k)])) continue;
        const std::uint32_t a = arc.points[i], b = arc.points[j], c = arc.points[k];
        worst = std::min(worst, shape({a, b, c, v}));
        if (worst > best[at(i, k)]) worst = std::min(worst, shape({b, a, c, u}));
        if (worst > best[at(i, k)]) {
          best[at(i, k)] = worst;
          choice[at(i, k)] = j;
        }
      }
    }
  if (best[at(0, n - 1)] <= enough) return -2;
  std::vector<std::pair<int, int>> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, k] = open.back();
    open.pop_back();
    if (k - i < 2) continue;
    const int j = choice[at(i, k)];
    arc.triangles.push_back({i, j, k});
    open.emplace_back(i, j);
    open.emplace_back(j, k);
  }
  return best[at(0, n - 1)];
}

/// Whether the triangles that fill an arc, and their edges across it, are none that there are elsewhere:
/// around what is turned over that can be.
bool Editor::is_new(const Arc& arc) const {
  const int last = static_cast<int>(arc.points.size()) - 1;
  const auto is_there = [&](int x, int y, int z) {
    return std::any_of(star_[arc.points[x]].begin(), star_[arc.points[x]].end(), [&](std::uint32_t t) {
      return tetrahedra_[t].place_of(arc.points[y]) >= 0 && tetrahedra_[t].place_of(arc.points[z]) >= 0;
    });
  };
  return std::none_of(arc.triangles.begin(), arc.triangles.end(), [&](const auto& triangle) {
    const auto& [i, j, k] = triangle;
    for (const auto& [x, y] : {std::pair(i, j), std::pair(j, k), std::pair(i, k)})
      if (y != x + 1 && (x > 0 || y < last) && is_there(x, y, y)) return true;
    return is_there(i, j, k);
  });
}

bool Editor::remove_edge(std::uint32_t u, std::uint32_t v) {
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.size() < (ring.is_inside() ? 3U : 1U) || is_fixed(u, v, ring)) return false;
  std::vector<Arc> arcs;
  if (!arcs_of(u, v, ring, arcs)) return false;
  double before = 1;
  for (const std::uint32_t t : ring.tetrahedra) before = std::min(before, tetrahedra_[t].shape);
  const double enough = std::max(before, 0.0);
  const std::int32_t side = ring.is_inside() ? inner : ring.sides[0].second;
  for (Arc& arc : arcs) {
    if (fill(arc, u, v, enough) <= enough) return false;
    // Two faces that are one already: nothing may be on them.
    if (arc.points.size() == 2 && (arc.outer[0][0] != inner || arc.outer[0][1] != inner)) return false;
    if (!is_new(arc)) return false;
  }
  if (!ring.is_inside()) {  // the new edge must be none that is there, and lead across that which goes
    const std::uint32_t a = ring.sides[0].first, b = ring.sides[1].first;
    const Point across = points_[b] - points_[a];
    if (dot(cross(across, points_[u] - points_[a]), cross(across, points_[v] - points_[a])) >= 0)
      return false;
    if (std::none_of(arcs.begin(), arcs.end(), [](const Arc& arc) { return arc.points.size() == 2; }) &&
        !ring_of(a, b).tetrahedra.empty())
      return false;
  }
  for (const std::uint32_t t : ring.tetrahedra) remove(t);
  for (const Arc& arc : arcs) {
    const int n = static_cast<int>(arc.points.size());
    const auto outer = [&](int i, int k,
                           int end) -> std::int32_t {  // of the face over an edge of the polygon
      if (k == i + 1) return arc.outer[static_cast<std::size_t>(i)][end];
      if (i == 0 && k == n - 1) return arc.is_closed ? arc.outer.back()[end] : side;
      return inner;
    };
    for (const auto& [i, j, k] : arc.triangles) {
      const std::uint32_t a = arc.points[i], b = arc.points[j], c = arc.points[k];
      add({a, b, c, v}, {outer(j, k, 0), outer(i, k, 0), outer(i, j, 0), inner}, arc.part);
      add({b, a, c, u}, {outer(i, k, 1), outer(j, k, 1), outer(i, j, 1), inner}, arc.part);
    }
    if (n == 2)
      for (const std::uint32_t end : {u, v}) set_side(end, arc.points[0], arc.points[1], side);
  }
  return true;
}

bool Editor::flip_face(std::uint32_t t, int face) {
  const Tetrahedron one = tetrahedra_[t];
  if (one.side[face] != inner) return false;
  const std::uint32_t other = beyond(t, face);
  if (other == none) return false;
  const Tetrahedron two = tetrahedra_[other];
  constexpr std::array<std::array<int, 3>, 4> inward{{{1, 3, 2}, {0, 2, 3}, {0, 3, 1}, {0, 1, 2}}};
  const std::uint32_t d = one.point[face];
  std::array<std::uint32_t, 3> p;
  for (int k = 0; k < 3; ++k) p[k] = one.point[inward[face][k]];  // (p, d) is right side out
  std::uint32_t e = none;
  for (const std::uint32_t q : two.point)
    if (q != p[0] && q != p[1] && q != p[2]) e = q;
  const double before = std::max(0.0, std::min(one.shape, two.shape));
  for (int k = 0; k < 3; ++k)
    if (shape({p[k], p[(k + 1) % 3], e, d}) <= before) return false;
  if (!ring_of(d, e).tetrahedra.empty()) return false;
  remove(t);
  remove(other);
  for (int k = 0; k < 3; ++k) {
    const std::uint32_t last = p[(k + 2) % 3];
    add({p[k], p[(k + 1) % 3], e, d},
        {inner, inner, one.side[one.place_of(last)], two.side[two.place_of(last)]}, one.part);
  }
  return true;
}

}  // namespace bsp2::meshing
