#include "csg_nodes.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <utility>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/builder.hpp"
#include "bsp2/model/tessellation.hpp"
#include "csg_any_nodes.hpp"
#include "csg_spline_nodes.hpp"
#include "imports.hpp"
#include "matrix.hpp"
#include "mesh_crossing.hpp"
#include "polygon.hpp"
#include "polyhedron.hpp"
#include "text.hpp"

namespace bsp2::model {
namespace {

/// The points inside an odd number of the paths.
Expression pooled_polygon(const std::vector<std::array<double, 2>>& points, const FaceCycles& paths, NodePool& pool) {
  PolygonPieces polygon = convex_pieces(points, paths);
  std::vector<Expression> pieces;
  for (ConvexPolygon& piece : polygon.pieces) pieces.push_back(pool.primitive(std::move(piece), 2));
  return pool.boolean(polygon.disjoint ? Operation::unite : Operation::symmetric_difference, 2, pieces, true);
}

constexpr std::pair<std::string_view, NodeKind> kinds[] = {
    {"group", NodeKind::group},
    {"union", NodeKind::group},
    {"color", NodeKind::color},
    {"render", NodeKind::group},
    {"multmatrix", NodeKind::multmatrix},
    {"cube", NodeKind::cube},
    {"cylinder", NodeKind::cylinder},
    {"difference", NodeKind::difference},
    {"intersection", NodeKind::intersection},
    {"sphere", NodeKind::sphere},
    {"polyhedron", NodeKind::polyhedron},
    {"square", NodeKind::square},
    {"circle", NodeKind::circle},
    {"polygon", NodeKind::polygon},
    {"text", NodeKind::text},
    {"import", NodeKind::import},
    {"surface", NodeKind::surface},
    {"linear_extrude", NodeKind::linear_extrude},
    {"rotate_extrude", NodeKind::rotate_extrude},
    {"roof", NodeKind::roof},
    {"hull", NodeKind::hull},
    {"minkowski", NodeKind::minkowski},
    {"offset", NodeKind::offset},
    {"projection", NodeKind::projection},
    {"resize", NodeKind::resize},
    {"fill", NodeKind::fill},
    {"intersection_for", NodeKind::intersection},
    {"echo", NodeKind::group},
    {"complement", NodeKind::complement},
    {"symmetric_difference", NodeKind::symmetric_difference},
    {"part", NodeKind::part},
    {"measure", NodeKind::measure},
    {"product", NodeKind::product},
    {"extrude", NodeKind::extrude},
    {"embed", NodeKind::embed},
    {"project", NodeKind::project},
    {"section", NodeKind::section},
    {"projective", NodeKind::projective},
    {"grow", NodeKind::grow},
    {"shrink", NodeKind::shrink},
    {"sweep", NodeKind::sweep},
    {"simplex", NodeKind::simplex},
    {"polytope", NodeKind::polytope},
    {"cuboid", NodeKind::cuboid},
    {"ball", NodeKind::ball},
    {"d_cylinder", NodeKind::d_cylinder},
    {"cone", NodeKind::cone},
    {"torus", NodeKind::torus},
    {"bezier", NodeKind::bezier},
    {"bspline", NodeKind::bspline},
    {"nurbs", NodeKind::bspline},
    {"subdivision", NodeKind::subdivision},
};

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
    return pool.empty(3);
  }
  const Expression box = pool.primitive(Cuboid{{x, y, z}}, 3);
  if (!arguments.flag("center", 1)) return box;
  return pool.transform({1, 0, 0, -x / 2, 0, 1, 0, -y / 2, 0, 0, 1, -z / 2, 0, 0, 0, 1}, box);
}

/// The sides of the polygons in the place of something round, where corners are needed.
std::uint32_t sides_in_place(double radius, const Arguments& arguments) {
  return static_cast<std::uint32_t>(std::clamp(side_count(radius, resolution_of(arguments)), 3.0, 1000.0));
}

