#include "tetrahedra/editor.hpp"

#include <algorithm>
#include <map>

#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

using Float128 = std::array<std::uint32_t, 4>;
using Sides = std::array<std::int32_t, 4>;

std::array<std::uint32_t, 3> sorted(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::array<std::uint32_t, 3> all{a, b, c};
  std::sort(all.begin(), all.end());
  return all;
}

constexpr std::size_t most_around = 9;  // of an edge that is removed: more are hardly ever worth it

}  // namespace

Editor::Editor(const Tetrahedra& mesh) : sides_(mesh.sides), points_(mesh.points) {
  std::vector<std::pair<std::array<std::uint32_t, 3>, std::int32_t>> tagged;
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    tagged.emplace_back(sorted(t[0], t[1], t[2]), static_cast<std::int32_t>(mesh.side[i]));
  }
  std::sort(tagged.begin(), tagged.end());
  star_.resize(points_.size());
  changed_.resize(points_.size(), clock_);
  settled_.resize(points_.size(), 0);
  tetrahedra_.reserve(mesh.tetrahedra.size());
  for (std::size_t i = 0; i < mesh.tetrahedra.size(); ++i) {
    const Float128& p = mesh.tetrahedra[i];
    Sides sides;
    for (int k = 0; k < 4; ++k) {
      const auto face = sorted(p[(k + 1) % 4], p[(k + 2) % 4], p[(k + 3) % 4]);
      const auto found = std::lower_bound(tagged.begin(), tagged.end(), std::pair(face, std::int32_t{-9}));
      sides[k] = found != tagged.end() && found->first == face ? found->second : inner;
    }
    add(p, sides, mesh.part[i]);
  }
  kind_.resize(points_.size(), inside);
  for (std::uint32_t p = 0; p < points_.size(); ++p) kind_[p] = find_kind(p);
}

Tetrahedra Editor::result() const {
  Tetrahedra mesh;
  mesh.sides = sides_;
  std::vector<std::uint32_t> map(points_.size(), none);
  for (std::uint32_t p = 0; p < points_.size(); ++p)
    if (!star_[p].empty()) {
      map[p] = static_cast<std::uint32_t>(mesh.points.size());
      mesh.points.push_back(points_[p]);
    }
  for (const Tetrahedron& t : tetrahedra_) {
    if (t.is_gone()) continue;
    const Float128 p{map[t.point[0]], map[t.point[1]], map[t.point[2]], map[t.point[3]]};
    mesh.tetrahedra.push_back(p);
    mesh.part.push_back(t.part);
    constexpr std::array<std::array<int, 3>, 4> outward{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
    for (int k = 0; k < 4; ++k)
      // An interface is on two tetrahedra: that of the part behind it tells.
      if (t.side[k] != inner && sides_[static_cast<std::size_t>(t.side[k])].part == t.part) {
        mesh.triangles.push_back({p[outward[k][0]], p[outward[k][1]], p[outward[k][2]]});
        mesh.side.push_back(static_cast<std::uint32_t>(t.side[k]));
      }
  }
  return mesh;
}

double Editor::shape(const Float128& p) const {
  return shape_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
}

double Editor::length(std::uint32_t u, std::uint32_t v) const {
  return std::sqrt(squared_distance(points_[u], points_[v]));
}

std::vector<std::uint32_t> Editor::neighbours(std::uint32_t p) const {
  std::vector<std::uint32_t> all;
  all.reserve(star_[p].size());
  seen_.resize(points_.size(), 0);
  seen_[p] = ++call_;
  for (const std::uint32_t t : star_[p])
    for (const std::uint32_t q : tetrahedra_[t].point)
      if (std::exchange(seen_[q], call_) != call_) all.push_back(q);
  std::sort(all.begin(), all.end());
  return all;
}

double Editor::worst_at(std::uint32_t p) const {
  double worst = 1;
  for (const std::uint32_t t : star_[p]) worst = std::min(worst, tetrahedra_[t].shape);
  return worst;
}

std::uint32_t Editor::add(const Float128& points, const Sides& sides, std::int32_t part) {
  std::uint32_t t = static_cast<std::uint32_t>(tetrahedra_.size());
  if (free_.empty()) {
    tetrahedra_.push_back({});
  } else {
    t = free_.back();
    free_.pop_back();
  }
  tetrahedra_[t] = {points, sides, part, shape(points)};
  for (const std::uint32_t p : points) {
    star_[p].push_back(t);
    changed_[p] = clock_;
  }
  ++clock_;
  return t;
}

std::uint32_t Editor::add_point(const Point& x, Kind kind) {
  points_.push_back(x);
  kind_.push_back(kind);
  star_.emplace_back();
  changed_.push_back(clock_);
  settled_.push_back(0);
  return static_cast<std::uint32_t>(points_.size() - 1);
}

void Editor::drop_last_point() {
  points_.pop_back();
  kind_.pop_back();
  star_.pop_back();
  changed_.pop_back();
  settled_.pop_back();
}

void Editor::move(std::uint32_t p, const Point& to) {
  points_[p] = to;
  for (const std::uint32_t t : star_[p]) {
    tetrahedra_[t].shape = shape(tetrahedra_[t].point);
    for (const std::uint32_t q : tetrahedra_[t].point) changed_[q] = clock_;
  }
  ++clock_;
}

void Editor::remove(std::uint32_t t) {
  for (const std::uint32_t p : tetrahedra_[t].point) {
    auto& star = star_[p];
    const auto found = std::find(star.begin(), star.end(), t);
    *found = star.back();
    star.pop_back();
    changed_[p] = clock_;
  }
  ++clock_;
  tetrahedra_[t].point[0] = none;
  free_.push_back(t);
}

/// The tetrahedron on the other side of a face, or `none`.
std::uint32_t Editor::beyond(std::uint32_t t, int face) const {
  const Float128& p = tetrahedra_[t].point;
  const std::uint32_t a = p[(face + 1) % 4], b = p[(face + 2) % 4], c = p[(face + 3) % 4];
  for (const std::uint32_t other : star_[a])
    if (other != t && tetrahedra_[other].place_of(b) >= 0 && tetrahedra_[other].place_of(c) >= 0)
      return other;
  return none;
}

/// Sets the side of a face in whatever tetrahedra have it.
void Editor::set_side(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::int32_t side) {
  for (const std::uint32_t t : star_[a]) {
    Tetrahedron& tet = tetrahedra_[t];
    if (tet.place_of(b) < 0 || tet.place_of(c) < 0) continue;
    tet.side[6 - tet.place_of(a) - tet.place_of(b) - tet.place_of(c)] = side;
  }
}

Editor::Ring Editor::ring_of(std::uint32_t u, std::uint32_t v) const {
  Ring ring;
  for (const std::uint32_t t : star_[u]) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int iv = tet.place_of(v);
    if (iv < 0) continue;
    ring.tetrahedra.push_back(t);
    const int iu = tet.place_of(u);
    for (int k = 0; k < 4; ++k) {
      if (k == iu || k == iv || tet.side[k] == inner) continue;
      const std::pair found(tet.point[6 - iu - iv - k], tet.side[k]);
      if (std::find(ring.sides.begin(), ring.sides.end(), found) == ring.sides.end())
        ring.sides.push_back(found);
    }
  }
  return ring;
}

