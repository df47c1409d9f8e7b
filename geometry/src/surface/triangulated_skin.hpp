#pragma once

#include <cstdint>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"
#include "bsp2/geometry/surface/contact.hpp"
#include "bsp2/geometry/surface/edge_chain.hpp"
#include "bsp2/geometry/surface/exact_points.hpp"
#include "surface/face_triangulation.hpp"

namespace bsp2::geometry {

/// A skin whose edges are maximal and straight, with its triangles.
///
/// No vertex lies inside an edge, and each is one in which something happens: edges do not go straight on
/// there in all faces. Everything depends on the set of points that the solid is of, and its parts, alone.
struct TriangulatedSkin {
  PointSet points;                ///< by coordinates
  std::vector<Skin::Face> faces;  ///< one for each plane, side and part: not connected
  EdgeChain edges;                ///< by face, and by ends within it
  TriangleSurface surface;        ///< face by face
  std::vector<std::uint32_t> face_of_triangle;
  std::vector<std::uint32_t> point_of_surface;  ///< for each point of `surface`, that of `points`
};

/// Puts in the surface: numbers the points in the order in which the triangles name them.
/// @param skin its edges are those that the triangles were made of.
TriangulatedSkin with_surface(TriangulatedSkin skin, const FaceTriangles& triangles);

/// The skin's triangles, put in; the same for any number of threads. @throws std::logic_error if the skin is
/// not that of a solid.
TriangulatedSkin triangulated(const HyperplaneTable<3>& table, Skin skin, const ToldShare& told,
                              unsigned threads);

}  // namespace bsp2::geometry
