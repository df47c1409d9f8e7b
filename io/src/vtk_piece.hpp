#pragma once

#include <vtkSmartPointer.h>

#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cell_batch.hpp"
#include "bsp2/io/vtu.hpp"

class vtkUnstructuredGrid;

namespace bsp2::io {

/// Consecutive cells of one batch.
struct CellRange {
  const geometry::CellBatch* batch;
  std::size_t first, last;
};

/// The cells of one piece.
using Piece = std::vector<CellRange>;

/// Divides a mesh into pieces of at most `piece_cells` cells; one empty piece if the mesh is empty.
std::vector<Piece> divide(std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
                          std::size_t piece_cells);

/// Does a piece hold a cell that is only a polyhedron?
bool has_polyhedra(const Piece& piece);

/// A piece as VTK knows it, with all cell arrays.
/// @param with_polyhedron write one cell as a polyhedron even if it is simpler. VTK's reader loses the polyhedra of a
/// whole `.pvtu` if one of its pieces has none.
vtkSmartPointer<vtkUnstructuredGrid> make_grid(const Piece& piece, bool with_polyhedron, const VtuOptions& options);

}  // namespace bsp2::io
