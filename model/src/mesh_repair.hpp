#pragma once

#include <cstdint>
#include <vector>

#include "mesh_closing.hpp"
#include "mesh_triangulation.hpp"

/// What can be done about faces that are no boundary of a solid.
namespace bsp2::model {

/// Drops all but one of faces that go through the same points in the same direction. @param dropped gets how many, `first`
/// the first of them.
FaceCycles without_duplicates(const FaceCycles& faces, std::size_t& dropped, std::size_t* first = nullptr);

/// Turns faces so that neighbours go through the edge between them in opposite directions, where exactly two faces share
/// it; of each connected part the smaller share is turned. @param turned gets how many.
FaceCycles consistently_wound(const FaceCycles& faces, std::size_t& turned);

/// Closes holes with cones over their rims, one for each connected part of the rims, whose apex is the mean of its points: a
/// rim in a plane gets a flat cap. Every edge is then used equally often in both directions.
/// @param points gets the apices.
FaceCycles capped(std::vector<Point3>& points, const FaceCycles& faces, const std::vector<OpenEdge>& open);

/// How often the triangles wind around a point. Of an open mesh it is no integer: the share of the sphere of directions
/// that the mesh covers. Source: A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside segmentation using
/// generalized winding numbers", SIGGRAPH 2013.
double winding_number(const std::vector<Point3>& points, const std::vector<Triangle>& triangles, const Point3& at);

/// Leaves out the connected parts that are no solid with a hole but a sheet: the mean of the generalized winding number
/// without the caps, over what the caps close in, is below 0.6.
/// @param first_apex points from this one on are those of caps. @param left_out gets the number of parts left out.
std::vector<Triangle> without_sheets(const std::vector<Point3>& points, const std::vector<Triangle>& triangles, std::uint32_t first_apex,
                                     std::size_t& left_out);

}  // namespace bsp2::model
