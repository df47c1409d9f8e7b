#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/cells/certain_boxes.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// The faces of a complex that one share gives. Cells have numbers: all of the first share, then all of the
/// second one, and so on.
///
/// Shape, for p points, s of them shared, c cells and f faces:
///   points         p      rounded, in an order that all shares have (PointRegister::rank)
///   shared         s      points that other pieces may have, too, ascending
///   names          s      their names, which are the same in all pieces
///   cells          c      numbers of the share's own cells, in the order of their corners
///   part           c      as in CellBatch
///   corner_offset  c + 1  cell i has corners [corner_offset[i], corner_offset[i + 1]), ascending
///   corners
///   face_offset    f + 1  face i has face_points [face_offset[i], face_offset[i + 1])
///   face_points           a cycle, counter-clockwise seen from the positive side of the plane
///   negative       f      number of the cell on the negative side, or `outside`
///   positive       f      likewise
///   plane          f      as in Complex
struct ComplexPiece {
  static constexpr std::uint32_t outside = ~0U;
  std::vector<Point> points;
  std::vector<std::uint32_t> shared;
  std::vector<std::array<geometry::HyperplaneId, 3>> names;
  std::vector<std::uint32_t> cells;
  std::vector<std::int32_t> part;
  std::vector<std::uint32_t> corner_offset{0}, corners;
  std::vector<std::uint32_t> face_offset{0}, face_points;
  std::vector<std::uint32_t> negative, positive, plane;
};

/// Puts the pieces of a complex together, those of all shares in their order: byte for byte what
/// `conforming_complex` makes of all cells, however these are dealt out.
Complex joined(const geometry::HyperplaneTable<3>& table, const std::vector<ComplexPiece>& pieces);

/// Cells that one share tells another one of.
struct NeighbourCells {
  geometry::CellBatch cells;
  std::vector<std::uint32_t> numbers;
  std::vector<geometry::CertainBox> boxes;
};

/// What one of several who share the cells of a mesh makes of its own ones.
///
/// How a facet is divided depends on the cells that touch it, but for what it shares with nobody: where lines
/// of others divide that, the points are corners of faces that other cells have, too. So a share needs the
/// cells that touch its own ones, and those that touch these. The calls come in this order, on all shares
/// alike; what is given out for each share is handed over between two of them:
///
///     beginning -> boxes -> neighbours -> take_neighbours -> boxes_of_neighbours -> neighbours ->
///     take_neighbours -> piece
///
/// All decisions are exact; which cells are far from each other boxes tell, for certain. Thread rule: one
/// thread at a time, which others help.
class ComplexShare {
 public:
  /// @param batches of dimension 3, and of the table; kept until the end. @param threads that work.
  ComplexShare(const geometry::HyperplaneTable<3>& table,
               std::vector<std::shared_ptr<const geometry::CellBatch>> batches, unsigned share,
               unsigned shares, unsigned threads);
  ~ComplexShare();
  ComplexShare(const ComplexShare&) = delete;
  ComplexShare& operator=(const ComplexShare&) = delete;

  /// What all are told first.
  struct Beginning {
    std::uint32_t cells = 0;                          ///< IN ones
    std::vector<geometry::HyperplaneId> of_families;  ///< planes (geometry::family_planes)
  };
  [[nodiscard]] Beginning beginning() const;
  /// Where the own cells are. @param all of all shares.
  /// @throws std::length_error if there are too many cells to be numbered.
  [[nodiscard]] std::vector<geometry::CertainBox> boxes(std::span<const Beginning> all);
  /// For each share the own cells that touch its boxes, but for those that it has. @param boxes of each.
  [[nodiscard]] std::vector<NeighbourCells> neighbours(
      const std::vector<std::vector<geometry::CertainBox>>& boxes);
  void take_neighbours(NeighbourCells cells);
  /// Where the cells are that touch own ones; all of these have come now.
  [[nodiscard]] std::vector<geometry::CertainBox> boxes_of_neighbours();
  [[nodiscard]] ComplexPiece piece();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bsp2::meshing
