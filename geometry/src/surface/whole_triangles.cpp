#include "surface/whole_triangles.hpp"

#include <algorithm>

#include "bsp2/geometry/surface/edge_chain.hpp"
#include "surface/no_index.hpp"
#include "surface/skin_steps.hpp"

namespace bsp2::geometry {

WholeTriangles::WholeTriangles(Skin& skin) {
  if (skin.untouched.empty()) return;
  // Where faces of one plane have become one, they may be joined at an edge.
  std::vector<std::uint32_t> edges_of(skin.faces.size());
  for (const Skin::Edge& edge : skin.edges) ++edges_of[edge.face];
  std::vector<std::uint8_t> is_own(skin.vertices.size());
  for (const std::uint32_t vertex : skin.untouched) is_own[vertex] = 1;
  for (const Skin::Edge& edge : skin.edges)
    if (edges_of[edge.face] != 3) is_own[edge.from] = is_own[edge.to] = 0;
  for (const Skin::Edge& edge : skin.edges)
    if (is_own[edge.from] == 0 || is_own[edge.to] == 0) edges_of[edge.face] = 0;  // not one of these
  const auto rest = std::stable_partition(skin.edges.begin(), skin.edges.end(),
                                          [&](const Skin::Edge& edge) { return edges_of[edge.face] == 3; });
  own_.edges.assign(skin.edges.begin(), rest);
  skin.edges.erase(skin.edges.begin(), rest);
  std::fill(is_own.begin(), is_own.end(), std::uint8_t{0});
  for (const Skin::Edge& edge : own_.edges) is_own[edge.from] = 1;
  take_vertices(skin, is_own);
}

void WholeTriangles::take_vertices(Skin& skin, std::span<const std::uint8_t> is_own) {
  std::vector<std::uint8_t> is_of_rest(skin.vertices.size());
  for (const Skin::Edge& edge : skin.edges) is_of_rest[edge.from] = is_of_rest[edge.to] = 1;
  Skin rest;
  const auto add = [&](std::uint32_t vertex, Skin& to) {
    to.vertices.push_back(skin.vertices[vertex]);
    to.incident.insert(to.incident.end(), skin.incident.begin() + skin.incident_offset[vertex],
                       skin.incident.begin() + skin.incident_offset[vertex + 1]);
    to.incident_offset.push_back(static_cast<std::uint32_t>(to.incident.size()));
    return static_cast<std::uint32_t>(to.vertices.size() - 1);
  };
  std::vector<std::uint32_t> own_number(skin.vertices.size(), none), rest_number(skin.vertices.size(), none);
  for (std::uint32_t vertex = 0; vertex < skin.vertices.size(); ++vertex) {
    if (is_of_rest[vertex] != 0) rest_number[vertex] = add(vertex, rest);
    if (is_own[vertex] == 0) continue;
    own_number[vertex] = add(vertex, own_);
    if (is_of_rest[vertex] != 0) shared_.push_back({own_number[vertex], rest_number[vertex]});
  }
  const auto renumber_edges = [](std::vector<Skin::Edge>& edges, std::span<const std::uint32_t> number) {
    for (Skin::Edge& edge : edges) {
      edge.from = number[edge.from];
      edge.to = number[edge.to];
    }
  };
  renumber_edges(own_.edges, own_number);
  renumber_edges(skin.edges, rest_number);
  skin.vertices = std::move(rest.vertices);
  skin.incident = std::move(rest.incident);
  skin.incident_offset = std::move(rest.incident_offset);
  skin.untouched.clear();
}

void WholeTriangles::renumber(std::span<const std::uint32_t> map) {
  for (Shared& vertex : shared_) vertex.rest = map[vertex.rest];
}

std::vector<std::uint8_t> WholeTriangles::put_back(const HyperplaneTable<3>& table, unsigned threads,
                                                   PointSet& points, Skin& skin) {
  std::vector<std::uint8_t> is_own(points.size());
  const PointSet own = take_points(table, threads, own_);
  for (Skin::Edge& edge : own_.edges)
    edge.across = common_plane(own, edge.from, edge.to, skin.faces[edge.face].outward.id());
  std::vector<std::uint32_t> number(own.size(), none);
  for (const Shared& vertex : shared_) {
    number[vertex.own] = vertex.rest;
    is_own[vertex.rest] = 1;
  }
  for (std::uint32_t vertex = 0; vertex < own.size(); ++vertex) {
    if (number[vertex] != none) continue;
    number[vertex] = static_cast<std::uint32_t>(points.size());
    points.add(own.vertices[vertex], own.planes_of(vertex));
  }
  is_own.resize(points.size(), 1);
  skin.edges.reserve(skin.edges.size() + own_.edges.size());
  for (const Skin::Edge& edge : own_.edges)
    skin.edges.push_back({number[edge.from], number[edge.to], edge.face, edge.across});
  own_ = {};
  return is_own;
}

}  // namespace bsp2::geometry
