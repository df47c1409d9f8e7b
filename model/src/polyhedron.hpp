#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/model/expression.hpp"
#include "mesh_closing.hpp"

namespace bsp2::model {

/// The closed triangle mesh of an OpenSCAD polyhedron (faces clockwise seen from outside), or nothing if the
/// faces bound nothing (there are none, or they are flat).
/// @throws bsp2::Error for an index without a point, a coordinate that is not finite, and open edges.
std::optional<TriangleMesh> closed_mesh(const std::vector<Point3>& points, const FaceCycles& faces);

/// The same, of faces that need not be the boundary of a solid: equal faces count once, faces wound unlike their neighbours
/// are turned, holes are capped, and sheets, which enclose nothing, are left out (generalized winding numbers decide); in this
/// order and only as far as it takes.
/// @param warn is told of each repair, and where the first open edge was.
std::optional<TriangleMesh> repaired_mesh(const std::vector<Point3>& points, const FaceCycles& faces, const std::function<void(std::string)>& warn);

}  // namespace bsp2::model