/// A polygon of so few sides is meant, not a circle.
bool is_polygon(double radius, const Arguments& arguments) {
  const double fn = resolution_of(arguments).fn;
  return fn > 0 && side_count(radius, {.fn = fn}) <= 6;
}

Expression make_sphere(const Arguments& arguments, const CsgOptions& options, NodePool& pool, const Warn& warn) {
  const double radius = radius_of(arguments, "r", "d", 0, 1);
  if (!std::isfinite(radius) || radius <= 0) {
    if (radius != 0) warn("this sphere is empty: its radius is " + text_of(radius));
    return pool.empty(3);
  }
  if (options.curved) return pool.primitive(Round{radius, radius, {}, sides_in_place(radius, arguments)}, 3);
  return pool.adopt(sphere(radius, checked_sides(radius, arguments, true)));
}

Expression make_cylinder(const Arguments& arguments, const CsgOptions& options, NodePool& pool, const Warn& warn) {
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
    const Expression round = pool.primitive(Round{bottom, top, {height}, sides_in_place(widest, arguments)}, 3);
    if (!arguments.flag("center", 3)) return round;
    return pool.transform({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -height / 2, 0, 0, 0, 1}, round);
  }
  const std::uint32_t sides = checked_sides(widest, arguments, false);
  return pool.adopt(cylinder(height, bottom, top, sides, arguments.flag("center", 3)));
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
    return pool.empty(3);
  }
  if (!read_points(points_list, points)) {
    warn("this polyhedron is empty: point " + std::to_string(points.size()) +
         " is not made of finite numbers");
    return pool.empty(3);
  }
  read_faces(faces_list, faces);
  std::optional<TriangleMesh> mesh;
  try {
    mesh = repaired_mesh(points, faces, Holes::refuse, [&](const std::string& text) { warn("this polyhedron is " + text); });
  } catch (const OpenMesh& error) {
    throw HollowPolyhedron(std::string("this polyhedron is ") + error.what(), std::move(points), true);
  }
  if (!mesh) throw HollowPolyhedron("this polyhedron is empty: its faces enclose nothing", std::move(points), false);
  return pool.primitive(std::move(*mesh), 3);
}

Expression make_square(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  double x = 1, y = 1;
  if (const Value* size = arguments.find("size", 0)) {
    if (size->kind == Value::number) {
      x = y = size->as_number;
    } else if (size->kind == Value::vector && size->size == 2 && size->span == 3 && size[1].kind == Value::number &&
               size[2].kind == Value::number) {
      x = size[1].as_number;
      y = size[2].as_number;
    }
  }
  if (!finite({x, y}) || x <= 0 || y <= 0) {
    if (!(x == 0 || y == 0)) warn("this square is empty: its size is [" + text_of(x) + ", " + text_of(y) + "]");
    return pool.empty(2);
  }
  const Expression square = pool.primitive(Cuboid{{x, y}}, 2);
  if (!arguments.flag("center", 1)) return square;
  return pool.transform({1, 0, -x / 2, 0, 1, -y / 2, 0, 0, 1}, square);
}

Expression make_circle(const Arguments& arguments, const CsgOptions& options, NodePool& pool, const Warn& warn) {
  const double radius = radius_of(arguments, "r", "d", 0, 1);
  if (!std::isfinite(radius) || radius <= 0) {
    if (radius != 0) warn("this circle is empty: its radius is " + text_of(radius));
    return pool.empty(2);
  }
  if (options.curved && !is_polygon(radius, arguments)) return pool.primitive(Round{radius, radius, {}, sides_in_place(radius, arguments)}, 2);
  return pool.primitive(RegularPolygon{checked_sides(radius, arguments, false), radius}, 2);
}

