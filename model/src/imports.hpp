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

/// A landscape: the heights of a text (.dat; rows are y, columns x) or the grey values of a picture (.png, 0 to 100) over
/// a grid of unit squares, four triangles each, down to 0 or to 1 below the lowest height, whichever is lower.
/// Without two rows and columns it has no faces. @throws bsp2::Error if the file cannot be read.
ImportedMesh import_surface(const std::filesystem::path& path, bool center, bool invert);

struct PlaneDrawing {
  std::vector<std::array<double, 2>> points;
  FaceCycles paths;
};

/// The paths of a DXF drawing's lines, arcs, circles, ellipses, polylines (bulges are passed over) and inserted blocks; ends within 0.001 of each other meet, open paths are
/// closed by a straight line, as in OpenSCAD.
/// @param layer only what is on this layer; empty: everything.
/// @throws bsp2::Error if the file cannot be read.
PlaneDrawing import_dxf(const std::filesystem::path& path, const std::string& layer, const Resolution& resolution);

/// The areas of an SVG drawing's paths, rectangles, circles, ellipses, polygons and lines, one drawing a shape, in millimetres
/// with y upwards. As in OpenSCAD 2021.01: a line (a path whose ends are apart, a polyline) has the width of its stroke, areas
/// have no strokes; text and <use> are passed over.
/// @throws bsp2::Error if the file cannot be read.
std::vector<PlaneDrawing> import_svg(const std::filesystem::path& path, double dpi, const Resolution& resolution);

}  // namespace bsp2::model
