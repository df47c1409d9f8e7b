#pragma once

#include <Quantity_ColorRGBA.hxx>
#include <TopoDS_Shape.hxx>
#include <optional>
#include <string>
#include <vector>

namespace bsp2::model {

/// Solids, or faces that bound one, as Open CASCADE has them.
struct CadPart {
  std::string name;  ///< empty: none
  std::optional<Quantity_ColorRGBA> colour;
  TopoDS_Shape shape;  ///< where it lies
};

/// What is in a file for CAD programs. Lengths are millimetres, but in .brep, which has no unit.
struct CadDocument {
  std::vector<CadPart> parts;
  std::vector<std::string> warnings, notes;
};

/// Reads a file by its ending. @throws bsp2::Error if it cannot be read.
CadDocument read_cad(const std::string& path);

}  // namespace bsp2::model
