#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "bsp2/model/tessellation.hpp"
#include "mesh_closing.hpp"

/// Files that a model names. All ranks read them, so all must be able to.
namespace bsp2::model {

struct ImportedMesh {
  std::vector<Point3> points;
  FaceCycles faces;  ///< clockwise seen from outside, as in a polyhedron
};

/// The meshes of a file (STL, OFF, OBJ, PLY, 3MF, AMF), with all that its scene does to them. Coordinates go through
/// single precision.
/// @throws bsp2::Error if the file cannot be read.
ImportedMesh import_mesh(const std::filesystem::path& path);

struct PlaneDrawing {
  std::vector<std::array<double, 2>> points;
  FaceCycles paths;  ///< closed
};

/// The closed paths of a DXF drawing's lines, arcs, circles and polylines; ends within 0.001 of each other meet, open paths
/// are left out, as in OpenSCAD.
/// @param layer only what is on this layer; empty: everything.
/// @throws bsp2::Error if the file cannot be read.
PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer, const Resolution& resolution);

}  // namespace bsp2::model
