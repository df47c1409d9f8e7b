#include "shaping/cleaning.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/interruption.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {

using geometry::Interruption;

namespace {

/// Of what is cleaned: what is so near to an edge is on it, but for rounding.
constexpr double as_good_as_on = 1e-3;

/// Whether a step of this length may be made with which that is moved in all. Some that are nothing but
/// rounding may where no moves are left.
bool is_left(const Displacement& moved, double step, double most) {
  constexpr double some = 20 * as_good_as_on;
  return moved.length() <= (step <= as_good_as_on * most ? 1 + some : 1) * most;
}

Point between(const Point& a, const Point& b) {
  Point middle;
  for (std::size_t k = 0; k < 3; ++k) middle[k] = a[k] + (b[k] - a[k]) / 2;
  return middle;
}

}  // namespace

std::uint64_t Cleaner::turned() const {
  std::uint64_t count = 0;
  for (std::uint32_t t = 0; t < editor_.size(); ++t)
    if (!editor_.at(t).is_gone() && editor_.at(t).shape <= 0) ++count;
  return count;
}

void Cleaner::absorb() {
  for (int pass = 0; pass < 12; ++pass) {
    std::uint64_t left = 0, changed = 0;
    for (std::uint32_t t = 0, end = static_cast<std::uint32_t>(editor_.size()); t < end; ++t) {
      if (editor_.at(t).is_gone() || editor_.at(t).shape > 0) continue;
      Interruption::check();
      ++left;
      if (absorb(t)) ++changed;
    }
    if (left == 0 || changed == 0) return;
  }
}

void Cleaner::loosen() {
  std::vector<std::uint32_t> near;
  for (std::uint32_t t = 0; t < editor_.size(); ++t)
    if (!editor_.at(t).is_gone() && editor_.at(t).shape <= 0)
      for (const std::uint32_t p : editor_.at(t).point) {
        const auto around = editor_.neighbours(p);
        near.insert(near.end(), around.begin(), around.end());
      }
  std::sort(near.begin(), near.end());
  near.erase(std::unique(near.begin(), near.end()), near.end());
  for (const std::uint32_t p : near) {
    Interruption::check();
    const std::vector<std::uint32_t> star(editor_.star(p).begin(), editor_.star(p).end());
    for (const std::uint32_t t : star)
      if (!editor_.at(t).is_gone() && editor_.at(t).shape > 0 && editor_.at(t).shape < Improver::fair)
        improver_.improve_one(t, false);
  }
}

bool Cleaner::absorb(std::uint32_t t) {
  auto edges = editor_.at(t).edges();
  std::sort(edges.begin(), edges.end(), [&](const Pair& a, const Pair& b) {
    return editor_.length(a[0], a[1]) < editor_.length(b[0], b[1]);
  });
  for (const auto& [u, v] : edges)
    if (editor_.collapse_either(u, v, {.shape = 0, .length = 0}) || merge_either(u, v, false)) return true;
  for (const auto& [u, v] : edges)
    if (editor_.remove_edge(u, v)) return true;
  for (int face = 0; face < 4; ++face)
    if (editor_.flip_face(t, face)) return true;
  for (const std::uint32_t p : editor_.at(t).point)
    if (editor_.smooth(p) || editor_.centre(p)) return true;
  if (editor_.separate(t) || mend(t) || dissolve(t) || editor_.hollow(t) || pull_apart(t)) return true;
  if (std::any_of(edges.begin(), edges.end(),
                  [&](const Pair& edge) { return merge_either(edge[0], edge[1], true); }))
    return true;
  return attach(t, as_good_as_on, Editor::Gain::none_deeper) || attach_around(t);
}

/// What is shorter than that there is absorbed.
double Cleaner::most_at(const Point& place) const {
  return options_.clean_by_place.is_empty() ? most_ : std::min(most_, options_.clean_by_place.at(place));
}
double Cleaner::most_between(std::uint32_t u, std::uint32_t v) const {
  return std::min(most_at(editor_.point(u)), most_at(editor_.point(v)));
}

/// Takes it away, and closes what that leaves open.
bool Cleaner::mend(std::uint32_t t) { return attach(t, 1, Editor::Gain::less) || cross_edges(t) || peel(t); }

/// Where a point of the tetrahedron is on one of its edges, the edge leads through the point.
/// @param share of what is cleaned: so far from the edge it may be.
bool Cleaner::attach(std::uint32_t t, double share, Editor::Gain gain) {
  const auto points = editor_.at(t).point;
  const double most = share * most_at(editor_.middle(t));
  for (const std::uint32_t m : points)
    for (const std::uint32_t u : points)
      for (const std::uint32_t v : points) {
        if (m == u || m == v || u >= v || !lead_through({u, v}, m, most, gain)) continue;
        ++report_.taken_away;
        return true;
      }
  return false;
}

