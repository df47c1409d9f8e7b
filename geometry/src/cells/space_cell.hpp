#pragma once

#include <cstddef>
#include <cstdint>

#include "bsp2/geometry/cells/cell.hpp"

namespace bsp2::geometry {

/// A cell in space that is written in place. Its size is known beforehand, as each edge lies in two facets.
///
/// The writer fills all arrays: vertices, then for each edge its two ends and hyperplanes, then for each
/// facet the oriented hyperplane, its edges, and where they end among all.
class SpaceCell {
 public:
  /// Throws length_error where 16 bits do not number the faces.
  SpaceCell(std::size_t vertices, std::size_t edges, std::size_t facets);

  Vertex<3>* vertices;
  std::uint32_t* edge_hyperplanes;   // two an edge
  std::uint16_t* edge_ends;          // two an edge
  std::uint32_t* facet_hyperplanes;  // one a facet
  std::uint32_t* facet_ends;         // one a facet
  std::uint16_t* facet_edges;        // two an edge

  void add_facet_edge(std::uint16_t edge) { facet_edges[filled_++] = edge; }
  /// Adds an edge if it is wanted, without a branch. What is not wanted is overwritten by the next one: there
  /// has to be one, of this facet or another.
  void add_facet_edge_if(bool wanted, std::uint16_t edge) {
    facet_edges[filled_] = edge;
    filled_ += wanted ? 1 : 0;
  }
  void close_facet(std::uint32_t hyperplane) {
    facet_hyperplanes[closed_] = hyperplane;
    facet_ends[closed_++] = filled_;
  }
  /// The finished cell. Throws logic_error unless each edge was given to two facets.
  Cell<3> take();

 private:
  Cell<3> cell_;
  std::uint32_t filled_ = 0, closed_ = 0;
};

/// What no convex facet does.
[[noreturn]] void throw_no_two_points();

}  // namespace bsp2::geometry
