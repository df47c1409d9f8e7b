#include "editing/editor.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

using Corners = std::array<std::uint32_t, 4>;
using Sides = std::array<std::int32_t, 4>;

std::array<std::uint32_t, 3> sorted(std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  std::array<std::uint32_t, 3> all{a, b, c};
  std::sort(all.begin(), all.end());
  return all;
}

}  // namespace

Editor::Editor(const Tetrahedra& mesh, std::vector<Kind> kinds)
    : sides_(mesh.sides), points_(mesh.points), kind_(std::move(kinds)) {
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
    geometry::Interruption::check();
    const Corners& p = mesh.tetrahedra[i];
    Sides sides;
    for (int k = 0; k < 4; ++k) {
      const auto face = sorted(p[(k + 1) % 4], p[(k + 2) % 4], p[(k + 3) % 4]);
      const auto found = std::lower_bound(tagged.begin(), tagged.end(), std::pair(face, std::int32_t{-9}));
      sides[k] = found != tagged.end() && found->first == face ? found->second : inner;
    }
    add(p, sides, mesh.part[i]);
  }
  if (!kind_.empty()) return;
  kind_.resize(points_.size(), inside);
  for (std::uint32_t p = 0; p < points_.size(); ++p) {
    geometry::Interruption::check();
    kind_[p] = find_kind(p);
  }
}

Tetrahedra Editor::result(std::vector<std::uint32_t>& map) const {
  Tetrahedra mesh;
  mesh.sides = sides_;
  map.assign(points_.size(), none);
  for (std::uint32_t p = 0; p < points_.size(); ++p)
    if (!star_[p].empty()) {
      map[p] = static_cast<std::uint32_t>(mesh.points.size());
      mesh.points.push_back(points_[p]);
    }
  for (const Tetrahedron& t : tetrahedra_) {
    if (t.is_gone()) continue;
    const Corners p{map[t.point[0]], map[t.point[1]], map[t.point[2]], map[t.point[3]]};
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

double Editor::shape(const Corners& p) const {
  return shape_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
}

double Editor::length(std::uint32_t u, std::uint32_t v) const {
  return std::sqrt(squared_distance(points_[u], points_[v]));
}

double Editor::volume(std::uint32_t t) const {
  const auto& [a, b, c, d] = tetrahedra_[t].point;
  return volume_of(points_[a], points_[b], points_[c], points_[d]);
}

void Editor::find_neighbours(std::uint32_t p, std::vector<std::uint32_t>& all) const {
  all.clear();
  if (seen_.size() < points_.size()) seen_.resize(2 * points_.size(), 0);
  seen_[p] = ++call_;
  for (const std::uint32_t t : star_[p])
    for (const std::uint32_t q : tetrahedra_[t].point)
      if (std::exchange(seen_[q], call_) != call_) all.push_back(q);
}

std::vector<std::uint32_t> Editor::neighbours(std::uint32_t p) const {
  std::vector<std::uint32_t> all;
  find_neighbours(p, all);
  std::sort(all.begin(), all.end());
  return all;
}

double Editor::worst_at(std::uint32_t p) const {
  double worst = 1;
  for (const std::uint32_t t : star_[p]) worst = std::min(worst, tetrahedra_[t].shape);
  return worst;
}

std::uint32_t Editor::add(const Corners& points, const Sides& sides, std::int32_t part) {
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

void Editor::touch(std::uint32_t p) {
  for (const std::uint32_t t : star_[p])
    for (const std::uint32_t q : tetrahedra_[t].point) changed_[q] = clock_;
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

Point Editor::middle(std::uint32_t t) const {
  Point sum{};
  for (const std::uint32_t p : tetrahedra_[t].point)
    for (std::size_t k = 0; k < 3; ++k) sum[k] += points_[p][k] / 4;
  return sum;
}

std::uint32_t Editor::beyond(std::uint32_t t, int face) const {
  const Corners& p = tetrahedra_[t].point;
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
  ring.tetrahedra.reserve(8);
  if (star_[v].size() < star_[u].size()) std::swap(u, v);
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

double Editor::smallest_wedge(std::uint32_t u, std::uint32_t v) const {
  const Point along = points_[v] - points_[u];
  std::map<std::int32_t, double> angles;  // by part
  for (const std::uint32_t t : ring_of(u, v).tetrahedra) {
    const Tetrahedron& tet = tetrahedra_[t];
    std::array<Point, 2> normal;  // of the faces at the edge
    std::size_t n = 0;
    for (const std::uint32_t p : tet.point)
      if (p != u && p != v) normal[n++] = cross(along, points_[p] - points_[u]);
    const Point across = cross(normal[0], normal[1]);
    angles[tet.part] += std::atan2(std::sqrt(dot(across, across)), dot(normal[0], normal[1]));
  }
  double smallest = 2 * std::numbers::pi;
  for (const auto& [part, angle] : angles) smallest = std::min(smallest, angle);
  return smallest;
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
  if (reached_around(p, star_[p].front()).size() != star_[p].size()) return corner;
  if (const auto ends = ends_along(p)) {
    // What else leads through it would move with it.
    const auto key = key_of(ring_of(p, (*ends)[0]));
    const bool is_all =
        std::ranges::all_of(sides, [&](std::int32_t side) { return std::ranges::binary_search(key, side); });
    return is_all ? on_edge : corner;
  }
  if (std::any_of(sides.begin(), sides.end(), [&](std::int32_t side) { return side != sides[0]; }))
    return corner;
  for (const std::uint32_t q : neighbours(p)) {
    const Ring ring = ring_of(p, q);
    if (!ring.is_inside() && !ring.is_flat()) return corner;
  }
  return on_side;
}

}  // namespace bsp2::meshing
