#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::io {

/// A cell in VTK's terms: a cell type and its points in VTK's order, as indices into the cell's own points.
/// For a polyhedron the order of the points means nothing.
struct VtkCell {
  std::uint8_t type = 0;
  std::vector<std::uint16_t> points;
};

/// Finds the most special type of a cell: tetrahedron, wedge, hexahedron or polyhedron in 3D, polygon in 2D,
/// line in 1D.
/// @param result reused from cell to cell, to allocate rarely.
void describe(const geometry::CellBatch& batch, std::size_t cell, VtkCell& result);

/// A simplex of a cell, its points in VTK's order (the last ones unused below 3D), and its volume.
struct Simplex {
  std::array<std::uint16_t, 4> points;
  double volume;
};

/// Cuts a cell (D = 2 or 3) into simplices, in 3D around the vertex that lies on the most facets. Where
/// rounding has made one of them flat or inverted, the cell is cut around another vertex, or its facets in
/// another way; what cannot be cut so is left out.
/// @return whether nothing is left out.
bool cut_into_simplices(const geometry::CellBatch& batch, std::size_t cell, std::vector<Simplex>& result);

/// Of a simplex of the cell, in degrees: the smallest angle between two faces of a tetrahedron (its dihedral
/// angle), or of a triangle.
double smallest_angle(const geometry::CellBatch& batch, std::size_t cell, const Simplex& simplex);

}  // namespace bsp2::io
