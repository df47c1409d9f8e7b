// The split in space, where most time is spent: what Splitter does in any dimension, its cells written in
// place.
#include <algorithm>
#include <stdexcept>

#include "bsp2/geometry/cells/splitter.hpp"
#include "cells/space_cell.hpp"

namespace bsp2::geometry {

namespace {

std::array<std::uint32_t, 2> ascending(std::uint32_t a, std::uint32_t b) {
  return {std::min(a, b), std::max(a, b)};
}

}  // namespace

/// The two points in which a hyperplane through vertices meets a facet's outline.
template <>
std::array<std::uint32_t, 2> Splitter<3>::find_common_edge(const Cell<3>& cell,
                                                           std::span<const std::uint16_t> outline) const {
  std::array<std::uint32_t, 2> ends{};
  std::size_t found = 0;
  const auto add = [&](std::uint32_t vertex) {
    if (found < 2) ends[found] = vertex;
    ++found;
  };
  for (const std::uint16_t edge : outline) {
    if (mask_[1][edge] == crosses) {
      add(static_cast<std::uint32_t>(cell.face_count(0)) + cut_number_[edge]);
    } else if (mask_[1][edge] == has_negative) {
      for (const std::uint16_t vertex : cell.subfaces(1, edge))
        if (mask_[0][vertex] == 0) add(vertex);
    }
  }
  if (found != 2) throw_no_two_points();
  return ascending(ends[0], ends[1]);
}

/// A new edge for each crossing facet, between the points in which the hyperplane meets its outline. These
/// are the outline of the facet that both halves have in common. New vertices are numbered on from the cell's
/// own, and new edges, too.
template <>
void Splitter<3>::find_common_edges(const Cell<3>& cell) {
  const std::uint8_t* const of_edge = mask_[1].data();
  const std::uint16_t* const number = cut_number_.data();
  const std::size_t edges = cell.face_count(1), facets = cell.facet_count();
  const auto first = static_cast<std::uint32_t>(cell.face_count(0));
  mask_[2].resize(facets);
  common_edges_.resize(facets);
  common_outline_.resize(facets);
  std::size_t crossing = 0;
  for (std::size_t facet = 0; facet < facets;
       ++facet) {  // hardly any branches: there is no telling which edges and facets cross
    std::array<std::uint32_t, 4> ends{};
    std::size_t found = 0;
    std::uint8_t mask = 0;
    for (const std::uint16_t edge : cell.subfaces(2, facet)) {
      mask |= of_edge[edge];
      ends[found & 3] = first + number[edge];
      found += of_edge[edge] == crosses ? 1 : 0;
    }
    mask_[2][facet] = mask;
    if (found != (mask == crosses ? 2 : 0)) throw_no_two_points();
    common_edges_[crossing] = ascending(ends[0], ends[1]);
    common_outline_[crossing] = static_cast<std::uint32_t>(edges + crossing);
    crossing += mask == crosses ? 1 : 0;
  }
  common_edges_.resize(crossing);
  common_outline_.resize(crossing);
}

/// Finds the common edges where vertices lie on the hyperplane, and maybe edges: each of these belongs to two
/// facets, one a side, and is taken from the negative one.
template <>
void Splitter<3>::find_touched_edges(const Cell<3>& cell) {
  const std::size_t edges = cell.face_count(1), facets = cell.facet_count();
  mask_[2].resize(facets);
  common_edges_.clear();
  common_outline_.clear();
  for (std::size_t facet = 0; facet < facets; ++facet) {
    const auto outline = cell.subfaces(2, facet);
    std::uint8_t mask = 0;
    for (const std::uint16_t edge : outline) mask |= mask_[1][edge];
    mask_[2][facet] = mask;
    if (mask == crosses) {
      common_outline_.push(static_cast<std::uint32_t>(edges + common_edges_.size()));
      common_edges_.push(find_common_edge(cell, outline));
    } else if (mask == has_negative) {
      for (const std::uint16_t edge : outline)
        if (mask_[1][edge] == 0) common_outline_.push(edge);
    }
  }
}

/// Those of the k-faces that a half keeps, in their order, which numbers them.
template <>
std::size_t Splitter<3>::number_kept(int k, std::size_t count, std::uint8_t other) {
  Buffer<std::uint16_t>&number = number_[k], &kept = kept_[k];
  number.resize(count);
  kept.resize(count);
  const std::uint8_t* const mask = mask_[k].data();
  std::size_t found = 0;
  for (std::size_t face = 0; face < count;
       ++face) {  // without branches: there is no telling which ones are kept
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
  const std::uint16_t *const vertex_number = number_[0].data(), *const edge_number = number_[1].data(),
                             *const cut_number = cut_number_.data();
  const std::uint8_t* const of_vertex = mask_[0].data();
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
      const std::uint32_t cut = of_vertex[end] == other ? ~0u : 0u;  // without a branch: there is no telling
      half.edge_ends[2 * i + k] = static_cast<std::uint16_t>(
          (static_cast<std::uint32_t>(vertices + cut_number[edge]) & cut) | (vertex_number[end] & ~cut));
      half.edge_hyperplanes[2 * i + k] = old_hyperplanes[2 * edge + k];
    }
  }
  const auto vertex = [&](std::uint32_t v) {
    return static_cast<std::uint16_t>(v < old_vertices ? vertex_number[v] : vertices + v - old_vertices);
  };
  std::size_t next = edges;  // of the common ones
  for (std::size_t i = 0; i < facets; ++i) {
    const std::size_t facet = kept_[2][i];
    const std::uint32_t hyperplane = cell.hyperplanes(2, facet)[0];
    for (const std::uint16_t edge : cell.subfaces(2, facet))
      half.add_facet_edge_if(mask_[1][edge] != other, edge_number[edge]);
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
    half.add_facet_edge(
        static_cast<std::uint16_t>(edge < old_edges ? edge_number[edge] : edges + edge - old_edges));
  half.close_facet(oriented(id, side == has_positive).code);  // the half is on its negative side
  return half.take();
}

template <>
void Splitter<3>::split(const Cell<3>& cell, HyperplaneId id, Cell<3>* negative, Cell<3>* positive) {
  ++counts_.splits;
  cut_edges(cell, id);
  const std::uint8_t* const of_vertex = mask_[0].data();
  const auto touched =
      static_cast<std::size_t>(std::count(of_vertex, of_vertex + cell.face_count(0), std::uint8_t{0}));
  if (touched == 0)
    find_common_edges(cell);
  else
    find_touched_edges(cell);
  if (common_outline_.size() != cuts_.size() + touched)
    throw std::logic_error("the common facet of two halves has not as many edges as corners");
  if (negative != nullptr) *negative = half_of(cell, id, has_negative);
  if (positive != nullptr) *positive = half_of(cell, id, has_positive);
}

}  // namespace bsp2::geometry
