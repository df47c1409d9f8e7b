#pragma once

#include <optional>
#include <random>
#include <span>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/process/process.hpp"

namespace bsp2::dataflow {

/// Producer of a solid bounded by a triangle mesh: within a cell, only the facets that may meet the cell are
/// left. A cell without facets is inside or outside as a whole, told by the winding number at one of its
/// points. Where rounding leaves that open (no double lies inside a cell thinner than doubles resolve), it is
/// taken at an exact point, exactly.
///
/// State of a leaf: the leaf's header; whether there is a reference point, and above that bit the mark of the
/// side of the cell up to which facets have been held against its sides; the point's three coordinates; the
/// mesh's winding number there; the facets. The winding number of another point of the same cell follows from
/// the facets that the segment between them crosses, and only those of the cell can.
class MeshProducer {
 public:
  MeshProducer(const Network<3>& network, const Producer<3>& producer)
      : network_(network), producer_(producer), mesh_(network.meshes[producer.index]) {}

  geometry::Label ask(const Word* leaf, CellView<3>& cell, Words& out) const;
  [[nodiscard]] std::size_t undecided(const Word* leaf) const {
    return (leaf[0] & Program::whole) != 0 ? mesh_.facets.size() : leaf[1] - header;
  }
  /// Of many facets, an axis-parallel cut that parts them; else the plane of the facet that cuts the fewest
  /// others.
  Advice advise(const Word* leaf, CellView<3>& cell) const;
  /// Appends the state of a leaf in a cell that only these facets may meet, of which no more is known.
  static void write_state(std::span<const Word> facets, std::vector<Word>& leaf) {
    leaf.resize(leaf.size() + header - Program::header, 0);
    leaf.insert(leaf.end(), facets.begin(), facets.end());
  }
  /// How often the mesh winds around a point of the model's space; nothing where rounding leaves that open.
  [[nodiscard]] std::optional<std::int32_t> winding_around(const std::array<double, 3>& point) const;
  /// How that changes from one point to another across a facet. @param error of the latter point.
  [[nodiscard]] std::optional<int> change_across(std::uint32_t facet, const std::array<double, 3>& from,
                                                 const std::array<double, 3>& to, double error) const;

 private:
  using Point = std::array<double, 3>;
  struct Reference {
    Point point;
    std::int32_t winding;
  };
  static constexpr std::size_t at_flag = Program::header, at_point = at_flag + 1, at_winding = at_point + 6,
                               header = at_winding + 1;
  const Network<3>& network_;
  const Producer<3>& producer_;
  const Mesh& mesh_;

  /// The facets of a leaf's state: all of the mesh if it is whole.
  template <typename Visit>
  void for_each_facet(const Word* leaf, Visit&& visit) const;
  [[nodiscard]] bool may_meet(const Mesh::Facet& facet, CellView<3>& cell) const;
  void load(std::span<const Word> facets, geometry::TriangleColumns& triangles) const;
  void drop_beyond(CellView<3>& cell, std::size_t first_side, Words& facets, std::size_t first) const;
  void mark_beyond(CellView<3>& cell, std::size_t first_side, std::span<Word> facets) const;
  [[nodiscard]] double reach_of_points_on(const geometry::Hyperplane<3>& rounded) const;
  [[nodiscard]] bool is_on(std::uint32_t corner, geometry::HyperplaneId id) const;
  [[nodiscard]] double moved_by(geometry::HyperplaneId id) const;
  [[nodiscard]] double thickness_by_merging(const geometry::Cell<3>& cell) const;
  [[nodiscard]] bool is_inside(const Point& point, const geometry::Cell<3>& cell) const;
  [[nodiscard]] std::optional<Reference> reference_of(const Word* leaf) const;
  template <typename Visit>
  void for_each_facet_near(const Point& from, const Point& to, double error, Visit&& visit) const;
  [[nodiscard]] std::optional<std::int32_t> winding_at(const Point& point, const Reference& from,
                                                       const Word* leaf) const;
  [[nodiscard]] std::optional<std::int32_t> winding_anew(const Point& point) const;
  [[nodiscard]] std::optional<Reference> new_reference(const Word* leaf, const CellView<3>& cell) const;
  [[nodiscard]] std::int32_t winding_within(const Word* leaf, CellView<3>& cell,
                                            const std::optional<Reference>& reference) const;
  [[nodiscard]] std::optional<int> crossing_into(CellView<3>& cell, const Point& from, const Point& to,
                                                 const Mesh::Facet& facet, double error) const;
  [[nodiscard]] std::optional<std::int32_t> winding_from_parent(const Word* leaf, CellView<3>& cell) const;
  [[nodiscard]] std::optional<std::int32_t> winding_beside(const CellView<3>& view) const;
  [[nodiscard]] Point beyond(const Point& point, std::minstd_rand& random) const;
  [[nodiscard]] std::int32_t exact_winding(CellView<3>& cell) const;
  [[nodiscard]] Reference outside() const;
  [[nodiscard]] Point point_outside(const Point& point) const;
  [[nodiscard]] std::optional<geometry::HyperplaneId> median(const Word* leaf, CellView<3>& cell) const;
  [[nodiscard]] geometry::HyperplaneId best_plane(const Word* leaf, CellView<3>& cell) const;
  [[nodiscard]] unsigned sides_of_near_corners(const Mesh::Facet& facet, const Mesh::Facet& other,
                                               const geometry::Hyperplane<3>& plane, double reach) const;
};

}  // namespace bsp2::dataflow