/// The paths of a polygon; all points in their order if there are none.
void read_paths(const Value* list, std::size_t points, FaceCycles& paths, const Warn& warn) {
  if (!list || list->kind != Value::vector) {
    for (std::uint32_t i = 0; i < points; ++i) paths.corners.push_back(i);
    paths.end_face();
    return;
  }
  const Value* path = list + 1;
  for (std::uint32_t p = 0; p < list->size; path += path->span, ++p) {
    if (path->kind != Value::vector) continue;
    for (const Value* index = path + 1; index != path + path->span; index += index->span) {
      const double x = index->kind == Value::number ? index->as_number : -1;
      if (x >= 0 && x < static_cast<double>(points))
        paths.corners.push_back(static_cast<std::uint32_t>(x));
      else
        warn("path " + std::to_string(p) + " of this polygon names a point that is not there; there are " + std::to_string(points));
    }
    paths.end_face();
  }
}

Expression make_polygon(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  const Value* list = arguments.find("points", 0);
  std::vector<Point3> points;
  if (!list || list->kind != Value::vector || !read_points(list, points)) {
    warn("this polygon is empty: it has no points, or one that is not made of finite numbers");
    return pool.empty(2);
  }
  std::vector<std::array<double, 2>> plane;
  for (const Point3& point : points) plane.push_back({point[0], point[1]});
  FaceCycles paths;
  read_paths(arguments.find("paths", 1), plane.size(), paths, warn);
  return pooled_polygon(plane, paths, pool);
}

Expression make_text(const Arguments& arguments, NodePool& pool, const Warn& warn) {
  TextStyle style;
  style.size = arguments.number("size", 1, 10);
  style.spacing = arguments.number("spacing", -1, 1);
  style.font = arguments.string("font", 2, "");
  style.direction = arguments.string("direction", -1, "ltr");
  style.language = arguments.string("language", -1, "en");
  style.script = arguments.string("script", -1, "");
  style.horizontal = arguments.string("halign", -1, "left");
  style.vertical = arguments.string("valign", -1, "baseline");
  if (!finite({style.size, style.spacing})) throw Error("text: size or spacing is not finite");
  // Curves of letters are short: an eighth of the segments of a circle of the text's size.
  style.segments = static_cast<std::uint32_t>(std::max(std::floor(checked_sides(style.size, arguments, false) / 8.0) + 1, 2.0));
  std::vector<Expression> glyphs;
  for (const GlyphOutline& glyph : text_outlines(arguments.string("text", 0, ""), style, warn)) {
    FaceCycles paths;
    for (std::uint32_t i = 0, end = 0; const std::uint32_t length : glyph.path_lengths) {
      for (end = i + length; i < end; ++i) paths.corners.push_back(i);
      paths.end_face();
    }
    glyphs.push_back(pooled_polygon(glyph.points, paths, pool));
  }
  return pool.boolean(Operation::unite, 2, glyphs, true);
}

/// Two or three numbers; one number counts for all of them.
template <std::size_t N>
void read_numbers(const Value* value, std::array<double, N>& into) {
  if (!value) return;
  if (value->kind == Value::number) into.fill(value->as_number);
  if (value->kind != Value::vector) return;
  const Value* at = value + 1;
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(value->size, N); at += at->span, ++i)
    if (at->kind == Value::number || at->kind == Value::boolean) into[i] = at->as_number;
}

std::string text_of(const Point3& p) {
  std::string text = "(";
  text += text_of(p[0]) + ", " + text_of(p[1]) + ", " + text_of(p[2]);
  return text += ")";
}

std::string text_of(const MeshCrossing& crossing) {
  const auto& [a, b, c] = crossing.triangle;
  return "the edge from " + text_of(crossing.edge[0]) + " to " + text_of(crossing.edge[1]) + " goes through the triangle " + text_of(a) + ", " + text_of(b) + ", " +
         text_of(c);
}

