#include "bsp2/geometry/surface/skin_builder.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "bsp2/geometry/cells/splitter.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "surface/no_index.hpp"
#include "surface/plane_skin.hpp"

namespace bsp2::geometry {

// --- PolygonSplitter ---

struct PolygonSplitter::Implementation {
  explicit Implementation(const HyperplaneTable<3>& t) : table(t), splitter(t), exact(t) {}
  const HyperplaneTable<3>& table;
  Splitter<3> splitter;  // its predicate
  ExactPoints exact;
  std::vector<int> signs;  // of the polygon that was asked about last

  void find_signs(std::span<const PolygonCorner> polygon, HyperplaneId id) {
    const auto rounded = table.rounded(id);
    signs.clear();
    for (const PolygonCorner& corner : polygon) signs.push_back(splitter.side(corner.point, id, rounded));
  }
};

PolygonSplitter::PolygonSplitter(const HyperplaneTable<3>& table)
    : implementation_(std::make_unique<Implementation>(table)) {}
PolygonSplitter::~PolygonSplitter() = default;

unsigned PolygonSplitter::sides(std::span<const PolygonCorner> polygon, HyperplaneId id) {
  const auto rounded = implementation_->table.rounded(id);
  unsigned sides = 0;
  for (const PolygonCorner& corner : polygon) {
    const int side = implementation_->splitter.side(corner.point, id, rounded);
    sides |= side < 0 ? 1U : side > 0 ? 2U : 0U;
    if (sides == 3) break;
  }
  return sides;
}

/// Source: Sutherland, Hodgman, "Reentrant polygon clipping" (1974).
void PolygonSplitter::split(std::span<const PolygonCorner> polygon, HyperplaneId plane, HyperplaneId id,
                            Buffer<PolygonCorner>* negative, Buffer<PolygonCorner>* positive) {
  implementation_->find_signs(polygon, id);
  const auto& signs = implementation_->signs;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const int here = signs[i], next = signs[i + 1 < signs.size() ? i + 1 : 0];
    // Where a part leaves through the hyperplane, its next edge lies in it.
    if (negative != nullptr && here <= 0)
      negative->push({polygon[i].point, here == 0 && next > 0 ? id : polygon[i].across});
    if (positive != nullptr && here >= 0)
      positive->push({polygon[i].point, here == 0 && next < 0 ? id : polygon[i].across});
    if (here * next >= 0) continue;
    const Vertex<3> vertex = canonical_vertex(implementation_->table, {plane, polygon[i].across, id});
    if (negative != nullptr) negative->push({vertex, here < 0 ? id : polygon[i].across});
    if (positive != nullptr) positive->push({vertex, here > 0 ? id : polygon[i].across});
  }
}

PolygonSplitter::Meeting PolygonSplitter::meet(std::span<const PolygonCorner> polygon, HyperplaneId plane,
                                               HyperplaneId id, std::array<PolygonCorner, 2>& ends) {
  implementation_->find_signs(polygon, id);
  const auto& signs = implementation_->signs;
  const auto count = [&](int sign) { return std::ranges::count(signs, sign); };
  if (count(-1) == 0 || count(1) == 0) return count(0) > 1 ? Meeting::along : Meeting::apart;
  std::size_t found = 0;
  for (std::size_t i = 0; i < polygon.size() && found < ends.size(); ++i) {
    if (signs[i] == 0) ends[found++].point = polygon[i].point;
    if (signs[i] * signs[i + 1 < signs.size() ? i + 1 : 0] < 0)
      ends[found++].point = canonical_vertex(implementation_->table, {plane, polygon[i].across, id});
  }
  return Meeting::crossing;
}

int PolygonSplitter::turn(OrientedHyperplane seen_from, const Vertex<3>& a, const Vertex<3>& b,
                          const Vertex<3>& c) {
  return PlaneFrame(implementation_->exact, seen_from).orientation(a, b, c);
}

// --- CellPolygons ---

namespace {
constexpr std::uint16_t no_facet = 0xffff;
}

void CellPolygons::find_facets_of_edges(const Cell<3>& cell) {
  facets_of_edge_.assign(cell.face_count(1), {no_facet, no_facet});
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet)
    for (const std::uint16_t edge : cell.subfaces(2, facet)) {
      auto& facets = facets_of_edge_[edge];
      facets[facets[0] == no_facet ? 0 : 1] = static_cast<std::uint16_t>(facet);
    }
}

