#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_closing.hpp"
#include "mesh/mesh_triangulation.hpp"

namespace bsp2::model {

/// What closes the holes of a mesh.
struct Patches {
  std::vector<Triangle> triangles;
  std::size_t holes = 0;
};

/// Closes holes: each loop of open edges, which goes through no corner twice, is cut into triangles. With the
/// faces they use every edge equally often in both directions.
///
/// A loop of few corners gets the triangles that go on from the faces around it with the least bend (the
/// integral of the angle over the edges, then the area; so an edge of the solid that a missing face had goes
/// on through the hole); a longer one is triangulated as a face; a very long one gets a cone whose apex is
/// the mean of its corners. Source: G. Barequet, M. Sharir, "Filling gaps in the boundary of a polyhedron",
/// 1995; P. Liepa, "Filling holes in meshes", 2003. Time: proportional to the open edges.
/// @param points gets the apices. @param open the open edges of `faces`.
Patches patches_of(std::vector<Point3>& points, const FaceCycles& faces, const std::vector<OpenEdge>& open);

}  // namespace bsp2::model
