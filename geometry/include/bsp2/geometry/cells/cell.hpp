#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/cells/block.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// A 0-face: the point in which D independent hyperplanes meet, and its rounded coordinates.
/// Invariant: the exact point is within `error` (Euclidean) of `x`.
template <int D>
struct Vertex {
  std::array<double, D> x;
  double error;
  std::array<HyperplaneId, D> hyperplanes;
};

/// A convex D-polytope as a Hasse diagram: all k-faces, 0 <= k < D, with the cover relation.
///
/// A k-face, k >= 1, knows its (k-1)-faces by index and the D-k independent hyperplanes whose intersection
/// carries it; those of facets (k = D-1) are oriented, the cell on the negative side. The D-face covers all
/// facets and is not stored. A value in one flat block: it shares nothing, moves for free, and can be copied
/// to disk as it stands. Source: the paper, section 3.1.
template <int D>
class Cell {
 public:
  Cell() = default;
  Cell(Cell&&) noexcept = default;
  Cell& operator=(Cell&&) noexcept = default;
  [[nodiscard]] Cell copy() const;

  [[nodiscard]] bool empty() const { return vertex_count_ == 0; }
  [[nodiscard]] std::span<const Vertex<D>> vertices() const {
    return {block_.template at<Vertex<D>>(0), vertex_count_};
  }
  /// Number of k-faces.
  [[nodiscard]] std::size_t face_count(int k) const { return k == 0 ? vertex_count_ : levels_[k - 1].faces; }
  [[nodiscard]] std::size_t facet_count() const { return face_count(D - 1); }
  /// Indices of the (k-1)-faces of k-face `face`, 1 <= k <= D-1.
  [[nodiscard]] std::span<const std::uint16_t> subfaces(int k, std::size_t face) const {
    const Level& level = levels_[k - 1];
    const auto* subfaces = block_.template at<std::uint16_t>(level.subfaces_at);
    if (k == 1) return {subfaces + 2 * face, 2};
    const auto* ends = block_.template at<std::uint32_t>(level.ends_at);
    const std::uint32_t begin = face == 0 ? 0 : ends[face - 1];
    return {subfaces + begin, ends[face] - begin};
  }
  /// Codes of the D-k hyperplanes of k-face `face`, 1 <= k <= D-1: ids, oriented codes for facets.
  [[nodiscard]] std::span<const std::uint32_t> hyperplanes(int k, std::size_t face) const {
    return {block_.template at<std::uint32_t>(levels_[k - 1].hyperplanes_at) + face * (D - k),
            static_cast<std::size_t>(D - k)};
  }
  /// The hyperplane of a facet, the cell on its negative side. D >= 2.
  [[nodiscard]] OrientedHyperplane facet_hyperplane(std::size_t facet) const {
    return {hyperplanes(D - 1, facet)[0]};
  }
  [[nodiscard]] std::size_t bytes() const { return block_.size(); }

 private:
  template <int>
  friend class CellScratch;
  friend class SpaceCell;
  struct Level {
    std::uint32_t faces = 0, hyperplanes_at = 0, ends_at = 0, subfaces_at = 0;
  };
  Block block_;
  std::uint32_t vertex_count_ = 0;
  std::array<Level, (D > 1 ? D - 1 : 1)> levels_{};
};

/// What all vertices of a cell tell by axis, as their coordinates are rounded.
template <int D>
struct VertexRange {
  std::array<double, D> lower, upper, sum;
  double error;  ///< the largest of the vertices' error bounds
};

template <int D>
VertexRange<D> vertex_range(const Cell<D>& cell);

/// The vertices of a facet, in ascending order. Takes memory: in space the ends of the facet's edges tell the
/// same.
template <int D>
std::vector<std::uint16_t> facet_vertices(const Cell<D>& cell, std::size_t facet);

/// The Hasse diagram of the table's root cell: the box of all axis positions.
template <int D>
Cell<D> root_cell(const HyperplaneTable<D>& table);

/// No vertex's error bound exceeds so much of the table's radius: it keeps the filter sharp and volumes
/// accurate.
inline constexpr double largest_vertex_error = 0x1p-40;

/// The vertex in which D hyperplanes meet; one that is conditioned worse than `largest_vertex_error` allows
/// is computed exactly and rounded.
/// @param exact_evaluations is increased where the rounded solution is too ill-conditioned and the exact one
/// is taken.
template <int D>
Vertex<D> make_vertex(const HyperplaneTable<D>& table, const std::array<HyperplaneId, D>& hyperplanes,
                      std::uint64_t& exact_evaluations);

/// `make_vertex` for many that share hyperplanes with others before them: the same bits.
std::vector<Vertex<3>> make_vertices(const HyperplaneTable<3>& table,
                                     std::span<const std::array<HyperplaneId, 3>> names);

/// The hyperplanes in which an edge lies.
template <int D>
using EdgeHyperplanes = std::array<HyperplaneId, D - 1>;

/// Makes the vertices in which one hyperplane cuts edges. @param vertices one an edge, to be written.
template <int D>
void make_vertices(const HyperplaneTable<D>& table, std::span<const EdgeHyperplanes<D>> edges,
                   HyperplaneId id, Vertex<D>* vertices, std::uint64_t& exact_evaluations);

}  // namespace bsp2::geometry
