#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/complex/complex_share.hpp"
#include "complex/cell_facets.hpp"
#include "complex/plane_overlay.hpp"

namespace bsp2::meshing {

/// What pairs of cells touch in, as a list: the faces of the complex. Thread rule: one thread at a time,
/// which others help.
class ComplexMaker {
 public:
  /// @param families all planes of families that facets are on (geometry::family_planes).
  ComplexMaker(const geometry::HyperplaneTable<3>& table, std::vector<geometry::HyperplaneId> families,
               unsigned threads);
  void load(std::span<const std::shared_ptr<const geometry::CellBatch>> batches) { loader_.load(batches); }
  /// The corners of a cell that was loaded, for certain.
  [[nodiscard]] geometry::CertainBox box_of(std::uint32_t cell) const;
  /// Of all that was loaded.
  Complex run();

  /// Cells of one share, then cells of others, which are around them.
  struct Shares {
    std::uint32_t first, count;             ///< numbers of the share's own cells
    std::uint32_t near;                     ///< so many of the others touch own ones; they come first
    std::span<const std::uint32_t> others;  ///< numbers of the others, which were loaded after them
    const std::vector<bool>& is_shared;     ///< of the own cells: those that others may touch
    [[nodiscard]] std::uint32_t number(std::int32_t cell) const {
      const auto index = static_cast<std::uint32_t>(cell);
      if (cell == Complex::outside) return ComplexPiece::outside;
      return index < count ? first + index : others[index - count];
    }
    [[nodiscard]] bool is_near(std::int32_t cell) const {
      return cell != Complex::outside && static_cast<std::uint32_t>(cell) < count + near;
    }
    /// Of a face: whether the share gives it.
    [[nodiscard]] bool gives(std::int32_t negative, std::int32_t positive) const {
      const std::uint32_t lower = std::min(number(negative), number(positive));
      return lower >= first && lower - first < count;
    }
  };
  /// The faces of which the cell with the lower number is an own one.
  ComplexPiece run(const Shares& shares);

 private:
  struct Face {
    std::uint32_t owner, neighbour;  // the outside is the last of all
    geometry::HyperplaneId plane;
    std::uint32_t begin, count;
    bool is_reversed;  // the owner is on the positive side
  };
  /// An edge of a face, seen from its lower end.
  struct Use {
    std::uint32_t high;
    std::uint32_t corner;  // among those of all faces, one face after the other
    std::uint32_t face;
    friend bool operator<(const Use& a, const Use& b) {
      return std::pair(a.high, a.corner) < std::pair(b.high, b.corner);
    }
  };
  static constexpr std::uint32_t none = ~0U;
  static constexpr std::uint8_t used = 1, shared = 2;  // points of a piece

  const geometry::HyperplaneTable<3>& table_;
  const unsigned threads_;
  geometry::ExactPoints exact_;
  PointRegister points_;
  FacetLoader loader_;
  CellFacets facets_;
  std::vector<std::uint32_t> place_;  // of each cell in the complex
  std::vector<PlanePiece> pieces_;
  std::vector<Face> faces_;
  std::vector<std::uint32_t> segment_of_;  // of each edge of the faces, one face after the other
  std::vector<geometry::EdgeSplitter::Segment> segments_;
  std::vector<std::uint32_t> first_inner_, inner_;  // by segment: points on it, from the lower end on
  Complex complex_;

  void renumber(const std::vector<std::uint32_t>& map);
  void make_pieces();
  void order_cells();
  void lay_over();
  void put_together(std::vector<PlaneOverlay::Result>& results);
  [[nodiscard]] std::span<const PolygonCorner> polygon(const Face& face) const;
  [[nodiscard]] std::size_t first_corner(const Face& face) const;
  void order_faces();
  void find_sides();
  void add_side(std::uint32_t low, std::span<const Use> uses);
  void divide_sides();
  void divide_faces();
  template <typename Add>
  void write_faces(const Add& add);
  void reserve();
  void add_face(const Face& face, std::vector<std::uint32_t>& cycle);
  void write_cells(const Shares& shares, std::vector<std::uint8_t>& use, ComplexPiece& piece) const;
  void write_points(const std::vector<std::uint8_t>& use, ComplexPiece& piece) const;
  void drop_unused_points();
};

}  // namespace bsp2::meshing
