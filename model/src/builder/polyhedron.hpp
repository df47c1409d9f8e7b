#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "mesh/mesh_closing.hpp"

namespace bsp2::model {

/// The closed triangle mesh of an OpenSCAD polyhedron (faces clockwise seen from outside), or nothing if the
/// faces bound nothing (there are none, or they are flat).
/// @throws bsp2::Error for an index without a point, a coordinate that is not finite, and open edges.
std::optional<TriangleMesh> closed_mesh(const std::vector<Point3>& points, const FaceCycles& faces);

/// Faces that leave edges open, so they bound no solid.
class OpenMesh : public Error {
 public:
  using Error::Error;
};

/// What to do about holes in a mesh.
enum class Holes : std::uint8_t {
  refuse,  ///< throw OpenMesh: as OpenSCAD does with its polyhedra
  cap      ///< merge corners and close holes by caps, unless the mesh is a sheet: for meshes from files
};

/// A polyhedron of faces that need not be the boundary of a solid: equal faces count once, faces wound unlike
/// their neighbours are turned; in this order and only as far as it takes. With Holes::cap, what is open even
/// then is begun anew: corners that noise has driven apart are merged (mesh_merging.hpp), faces that are
/// there already left out, others turned, holes capped (mesh_patching.hpp), and sheets, which enclose
/// nothing, left out (generalized winding numbers decide), each as far as it helps.
///
/// With Holes::cap the faces may also be closed and still bound no solid: those that are all there several
/// times count once, and shells that are inside out are turned (mesh_shells.hpp); without it only the mesh as
/// a whole is.
/// @param warn is told of each repair, and where the first open edge was ("not closed: ...", "inside out:
/// ..."); with Holes::refuse not of a mesh that is turned as a whole, as OpenSCAD does not speak of that
/// either.
/// @throws OpenMesh "not closed: the edge from point ..." if holes are left that may not be capped.
std::optional<TriangleMesh> repaired_mesh(const std::vector<Point3>& points, const FaceCycles& faces,
                                          Holes holes, const std::function<void(std::string)>& warn);

/// The integral over what closed triangles enclose, each point as often as they wind around it,
/// counter-clockwise seen from outside.
double signed_volume(const std::vector<Point3>& points,
                     const std::vector<std::array<std::uint32_t, 3>>& triangles);

/// What has the hull of these points and is convex, for hulls and sums around it: a mesh, or a flat polytope
/// (flat.hpp).
/// @pre there is a point.
Primitive spanned(const std::vector<Point3>& points);

}  // namespace bsp2::model
