#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "bsp2/dataflow/localizer.hpp"

namespace bsp2::dataflow {

/// Producer of a solid bounded by a triangle mesh: within a cell, only the facets that may meet the cell are left. A cell
/// without facets is inside or outside as a whole, told by the winding number at one of its points.
///
/// State of a leaf: the leaf's header; whether there is a reference point; its three coordinates; the mesh's winding
/// number there; the facets. The winding number of another point of the same cell follows from the facets that the
/// segment between them crosses, and only those of the cell can.
class MeshLocalizer {
 public:
  static constexpr std::size_t header = Network<3>::header + 8;

  MeshLocalizer(const Network<3>& network, geometry::Splitter<3>& splitter, const geometry::Cell<3>& cell,
                const CellExtent<3>& extent, bool quick)
      : network_(network), splitter_(splitter), cell_(cell), extent_(extent), quick_(quick) {}

  /// The label within the cell; for FUZZY the new state is appended to `out`.
  geometry::Label visit(const Word* leaf, const Producer<3>& producer, std::vector<Word>& out);
  /// Axis-parallel cuts that have many facets on either side.
  void median_candidates(const Word* leaf, std::vector<std::pair<double, geometry::HyperplaneId>>& candidates) const;
  /// The facets' plane that cuts the fewest other facets and parts them best.
  geometry::HyperplaneId best_plane(const Word* leaf) const;

 private:
  using Point = std::array<double, 3>;
  struct Reference {
    Point point;
    std::int32_t winding;
  };
  const Network<3>& network_;
  geometry::Splitter<3>& splitter_;
  const geometry::Cell<3>& cell_;
  const CellExtent<3>& extent_;
  bool quick_;

  [[nodiscard]] const Mesh& mesh_of(const Word* leaf) const { return network_.meshes[network_.producers[leaf[2]].mesh]; }
  /// The facets of a leaf's state: all of the mesh if it is whole.
  template <typename Visit>
  void for_each_facet(const Word* leaf, const Mesh& mesh, Visit&& visit) const;
  [[nodiscard]] bool may_meet(const Mesh& mesh, const Mesh::Facet& facet) const;
  [[nodiscard]] int corner_side(const Mesh& mesh, std::uint32_t corner, geometry::OrientedHyperplane plane) const;
  [[nodiscard]] bool is_inside(const Point& point) const;
  [[nodiscard]] std::optional<Reference> reference_of(const Word* leaf, const Mesh& mesh, const Producer<3>& producer) const;
  [[nodiscard]] std::optional<std::int32_t> winding_at(const Point& point, const Reference& from, const Word* leaf, const Mesh& mesh) const;
  [[nodiscard]] std::optional<Reference> new_reference(const Word* leaf, const Mesh& mesh, const Producer<3>& producer) const;
  [[nodiscard]] std::int32_t winding_without_reference(const Mesh& mesh, const Producer<3>& producer) const;
};

}  // namespace bsp2::dataflow
