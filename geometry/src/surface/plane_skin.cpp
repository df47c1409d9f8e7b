#include "surface/plane_skin.hpp"

namespace bsp2::geometry {

std::uint32_t PlaneSkin::face_of(bool flipped, std::int32_t owner, std::int32_t other) {
  const OrientedHyperplane outward = oriented(plane_, flipped);
  for (std::uint32_t i = 0; i < faces_.size(); ++i)
    if (faces_[i].outward == outward && faces_[i].owner == owner && faces_[i].other == other) return i;
  faces_.push_back({outward, owner, other});
  return static_cast<std::uint32_t>(faces_.size() - 1);
}

void PlaneSkin::add_loop(std::span<const PlaneCorner> corners, std::uint32_t face, bool forward) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const std::uint32_t a = corners[i].point, b = corners[i + 1 < corners.size() ? i + 1 : 0].point;
    edges_.push_back({forward ? a : b, forward ? b : a, face, corners[i].across});
  }
}

void PlaneSkin::reduce() {
  united_.clear();
  std::sort(also_on_.begin(), also_on_.end());
  auto other = also_on_.begin();
  std::vector<HyperplaneId> known;
  for (std::uint32_t i = 0; i < points_.vertices().size(); ++i) {
    const Vertex<3>& vertex = points_.vertices()[i];
    const auto [a, b] = points_.name(i);
    known.assign(vertex.hyperplanes.begin(), vertex.hyperplanes.end());
    for (const HyperplaneId id : {plane_, a, b})
      if (std::find(known.begin(), known.end(), id) == known.end()) known.push_back(id);
    for (; other != also_on_.end() && other->first == i; ++other) known.push_back(other->second);
    united_.add(vertex, known);
  }
  const auto map = exact_.unify(united_);
  for (Skin::Edge& edge : edges_) {
    edge.from = map[edge.from];
    edge.to = map[edge.to];
  }
  adder_.add_up(united_, plane_, edges_);
}

void PlaneSkin::append_to(Skin& skin) {
  reduce();
  const auto first_face = static_cast<std::uint32_t>(skin.faces.size());
  if (!edges_.empty()) skin.faces.insert(skin.faces.end(), faces_.begin(), faces_.end());
  std::vector<std::uint32_t> map(united_.size(), none);
  const auto vertex = [&](std::uint32_t point) {
    if (map[point] == none) {
      map[point] = static_cast<std::uint32_t>(skin.vertices.size());
      skin.vertices.push_back(united_.vertices[point].hyperplanes);
      const auto planes = united_.planes_of(point);
      skin.incident.insert(skin.incident.end(), planes.begin(), planes.end());
      skin.incident_offset.push_back(static_cast<std::uint32_t>(skin.incident.size()));
    }
    return map[point];
  };
  for (const Skin::Edge& edge : edges_) {
    const std::uint32_t from = vertex(edge.from), to = vertex(edge.to);
    skin.edges.push_back({from, to, first_face + edge.face, edge.across});
  }
}

}  // namespace bsp2::geometry
