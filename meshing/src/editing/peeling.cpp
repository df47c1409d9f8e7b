// Taking away what is thinner than is cleaned, or than points are rounded, and stands out of the solid or
// lies on its surface.

#include <algorithm>
#include <cmath>
#include <limits>

#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

constexpr double negligible = 1e-3;  // of what is cleaned

double area(const Point& a, const Point& b, const Point& c) {
  const Point n = cross(b - a, c - a);
  return std::sqrt(dot(n, n)) / 2;
}

}  // namespace

Editor::OuterFaces Editor::outer_faces_of(std::uint32_t t) const {
  const Tetrahedron& tet = tetrahedra_[t];
  OuterFaces faces;
  std::size_t others = 0;
  double largest = 0;
  for (int k = 0; k < 4; ++k) {
    const auto [a, b, c] = face_opposite(t, k);
    const double own = area(points_[a], points_[b], points_[c]);
    const bool is_out = is_outer(tet.side[k]);
    (is_out ? faces.outer : faces.other) += own;
    // The edge that two faces have in common is that of the points opposite of the two others.
    if (is_out)
      faces.edges[1][std::min<std::size_t>(faces.count++, 1)] = tet.point[static_cast<std::size_t>(k)];
    else
      faces.edges[0][std::min<std::size_t>(others++, 1)] = tet.point[static_cast<std::size_t>(k)];
    if (is_out && (faces.side == inner || own > largest)) {
      faces.side = tet.side[k];
      largest = own;
    }
  }
  return faces;
}

std::optional<Editor::Peel> Editor::look_at_peel(std::uint32_t t, double most) const {
  const auto alone = peel_alone(t);
  if (!alone || alone->depth <= most) return alone;
  auto plate = plate_around(t, most);
  return plate ? plate : alone;
}

std::optional<Editor::Peel> Editor::peel_alone(std::uint32_t t) const {
  const OuterFaces faces = outer_faces_of(t);
  if (faces.side == inner) return std::nullopt;
  // Nearly in one plane, the faces cover each place twice. What faces out afterwards then lies on something
  // that faced out before, or two outer faces lie on each other, and what is between them goes.
  const auto& p = tetrahedra_[t].point;
  if (faces.count > 2)
    return Peel{{t}, depth(p), faces.count > 3 ? std::nullopt : way_inwards(t), faces.side};
  if (faces.count == 2)
    if (const auto nearest = nearest_of(faces.edges)) {
      const Point way = (*nearest)[1] - (*nearest)[0];
      return Peel{{t}, std::sqrt(dot(way, way)), way, faces.side};
    }
  if (tetrahedra_[t].shape <= 0 && faces.other <= faces.outer * (1 + 1e-6))
    return Peel{{t}, depth(p), {}, faces.side};
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = i + 1; k < 4; ++k) longest = std::max(longest, length(p[i], p[k]));
  return Peel{{t}, longest, {}, faces.side};
}

/// Across a tetrahedron of which one face is inside: along the normal of the largest face, to that one.
std::optional<Point> Editor::way_inwards(std::uint32_t t) const {
  const Tetrahedron& tet = tetrahedra_[t];
  const auto normals =
      normals_of(points_[tet.point[0]], points_[tet.point[1]], points_[tet.point[2]], points_[tet.point[3]]);
  const Point largest = largest_normal(t);
  const auto inner_face = static_cast<std::size_t>(std::ranges::find(tet.side, inner) - tet.side.begin());
  const double size = dot(largest, largest);
  if (inner_face == 4 || !(size > 0)) return std::nullopt;
  const double length = depth(tet.point) / std::sqrt(size);
  const double share = dot(largest, normals[inner_face]) < 0 ? -length : length;
  return Point{share * largest[0], share * largest[1], share * largest[2]};
}

/// Flat tetrahedra in one plane, side by side, whose faces to one side of it are outer ones: what faces out
/// afterwards lies on these.
std::optional<Editor::Peel> Editor::plate_around(std::uint32_t t, double most) const {
  Point normal = largest_normal(t);
  const double length = std::sqrt(dot(normal, normal));
  if (!(length > 0)) return std::nullopt;
  for (double& x : normal) x /= length;
  auto plate = plate_towards(normal, t, most);
  if (plate) return plate;
  for (double& x : normal) x = -x;
  return plate_towards(normal, t, most);
}

/// @param normal of the plane, of length 1, to the side where the faces are outer ones.
std::optional<Editor::Peel> Editor::plate_towards(const Point& normal, std::uint32_t t, double most) const {
  constexpr std::size_t many = 16;
  Peel plate{{t}, 0, {}, inner};
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest, largest = 0;
  const Point& origin = points_[tetrahedra_[t].point[0]];
  for (std::size_t i = 0; i < plate.tetrahedra.size(); ++i) {
    const std::uint32_t own = plate.tetrahedra[i];
    for (const std::uint32_t p : tetrahedra_[own].point) {
      const double height = dot(normal, points_[p] - origin);
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    plate.depth = highest - lowest;
    const auto faces = faces_towards(normal, own, negligible * most);
    if (plate.depth > most || plate.tetrahedra.size() > many || faces.empty()) return std::nullopt;
    for (const auto& [face, area] : faces) {
      const std::int32_t side = tetrahedra_[own].side[static_cast<std::size_t>(face)];
      if (is_outer(side)) {
        if (area > largest) plate.side = side;
        largest = std::max(largest, area);
        continue;
      }
      const std::uint32_t next = side == inner ? beyond(own, face) : none;
      if (next == none) return std::nullopt;
      if (std::ranges::find(plate.tetrahedra, next) == plate.tetrahedra.end())
        plate.tetrahedra.push_back(next);
    }
  }
  return plate.side == inner ? std::nullopt : std::optional(plate);
}

/// Faces of a tetrahedron that look that way, and twice their areas seen from there. Those that are narrower
/// than `width` then stand across it.
std::vector<std::pair<int, double>> Editor::faces_towards(const Point& normal, std::uint32_t t,
                                                          double width) const {
  const auto& p = tetrahedra_[t].point;
  const auto normals = normals_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
  std::vector<std::pair<int, double>> faces;
  for (int k = 0; k < 4; ++k) {
    const auto [a, b, c] = face_opposite(t, k);
    const double longest = std::max({length(a, b), length(b, c), length(c, a)}),
                 area = dot(normals[static_cast<std::size_t>(k)], normal);
    if (area > width * longest) faces.emplace_back(k, area);
  }
  return faces;
}

Point Editor::largest_normal(std::uint32_t t) const {
  const auto& p = tetrahedra_[t].point;
  const auto normals = normals_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
  return *std::ranges::max_element(normals,
                                   [](const Point& a, const Point& b) { return dot(a, a) < dot(b, b); });
}

bool Editor::peel(const Peel& peel) {
  Change change;
  change.side = peel.side;
  change.removed = peel.tetrahedra;
  return apply(change);
}

bool Editor::peel(std::uint32_t t) { return peel(Peel{{t}, 0, {}, outer_faces_of(t).side}); }

}  // namespace bsp2::meshing
