#include <algorithm>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/contact.hpp"
#include "support/counted_order.hpp"

namespace bsp2::geometry {

void Skin::append(const Skin& other) {
  const auto first_vertex = static_cast<std::uint32_t>(vertices.size()),
             first_face = static_cast<std::uint32_t>(faces.size()),
             first_incident = static_cast<std::uint32_t>(incident.size());
  vertices.insert(vertices.end(), other.vertices.begin(), other.vertices.end());
  incident.insert(incident.end(), other.incident.begin(), other.incident.end());
  for (std::size_t i = 1; i < other.incident_offset.size(); ++i)
    incident_offset.push_back(first_incident + other.incident_offset[i]);
  faces.insert(faces.end(), other.faces.begin(), other.faces.end());
  for (const Edge& edge : other.edges)
    edges.push_back({first_vertex + edge.from, first_vertex + edge.to, first_face + edge.face, edge.across});
  for (const std::uint32_t vertex : other.untouched) untouched.push_back(first_vertex + vertex);
}

std::vector<std::uint32_t> Skin::weld() {
  const auto order = counted_order(
      vertices.size(), [&](std::size_t i) { return vertices[i][0]; },
      [&](std::uint32_t a, std::uint32_t b) { return vertices[a] < vertices[b]; });
  std::vector<std::uint32_t> place(vertices.size());
  Skin united;
  united.incident.reserve(incident.size());
  std::vector<HyperplaneId> known;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    const auto& name = vertices[order[begin]];
    known.clear();
    for (; end < order.size() && vertices[order[end]] == name; ++end) {
      const std::uint32_t old = order[end];
      place[old] = static_cast<std::uint32_t>(united.vertices.size());
      known.insert(known.end(), incident.begin() + incident_offset[old],
                   incident.begin() + incident_offset[old + 1]);
    }
    std::sort(known.begin(), known.end());
    known.erase(std::unique(known.begin(), known.end()), known.end());
    united.vertices.push_back(name);
    united.incident.insert(united.incident.end(), known.begin(), known.end());
    united.incident_offset.push_back(static_cast<std::uint32_t>(united.incident.size()));
  }
  vertices = std::move(united.vertices);
  incident = std::move(united.incident);
  incident_offset = std::move(united.incident_offset);
  for (Edge& edge : edges) {
    edge.from = place[edge.from];
    edge.to = place[edge.to];
  }
  untouched.clear();
  return place;
}

}  // namespace bsp2::geometry