Expression make_import(const Arguments& arguments, const std::filesystem::path& folder, NodePool& pool, const Warn& warn) {
  const std::string name = arguments.string("file", 0, "");
  if (name.empty()) throw Error("import: it names no file");
  const std::filesystem::path path = folder / name;
  std::string kind = path.extension().string();
  std::transform(kind.begin(), kind.end(), kind.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (kind == ".dxf") {
    std::array<double, 2> origin{};
    read_numbers(arguments.find("origin"), origin);
    const double scale = arguments.number("scale", -1, 1);
    PlaneDrawing drawing = import_dxf(path, arguments.string("layer", -1, ""), resolution_of(arguments));
    for (auto& point : drawing.points)
      for (int i = 0; i < 2; ++i) point[i] = (point[i] - origin[i]) * scale;
    if (drawing.paths.size() == 0) warn("this import is empty: there is no path in " + path.string());
    return pooled_polygon(drawing.points, drawing.paths, pool);
  }
  if (kind == ".svg") {
    const double dpi = arguments.number("dpi", -1, 72);
    std::vector<Expression> shapes;
    for (const PlaneDrawing& drawing : import_svg(path, dpi > 0 ? dpi : 72, resolution_of(arguments)))
      shapes.push_back(pooled_polygon(drawing.points, drawing.paths, pool));
    if (arguments.flag("center", -1)) warn("center is not supported for SVG files; the drawing stays where it is");
    return pool.boolean(Operation::unite, 2, shapes, true);
  }
  if (!is_mesh_ending(kind))
    throw Error("import: files named *" + kind + " are not read; .stl, .off, .obj, .ply, .3mf, .amf, .dxf and .svg are");
  const ImportedMesh mesh = import_mesh(path);
  std::optional<TriangleMesh> closed;
  try {
    closed = repaired_mesh(mesh.points, mesh.faces, Holes::cap, [&](const std::string& text) { warn("the mesh of " + path.string() + " is " + text); });
  } catch (const Error& error) {
    throw Error("import of " + path.string() + ": " + error.what());
  }
  if (closed) {
    if (const auto crossing = self_crossing(*closed))
      warn("the mesh of " + path.string() + " crosses itself: " + text_of(*crossing) + ". What its faces wind around counts as inside");
    return pool.primitive(std::move(*closed), 3);
  }
  warn("this import is empty: the faces of " + path.string() + " enclose nothing");
  return pool.empty(3);
}

Expression make_surface(const Arguments& arguments, const std::filesystem::path& folder, NodePool& pool, const Warn& warn) {
  const std::string name = arguments.string("file", 0, "");
  if (name.empty()) throw Error("surface: it names no file");
  const ImportedMesh mesh = import_surface(folder / name, arguments.flag("center", 1), arguments.flag("invert", 2));
  if (std::optional<TriangleMesh> closed = closed_mesh(mesh.points, mesh.faces)) return pool.primitive(std::move(*closed), 3);
  warn("this surface is empty: it takes two rows and two columns of heights");
  return pool.empty(3);
}

std::optional<Construct> read_linear_extrude(const Arguments& arguments, const Warn& warn) {
  LinearExtrusion extrusion;
  const Value* height = arguments.find("height", 0);
  if (!height) height = arguments.find("h");
  const double length = height && height->kind == Value::number ? height->as_number : 100;
  extrusion.direction = {0, 0, length};
  if (const Value* v = arguments.find("v"); v && v->kind == Value::vector) {
    std::array<double, 3> direction{};
    read_numbers(v, direction);
    const double norm = std::hypot(direction[0], direction[1], direction[2]);
    for (int i = 0; i < 3; ++i) extrusion.direction[i] = height ? direction[i] * (length / norm) : direction[i];
  }
  extrusion.center = arguments.flag("center", -1);
  extrusion.twist = arguments.number("twist", -1, 0);
  if (!std::isfinite(extrusion.twist)) extrusion.twist = 0;
  read_numbers(arguments.find("scale"), extrusion.scale);
  for (double& scale : extrusion.scale) scale = std::isfinite(scale) ? std::max(scale, 0.0) : 1;
  const double slices = arguments.number("slices", -1, 0);
  if (slices > max_sides) throw Error(text_of(slices) + " slices asked for; the limit is " + std::to_string(max_sides));
  extrusion.slices = slices >= 1 ? static_cast<std::uint32_t>(slices) : 0;
  extrusion.resolution = resolution_of(arguments);
  const auto& d = extrusion.direction;
  if (!finite({d[0], d[1], d[2]}) || d[2] <= 0) {
    if (d[2] != 0) warn("this linear_extrude is empty: its height is " + text_of(d[2]));
    return std::nullopt;
  }
  return extrusion;
}

std::optional<Construct> read_rotate_extrude(const Arguments& arguments, const Warn& warn) {
  RotateExtrusion extrusion;
  extrusion.angle = arguments.number("angle", -1, 360);
  if (!(extrusion.angle > -360 && extrusion.angle <= 360)) extrusion.angle = 360;
  extrusion.start = arguments.number("start", -1, extrusion.angle == 360 ? 180 : 0);
  if (!std::isfinite(extrusion.start)) extrusion.start = 0;
  extrusion.resolution = resolution_of(arguments);
  if (extrusion.angle != 0) return extrusion;
  warn("this rotate_extrude is empty: its angle is 0");
  return std::nullopt;
}

Construct read_offset(const Arguments& arguments) {
  Offset offset;
  offset.resolution = resolution_of(arguments);
  if (const Value* r = arguments.find("r", 0); r && r->kind == Value::number) {
    offset.distance = r->as_number;
    checked_sides(std::fabs(offset.distance), arguments, false);
  } else {
    offset.distance = arguments.number("delta", -1, 1);
    offset.join = arguments.flag("chamfer", -1) ? Offset::Join::square : Offset::Join::mitre;
  }
  if (!std::isfinite(offset.distance)) throw Error("offset: the distance is not finite");
  return offset;
}

Construct read_roof(const Arguments& arguments, const Warn& warn) {
  Roof roof;
  roof.resolution = resolution_of(arguments);
  const std::string method = arguments.string("method", 0, "voronoi");
  if (method == "straight")
    roof.method = Roof::Method::straight;
  else if (method != "voronoi")
    warn("roof has no method '" + method.substr(0, 60) + "'; voronoi is taken");
  return roof;
}

Construct read_resize(const Arguments& arguments) {
  Resize resize;
  read_numbers(arguments.find("newsize", 0), resize.size);
  std::array<double, 3> automatic{};
  read_numbers(arguments.find("auto", 1), automatic);
  if (const Value* value = arguments.find("auto", 1); value && value->kind == Value::boolean) automatic.fill(value->as_number);
  for (int i = 0; i < 3; ++i) {
    resize.automatic[i] = automatic[i] != 0;
    if (!std::isfinite(resize.size[i])) resize.size[i] = 0;
  }
  return resize;
}

}  // namespace

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