/// Where several points are on one line, those of the tetrahedron alone do not do: edges lead through any
/// that is on them, which makes the line a row of short edges, step by step.
bool Cleaner::attach_around(std::uint32_t t) {
  for (const auto& [u, v] : editor_.at(t).edges()) {
    const std::vector<std::uint32_t> at_u = editor_.neighbours(u), at_v = editor_.neighbours(v);
    for (const std::uint32_t m : at_u) {
      if (!std::ranges::binary_search(at_v, m)) continue;
      const double most = as_good_as_on * most_at(editor_.point(m));
      if (!lead_through({std::min(u, v), std::max(u, v)}, m, most, Editor::Gain::none_deeper)) continue;
      ++report_.taken_away;
      return true;
    }
  }
  return false;
}

/// Where two edges of the tetrahedron cross, both lead through a new point.
bool Cleaner::cross_edges(std::uint32_t t) {
  const auto p = editor_.at(t).point;
  const double most = most_at(editor_.middle(t));
  for (const Editor::Across& edges :
       {Editor::Across{{{p[0], p[1]}, {p[2], p[3]}}}, Editor::Across{{{p[0], p[2]}, {p[3], p[1]}}},
        Editor::Across{{{p[0], p[3]}, {p[1], p[2]}}}}) {
    const auto gap = editor_.gap_between(edges);
    if (!gap || *gap > most) continue;
    Displacement since;  // of the surface at that point
    const Point middle = editor_.middle(t);
    for (const auto& [u, v] : edges)
      if (editor_.is_on_surface(u, v)) since.unite(moves_.since_along(u, v, middle).then_within(*gap / 2));
    const Displacement moved = moves_.in_all(since, middle);
    if (!is_left(moved, *gap, most) || !editor_.cross_edges(t, edges)) continue;
    tell_move(moved);
    const auto m = static_cast<std::uint32_t>(editor_.point_count() - 1);
    moves_.lead_through(m, since);
    for (const std::uint32_t q : p) moves_.bend(q, m, since);
    ++report_.taken_away;
    return true;
  }
  return false;
}

bool Cleaner::peel(std::uint32_t t) {
  double most = most_at(editor_.middle(t));
  const auto how = editor_.look_at_peel(t, most);
  if (!how) return false;
  std::vector<std::uint32_t> points;
  std::vector<Pair> edges;
  for (const std::uint32_t own : how->tetrahedra) {
    most = std::min(most, most_at(editor_.middle(own)));
    std::ranges::copy(editor_.at(own).point, std::back_inserter(points));
    std::ranges::copy(editor_.at(own).edges(), std::back_inserter(edges));
  }
  const Displacement step =
      how->way ? Displacement().then_up_to(*how->way) : Displacement().then_within(how->depth);
  Displacement since, moved;
  const auto add = [&](const Displacement& before, const Point& place) {
    since.unite(before.then_as(step));
    moved.unite(moves_.in_all(before.then_as(step), place));
  };
  for (const std::uint32_t p : points) add(moves_.since_at(p), editor_.point(p));
  for (const auto& [u, v] : edges) add(moves_.bent_along(u, v), between(editor_.point(u), editor_.point(v)));
  if (!is_left(moved, how->depth, most) || !editor_.peel(*how)) return false;
  tell_move(moved);
  for (const std::uint32_t p : points) moves_.lead_through(p, since);
  for (const auto& [u, v] : edges) moves_.bend(u, v, since);
  report_.taken_away += how->tetrahedra.size();
  return true;
}

/// Collapses an edge that leads away from it: then all is another around one of its points.
bool Cleaner::dissolve(std::uint32_t t) {
  const auto points = editor_.at(t).point;
  for (const std::uint32_t p : points)
    for (const std::uint32_t q : editor_.neighbours(p))
      if (std::find(points.begin(), points.end(), q) == points.end() &&
          editor_.collapse(p, q, {.shape = 0, .length = 0}))
        return true;
  for (const std::uint32_t p : points)
    for (const std::uint32_t q : editor_.neighbours(p))
      if (editor_.remove_edge(p, q)) return true;
  return false;
}

