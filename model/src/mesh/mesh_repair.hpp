#pragma once

#include <cstdint>
#include <vector>

#include "mesh/mesh_closing.hpp"
#include "mesh/mesh_triangulation.hpp"

/// What can be done about faces that are no boundary of a solid.
namespace bsp2::model {

/// Drops all but one of faces that go through the same points in the same direction. @param dropped gets how
/// many, `first` the first of them.
FaceCycles without_duplicates(const FaceCycles& faces, std::size_t& dropped, std::size_t* first = nullptr);

/// Drops copies of faces, in whichever direction: of those that go through the same points one stays. Where
/// as many go in one direction as in the other and other faces meet along all of their edges, they are a wall
/// that bounds nothing and all stay: they cancel each other.
FaceCycles without_copies(const FaceCycles& faces, std::size_t& dropped);

/// Turns faces so that neighbours go through the edge between them in opposite directions, where exactly two
/// faces share it; of each connected part the smaller share is turned. @param turned gets how many.
FaceCycles consistently_wound(const FaceCycles& faces, std::size_t& turned);

/// How often the triangles wind around a point. Of an open mesh it is no integer: the share of the sphere of
/// directions that the mesh covers. Source: A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside
/// segmentation using generalized winding numbers", SIGGRAPH 2013.
double winding_number(const std::vector<Point3>& points, const std::vector<Triangle>& triangles,
                      const Point3& at);

/// Leaves out the connected parts that are no solid with a hole but a sheet: the mean of the generalized
/// winding number without the caps, over what the caps close in, is below 0.6.
/// @param own the triangles of the mesh. @param caps those that close its holes; of the parts left out they
/// are taken away, too.
/// @return the number of parts left out.
std::size_t leave_out_sheets(const std::vector<Point3>& points, std::vector<Triangle>& own,
                             std::vector<Triangle>& caps);

}  // namespace bsp2::model
