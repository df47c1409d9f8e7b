#include "cells/space_cell.hpp"

#include <limits>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/cells/splitter.hpp"

namespace bsp2::geometry {

/// Laid out as CellScratch::pack() does.
SpaceCell::SpaceCell(std::size_t vertex_count, std::size_t edges, std::size_t facets) {
  constexpr std::size_t most = std::numeric_limits<std::uint16_t>::max();
  if (vertex_count > most || edges > most || facets > most) CellScratch<3>::throw_too_many_faces();
  auto& [of_edges, of_facets] = cell_.levels_;
  std::size_t at = vertex_count * sizeof(Vertex<3>);
  const auto place = [&at](std::size_t bytes) {
    return static_cast<std::uint32_t>(std::exchange(at, at + (bytes + 3) / 4 * 4));
  };
  of_edges.faces = static_cast<std::uint32_t>(edges);
  of_edges.hyperplanes_at = place(edges * 2 * sizeof(std::uint32_t));
  of_edges.ends_at = static_cast<std::uint32_t>(at);
  of_edges.subfaces_at = place(edges * 2 * sizeof(std::uint16_t));
  of_facets.faces = static_cast<std::uint32_t>(facets);
  of_facets.hyperplanes_at = place(facets * sizeof(std::uint32_t));
  of_facets.ends_at = place(facets * sizeof(std::uint32_t));
  of_facets.subfaces_at = place(edges * 2 * sizeof(std::uint16_t));
  Block& block = cell_.block_;
  block = Block(at);
  cell_.vertex_count_ = static_cast<std::uint32_t>(vertex_count);
  vertices = block.at<Vertex<3>>(0);
  edge_hyperplanes = block.at<std::uint32_t>(of_edges.hyperplanes_at);
  edge_ends = block.at<std::uint16_t>(of_edges.subfaces_at);
  facet_hyperplanes = block.at<std::uint32_t>(of_facets.hyperplanes_at);
  facet_ends = block.at<std::uint32_t>(of_facets.ends_at);
  facet_edges = block.at<std::uint16_t>(of_facets.subfaces_at);
}

Cell<3> SpaceCell::take() {
  if (filled_ != 2 * cell_.face_count(1) || closed_ != cell_.facet_count())
    throw std::logic_error("an edge of a cell in space lies in other than two facets");
  return std::move(cell_);
}

void throw_no_two_points() {
  throw std::logic_error("a plane meets the outline of a convex facet in other than two points");
}

}  // namespace bsp2::geometry