/// Moves one of the points away from the other three, as little as helps: what is there is thinner than the
/// points are rounded, and no other step has helped.
bool Cleaner::pull_apart(std::uint32_t t) {
  constexpr double least = 0x1p-30, step = 0.25;  // of what may be moved
  const auto points = editor_.at(t).point;
  for (double share = least; share <= 1; share /= step)
    for (int k = 0; k < 4; ++k) {
      const std::uint32_t p = points[static_cast<std::size_t>(k)];
      const double length =
          share * (most_at(editor_.point(p)) - moves_.in_all(moves_.since_at(p), editor_.point(p)).length());
      const Point across = normal_of_face(points, k);
      for (const double side : {length, -length}) {
        const Point from = editor_.point(p);
        Point to = from;
        for (std::size_t axis = 0; axis < 3; ++axis) to[axis] += side * across[axis];
        if (!(length > 0) || !editor_.nudge(p, to)) continue;
        if (editor_.kind(p) != Editor::inside) {
          const Displacement since = moves_.since_at(p).then(to - from);
          if (!moves_.has_moved(p)) ++report_.moved_points;
          moves_.move(p, since);
          tell_move(moves_.in_all(since, to));
        }
        return true;
      }
    }
  return false;
}

/// Of the face opposite of a point, one long; as long as nothing where that has no area.
Point Cleaner::normal_of_face(const std::array<std::uint32_t, 4>& points, int k) const {
  std::array<Point, 3> corner;
  for (int i = 0, n = 0; i < 4; ++i)
    if (i != k) corner[static_cast<std::size_t>(n++)] = editor_.point(points[static_cast<std::size_t>(i)]);
  Point u, v, normal;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    u[axis] = corner[1][axis] - corner[0][axis];
    v[axis] = corner[2][axis] - corner[0][axis];
  }
  double length = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
    normal[axis] = u[a] * v[b] - u[b] * v[a];
    length += normal[axis] * normal[axis];
  }
  for (double& x : normal) x = length > 0 ? x / std::sqrt(length) : 0;
  return normal;
}

/// Makes two points one that are closer than what is cleaned, whatever they are on; told.
bool Cleaner::merge_either(std::uint32_t u, std::uint32_t v, bool may_leave_more) {
  if (editor_.kind(u) < editor_.kind(v)) std::swap(u, v);
  const double length = editor_.length(u, v);
  for (const auto& [from, to] : {std::pair(u, v), std::pair(v, u)}) {
    const bool is_told = editor_.kind(from) != Editor::inside;
    const Displacement since =
        is_told ? moves_.since_at(from).then(editor_.point(to) - editor_.point(from)) : Displacement();
    const Displacement moved = is_told ? moves_.in_all(since, editor_.point(to)) : Displacement();
    // A point inside may go as far as it likes where nothing else has helped: that moves no surface.
    const double far = is_told || !may_leave_more ? std::max(length, moved.length()) : 0;
    if (far > most_ || far > most_between(u, v) || !editor_.merge(from, to, may_leave_more)) continue;
    if (!is_told) return true;
    moves_.move(to, since);
    ++report_.moved_points;
    tell_move(moved);
    return true;
  }
  return !may_leave_more && length <= most_between(u, v) && (merge_half_way(u, v) || merge_half_way(v, u));
}

/// Makes two points of the surface one in the middle between them, so that either goes half as far.
/// @return whether something has changed.
bool Cleaner::merge_half_way(std::uint32_t from, std::uint32_t to) {
  if (editor_.kind(from) == Editor::inside || editor_.kind(to) == Editor::inside) return false;
  const Point at = editor_.point(to), middle = between(at, editor_.point(from));
  Displacement since = moves_.since_at(from).then(middle - editor_.point(from));
  since.unite(moves_.since_at(to).then(middle - at));
  const Displacement moved = moves_.in_all(since, middle);
  if (moved.length() > most_between(from, to) || !editor_.put(to, middle, 0)) return false;
  const bool is_merged = editor_.merge(from, to, false);
  if (!is_merged && editor_.put(to, at, 0)) return false;
  moves_.move(to, since);
  if (!is_merged) editor_.hold(to);
  report_.moved_points += is_merged ? 2 : 1;
  tell_move(moved);
  return true;
}

void Cleaner::tell_move(const Displacement& moved) {
  report_.largest_move = std::max(report_.largest_move, moved.length());
}

void Cleaner::clean() {
  if (!(most_ > 0)) return;
  for (int pass = 0; pass < 4; ++pass) {
    std::uint64_t changed = 0;
    for (const auto& [u, v] : sizing_.edges_where([&](double length, double) { return length < most_; })) {
      Interruption::check();
      if (editor_.star(u).empty() || editor_.star(v).empty() || editor_.length(u, v) > most_between(u, v))
        continue;
      if (editor_.collapse_either(u, v, {.shape = 0, .length = 0}) || merge_either(u, v, false)) ++changed;
    }
    changed += lead_edges_through_points() + peel_flakes();
    if (changed == 0) return;
  }
}

