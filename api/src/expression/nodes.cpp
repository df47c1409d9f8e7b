#include <algorithm>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "expression/node.hpp"

namespace bsp2 {
namespace {

void add(Arguments& arguments, const Corners& corners) {
  arguments.insert(arguments.end(), {{"$fn", corners.fn}, {"$fa", corners.fa}, {"$fs", corners.fs}});
}

/// The dimension of points, all of one.
int dimension_of(const std::string& name, const Points& points) {
  if (points.empty()) throw Error(name + ": it has no points");
  for (const Vector& point : points)
    if (point.size() != points.front().size())
      throw Error(name + ": a point of " + counted(point.size(), "# number[s] among points of ") +
                  std::to_string(points.front().size()));
  return static_cast<int>(points.front().size());
}

void check_dimension(const std::string& name, const Points& points, int dimension) {
  if (dimension_of(name, points) != dimension)
    throw Error(name + ": points of " + counted(points.front().size(), "# number[s]; it takes ") +
                std::to_string(dimension));
}

/// Of control points in lists in lists: how many numbers the innermost ones have.
int innermost_size(const std::string& name, const Value& points) {
  const std::string& text = points.text();
  const std::size_t begin = text.find_first_not_of('[');
  if (begin == std::string::npos || begin == 0) throw Error(name + ": it has no points");
  const auto end = text.find(']', begin);
  return static_cast<int>(std::count(text.begin() + static_cast<std::ptrdiff_t>(begin),
                                     text.begin() + static_cast<std::ptrdiff_t>(end), ',')) +
         1;
}

Arguments with(Arguments arguments, const Arguments& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

void add_fineness(Arguments& arguments, unsigned fn) {
  if (fn != 0) arguments.emplace_back("$fn", fn);
}

Expression growth(const char* name, const Expression& operand, double r, const Corners& corners) {
  Arguments arguments{{"r", r}};
  add(arguments, corners);
  return Expression::node(name, arguments, {operand});
}

}  // namespace

Expression unite(const std::vector<Expression>& operands) {
  static const Expression empty;  // of no dimension in particular, as far as unions go
  std::vector<Expression> solids;
  solids.reserve(operands.size());
  for (const Expression& operand : operands)
    if (operand.root() != empty.root()) solids.push_back(operand);
  if (solids.size() == 1) return solids.front();
  return solids.empty() ? empty : Expression::node("union", {}, solids);
}
Expression intersect(const std::vector<Expression>& operands) {
  if (operands.empty()) throw Error("intersection: it has no operands");
  return Expression::node("intersection", {}, operands);
}
Expression subtract(const std::vector<Expression>& operands) {
  if (operands.empty()) throw Error("difference: it has no operands");
  return Expression::node("difference", {}, operands);
}
Expression symmetric_difference(const std::vector<Expression>& operands) {
  return operands.empty() ? Expression() : Expression::node("symmetric_difference", {}, operands);
}
Expression complement(const Expression& operand) { return Expression::node("complement", {}, {operand}); }
Expression product(const std::vector<Expression>& operands) {
  if (operands.empty()) throw Error("product: it has no operands");
  int dimension = 0;
  for (const Expression& operand : operands) dimension += operand.dimension();
  return Expression::node("product", {}, operands, dimension);
}

Expression operator+(const Expression& a, const Expression& b) { return unite({a, b}); }
Expression operator-(const Expression& a, const Expression& b) { return subtract({a, b}); }
Expression operator&(const Expression& a, const Expression& b) { return intersect({a, b}); }
Expression operator^(const Expression& a, const Expression& b) { return symmetric_difference({a, b}); }
Expression operator*(const Expression& a, const Expression& b) { return product({a, b}); }
Expression operator~(const Expression& a) { return complement(a); }

Expression cube(double size, bool center) { return cuboid({size, size, size}, center); }
Expression square(double size, bool center) { return cuboid({size, size}, center); }
Expression sphere(double r, Corners corners) {
  Arguments arguments{{"r", r}};
  add(arguments, corners);
  return Expression::node("sphere", arguments);
}
Expression cylinder(double h, double r, bool center, Corners corners) {
  return cylinder(h, r, r, center, corners);
}
Expression cylinder(double h, double r1, double r2, bool center, Corners corners) {
  Arguments arguments{{"h", h}, {"r1", r1}, {"r2", r2}, {"center", center}};
  add(arguments, corners);
  return Expression::node("cylinder", arguments);
}
Expression circle(double r, Corners corners) {
  Arguments arguments{{"r", r}};
  add(arguments, corners);
  return Expression::node("circle", arguments, {}, 2);
}
Expression polygon(const Points& points, const std::vector<std::vector<std::uint32_t>>& paths) {
  check_dimension("polygon", points, 2);
  Arguments arguments{{"points", points}};
  if (!paths.empty()) arguments.emplace_back("paths", paths);
  return Expression::node("polygon", arguments, {}, 2);
}
Expression polyhedron(const Points& points, const std::vector<std::vector<std::uint32_t>>& faces) {
  check_dimension("polyhedron", points, 3);
  return Expression::node("polyhedron", {{"points", points}, {"faces", faces}});
}
Expression mesh(std::span<const double> points, std::span<const std::uint32_t> triangles) {
  if (points.size() % 3 != 0 || triangles.size() % 3 != 0)
    throw Error("mesh: it takes 3 numbers a point, and 3 corners a triangle");
  std::vector<std::uint32_t> clockwise(triangles.begin(), triangles.end());
  for (std::size_t i = 0; i < clockwise.size(); i += 3) std::swap(clockwise[i + 1], clockwise[i + 2]);
  for (const std::uint32_t corner : clockwise)
    if (corner >= points.size() / 3)
      throw Error("mesh: a triangle names point " + std::to_string(corner) + ", and there are " +
                  std::to_string(points.size() / 3));
  return Expression::node("polyhedron",
                          {{"points", Value::rows(points, 3)}, {"faces", Value::rows(clockwise, 3)}});
}
Expression text(const std::string& text, double size, const Arguments& more, Corners corners) {
  Arguments arguments = with({{"text", text}, {"size", size}}, more);
  add(arguments, corners);
  return Expression::node("text", arguments, {}, 2);
}
Expression imported(const std::filesystem::path& path, const Arguments& more) {
  std::string ending = path.extension().string();
  for (char& c : ending)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return Expression::node("import", with({{"file", absolute_path(path).string()}}, more), {},
                          ending == ".svg" || ending == ".dxf" ? 2 : 3);
}
Expression surface(const std::filesystem::path& path, bool center, bool invert) {
  return Expression::node("surface",
                          {{"file", absolute_path(path).string()}, {"center", center}, {"invert", invert}});
}

Expression cuboid(const Vector& size, bool center) {
  return Expression::node("cuboid", {{"size", size}, {"center", center}}, {}, static_cast<int>(size.size()));
}
Expression simplex(int dimension, double size) {
  return Expression::node("simplex", {{"dimension", dimension}, {"size", size}}, {}, dimension);
}
Expression simplex(const Points& corners) {
  return Expression::node("simplex", {{"points", corners}}, {}, dimension_of("simplex", corners));
}
Expression polytope(const Points& points) {
  return Expression::node("polytope", {{"points", points}}, {}, dimension_of("polytope", points));
}
Expression polytope(std::span<const double> points, int dimension) {
  if (dimension < 1 || points.empty() || points.size() % static_cast<std::size_t>(dimension) != 0)
    throw Error("polytope: " + counted(points.size(), "# number[s] [is|are] no points of ") +
                counted(dimension, "# dimension[s]"));
  return Expression::node("polytope", {{"points", Value::rows(points, static_cast<std::size_t>(dimension))}},
                          {}, dimension);
}
Expression ball(int dimension, double r, unsigned fn) {
  Arguments arguments{{"dimension", dimension}, {"r", r}};
  add_fineness(arguments, fn);
  return Expression::node("ball", arguments, {}, dimension);
}
Expression d_cylinder(int dimension, double r, const Vector& h, bool center, unsigned fn) {
  Arguments arguments{{"dimension", dimension}, {"r", r}, {"h", h}, {"center", center}};
  add_fineness(arguments, fn);
  return Expression::node("d_cylinder", arguments, {}, dimension);
}
Expression cone(double h, double r1, double r2, bool center, unsigned fn) {
  Arguments arguments{{"h", h}, {"r1", r1}, {"r2", r2}, {"center", center}};
  add_fineness(arguments, fn);
  return Expression::node("cone", arguments);
}
Expression torus(double R, double r, unsigned fn) {
  Arguments arguments{{"R", R}, {"r", r}};
  add_fineness(arguments, fn);
  return Expression::node("torus", arguments);
}
Expression paraboloid(double h, double r, int dimension, unsigned fn) {
  Arguments arguments{{"h", h}, {"r", r}, {"dimension", dimension}};
  add_fineness(arguments, fn);
  return Expression::node("paraboloid", arguments, {}, dimension);
}

Expression bezier(const Value& points, const std::optional<Value>& weights) {
  Arguments arguments{{"points", points}};
  if (weights) arguments.emplace_back("weights", *weights);
  return Expression::node("bezier", arguments, {}, innermost_size("bezier", points));
}
Expression bspline(const Value& points, const Arguments& more) {
  return Expression::node("bspline", with({{"points", points}}, more), {}, innermost_size("bspline", points));
}
Expression subdivision(const Points& points, const std::vector<std::vector<std::uint32_t>>& faces,
                       const std::string& scheme) {
  return Expression::node("subdivision", {{"points", points}, {"faces", faces}, {"scheme", scheme}}, {},
                          dimension_of("subdivision", points));
}

Expression hull(const std::vector<Expression>& operands) { return Expression::node("hull", {}, operands); }
Expression minkowski(const std::vector<Expression>& operands) {
  return Expression::node("minkowski", {}, operands);
}
Expression fill(const Expression& plane) { return Expression::node("fill", {}, {plane}); }
Expression offset(const Expression& plane, double distance, Join join, Corners corners) {
  Arguments arguments;
  if (join == Join::round)
    arguments = {{"r", distance}};
  else
    arguments = {{"delta", distance}, {"chamfer", join == Join::chamfer}};
  add(arguments, corners);
  return Expression::node("offset", arguments, {plane});
}
Expression linear_extrude(const Expression& plane, const LinearExtrusion& how) {
  Arguments arguments{{"height", how.height}, {"center", how.center}};
  if (how.twist != 0) arguments.emplace_back("twist", how.twist);
  if (how.scale != std::array{1.0, 1.0}) arguments.emplace_back("scale", how.scale);
  if (how.slices != 0) arguments.emplace_back("slices", how.slices);
  add(arguments, how.corners);
  return Expression::node("linear_extrude", arguments, {plane}, 3);
}
Expression rotate_extrude(const Expression& plane, double degrees, Corners corners) {
  Arguments arguments{{"angle", degrees}};
  add(arguments, corners);
  return Expression::node("rotate_extrude", arguments, {plane}, 3);
}
Expression roof(const Expression& plane, bool straight, Corners corners) {
  Arguments arguments{{"method", straight ? "straight" : "voronoi"}};
  add(arguments, corners);
  return Expression::node("roof", arguments, {plane}, 3);
}
Expression projection(const Expression& solid, bool cut) {
  return Expression::node("projection", {{"cut", cut}}, {solid}, 2);
}
Expression extrude(const Expression& operand, const Vector& h, bool center) {
  return Expression::node("extrude", {{"h", h}, {"center", center}}, {operand},
                          operand.dimension() + static_cast<int>(h.size()));
}
Expression embed(const Expression& operand, int dimension, double thickness) {
  return Expression::node("embed", {{"dimension", dimension}, {"thickness", thickness}}, {operand},
                          dimension);
}
Expression project(const Expression& operand, int dimension) {
  return Expression::node("project", {{"dimension", dimension}}, {operand}, dimension);
}
Expression project(const Expression& operand, const std::vector<int>& axes) {
  return Expression::node("project", {{"axes", axes}}, {operand}, static_cast<int>(axes.size()));
}
Expression section(const Expression& operand, int axis, double at) {
  return Expression::node("section", {{"axis", axis}, {"at", at}}, {operand}, operand.dimension() - 1);
}
Expression grow(const Expression& operand, double delta) {
  return Expression::node("grow", {{"delta", delta}}, {operand});
}
Expression grow_round(const Expression& operand, double r, Corners corners) {
  return growth("grow", operand, r, corners);
}
Expression shrink(const Expression& operand, double delta) {
  return Expression::node("shrink", {{"delta", delta}}, {operand});
}
Expression shrink_round(const Expression& operand, double r, Corners corners) {
  return growth("shrink", operand, r, corners);
}
Expression sweep(const Expression& operand, const Points& path) {
  return Expression::node("sweep", {{"path", path}}, {operand});
}

}  // namespace bsp2
