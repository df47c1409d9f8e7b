#pragma once

#include <vtkSmartPointer.h>

#include <string>
#include <vector>

#include "bsp2/io/outputs/vtu.hpp"
#include "outputs/piece.hpp"

class vtkFieldData;
class vtkUnstructuredGrid;

namespace bsp2::io {

/// Does a piece hold a cell that is only a polyhedron?
bool has_polyhedra(const Piece& piece);

/// A piece as VTK knows it, with all cell arrays.
/// @param with_polyhedron write one cell as a polyhedron even if it is simpler. VTK's reader loses the
/// polyhedra of a whole `.pvtu` if one of its pieces has none.
/// @param simplices what the cells are cut into, if they are, is added.
vtkSmartPointer<vtkUnstructuredGrid> make_grid(const Piece& piece, bool with_polyhedron,
                                               const VtuOptions& options, SimplexCount& simplices);

/// As the field array `part_names`, if there are any.
void add_part_names(vtkFieldData* to, const std::vector<std::string>& part_names);

}  // namespace bsp2::io