void CellPolygons::find_loop(const Cell<3>& cell, std::size_t facet) {
  const auto edges = cell.subfaces(2, facet);
  edges_at_.resize(cell.face_count(0));
  for (const std::uint16_t edge : edges)
    for (const std::uint16_t vertex : cell.subfaces(1, edge)) edges_at_[vertex] = {no_facet, no_facet};
  for (const std::uint16_t edge : edges)
    for (const std::uint16_t vertex : cell.subfaces(1, edge))
      edges_at_[vertex][edges_at_[vertex][0] == no_facet ? 0 : 1] = edge;
  loop_.clear();
  std::uint16_t edge = edges[0], at = cell.subfaces(1, edge)[0];
  for (std::size_t i = 0; i < edges.size(); ++i) {
    loop_.push_back(at);
    loop_.push_back(edge);
    const auto ends = cell.subfaces(1, edge);
    at = ends[0] == at ? ends[1] : ends[0];
    edge = edges_at_[at][0] == edge ? edges_at_[at][1] : edges_at_[at][0];
  }
}

void CellPolygons::load(PolygonSplitter& kernel, const Cell<3>& cell) {
  outward_.clear();
  ends_.clear();
  corners_.clear();
  find_facets_of_edges(cell);
  const auto vertices = cell.vertices();
  for (std::size_t facet = 0; facet < cell.facet_count(); ++facet) {
    const OrientedHyperplane outward = cell.facet_hyperplane(facet);
    find_loop(cell, facet);
    const std::size_t n = loop_.size() / 2;
    const auto vertex = [&](std::size_t i) { return std::uint32_t{loop_[2 * i]}; };
    const auto across = [&](std::size_t i) {
      const auto [a, b] = facets_of_edge_[loop_[2 * i + 1]];
      return cell.facet_hyperplane(a == facet ? b : a).id();
    };
    if (kernel.turn(outward, vertices[vertex(0)], vertices[vertex(1)], vertices[vertex(2)]) > 0)
      for (std::size_t i = 0; i < n; ++i) corners_.push({vertex(i), across(i)});
    else
      for (std::size_t i = n; i-- > 0;) corners_.push({vertex(i), across(i > 0 ? i - 1 : n - 1)});
    outward_.push_back(outward);
    ends_.push_back(static_cast<std::uint32_t>(corners_.size()));
  }
}

// --- SkinBuilder ---

void SkinBuilder::add(OrientedHyperplane outward, std::int32_t owner, std::span<const PolygonCorner> polygon,
                      OrientedHyperplane seen_from) {
  const auto begin = static_cast<std::uint32_t>(corners_.size());
  corners_.append(polygon);
  pieces_.push_back(
      {outward, owner, begin, static_cast<std::uint32_t>(corners_.size()), outward == seen_from});
}

void SkinBuilder::finish(Skin& skin) {
  std::vector<std::uint32_t> order(pieces_.size());
  std::iota(order.begin(), order.end(), 0U);
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
    const HyperplaneId p = pieces_[a].outward.id(), q = pieces_[b].outward.id();
    return p != q ? p < q : a < b;
  });
  ExactPoints exact(table_);
  PlaneSkin plane_skin(exact);
  std::vector<PlaneCorner> loop;
  for (std::size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    const HyperplaneId plane = pieces_[order[begin]].outward.id();
    plane_skin.clear(plane);
    for (; end < order.size() && pieces_[order[end]].outward.id() == plane; ++end) {
      const Piece& piece = pieces_[order[end]];
      const std::span corners(corners_.data() + piece.begin, piece.end - piece.begin);
      loop.clear();
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const PolygonCorner& before = corners[i > 0 ? i - 1 : corners.size() - 1];
        const auto make = [&] {
          Vertex<3> vertex = corners[i].point;
          std::sort(vertex.hyperplanes.begin(), vertex.hyperplanes.end());
          return vertex;
        };
        loop.push_back({plane_skin.points().find(before.across, corners[i].across, make), corners[i].across});
      }
      plane_skin.add_loop(loop, plane_skin.face_of(piece.outward.flipped(), piece.owner), piece.forward);
    }
    plane_skin.append_to(skin);
  }
  pieces_.clear();
  corners_.clear();
}

}  // namespace bsp2::geometry
