#pragma once

#include <array>
#include <filesystem>
#include <vector>

#include "csg/csg_nodes.hpp"
#include "mesh/mesh_closing.hpp"

/// The primitives of the language, one function a node, and what they share. Errors have no position.
namespace bsp2::model {

Expression make_cube(const PrimitiveText& from);
Expression make_sphere(const PrimitiveText& from);
Expression make_cylinder(const PrimitiveText& from);
Expression make_polyhedron(const PrimitiveText& from);

Expression make_square(const PrimitiveText& from);
Expression make_circle(const PrimitiveText& from);
Expression make_polygon(const PrimitiveText& from);
Expression make_text(const PrimitiveText& from);

Expression make_import(const PrimitiveText& from);
Expression make_surface(const PrimitiveText& from);

/// The points inside an odd number of the paths.
Expression pooled_polygon(const std::vector<std::array<double, 2>>& points, const FaceCycles& paths,
                          NodePool& pool);

/// Sides of a circle of this radius. @throws bsp2::Error for more than anybody needs, in a sphere also of its
/// facets.
std::uint32_t checked_sides(double radius, const Arguments& arguments, bool is_sphere);

double radius_of(const Arguments& arguments, std::string_view radius, std::string_view diameter, int place,
                 double missing);

/// The sides of the polygons in the place of something round, where corners are needed.
std::uint32_t sides_in_place(double radius, const Arguments& arguments);

/// A polygon of so few sides is meant, not a circle.
bool is_polygon(double radius, const Arguments& arguments);

/// The points of a polyhedron, or of a polygon (`largest` = 2 numbers each). @return false if one of them is
/// no point.
bool read_points(const Value* list, std::uint32_t largest, std::vector<Point3>& points);

}  // namespace bsp2::model
