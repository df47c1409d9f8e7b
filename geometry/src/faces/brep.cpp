#include "bsp2/geometry/surface/brep.hpp"

#include <algorithm>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/skin_share.hpp"
#include "faces/brep_piece.hpp"
#include "surface/no_index.hpp"
#include "surface/triangulated_skin.hpp"

namespace bsp2::geometry {

bool has_interfaces(const Skin& skin) {
  return std::any_of(skin.edges.begin(), skin.edges.end(),
                     [&](const Skin::Edge& edge) { return skin.faces[edge.face].other != Skin::outside; });
}

Skin without_interfaces(const Skin& skin) {
  Skin outer;
  outer.faces = skin.faces;
  for (const Skin::Edge& edge : skin.edges)
    if (skin.faces[edge.face].other == Skin::outside) outer.edges.push_back(edge);
  // Vertices of interfaces alone are left out, too: a name of theirs would be taken where it is lower.
  std::vector<std::uint32_t> number(skin.vertices.size(), none);
  for (Skin::Edge& edge : outer.edges)
    for (std::uint32_t* vertex : {&edge.from, &edge.to}) {
      const std::uint32_t old = *vertex;
      if (number[old] == none) {
        number[old] = static_cast<std::uint32_t>(outer.vertices.size());
        outer.vertices.push_back(skin.vertices[old]);
        outer.incident.insert(outer.incident.end(), skin.incident.begin() + skin.incident_offset[old],
                              skin.incident.begin() + skin.incident_offset[old + std::size_t{1}]);
        outer.incident_offset.push_back(static_cast<std::uint32_t>(outer.incident.size()));
      }
      *vertex = number[old];
    }
  return outer;
}

Brep brep_of(const HyperplaneTable<3>& table, Skin skin, TriangleSurface* surface, const ToldShare& told,
             unsigned threads) {
  const bool is_divided = has_interfaces(skin);
  if (surface != nullptr && is_divided) *surface = triangulate(table, without_interfaces(skin), {}, threads);
  ExactPoints exact(table);
  std::vector<BrepPiece> pieces;
  pieces.push_back(brep_piece_of(exact, triangulated(table, std::move(skin), told, threads),
                                 [](std::uint32_t) { return false; }));
  return joined(table, pieces, is_divided ? nullptr : surface);
}

bool has_interfaces(const Brep& brep) {
  return std::any_of(brep.faces.begin(), brep.faces.end(),
                     [](const Brep::Face& face) { return face.other != Brep::outside; });
}

TriangleSurface surface_by_part(const Brep& brep) {
  TriangleSurface surface;
  surface.closes_parts = true;
  surface.points = brep.points;
  surface.triangles.reserve(brep.triangles.size());
  surface.owner.reserve(brep.triangles.size());
  for (std::size_t t = 0; t < brep.triangles.size(); ++t) {
    const auto& [a, b, c] = brep.triangles[t];
    const Brep::Face& face = brep.faces[brep.face_of_triangle[t]];
    surface.triangles.push_back({a, b, c});
    surface.owner.push_back(face.part);
    if (face.other == Brep::outside) continue;
    surface.triangles.push_back({a, c, b});
    surface.owner.push_back(face.other);
  }
  return surface;
}

}  // namespace bsp2::geometry
