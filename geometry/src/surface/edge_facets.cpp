#include "bsp2/geometry/surface/edge_facets.hpp"

#include <algorithm>
#include <stdexcept>

namespace bsp2::geometry {

void EdgeFacets::find(const CellBatch& batch, std::uint32_t cell) {
  const std::uint32_t first_facet = batch.facet_offset[cell], end_facet = batch.facet_offset[cell + 1];
  first_corner_ = batch.facet_vertex_offset[first_facet];
  edges_.assign(batch.facet_vertex_offset[end_facet] - first_corner_, {});
  newest_at_.assign(batch.point_offset[cell + 1] - batch.point_offset[cell], none);
  is_consistent_ = true;
  std::uint32_t corner = 0, matched = 0;
  for (std::uint32_t facet = first_facet; facet < end_facet; ++facet) {
    const auto loop = batch.vertices_of_facet(facet);
    for (std::size_t k = 0; k < loop.size(); ++k, ++corner)
      matched += add(corner, facet, loop[k], loop[k + 1 < loop.size() ? k + 1 : 0]);
  }
  if (2 * matched != corner) throw std::logic_error("an edge of a cell is in one facet only");
}

/// @return whether the edge has been seen from the other side before.
bool EdgeFacets::add(std::uint32_t corner, std::uint32_t facet, std::uint16_t from, std::uint16_t to) {
  const auto [low, high] = std::minmax(from, to);
  for (std::uint32_t at = newest_at_[low]; at != none; at = edges_[at].earlier)
    if (edges_[at].high == high) {
      edges_[at].beyond = facet;
      edges_[corner].beyond = edges_[at].facet;
      is_consistent_ = is_consistent_ && edges_[at].ascends != (from < to);
      return true;
    }
  edges_[corner] = {facet, none, newest_at_[low], high, from < to};
  newest_at_[low] = corner;
  return false;
}

}  // namespace bsp2::geometry