/// The sides that meet in an edge, ascending. Edges with the same ones, of two planes at least, are on one
/// line.
std::vector<std::int32_t> Editor::key_of(const Ring& ring) const {
  std::vector<std::int32_t> key;
  for (const auto& [third, side] : ring.sides) key.push_back(side);
  std::sort(key.begin(), key.end());
  key.erase(std::unique(key.begin(), key.end()), key.end());
  return key;
}

/// The two ends of the edges of the solid that go on along each other in a point; none if it is a corner, or
/// not on an edge.
std::optional<std::array<std::uint32_t, 2>> Editor::ends_along(std::uint32_t p) const {
  std::vector<std::uint32_t> around;
  for (const std::uint32_t t : star_[p]) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int at = tet.place_of(p);
    for (int k = 0; k < 4; ++k)
      if (k != at && tet.side[k] != inner)
        for (int l = 0; l < 4; ++l)
          if (l != at && l != k) around.push_back(tet.point[l]);
  }
  std::sort(around.begin(), around.end());
  around.erase(std::unique(around.begin(), around.end()), around.end());
  std::vector<std::uint32_t> ends;
  std::vector<std::int32_t> key;
  for (const std::uint32_t q : around) {
    const Ring ring = ring_of(p, q);
    if (ring.is_inside() || ring.is_flat()) continue;
    if (ends.size() == 2) return std::nullopt;
    std::vector<std::int32_t> own = key_of(ring);
    if (ends.size() == 1 && own != key) return std::nullopt;
    key = std::move(own);
    ends.push_back(q);
  }
  if (ends.size() != 2) return std::nullopt;
  for (const std::int32_t side : key)
    if (sides_[static_cast<std::size_t>(side)].plane != sides_[static_cast<std::size_t>(key[0])].plane)
      return std::array{ends[0], ends[1]};
  return std::nullopt;
}

Editor::Kind Editor::find_kind(std::uint32_t p) const {
  std::vector<std::int32_t> sides;
  for (const std::uint32_t t : star_[p]) {
    const Tetrahedron& tet = tetrahedra_[t];
    for (int k = 0; k < 4; ++k)
      if (tet.point[k] != p && tet.side[k] != inner) sides.push_back(tet.side[k]);
  }
  if (sides.empty()) return inside;
  // Pieces of the solid that only touch in a point keep it where it is.
  std::vector<std::uint32_t> reached{star_[p].front()};
  for (std::size_t i = 0; i < reached.size(); ++i)
    for (int k = 0; k < 4; ++k) {
      if (tetrahedra_[reached[i]].point[k] == p) continue;
      const std::uint32_t next = beyond(reached[i], k);
      if (next != none && std::find(reached.begin(), reached.end(), next) == reached.end())
        reached.push_back(next);
    }
  if (reached.size() != star_[p].size()) return corner;
  if (ends_along(p)) return on_edge;
  if (std::any_of(sides.begin(), sides.end(), [&](std::int32_t side) { return side != sides[0]; }))
    return corner;
  for (const std::uint32_t q : neighbours(p)) {
    const Ring ring = ring_of(p, q);
    if (!ring.is_inside() && !ring.is_flat()) return corner;
  }
  return on_side;
}

