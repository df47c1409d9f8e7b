#include <algorithm>
#include <cmath>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "builder/polyhedron.hpp"
#include "csg/csg_primitive_nodes.hpp"

namespace bsp2::model {
namespace {

/// As OpenSCAD: a vector of three numbers; from the first that is no number on, and where it is no such
/// vector, lengths are 1.
std::array<double, 3> cube_size(const Value* size, const Warn& warn) {
  std::array<double, 3> result{1, 1, 1};
  if (!size || size->kind == Value::undefined) return result;
  if (size->kind == Value::number) {
    result.fill(size->as_number);
    return result;
  }
  std::uint32_t i = 0;
  if (size->kind == Value::vector && size->size == 3)
    for (const Value* at = size + 1; i < 3 && at->kind == Value::number; at += at->span)
      result[i++] = at->as_number;
  if (i < 3)
    warn("the size of this cube is neither a number nor a vector of three numbers; it is taken to be [" +
         text_of(result[0]) + ", " + text_of(result[1]) + ", " + text_of(result[2]) + "]");
  return result;
}

/// The faces of a polyhedron. As OpenSCAD does it passes over what is no face, and over indices that name no
/// point; what is no number counts as 0 there.
void read_faces(const Value* list, std::size_t points, FaceCycles& faces, const Warn& warn) {
  const Value* at = list + 1;
  for (std::uint32_t f = 0; f < list->size; at += at->span, ++f) {
    if (at->kind != Value::vector) {
      warn("face " + std::to_string(f) +
           " of this polyhedron is no vector of point indices; it is passed over");
      continue;
    }
    for (const Value* index = at + 1; index != at + at->span; index += index->span) {
      if (index->kind != Value::number)
        warn("face " + std::to_string(f) +
             " of this polyhedron holds something that is no point index; it counts as 0");
      const double x = index->kind == Value::number ? std::trunc(index->as_number) : 0;
      if (x >= 0 && x < static_cast<double>(points))
        faces.corners.push_back(static_cast<std::uint32_t>(x));
      else
        warn("face " + std::to_string(f) + " of this polyhedron names point " + text_of(x) +
             ", but there are " + counted(points, "# point[s], the first being 0; it is passed over"));
    }
    faces.end_face();
  }
}

/// Those of the points that are corners of faces.
std::vector<Point3> corners_of(const std::vector<Point3>& points, const FaceCycles& faces) {
  std::vector<Point3> corners;
  corners.reserve(faces.corners.size());
  for (const std::uint32_t corner : faces.corners) corners.push_back(points[corner]);
  return corners;
}

}  // namespace

Expression make_cube(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const auto [x, y, z] = cube_size(arguments.find("size", 0), warn);
  if (!finite({x, y, z}) || x <= 0 || y <= 0 || z <= 0) {
    if (!(x == 0 || y == 0 || z == 0))
      warn("this cube is empty: its size is [" + text_of(x) + ", " + text_of(y) + ", " + text_of(z) + "]");
    return pool.empty(3);
  }
  const Expression box = pool.primitive(Cuboid{{x, y, z}}, 3);
  if (!arguments.flag("center", 1)) return box;
  return pool.transform({1, 0, 0, -x / 2, 0, 1, 0, -y / 2, 0, 0, 1, -z / 2, 0, 0, 0, 1}, box);
}

Expression make_sphere(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const double radius = radius_of(arguments, "r", "d", 0, 1);
  if (!std::isfinite(radius) || radius <= 0) {
    if (radius != 0) warn("this sphere is empty: its radius is " + text_of(radius));
    return pool.empty(3);
  }
  if (options.curved) return pool.primitive(Round{radius, radius, {}, sides_in_place(radius, arguments)}, 3);
  return pool.adopt(sphere(radius, checked_sides(radius, arguments, true)));
}

Expression make_cylinder(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const double height = arguments.number("h", 0, 1);
  const double both = radius_of(arguments, "r", "d", -1, 1);
  const double bottom = radius_of(arguments, "r1", "d1", 1, both),
               top = radius_of(arguments, "r2", "d2", 2, both);
  if (!finite({height, bottom, top}) || height <= 0 || bottom < 0 || top < 0 || (bottom == 0 && top == 0)) {
    if (height != 0 && !(bottom == 0 && top == 0))
      warn("this cylinder is empty: h = " + text_of(height) + ", r1 = " + text_of(bottom) +
           ", r2 = " + text_of(top));
    return pool.empty(3);
  }
  const double widest = std::max(bottom, top);
  if (options.curved && !is_polygon(widest, arguments)) {
    const Expression round =
        pool.primitive(Round{bottom, top, {height}, sides_in_place(widest, arguments)}, 3);
    if (!arguments.flag("center", 3)) return round;
    return pool.transform({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -height / 2, 0, 0, 0, 1}, round);
  }
  const std::uint32_t sides = checked_sides(widest, arguments, false);
  const bool center = arguments.flag("center", 3);
  const double low = center ? -height / 2 : 0, high = center ? height / 2 : height;
  return low < high ? pool.primitive(Lathe{sides, {{bottom, low}, {top, high}}}, 3) : pool.empty(3);
}

Expression make_polyhedron(const PrimitiveText& from) {
  const auto& [node, arguments, folder, options, pool, warn, note] = from;
  const Value* points_list = arguments.find("points", 0);
  const Value* faces_list = arguments.find("faces", 1);
  if (!faces_list) faces_list = arguments.find("triangles");  // an old spelling
  const auto is_list = [](const Value* value) { return value && value->kind == Value::vector; };
  std::vector<Point3> points;
  FaceCycles faces;
  if (!is_list(points_list) || !is_list(faces_list)) {
    warn("this polyhedron is empty: it has no points or no faces");
    return pool.empty(3);
  }
  if (!read_points(points_list, 3, points)) {
    warn("this polyhedron is empty: point " + std::to_string(points.size()) +
         " is not made of finite numbers");
    return pool.empty(3);
  }
  read_faces(faces_list, points.size(), faces, warn);
  std::optional<TriangleMesh> mesh;
  try {
    mesh = repaired_mesh(points, faces, Holes::refuse,
                         [&warn = warn](const std::string& text) { warn("this polyhedron is " + text); });
  } catch (const OpenMesh& error) {
    throw HollowPolyhedron(std::string("this polyhedron is ") + error.what(), corners_of(points, faces),
                           true);
  }
  if (!mesh)
    throw HollowPolyhedron("this polyhedron is empty: its faces enclose nothing", corners_of(points, faces),
                           false);
  return pool.primitive(std::move(*mesh), 3);
}

}  // namespace bsp2::model
