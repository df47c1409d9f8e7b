#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "shapes/mesh_shape.hpp"

namespace bsp2::dataflow {

/// A mesh in the model, and the hyperplanes that represent its facets since `merge`.
struct MergedFacets {
  const MeshShape& shape;
  const geometry::Matrix<3>& matrix;
  std::uint32_t map, first_covector;  ///< in the table
  std::span<geometry::OrientedHyperplane> planes;
};

/// Keeps the corners of a mesh where they are, as near as the tolerance says.
///
/// A hyperplane that represents a facet misses its corners by less than the tolerance. Where two hyperplanes
/// meet at a small angle, as the facets of one flat face do whose corners are rounded by about the tolerance,
/// that makes far more of where they meet: a needle would stand out of the face there. The facets that such a
/// hyperplane represents get ones of their own again.
///
/// So do those of a mesh in which merging has found few such facets: there it is chance that two are nearly
/// in one plane, which simplifies nothing, and a mesh all of whose facets pass through their corners is
/// exact.
class FacetCorners {
 public:
  /// @param tolerance of merging, a length.
  FacetCorners(const geometry::HyperplaneTable<3>& table, const MergedFacets& facets, double tolerance);

  /// Whether no corner moves. Any number of threads may ask, of different meshes.
  [[nodiscard]] bool stay() const;
  /// Takes merging back until none does.
  void keep(geometry::HyperplaneTable<3>::Unmerging& unmerge);
  /// The facets that others of the mesh represent though they are not quite in one plane: how many.
  [[nodiscard]] std::size_t tilted() const;
  /// Takes merging back for these, if they are few in the mesh.
  /// @param shared the ids of hyperplanes that have facets of other solids, too, which keep what they have.
  void part_few(const std::vector<bool>& shared, geometry::HyperplaneTable<3>::Unmerging& unmerge);
  /// The hyperplanes that miss corners of facets they represent by more than rounding, by id, and how far.
  [[nodiscard]] std::vector<Mesh::Moved> moved() const;

 private:
  /// A hyperplane at a corner, and how far it misses it; 0: by rounding, at most.
  struct Miss {
    geometry::HyperplaneId id;
    std::array<double, 3> normal;
    double distance;
  };
  struct Represented {
    geometry::HyperplaneId by;
    std::uint32_t facet;
    auto operator<=>(const Represented&) const = default;
  };

  const geometry::HyperplaneTable<3>& table_;
  MergedFacets facets_;
  double tolerance_;
  std::vector<std::uint32_t> offset_, around_;  // the facets at each corner; none if all represent themselves

  [[nodiscard]] bool is_own(std::size_t facet) const;
  [[nodiscard]] bool is_tilted(std::size_t facet) const;
  [[nodiscard]] std::span<const std::uint32_t> facets_at(std::uint32_t corner) const;
  [[nodiscard]] std::array<double, 3> place(std::uint32_t corner) const;
  void find_misses(std::uint32_t corner, std::vector<Miss>& misses) const;
  [[nodiscard]] bool moves(std::uint32_t corner, std::vector<Miss>& misses) const;
  void set_apart(std::span<const Represented> facets, geometry::HyperplaneTable<3>::Unmerging& unmerge,
                 std::vector<std::uint32_t>& corners);
  [[nodiscard]] bool two_part(const Miss& a, const Miss& b) const;
  [[nodiscard]] bool three_part(const Miss& a, const Miss& b, const Miss& c) const;
};

}  // namespace bsp2::dataflow