// --- collapse ---

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
    const auto around = neighbours(p);
    return std::any_of(around.begin(), around.end(),
                       [&](std::uint32_t q) { return kind_[q] != inside && is_junction(ring_of(p, q)); });
  };
  return is_junction(ring) || !is_at_junction(u) || !is_at_junction(v);
}

bool Editor::collapse(std::uint32_t u, std::uint32_t v, const CollapseLimits& limits) {
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
    Float128 p = tet.point;
    p[static_cast<std::size_t>(tet.place_of(u))] = v;
    const double now = shape(p);
    if (now <= 0 && (!has_turned || (now < hardly_turned && depth(p) > deepest))) return false;
    if (now <= 0) ++turned_after;
    if (now > 0 && !has_turned && now < enough) return false;
    if (limits.length > 0)
      for (const std::uint32_t q : p)
        if (q != v && squared_distance(points_[q], points_[v]) > limits.length * limits.length) return false;
  }
  if (has_turned && turned_after >= turned_before) return false;
  if (!keeps_topology(u, v, ring)) return false;
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

// --- split ---

void Editor::replace_with_middle(const Ring& ring, std::uint32_t u, std::uint32_t v, std::uint32_t m) {
  for (const std::uint32_t t : ring.tetrahedra) {
    const Tetrahedron tet = tetrahedra_[t];
    const auto iu = static_cast<std::size_t>(tet.place_of(u)), iv = static_cast<std::size_t>(tet.place_of(v));
    remove(t);
    Float128 at_u = tet.point, at_v = tet.point;
    Sides side_u = tet.side, side_v = tet.side;
    at_u[iv] = m;
    side_u[iu] = inner;
    at_v[iu] = m;
    side_v[iv] = inner;
    add(at_u, side_u, tet.part);
    add(at_v, side_v, tet.part);
  }
}

std::uint32_t Editor::split(std::uint32_t u, std::uint32_t v, double least) {
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.empty()) return none;
  Point middle;
  for (std::size_t k = 0; k < 3; ++k) middle[k] = points_[u][k] + (points_[v][k] - points_[u][k]) / 2;
  const std::uint32_t m = add_point(middle, ring.is_inside() ? inside : ring.is_flat() ? on_side : on_edge);
  for (const std::uint32_t t : ring.tetrahedra)
    for (const std::uint32_t end : {u, v}) {
      Float128 p = tetrahedra_[t].point;
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

bool Editor::split_better(std::uint32_t u, std::uint32_t v) {
  const Ring ring = ring_of(u, v);
  if (ring.tetrahedra.empty() || !ring.is_inside()) return false;
  double before = 1;
  Point centre{};
  for (const std::uint32_t t : ring.tetrahedra) {
    before = std::min(before, tetrahedra_[t].shape);
    for (const std::uint32_t p : tetrahedra_[t].point)
      for (std::size_t k = 0; k < 3; ++k)
        centre[k] += points_[p][k] / static_cast<double>(4 * ring.tetrahedra.size());
  }
  const std::uint32_t m = add_point(centre, inside);
  double best = before;
  Point best_place{};
  for (const double share : {0.0, 0.5, 1.0}) {
    for (std::size_t k = 0; k < 3; ++k)
      points_[m][k] = centre[k] + share * ((points_[u][k] + points_[v][k]) / 2 - centre[k]);
    double worst = 1;
    for (const std::uint32_t t : ring.tetrahedra)
      for (const std::uint32_t end : {u, v}) {
        Float128 p = tetrahedra_[t].point;
        p[static_cast<std::size_t>(tetrahedra_[t].place_of(end))] = m;
        worst = worst > best ? std::min(worst, shape(p)) : worst;
      }
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

// --- flips ---

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
  if (ring.tetrahedra.size() < (ring.is_inside() ? 3U : 1U)) return false;
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
  if (!ring.is_inside()) {  // the new edge must be none that is there
    const std::uint32_t a = ring.sides[0].first, b = ring.sides[1].first;
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

// --- smoothing ---

/// The worst shape around a point if it were at x; what is not above `enough` does not matter.
double Editor::worst_with(std::uint32_t p, const Point& x, double enough) const {
  double worst = 1;
  for (const std::uint32_t t : star_[p]) {
    const Float128& q = tetrahedra_[t].point;
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
