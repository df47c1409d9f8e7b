#pragma once

#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"

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

}  // namespace bsp2::io
