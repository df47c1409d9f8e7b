#pragma once

#include <optional>
#include <vector>

#include "bsp2/model/expression.hpp"
#include "mesh_closing.hpp"

namespace bsp2::model {

/// The closed triangle mesh of an OpenSCAD polyhedron (faces clockwise seen from outside), or nothing if the
/// faces bound nothing (there are none, or they are flat).
/// @throws bsp2::Error for an index without a point, a coordinate that is not finite, and open edges.
std::optional<TriangleMesh> closed_mesh(const std::vector<Point3>& points, const FaceCycles& faces);

}  // namespace bsp2::model