NodeKind node_kind(std::string_view name) {
  for (const auto& [known, kind] : kinds)
    if (known == name) return kind;
  return NodeKind::unknown;
}

std::string why_not(std::string_view name) {
  const std::string quoted = "'" + std::string(name.substr(0, 60)) + "'";
  if (contains(source_words, name))
    return quoted + " is OpenSCAD source, not .csg; convert it: openscad -o model.csg model.scad";
  std::string text = "there is no node " + quoted;
  for (const auto& entry : kinds)
    if (resembles(name, entry.first)) return text + "; did you mean '" + std::string(entry.first) + "'?";
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

std::string Arguments::string(std::string_view name, int place, std::string_view missing) const {
  const Value* value = find(name, place);
  if (!value || value->kind != Value::text) return std::string(missing);
  std::string text;
  for (const char *at = value->as_text, *end = at + value->size; at != end; ++at) {
    if (*at == '\\' && at + 1 != end) {
      ++at;
      text += *at == 'n' ? '\n' : *at == 't' ? '\t' : *at == 'r' ? '\r' : *at;
    } else {
      text += *at;
    }
  }
  return text;
}

bool Arguments::flag(std::string_view name, int place) const {
  const Value* value = find(name, place);
  return value && value->kind == Value::boolean && value->as_number != 0;
}

Expression make_primitive(NodeKind kind, const Arguments& arguments, const std::filesystem::path& folder, const CsgOptions& options, NodePool& pool,
                          const Warn& warn) {
  if (kind >= NodeKind::simplex) return make_any_primitive(kind, arguments, pool);
  switch (kind) {
    case NodeKind::cube:
      return make_cube(arguments, pool, warn);
    case NodeKind::sphere:
      return make_sphere(arguments, options, pool, warn);
    case NodeKind::cylinder:
      return make_cylinder(arguments, options, pool, warn);
    case NodeKind::square:
      return make_square(arguments, pool, warn);
    case NodeKind::circle:
      return make_circle(arguments, options, pool, warn);
    case NodeKind::polygon:
      return make_polygon(arguments, pool, warn);
    case NodeKind::text:
      return make_text(arguments, pool, warn);
    case NodeKind::import:
      return make_import(arguments, folder, pool, warn);
    case NodeKind::surface:
      return make_surface(arguments, folder, pool, warn);
    case NodeKind::bezier:
    case NodeKind::bspline:
    case NodeKind::subdivision:
      return make_spline_node(kind, arguments, pool);
    default:
      return make_polyhedron(arguments, pool, warn);
  }
}

std::array<double, 16> read_matrix(const Arguments& arguments) {
  std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0,
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
  return matrix;
}

std::optional<Colour> read_colour(const Arguments& arguments) {
  const Value* channels = arguments.find("c", 0);
  if (!channels || channels->kind != Value::vector || channels->size < 3 || channels->size > 4 || channels->span != channels->size + 1) return std::nullopt;
  Colour colour{0, 0, 0, arguments.number("alpha", 1, 1)};
  for (std::uint32_t i = 0; i < channels->size; ++i) {
    if (channels[i + 1].kind != Value::number) return std::nullopt;
    colour[i] = channels[i + 1].as_number;
  }
  for (double& channel : colour) {
    if (!(channel >= 0)) return std::nullopt;  // -1: OpenSCAD's word for none
    channel = std::min(channel, 1.0);
  }
  return colour;
}

std::vector<double> affine_matrix(const std::array<double, 16>& m, int dimension, const Warn& warn) {
  std::vector<double> matrix(m.begin(), m.end());
  if (!std::all_of(m.begin(), m.end(), [](double x) { return std::isfinite(x); })) return regular_matrix(std::move(matrix), warn);
  if (dimension == 2) matrix = {m[0], m[1], m[3], m[4], m[5], m[7], m[12], m[13], m[15]};
  return regular_matrix(std::move(matrix), warn);
}

std::vector<double> regular_matrix(std::vector<double> matrix, const Warn& warn) {
  const bool all_finite = std::all_of(matrix.begin(), matrix.end(), [](double x) { return std::isfinite(x); });
  switch (all_finite ? normalize_affine(matrix) : MatrixKind::not_finite) {
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

std::optional<Construct> read_construct(NodeKind kind, const Arguments& arguments, const Warn& warn) {
  switch (kind) {
    case NodeKind::hull:
      return Hull{};
    case NodeKind::minkowski:
      return MinkowskiSum{};
    case NodeKind::fill:
      return Fill{};
    case NodeKind::offset:
      return read_offset(arguments);
    case NodeKind::projection:
      return Projection{arguments.flag("cut", 0)};
    case NodeKind::resize:
      return read_resize(arguments);
    case NodeKind::linear_extrude:
      return read_linear_extrude(arguments, warn);
    case NodeKind::roof:
      return read_roof(arguments, warn);
    default:
      return read_rotate_extrude(arguments, warn);
  }
}

int operand_dimension(NodeKind kind) {
  switch (kind) {
    case NodeKind::offset:
    case NodeKind::fill:
    case NodeKind::linear_extrude:
    case NodeKind::rotate_extrude:
    case NodeKind::roof:
      return 2;
    case NodeKind::projection:
      return 3;
    default:
      return 0;
  }
}

}  // namespace bsp2::model
