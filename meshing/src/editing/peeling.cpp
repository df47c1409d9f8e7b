// Taking away what is thinner than is cleaned, or than points are rounded, and stands out of the solid or
// lies on its surface.

#include <algorithm>
#include <limits>

#include "editing/editor.hpp"
#include "simplices/shape.hpp"

namespace bsp2::meshing {
namespace {

double area(const Point& a, const Point& b, const Point& c) {
  const Point n = cross(b - a, c - a);
  return std::sqrt(dot(n, n)) / 2;
}

}  // namespace

Editor::OuterFaces Editor::outer_faces_of(std::uint32_t t) const {
  const Tetrahedron& tet = tetrahedra_[t];
  OuterFaces faces;
  std::size_t others = 0;
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
    if (is_out && (faces.side == inner || own > faces.largest)) {
      faces.side = tet.side[k];
      faces.largest = own;
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
  if (faces.count > 2) return Peel{{t}, depth(p), faces.count > 3 ? std::nullopt : way_inwards(t)};
  if (faces.count == 2)
    if (const auto nearest = nearest_of(faces.edges)) {
      const Point way = (*nearest)[1] - (*nearest)[0];
      return Peel{{t}, std::sqrt(dot(way, way)), way};
    }
  if (tetrahedra_[t].shape <= 0 && faces.other <= faces.outer * (1 + 1e-6)) return Peel{{t}, depth(p), {}};
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = i + 1; k < 4; ++k) longest = std::max(longest, length(p[i], p[k]));
  return Peel{{t}, longest, {}};
}

/// Across a tetrahedron of which one face is inside: along the normal of the largest face, to that one.
std::optional<Point> Editor::way_inwards(std::uint32_t t) const {
  const Tetrahedron& tet = tetrahedra_[t];
  const auto normals =
      normals_of(points_[tet.point[0]], points_[tet.point[1]], points_[tet.point[2]], points_[tet.point[3]]);
  const auto by_size = [](const Point& a, const Point& b) { return dot(a, a) < dot(b, b); };
  const Point largest = *std::ranges::max_element(normals, by_size);
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
  const auto& p = tetrahedra_[t].point;
  const auto normals = normals_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
  Point normal = *std::ranges::max_element(
      normals, [](const Point& a, const Point& b) { return dot(a, a) < dot(b, b); });
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
  Peel plate{{t}, 0, {}};
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  const Point& origin = points_[tetrahedra_[t].point[0]];
  for (std::size_t i = 0; i < plate.tetrahedra.size(); ++i) {
    const Tetrahedron& tet = tetrahedra_[plate.tetrahedra[i]];
    for (const std::uint32_t p : tet.point) {
      const double height = dot(normal, points_[p] - origin);
      lowest = std::min(lowest, height);
      highest = std::max(highest, height);
    }
    plate.depth = highest - lowest;
    if (plate.depth > most || plate.tetrahedra.size() > many) return std::nullopt;
    const auto& p = tet.point;
    const auto normals = normals_of(points_[p[0]], points_[p[1]], points_[p[2]], points_[p[3]]);
    for (int k = 0; k < 4; ++k) {
      const auto face = static_cast<std::size_t>(k);
      if (!(dot(normals[face], normal) > 0) || is_outer(tet.side[face]) ||
          is_narrower(face_opposite(plate.tetrahedra[i], k), most))
        continue;
      const std::uint32_t next = tet.side[face] == inner ? beyond(plate.tetrahedra[i], k) : none;
      if (next == none) return std::nullopt;
      if (std::ranges::find(plate.tetrahedra, next) == plate.tetrahedra.end())
        plate.tetrahedra.push_back(next);
    }
  }
  return plate;
}

/// Whether a triangle is nowhere as high as that.
bool Editor::is_narrower(const std::array<std::uint32_t, 3>& face, double height) const {
  const auto& [a, b, c] = face;
  const double longest = std::max({length(a, b), length(b, c), length(c, a)});
  return 2 * area(points_[a], points_[b], points_[c]) <= height * longest;
}

bool Editor::peel(std::span<const std::uint32_t> tetrahedra) {
  Change change;
  double largest = 0;
  for (const std::uint32_t t : tetrahedra) {
    const OuterFaces faces = outer_faces_of(t);
    if (faces.side != inner && (change.side == inner || faces.largest > largest)) {
      change.side = faces.side;
      largest = faces.largest;
    }
  }
  change.removed.assign(tetrahedra.begin(), tetrahedra.end());
  return apply(change);
}

}  // namespace bsp2::meshing
