#include "csg_nodes.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/builder.hpp"
#include "bsp2/model/tessellation.hpp"
#include "matrix.hpp"
#include "polyhedron.hpp"

namespace bsp2::model {
namespace {

constexpr std::pair<std::string_view, NodeKind> kinds[] = {
    {"group", NodeKind::group},
    {"union", NodeKind::group},
    {"color", NodeKind::group},
    {"render", NodeKind::group},
    {"multmatrix", NodeKind::multmatrix},
    {"cube", NodeKind::cube},
    {"cylinder", NodeKind::cylinder},
    {"difference", NodeKind::difference},
    {"intersection", NodeKind::intersection},
    {"sphere", NodeKind::sphere},
    {"polyhedron", NodeKind::polyhedron},
};

constexpr std::string_view not_yet[] = {
    "square",    "circle",           "polygon",        "text",       "offset", "hull",
    "minkowski", "linear_extrude",   "rotate_extrude", "projection", "import", "surface",
    "resize",    "intersection_for", "roof",           "fill",       "echo"};

constexpr std::string_view source_words[] = {"translate", "rotate",   "scale",  "mirror", "module",
                                             "function",  "for",      "if",     "let",    "use",
                                             "include",   "children", "assert", "each"};

bool contains(std::span<const std::string_view> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string text_of(double x) {
  char buffer[32];
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, x).ptr};
}

/// A slip of one letter, or of two next to each other.
bool resembles(std::string_view a, std::string_view b) {
  if (a.size() > b.size()) std::swap(a, b);
  if (b.size() - a.size() > 1) return false;
  std::size_t i = 0;
  while (i < a.size() && a[i] == b[i]) ++i;
  if (a.size() < b.size()) return a.substr(i) == b.substr(i + 1);
  if (i + 1 < a.size() && a[i] == b[i + 1] && a[i + 1] == b[i] && a.substr(i + 2) == b.substr(i + 2))
    return true;
  return i == a.size() || a.substr(i + 1) == b.substr(i + 1);
}

/// `$fn`, `$fa`, `$fs`: what is no number counts as 0, as in OpenSCAD.
Resolution resolution_of(const Arguments& arguments) {
  Resolution resolution;
  const auto read = [&](std::string_view name, double& into) {
    if (const Value* value = arguments.find(name)) into = value->kind == Value::number ? value->as_number : 0;
  };
  read("$fn", resolution.fn);
  read("$fa", resolution.fa);
  read("$fs", resolution.fs);
  return resolution;
}

std::string sides_text(double sides, double radius, const Resolution& resolution) {
  return text_of(sides) + " sides asked for ($fn = " + text_of(resolution.fn) +
         ", $fa = " + text_of(resolution.fa) + ", $fs = " + text_of(resolution.fs) + ", radius " +
         text_of(radius) + ")";
}

std::uint32_t checked_sides(double radius, const Arguments& arguments, bool is_sphere) {
  const Resolution resolution = resolution_of(arguments);
  const double sides = side_count(radius, resolution);
  if (!(sides <= max_sides))
    throw Error(sides_text(sides, radius, resolution) + "; the limit is " + std::to_string(max_sides));
  const auto count = static_cast<std::uint32_t>(sides);
  if (is_sphere && std::uint64_t{count} * ring_count(count) > max_sphere_facets)
    throw Error(sides_text(sides, radius, resolution) + " in " + std::to_string(ring_count(count)) +
                " rings; the limit is " + std::to_string(max_sphere_facets) + " facets");
  return count;
}

double radius_of(const Arguments& arguments, std::string_view radius, std::string_view diameter, int place,
                 double missing) {
  if (const Value* value = arguments.find(diameter); value && value->kind == Value::number)
    return value->as_number / 2;
  return arguments.number(radius, place, missing);
}

std::array<double, 3> cube_size(const Value* size) {
  if (!size) return {1, 1, 1};
  if (size->kind == Value::number) return {size->as_number, size->as_number, size->as_number};
  // As OpenSCAD: a vector of two or three numbers, the third being 0 if it is missing; else the default.
  if (size->kind != Value::vector || size->size < 2 || size->size > 3 || size->span != size->size + 1)
    return {1, 1, 1};
  std::array<double, 3> result{};
  for (std::uint32_t i = 0; i < size->size; ++i) {
    if (size[i + 1].kind != Value::number) return {1, 1, 1};
    result[i] = size[i + 1].as_number;
  }
  return result;
}

bool finite(std::initializer_list<double> numbers) {
  return std::all_of(numbers.begin(), numbers.end(), [](double x) { return std::isfinite(x); });
}

Expression make_cube(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  const auto [x, y, z] = cube_size(arguments.find("size", 0));
  if (!finite({x, y, z}) || x <= 0 || y <= 0 || z <= 0) {
    if (!(x == 0 || y == 0 || z == 0))
      warn("this cube is empty: its size is [" + text_of(x) + ", " + text_of(y) + ", " + text_of(z) + "]");
    return pool.empty();
  }
  const Expression box = pool.primitive(Cuboid{{x, y, z}});
  if (!arguments.flag("center", 1)) return box;
  const double matrix[] = {1, 0, 0, -x / 2, 0, 1, 0, -y / 2, 0, 0, 1, -z / 2, 0, 0, 0, 1};
  return pool.transform(matrix, box);
}

/// The pooled version of an expression that is one primitive, or empty.
Expression adopt(const Expression& made, NodePool& pool) {
  const auto* primitive = std::get_if<Primitive>(&made.node().value);
  return primitive ? pool.primitive(*primitive) : pool.empty();
}

Expression make_sphere(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  const double radius = radius_of(arguments, "r", "d", 0, 1);
  if (!std::isfinite(radius) || radius <= 0) {
    if (radius != 0) warn("this sphere is empty: its radius is " + text_of(radius));
    return pool.empty();
  }
  return adopt(sphere(radius, checked_sides(radius, arguments, true)), pool);
}

Expression make_cylinder(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  const double height = arguments.number("h", 0, 1);
  const double both = radius_of(arguments, "r", "d", -1, 1);
  const double bottom = radius_of(arguments, "r1", "d1", 1, both),
               top = radius_of(arguments, "r2", "d2", 2, both);
  if (!finite({height, bottom, top}) || height <= 0 || bottom < 0 || top < 0 || (bottom == 0 && top == 0)) {
    if (height != 0 && !(bottom == 0 && top == 0))
      warn("this cylinder is empty: h = " + text_of(height) + ", r1 = " + text_of(bottom) +
           ", r2 = " + text_of(top));
    return pool.empty();
  }
  const std::uint32_t sides = checked_sides(std::max(bottom, top), arguments, false);
  return adopt(cylinder(height, bottom, top, sides, arguments.flag("center", 3)), pool);
}

/// The points of a polyhedron. @return false if one of them is no point.
bool read_points(const Value* list, std::vector<Point3>& points) {
  points.reserve(list->size);
  const Value* at = list + 1;
  for (std::uint32_t i = 0; i < list->size; at += at->span, ++i) {
    if (at->kind != Value::vector || at->size < 2 || at->size > 3 || at->span != at->size + 1) return false;
    Point3 point{};
    for (std::uint32_t k = 0; k < at->size; ++k) {
      if (at[k + 1].kind != Value::number || !std::isfinite(at[k + 1].as_number)) return false;
      point[k] = at[k + 1].as_number;
    }
    points.push_back(point);
  }
  return true;
}

void read_faces(const Value* list, FaceCycles& faces) {
  const Value* at = list + 1;
  for (std::uint32_t f = 0; f < list->size; at += at->span, ++f) {
    if (at->kind != Value::vector)
      throw Error("polyhedron: face " + std::to_string(f) + " is no vector of point indices");
    for (const Value* index = at + 1; index != at + at->span; index += index->span) {
      const double x = index->kind == Value::number ? index->as_number : -1;
      if (!(x >= 0 && x < 4294967295.0))
        throw Error("polyhedron: face " + std::to_string(f) + " holds something that is no point index");
      faces.corners.push_back(static_cast<std::uint32_t>(x));
    }
    faces.end_face();
  }
}

Expression make_polyhedron(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  const Value* points_list = arguments.find("points", 0);
  const Value* faces_list = arguments.find("faces", 1);
  if (!faces_list) faces_list = arguments.find("triangles");  // an old spelling
  const auto is_list = [](const Value* value) { return value && value->kind == Value::vector; };
  std::vector<Point3> points;
  FaceCycles faces;
  if (!is_list(points_list) || !is_list(faces_list)) {
    warn("this polyhedron is empty: it has no points or no faces");
    return pool.empty();
  }
  if (!read_points(points_list, points)) {
    warn("this polyhedron is empty: point " + std::to_string(points.size()) +
         " is not made of finite numbers");
    return pool.empty();
  }
  read_faces(faces_list, faces);
  std::optional<TriangleMesh> mesh = closed_mesh(points, faces);
  if (!mesh) {
    warn("this polyhedron is empty: its faces enclose nothing");
    return pool.empty();
  }
  return pool.primitive(std::move(*mesh));
}

}  // namespace