/// What is thinner than is cleaned though its edges are long: three points on a line, but for that.
std::uint64_t Cleaner::lead_edges_through_points() {
  std::uint64_t changed = 0;
  for (std::uint32_t t = 0; t < editor_.size(); ++t) {
    if (editor_.at(t).is_gone() || editor_.at(t).shape > Improver::fair) continue;
    Interruption::check();
    const auto points = editor_.at(t).point;
    const auto edges = editor_.at(t).edges();
    changed += std::ranges::any_of(edges, [&](const Pair& edge) {
      return std::ranges::any_of(points, [&](std::uint32_t m) {
        const auto& [u, v] = edge;
        if (m == u || m == v) return false;
        const auto distance = editor_.distance_from_edge(m, u, v);
        const double most = most_at(editor_.point(m));
        return distance && *distance <= most && editor_.is_on_surface(u, v) &&
               lead_through({std::min(u, v), std::max(u, v)}, m, most, Editor::Gain::no_more);
      });
    });
  }
  return changed;
}

/// Takes away what stands out of the surface and is thinner than is cleaned.
std::uint64_t Cleaner::peel_flakes() {
  std::uint64_t changed = 0;
  for (std::uint32_t t = 0; t < editor_.size(); ++t) {
    if (editor_.at(t).is_gone() || editor_.at(t).shape > Improver::fair ||
        std::ranges::count(editor_.at(t).side, Editor::inner) > 2)
      continue;
    Interruption::check();
    if (peel(t)) ++changed;
  }
  return changed;
}

/// An edge that passes by a point leads through it, if it is no farther from it than this; told if it is on
/// the surface.
bool Cleaner::lead_through(const Pair& edge, std::uint32_t m, double most, Editor::Gain gain) {
  const auto& [u, v] = edge;
  const auto foot = editor_.foot_on_edge(m, u, v);
  if (!foot) return false;
  const Point step = editor_.point(m) - *foot;
  const double length = std::sqrt(dot(step, step));
  if (length > most) return false;
  if (!editor_.is_on_surface(u, v)) return editor_.lead_through(u, v, m, gain);
  if (is_left(moves_.in_all(moves_.since_along(u, v, *foot).then(step), *foot), length,
              most_at(editor_.point(m))))
    return lead_to(edge, m, step, gain);
  return lead_half_way(edge, m, *foot, gain);
}

/// @param step from the edge to the point.
bool Cleaner::lead_to(const Pair& edge, std::uint32_t m, const Point& step, Editor::Gain gain) {
  const auto& [u, v] = edge;
  const Point foot = editor_.point(m) - step;
  const Displacement before = moves_.since_along(u, v, foot), since = before.then(step),
                     bent = before.then_up_to(step);
  const std::vector<std::uint32_t> around = editor_.neighbours(u), around_v = editor_.neighbours(v);
  if (!editor_.lead_through(u, v, m, gain)) return false;
  moves_.bend(u, m, bent);
  moves_.bend(v, m, bent);
  for (const std::uint32_t p : around)
    if (p != m && std::ranges::binary_search(around_v, p)) moves_.bend(p, m, bent);
  moves_.lead_through(m, since);
  ++report_.bent_edges;
  tell_move(moves_.in_all(since, foot));
  return true;
}

/// The point comes to meet the edge, so that either goes half as far.
/// @return whether something has changed.
bool Cleaner::lead_half_way(const Pair& edge, std::uint32_t m, const Point& foot, Editor::Gain gain) {
  if (editor_.kind(m) == Editor::inside) return false;
  const Point at = editor_.point(m), middle = between(foot, at);
  const Displacement since = moves_.since_at(m).then(middle - at), moved = moves_.in_all(since, at);
  const Displacement of_edge = moves_.since_along(edge[0], edge[1], foot).then(middle - foot);
  const double most = most_at(at);
  if (moved.length() > most || moves_.in_all(of_edge, foot).length() > most || !editor_.put(m, middle, 0))
    return false;
  const bool is_led = lead_to(edge, m, middle - foot, gain);
  if (!is_led && editor_.put(m, at, 0)) return false;
  if (!is_led) editor_.hold(m);
  moves_.move(m, since);
  ++report_.moved_points;
  tell_move(moved);
  return true;
}

}  // namespace bsp2::meshing
