#pragma once

#include <TopoDS_Shape.hxx>
#include <array>
#include <cstdint>
#include <vector>

#include "readers/reader_main.hpp"

namespace bsp2::model {

/// Triangles in the place of faces, counter-clockwise seen from outside. Faces that share an edge have the
/// same points on it.
struct CadMesh {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::size_t faces = 0;
  std::size_t faces_lost = 0;  ///< that could not be meshed
  double deviation = 0;        ///< the largest distance of the triangles from curved faces and edges
};

/// @param shape is given triangles, as Open CASCADE keeps them.
CadMesh mesh_of(const TopoDS_Shape& shape, const ReadRequest& request);

}  // namespace bsp2::model
