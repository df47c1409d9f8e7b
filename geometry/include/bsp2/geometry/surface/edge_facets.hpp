#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::geometry {

/// The facets of one cell that meet in each of its edges. Keeps its memory from one cell to the next.
class EdgeFacets {
 public:
  /// @param cell of the batch, of dimension 3. Linear in the corners of its facets.
  void find(const CellBatch& batch, std::uint32_t cell);
  /// The facet of the cell beyond the edge that begins at a corner. @param corner counts through the batch.
  [[nodiscard]] std::uint32_t beyond(std::uint32_t corner) const {
    return edges_[corner - first_corner_].beyond;
  }
  /// Whether each edge leads one way in one of its facets, and back in the other: then either all facets
  /// turn the right way round, or none.
  [[nodiscard]] bool is_consistent() const { return is_consistent_; }

 private:
  static constexpr std::uint32_t none = ~0U;
  struct Edge {
    std::uint32_t facet = none, beyond = none;
    std::uint32_t earlier = none;  ///< another edge whose lower vertex is the same
    std::uint16_t high = 0;        ///< the higher vertex
    bool ascends = false;          ///< in the facet where it was seen first
  };
  std::uint32_t first_corner_ = 0;
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> newest_at_;  ///< the last edge seen at each lower vertex
  bool is_consistent_ = true;

  bool add(std::uint32_t corner, std::uint32_t facet, std::uint16_t from, std::uint16_t to);
};

}  // namespace bsp2::geometry