NodeKind node_kind(std::string_view name) {
  for (const auto& [known, kind] : kinds)
    if (known == name) return kind;
  return contains(not_yet, name) ? NodeKind::unsupported : NodeKind::unknown;
}

std::string why_not(std::string_view name, NodeKind kind) {
  const std::string quoted = "'" + std::string(name.substr(0, 60)) + "'";
  if (kind == NodeKind::unsupported) return "the node " + quoted + " is not supported yet";
  if (contains(source_words, name))
    return quoted + " is OpenSCAD source, not .csg; convert it: openscad -o model.csg model.scad";
  std::string text = "there is no node " + quoted;
  for (const auto& entry : kinds)
    if (resembles(name, entry.first)) return text + "; did you mean '" + std::string(entry.first) + "'?";
  for (const std::string_view known : not_yet)
    if (resembles(name, known))
      return text + "; did you mean '" + std::string(known) + "' (which is not supported yet)?";
  return text;
}

const Value* Arguments::find(std::string_view name, int place) const {
  const Value* positional = nullptr;
  for (std::size_t i = arguments_.size(); i-- > 0;)
    if (arguments_[i].name == name) return &tape_[arguments_[i].value];
  int position = 0;
  for (const Argument& argument : arguments_) {
    if (!argument.name.empty()) continue;
    if (position++ == place) positional = &tape_[argument.value];
  }
  return positional;
}

