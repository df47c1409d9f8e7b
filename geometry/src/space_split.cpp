// The split in space, where most time is spent: what Splitter does in any dimension, its cells written in place.
#include <algorithm>
#include <stdexcept>

#include "bsp2/geometry/splitter.hpp"
#include "space_cell.hpp"

namespace bsp2::geometry {

/// The two points in which the hyperplane meets a facet's outline.
template <>
std::array<std::uint32_t, 2> Splitter<3>::find_common_edge(const Cell<3>& cell, std::span<const std::uint16_t> outline, bool is_touched) const {
  std::array<std::uint32_t, 2> ends{};
  std::size_t found = 0;
  const auto add = [&](std::uint32_t vertex) {
    if (found < 2) ends[found] = vertex;
    ++found;
  };
  for (const std::uint16_t edge : outline) {
    if (found == 2 && !is_touched) break;
    if (mask_[1][edge] == crosses) {
      add(static_cast<std::uint32_t>(cell.face_count(0)) + cut_number_[edge]);
    } else if (is_touched && mask_[1][edge] == has_negative) {
      for (const std::uint16_t vertex : cell.subfaces(1, edge))
        if (mask_[0][vertex] == 0) add(vertex);
    }
  }
  if (found != 2) throw std::logic_error("a hyperplane meets the outline of a convex facet in other than two points");
  return ends;
}

/// A new edge for each crossing facet, between the points in which the hyperplane meets its outline; and the outline of the facet that both
/// halves have in common: the new edges, and those that lie on the hyperplane already. Each of these belongs to two facets, one a side, and
/// is taken from the negative one. New vertices are numbered on from the cell's own, and new edges, too.
template <>
void Splitter<3>::find_common_facet(const Cell<3>& cell) {
  const std::uint8_t *const of_vertex = mask_[0].data(), *const of_edge = mask_[1].data();
  const std::size_t vertices = cell.face_count(0), edges = cell.face_count(1), facets = cell.facet_count();
  const auto touched = static_cast<std::size_t>(std::count(of_vertex, of_vertex + vertices, std::uint8_t{0}));
  mask_[2].resize(facets);
  common_edges_.clear();
  common_outline_.clear();
  for (std::size_t facet = 0; facet < facets; ++facet) {
    const auto outline = cell.subfaces(2, facet);
    std::uint8_t mask = 0;
    for (const std::uint16_t edge : outline) mask |= of_edge[edge];
    mask_[2][facet] = mask;
    if (mask == crosses) {
      common_outline_.push(static_cast<std::uint32_t>(edges + common_edges_.size()));
      common_edges_.push(find_common_edge(cell, outline, touched != 0));
    } else if (touched != 0 && mask == has_negative) {
      for (const std::uint16_t edge : outline)
        if (of_edge[edge] == 0) common_outline_.push(edge);
    }
  }
  if (common_outline_.size() != cuts_.size() + touched) throw std::logic_error("the common facet of two halves has not as many edges as corners");
}

/// Those of the k-faces that a half keeps, in their order, which numbers them.
template <>
std::size_t Splitter<3>::number_kept(int k, std::size_t count, std::uint8_t other) {
  Buffer<std::uint16_t>&number = number_[k], &kept = kept_[k];
  number.resize(count);
  kept.resize(count);
  const std::uint8_t* const mask = mask_[k].data();
  std::size_t found = 0;
  for (std::size_t face = 0; face < count; ++face) {  // without branches: there is no telling which ones are kept
    number[face] = static_cast<std::uint16_t>(found);
    kept[found] = static_cast<std::uint16_t>(face);
    found += mask[face] != other ? 1 : 0;
  }
  return found;
}

template <>
Cell<3> Splitter<3>::half_of(const Cell<3>& cell, HyperplaneId id, std::uint8_t side) {
  const std::uint8_t other = crosses ^ side;
  const std::size_t old_vertices = cell.face_count(0), old_edges = cell.face_count(1);
  const std::size_t vertices = number_kept(0, old_vertices, other), edges = number_kept(1, old_edges, other);
  const std::size_t facets = number_kept(2, cell.facet_count(), other);
  const std::uint16_t *const vertex_number = number_[0].data(), *const edge_number = number_[1].data();
  SpaceCell half(vertices + cuts_.size(), edges + common_edges_.size(), facets + 1);

  const Vertex<3>* const old = cell.vertices().data();
  for (std::size_t i = 0; i < vertices; ++i) half.vertices[i] = old[kept_[0][i]];
  std::copy(cuts_.begin(), cuts_.end(), half.vertices + vertices);

  const std::uint16_t* const old_ends = cell.subfaces(1, 0).data();
  const std::uint32_t* const old_hyperplanes = cell.hyperplanes(1, 0).data();
  for (std::size_t i = 0; i < edges; ++i) {
    const std::size_t edge = kept_[1][i];
    for (std::size_t k = 0; k < 2; ++k) {
      const std::uint16_t end = old_ends[2 * edge + k];
      half.edge_ends[2 * i + k] = static_cast<std::uint16_t>(mask_[0][end] == other ? vertices + cut_number_[edge] : vertex_number[end]);
      half.edge_hyperplanes[2 * i + k] = old_hyperplanes[2 * edge + k];
    }
  }
  const auto vertex = [&](std::uint32_t v) { return static_cast<std::uint16_t>(v < old_vertices ? vertex_number[v] : vertices + v - old_vertices); };
  std::size_t next = edges;  // of the common ones
  for (std::size_t i = 0; i < facets; ++i) {
    const std::size_t facet = kept_[2][i];
    const std::uint32_t hyperplane = cell.hyperplanes(2, facet)[0];
    for (const std::uint16_t edge : cell.subfaces(2, facet))
      if (mask_[1][edge] != other) half.add_facet_edge(edge_number[edge]);
    if (mask_[2][facet] == crosses) {
      const auto& ends = common_edges_[next - edges];
      for (std::size_t k = 0; k < 2; ++k) half.edge_ends[2 * next + k] = vertex(ends[k]);
      half.edge_hyperplanes[2 * next] = hyperplane >> 1;
      half.edge_hyperplanes[2 * next + 1] = id;
      half.add_facet_edge(static_cast<std::uint16_t>(next++));
    }
    half.close_facet(hyperplane);
  }
  for (const std::uint32_t edge : common_outline_)
    half.add_facet_edge(static_cast<std::uint16_t>(edge < old_edges ? edge_number[edge] : edges + edge - old_edges));
  half.close_facet(oriented(id, side == has_positive).code);  // the half is on its negative side
  return half.take();
}

template <>
void Splitter<3>::split(const Cell<3>& cell, HyperplaneId id, Cell<3>* negative, Cell<3>* positive) {
  ++counts_.splits;
  cut_edges(cell, id);
  find_common_facet(cell);
  if (negative != nullptr) *negative = half_of(cell, id, has_negative);
  if (positive != nullptr) *positive = half_of(cell, id, has_positive);
}

}  // namespace bsp2::geometry
