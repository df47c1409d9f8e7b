#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"

namespace bsp2::dataflow {

/// A triangle of a mesh at one of its points.
struct FacetCorner {
  std::uint32_t facet, number;   ///< which corner of the facet
  std::uint32_t next, previous;  ///< points of the facet after this one, counter-clockwise seen from outside
};

/// Which facets meet at the points of a placed mesh, and beyond the edges of each. Once made, any number of
/// threads may read it.
class MeshTopology {
 public:
  explicit MeshTopology(const Mesh& mesh);

  /// Every edge has one facet on each side, wound alike.
  [[nodiscard]] bool is_manifold() const { return is_manifold_; }
  /// A point of a facet, counter-clockwise seen from outside also where the map mirrors.
  [[nodiscard]] std::uint32_t point(std::uint32_t facet, std::uint32_t corner) const {
    return mesh_->facets[facet].corners[mirrored_ ? (3 - corner) % 3 : corner];
  }
  /// The facet beyond the edge that leads from a corner to the next one. @pre is_manifold().
  [[nodiscard]] std::uint32_t beyond(std::uint32_t facet, std::uint32_t corner) const {
    return beyond_[3 * std::size_t{facet} + corner];
  }
  [[nodiscard]] std::span<const FacetCorner> around(std::uint32_t point) const {
    return {corners_.data() + begin_[point], begin_[point + 1] - begin_[point]};
  }

 private:
  const Mesh* mesh_;
  bool mirrored_, is_manifold_ = true;
  std::vector<std::uint32_t> begin_;  // of each point among the corners, and the end
  std::vector<FacetCorner> corners_;
  std::vector<std::uint32_t> beyond_;

  void find_corners();
  void find_neighbours();
};

/// The facets of a mesh of which it is not sure that they bound its solid, ascending: that they meet others
/// in common edges and corners alone, and that the mesh winds once around what is right behind them, and not
/// around what is right before them. Of a mesh that is surely embedded there are none. Nothing where they are
/// many.
///
/// Rounded numbers with bounds of their errors: what is not told is certain, some that are may merely be too
/// near to each other to tell. Time: n log n for n facets of a mesh that is no heap of them.
/// @pre topology.is_manifold().
[[nodiscard]] std::optional<std::vector<std::uint32_t>> doubtful_facets(const Network<3>& network,
                                                                        const Producer<3>& producer,
                                                                        const MeshTopology& topology);

}  // namespace bsp2::dataflow
