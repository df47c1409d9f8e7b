// Steps that mend what rounding has made flat or turned over. The others of the editor leave what touches
// what as it is; these close gaps and take away layers that are thinner than points are rounded, so they work
// on any set of tetrahedra that is taken out and put in: which faces are outer ones or interfaces afterwards
// is seen from what has them then.

#include <algorithm>
#include <map>
#include <numeric>

#include "bsp2/geometry/support/interruption.hpp"
#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

// Faces opposite of each corner, seen from outside.
constexpr std::array<std::array<int, 3>, 4> face_of{{{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

/// Parameters of the points of the lines a b and c d that are closest to each other; 2 where they are
/// parallel.
std::array<double, 2> closest(const Point& a, const Point& b, const Point& c, const Point& d) {
  const Point u = b - a, v = d - c, w = a - c;
  const double uu = dot(u, u), uv = dot(u, v), vv = dot(v, v), uw = dot(u, w), vw = dot(v, w);
  const double determinant = uu * vv - uv * uv;
  if (!(determinant > 1e-12 * uu * vv)) return {2, 2};
  return {(uv * vw - vv * uw) / determinant, (uu * vw - uv * uw) / determinant};
}

bool is_even(const std::array<std::uint32_t, 4>& p) {
  int inversions = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = i + 1; k < 4; ++k) inversions += p[i] > p[k] ? 1 : 0;
  return inversions % 2 == 0;
}

}  // namespace

/// How far the nearest point is from the plane of the face opposite of it: how thin a tetrahedron is, or by
/// how much it is turned over.
double Editor::depth(const std::array<std::uint32_t, 4>& p) const {
  const Point &a = points_[p[0]], &b = points_[p[1]], &c = points_[p[2]], &d = points_[p[3]];
  double largest = 0;
  for (const Point& n : normals_of(a, b, c, d)) largest = std::max(largest, dot(n, n));
  return largest > 0 ? std::fabs(dot(cross(b - a, c - a), d - a)) / std::sqrt(largest) : 0;
}

/// All faces of a change, with those that stay beside them, by face.
std::vector<Editor::FaceUse> Editor::uses_of(const Change& change) const {
  std::vector<FaceUse> uses;
  const auto add = [&uses](FaceUse::From from, std::uint32_t index, const std::array<std::uint32_t, 4>& p,
                           const std::array<std::int32_t, 4>& side, std::int32_t part, int place) {
    const auto& o = face_of[static_cast<std::size_t>(place)];
    std::array<std::uint32_t, 3> f{p[o[0]], p[o[1]], p[o[2]]};
    const bool is_even = (f[0] < f[1]) ^ (f[1] < f[2]) ^ (f[0] < f[2]);
    std::sort(f.begin(), f.end());
    uses.push_back({f, from, index, place, side[static_cast<std::size_t>(place)], part, is_even});
  };
  const auto add_tetrahedron = [&](FaceUse::From from, std::uint32_t t) {
    for (int k = 0; k < 4; ++k)
      add(from, t, tetrahedra_[t].point, tetrahedra_[t].side, tetrahedra_[t].part, k);
  };
  for (const std::uint32_t t : change.removed) add_tetrahedron(FaceUse::gone, t);
  for (std::uint32_t i = 0; i < change.added.size(); ++i)
    for (int k = 0; k < 4; ++k)
      add(FaceUse::made, i, change.added[i].point, change.added[i].side, change.added[i].part, k);
  for (const auto& [face, side] : change.hints)
    uses.push_back({face, FaceUse::gone, none, 0, side, 0, false});
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (const FaceUse& use : uses) faces.push_back(use.face);
  std::sort(faces.begin(), faces.end());
  faces.erase(std::unique(faces.begin(), faces.end()), faces.end());
  for (const auto& [a, b, c] : faces) {
    geometry::Interruption::check();
    for (const std::uint32_t t : star_[a]) {
      const Tetrahedron& tet = tetrahedra_[t];
      if (tet.place_of(b) < 0 || tet.place_of(c) < 0) continue;
      if (std::find(change.removed.begin(), change.removed.end(), t) != change.removed.end()) continue;
      add(FaceUse::kept, t, tet.point, tet.side, tet.part,
          6 - tet.place_of(a) - tet.place_of(b) - tet.place_of(c));
    }
  }
  std::sort(uses.begin(), uses.end(), [](const FaceUse& x, const FaceUse& y) {
    return std::tie(x.face, x.from, x.index) < std::tie(y.face, y.from, y.index);
  });
  return uses;
}

/// The side on the plane of another one, seen from a face of the tetrahedron of the lower part.
std::int32_t Editor::side_like(std::int32_t like, std::int32_t part, std::int32_t other,
                               const Point& normal) {
  PlaneSide side = sides_[static_cast<std::size_t>(like)];
  if (side.part == part && side.other == other) return like;
  side.part = part;
  side.other = other;
  if (dot(side.outward, normal) < 0)
    for (double& x : side.outward) x = -x;
  const auto found = std::find(sides_.begin(), sides_.end(), side);
  const auto place = static_cast<std::int32_t>(found - sides_.begin());
  if (found == sides_.end()) sides_.push_back(side);
  return place;
}

bool Editor::is_better(const Change& change, Gain gain) const {
  std::size_t before = 0, after = 0;
  double deepest = 0, sum_before = 0, sum_after = 0;
  for (const std::uint32_t t : change.removed)
    if (tetrahedra_[t].shape <= 0) {
      ++before;
      const double own = depth(tetrahedra_[t].point);
      deepest = std::max(deepest, own);
      sum_before += own;
    }
  for (const New& tet : change.added) {
    const double now = shape(tet.point);
    if (now > 0) continue;
    if (++after > before && gain != Gain::none_deeper) return false;
    const double own = depth(tet.point);
    if (now < hardly_turned && own > deepest) return false;
    sum_after += own;
  }
  return gain != Gain::less || after < before || sum_after < sum_before;
}

/// Makes a change if what comes of it fits together: a face is on two tetrahedra at most, on its two sides.
bool Editor::apply(const Change& change) {
  const std::vector<FaceUse> uses = uses_of(change);
  struct Tag {
    std::size_t first, second;  // uses, the lower part first
    std::int32_t like;
  };
  std::vector<Tag> tags;
  for (std::size_t i = 0, end = 0; i < uses.size(); i = end) {
    std::vector<std::size_t> of;
    std::int32_t like = inner;
    for (end = i; end < uses.size() && uses[end].face == uses[i].face; ++end) {
      if (uses[end].from != FaceUse::gone) of.push_back(end);
      if (like == inner) like = uses[end].side;
    }
    if (of.empty()) continue;
    if (of.size() > 2 || (of.size() == 2 && uses[of[0]].is_even == uses[of[1]].is_even)) return false;
    if (of.size() == 2 && uses[of[1]].part < uses[of[0]].part) std::swap(of[0], of[1]);
    const bool is_inner = of.size() == 2 && uses[of[0]].part == uses[of[1]].part;
    if (!is_inner && like == inner) like = change.side;
    if (!is_inner && like == inner) return false;
    tags.push_back({of[0], of.back(), is_inner ? inner : like});
  }
  std::vector<std::uint32_t> points;
  for (const std::uint32_t t : change.removed) {
    points.insert(points.end(), tetrahedra_[t].point.begin(), tetrahedra_[t].point.end());
  }
  for (const std::uint32_t t : change.removed) remove(t);
  std::vector<std::uint32_t> made;
  for (const New& tet : change.added) {
    points.insert(points.end(), tet.point.begin(), tet.point.end());
    made.push_back(add(tet.point, tet.side, tet.part));
  }
  for (const Tag& tag : tags) {
    std::int32_t side = inner;
    const auto tetrahedron = [&](std::size_t use) -> Tetrahedron& {
      return tetrahedra_[uses[use].from == FaceUse::made ? made[uses[use].index] : uses[use].index];
    };
    if (tag.like != inner) {
      const Tetrahedron& tet = tetrahedron(tag.first);
      const auto& p = tet.point;
      const auto normals = normals_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
      side =
          side_like(tag.like, tet.part, tag.first == tag.second ? PlaneSide::nothing : uses[tag.second].part,
                    normals[static_cast<std::size_t>(uses[tag.first].place)]);
    }
    for (const std::size_t use : {tag.first, tag.second})
      tetrahedron(use).side[static_cast<std::size_t>(uses[use].place)] = side;
  }
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  for (const std::uint32_t p : points)
    if (!star_[p].empty() && kind_[p] != corner) kind_[p] = find_kind(p);
  return true;
}

/// A place that is inside of all faces, which see it counter-clockwise from outside: by relaxation, towards
/// the inner side of whichever face it is least inside of. @param try_it is asked of each; none has more
/// room. Source: Agmon, "The relaxation method for linear inequalities" (1954).
template <typename Try>
bool Editor::find_inside(const std::vector<std::array<std::uint32_t, 3>>& faces, const Point& start,
                         const Try& try_it) const {
  struct Plane {
    Point inward, on;
  };
  std::vector<Plane> planes;
  double reach = 0;
  for (const auto& [a, b, c] : faces) {
    Point n = cross(points_[c] - points_[a], points_[b] - points_[a]);
    const double size = std::sqrt(dot(n, n));
    reach = std::max(reach, std::sqrt(squared_distance(points_[a], start)));
    if (!(size > 0)) continue;
    for (double& x : n) x /= size;
    planes.push_back({n, points_[a]});
  }
  for (double wanted = reach / 16; wanted > reach * 1e-9; wanted /= 8) {
    Point x = start;
    for (int step = 0; step < 100; ++step) {
      geometry::Interruption::check();
      double least = wanted;
      const Plane* worst = nullptr;
      for (const Plane& plane : planes)
        if (const double depth_here = dot(plane.inward, x - plane.on); depth_here < least) {
          least = depth_here;
          worst = &plane;
        }
      if (worst == nullptr) break;
      for (std::size_t k = 0; k < 3; ++k) x[k] += 1.5 * (wanted - least) * worst->inward[k];
    }
    if (try_it(x)) return true;
  }
  return false;
}

bool Editor::centre(std::uint32_t p) {
  if (kind_[p] != inside) return false;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (const std::uint32_t t : star_[p]) faces.push_back(face_opposite(t, tetrahedra_[t].place_of(p)));
  return find_inside(faces, points_[p], [&](const Point& x) { return nudge(p, x); });
}

std::array<std::uint32_t, 3> Editor::face_opposite(std::uint32_t t, int place) const {
  const auto& p = tetrahedra_[t].point;
  const auto& [a, b, c] = face_of[static_cast<std::size_t>(place)];
  return {p[static_cast<std::size_t>(a)], p[static_cast<std::size_t>(b)], p[static_cast<std::size_t>(c)]};
}

bool Editor::hollow(std::uint32_t t) {
  constexpr int most_layers = 8;
  Change change;
  change.removed.push_back(t);
  for (int layer = 0; layer < most_layers; ++layer) {
    std::vector<std::array<std::uint32_t, 3>> faces;
    std::vector<std::int32_t> sides;
    std::vector<std::uint32_t> next;
    Point middle{};
    for (const std::uint32_t own : change.removed) {
      geometry::Interruption::check();
      for (int k = 0; k < 4; ++k) {
        const std::int32_t side = tetrahedra_[own].side[k];
        const std::uint32_t other = side == inner ? beyond(own, k) : none;
        if (std::find(change.removed.begin(), change.removed.end(), other) != change.removed.end()) continue;
        if (other != none) next.push_back(other);
        faces.push_back(face_opposite(own, k));
        sides.push_back(side);
        for (const std::uint32_t p : faces.back())
          for (std::size_t i = 0; i < 3; ++i) middle[i] += points_[p][i];
      }
    }
    for (double& x : middle) x /= static_cast<double>(3 * faces.size());
    const std::uint32_t m = add_point(middle, inside);
    const auto fill = [&](const Point& x) {
      points_[m] = x;
      change.added.clear();
      for (std::size_t i = 0; i < faces.size(); ++i) {
        const auto& [a, b, c] = faces[i];
        change.added.push_back({{b, a, c, m}, {inner, inner, inner, sides[i]}, tetrahedra_[t].part});
      }
      return is_better(change, Gain::less) && apply(change);
    };
    if (find_inside(faces, middle, fill)) return true;
    drop_last_point();
    std::sort(next.begin(), next.end());
    next.erase(std::unique(next.begin(), next.end()), next.end());
    change.removed.insert(change.removed.end(), next.begin(), next.end());
  }
  return false;
}

bool Editor::separate(std::uint32_t t) {
  for (const std::uint32_t p : tetrahedra_[t].point) {
    const std::vector<std::uint32_t> around = reached_around(p, t);
    if (around.size() == star_[p].size()) continue;
    const std::uint32_t own = add_point(points_[p], inside);
    Change change;
    bool is_closed = true;
    for (const std::uint32_t s : around) {
      New copy{tetrahedra_[s].point, tetrahedra_[s].side, tetrahedra_[s].part};
      const auto place = static_cast<std::size_t>(tetrahedra_[s].place_of(p));
      copy.point[place] = own;
      for (std::size_t k = 0; k < 4; ++k) is_closed &= k == place || copy.side[k] == inner;
      change.removed.push_back(s);
      change.added.push_back(copy);
    }
    if (is_closed && apply(change)) return true;
    drop_last_point();
  }
  return false;
}

/// The tetrahedra at a point that faces at it join to one of them.
std::vector<std::uint32_t> Editor::reached_around(std::uint32_t p, std::uint32_t t) const {
  std::vector<std::uint32_t> reached{t};
  for (std::size_t i = 0; i < reached.size(); ++i)
    for (int k = 0; k < 4; ++k) {
      if (tetrahedra_[reached[i]].point[static_cast<std::size_t>(k)] == p) continue;
      const std::uint32_t next = beyond(reached[i], k);
      if (next != none && std::ranges::find(reached, next) == reached.end()) reached.push_back(next);
    }
  return reached;
}

bool Editor::merge(std::uint32_t u, std::uint32_t v, bool may_leave_more) {
  Change change;
  change.removed.assign(star_[u].begin(), star_[u].end());
  bool is_edge = false;
  for (const std::uint32_t t : star_[u]) {
    const Tetrahedron& tet = tetrahedra_[t];
    if (tet.place_of(v) >= 0) {
      is_edge = true;
      continue;
    }
    New copy{tet.point, tet.side, tet.part};
    copy.point[static_cast<std::size_t>(tet.place_of(u))] = v;
    if (!cancel(change, u, v, copy)) change.added.push_back(copy);
  }
  if (!is_edge || !is_better(change, may_leave_more ? Gain::none_deeper : Gain::no_more)) return false;
  const bool was_on_surface = kind_[u] != inside;
  // Of a tetrahedron at the edge, the faces opposite of its ends become one.
  for (const std::uint32_t t : star_[u]) {
    const Tetrahedron& tet = tetrahedra_[t];
    const int iu = tet.place_of(u), iv = tet.place_of(v);
    if (iv < 0) continue;
    auto face = tet.point;
    face[static_cast<std::size_t>(iu)] = v;
    std::swap(face[static_cast<std::size_t>(iv)], face[3]);
    hint(change, face[0], face[1], face[2], tet.side[static_cast<std::size_t>(iv)]);
  }
  if (!apply(change)) return false;
  if (was_on_surface) kind_[v] = corner;
  return true;
}

/// What was between u and v without their edge is folded flat: one at u comes to lie on one at v, from its
/// other side, and both go.
bool Editor::cancel(Change& change, std::uint32_t u, std::uint32_t v, const New& tet) const {
  auto corners = tet.point;
  std::sort(corners.begin(), corners.end());
  for (const std::uint32_t t : star_[v]) {
    auto own = tetrahedra_[t].point;
    std::sort(own.begin(), own.end());
    if (own != corners || tetrahedra_[t].place_of(u) >= 0) continue;
    if (is_even(tet.point) == is_even(tetrahedra_[t].point)) return false;
    change.removed.push_back(t);
    for (const auto& [a, b, c] : face_of)
      hint(change, tet.point[static_cast<std::size_t>(a)], tet.point[static_cast<std::size_t>(b)],
           tet.point[static_cast<std::size_t>(c)], tet.side[static_cast<std::size_t>(6 - a - b - c)]);
    return true;
  }
  return false;
}

/// A face that comes of a change, and the side that it is on if nothing tells otherwise.
void Editor::hint(Change& change, std::uint32_t a, std::uint32_t b, std::uint32_t c, std::int32_t side) {
  std::array<std::uint32_t, 3> face{a, b, c};
  std::sort(face.begin(), face.end());
  if (side != inner) change.hints.emplace_back(face, side);
}

/// The tetrahedra at an edge in two halves at m, but for those that have m as a corner: these go.
void Editor::divide(Change& change, std::uint32_t u, std::uint32_t v, std::uint32_t m) const {
  for (const std::uint32_t t : ring_of(u, v).tetrahedra) {
    const Tetrahedron& tet = tetrahedra_[t];
    if (std::find(change.removed.begin(), change.removed.end(), t) != change.removed.end()) continue;
    change.removed.push_back(t);
    if (const int im = tet.place_of(m); im >= 0) {
      for (const std::uint32_t z : tet.point)
        for (const std::uint32_t end : {u, v})
          if (z != u && z != v && z != m) hint(change, end, m, z, tet.side[static_cast<std::size_t>(im)]);
      continue;
    }
    const auto iu = static_cast<std::size_t>(tet.place_of(u)), iv = static_cast<std::size_t>(tet.place_of(v));
    New at_u{tet.point, tet.side, tet.part}, at_v = at_u;
    at_u.point[iv] = m;
    at_u.side[iu] = inner;
    at_v.point[iu] = m;
    at_v.side[iv] = inner;
    change.added.push_back(at_u);
    change.added.push_back(at_v);
  }
}

std::optional<Point> Editor::foot_on_edge(std::uint32_t m, std::uint32_t u, std::uint32_t v) const {
  const Point along = points_[v] - points_[u], from = points_[m] - points_[u];
  const double share = dot(along, from) / dot(along, along);
  if (!(share > 0 && share < 1)) return std::nullopt;
  Point foot;
  for (std::size_t k = 0; k < 3; ++k) foot[k] = points_[u][k] + share * along[k];
  return foot;
}

std::optional<double> Editor::distance_from_edge(std::uint32_t m, std::uint32_t u, std::uint32_t v) const {
  const auto foot = foot_on_edge(m, u, v);
  if (!foot) return std::nullopt;
  return std::sqrt(squared_distance(*foot, points_[m]));
}

bool Editor::lead_through(std::uint32_t u, std::uint32_t v, std::uint32_t m, Gain gain) {
  Change change;
  divide(change, u, v, m);
  return is_better(change, gain) && apply(change);
}

std::optional<std::array<Point, 2>> Editor::nearest_of(const Across& edges) const {
  const auto& [ab, cd] = edges;
  const Point &a = points_[ab[0]], &b = points_[ab[1]], &c = points_[cd[0]], &d = points_[cd[1]];
  const auto [s, r] = closest(a, b, c, d);
  if (!(s > 0 && s < 1 && r > 0 && r < 1)) return std::nullopt;
  std::array<Point, 2> nearest;
  for (std::size_t i = 0; i < 3; ++i) {
    nearest[0][i] = a[i] + s * (b[i] - a[i]);
    nearest[1][i] = c[i] + r * (d[i] - c[i]);
  }
  return nearest;
}

std::optional<double> Editor::gap_between(const Across& edges) const {
  const auto nearest = nearest_of(edges);
  if (!nearest) return std::nullopt;
  return std::sqrt(squared_distance((*nearest)[0], (*nearest)[1]));
}

bool Editor::cross_edges(std::uint32_t t, const Across& edges) {
  const auto nearest = nearest_of(edges);
  if (!nearest) return false;
  Point middle;
  for (std::size_t i = 0; i < 3; ++i)
    middle[i] = (*nearest)[0][i] + ((*nearest)[1][i] - (*nearest)[0][i]) / 2;
  const auto& [ab, cd] = edges;
  const std::uint32_t m = add_point(middle, inside);
  Change change;
  change.removed.push_back(t);
  const auto hint_at = [&](const std::array<std::uint32_t, 2>& edge, std::uint32_t third,
                           std::uint32_t opposite) {
    const Tetrahedron& tet = tetrahedra_[t];
    for (const std::uint32_t end : edge)
      hint(change, end, m, third, tet.side[static_cast<std::size_t>(tet.place_of(opposite))]);
  };
  hint_at(ab, cd[0], cd[1]);
  hint_at(ab, cd[1], cd[0]);
  hint_at(cd, ab[0], ab[1]);
  hint_at(cd, ab[1], ab[0]);
  divide(change, ab[0], ab[1], m);
  divide(change, cd[0], cd[1], m);
  if (is_better(change, Gain::less) && apply(change)) return true;
  drop_last_point();
  return false;
}

}  // namespace bsp2::meshing
