#pragma once

#include <filesystem>
#include <memory>
#include <span>

#include "bsp2/geometry/cell_batch.hpp"

namespace bsp2::io {

struct VtuOptions {
  bool tets = false;  ///< cut the cells into simplices: larger files, but faster filters in ParaView
  int rank = 0;       ///< who computed the cells, for the cell array `rank`
  std::size_t piece_cells =
      20000;  ///< at most so many cells of the mesh in a piece; bounds the memory for writing
};

/// Writes a solid mesh as a VTK unstructured grid: `NAME.pvtu` and its pieces `NAME_0.vtu`, `NAME_1.vtu`, ...
///
/// Cells are tetrahedra, wedges and hexahedra where they are exactly that, else polyhedra; polygons in 2D,
/// lines in 1D. Points with the same coordinates are one within a piece. Cell data: label, part, region,
/// rank, level, volume. All files are complete before the first of them appears under its name, the `.pvtu`
/// last.
/// @param pvtu a path that ends in `.pvtu`, in a folder that exists.
/// @param batches all of the same dimension.
/// @throws bsp2::Error if a file cannot be written, and if the dimension is above 3.
void write_vtu(const std::filesystem::path& pvtu, int dimension,
               std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
               const VtuOptions& options = {});

}  // namespace bsp2::io