double Arguments::number(std::string_view name, int place, double missing) const {
  const Value* value = find(name, place);
  return value && value->kind == Value::number ? value->as_number : missing;
}

bool Arguments::flag(std::string_view name, int place) const {
  const Value* value = find(name, place);
  return value && value->kind == Value::boolean && value->as_number != 0;
}

Expression make_primitive(NodeKind kind, const Arguments& arguments, NodePool& pool, const Warn& warn) {
  switch (kind) {
    case NodeKind::cube:
      return make_cube(arguments, pool, warn);
    case NodeKind::sphere:
      return make_sphere(arguments, pool, warn);
    case NodeKind::cylinder:
      return make_cylinder(arguments, pool, warn);
    default:
      return make_polyhedron(arguments, pool, warn);
  }
}

std::vector<double> read_matrix(const Arguments& arguments, const Warn& warn) {
  std::vector<double> matrix{1, 0, 0, 0, 0, 1, 0, 0,
                             0, 0, 1, 0, 0, 0, 0, 1};  // OpenSCAD's default for what is missing
  if (const Value* rows = arguments.find("m", 0); rows && rows->kind == Value::vector) {
    const Value* row = rows + 1;
    for (std::uint32_t i = 0; i < std::min(rows->size, 4u); row += row->span, ++i) {
      if (row->kind != Value::vector) continue;
      const Value* entry = row + 1;
      for (std::uint32_t j = 0; j < std::min(row->size, 4u); entry += entry->span, ++j)
        if (entry->kind == Value::number) matrix[i * 4 + j] = entry->as_number;
    }
  }
  switch (normalize_affine(matrix)) {
    case MatrixKind::regular:
      return matrix;
    case MatrixKind::singular:
      warn("this multmatrix flattens its children to nothing (its determinant is 0)");
      break;
    case MatrixKind::not_finite:
      warn("this multmatrix removes its children: its matrix holds inf or nan");
      break;
  }
  return {};
}

}  // namespace bsp2::model
