#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bsp2/error.hpp"

/// Solids as expressions. Part of bsp2.hpp, which says what holds of all.
namespace bsp2 {

class Expression;

/// The value of an argument of a node: a number, a truth value, a text, or a list of values. Numbers keep all
/// their digits; a node refuses those that are infinite or none.
class BSP2_API Value {
 public:
  Value(double number);                                              // NOLINT: what is meant is clear
  Value(int number) : Value(double{1} * number) {}                   // NOLINT
  Value(unsigned number) : Value(double{1} * number) {}              // NOLINT
  Value(bool truth) : text_(truth ? "true" : "false") {}             // NOLINT
  Value(std::string_view text);                                      // NOLINT
  Value(const std::string& text) : Value(std::string_view(text)) {}  // NOLINT
  Value(const char* text) : Value(std::string_view(text)) {}         // NOLINT
  Value(std::initializer_list<Value> list);
  Value(std::span<const double> numbers);                                   // NOLINT
  Value(const std::vector<double>& numbers) : Value(std::span(numbers)) {}  // NOLINT
  Value(const std::vector<Value>& list);                                    // NOLINT
  template <typename Item>
  Value(const std::vector<Item>& list) : Value(std::vector<Value>(list.begin(), list.end())) {}  // NOLINT
  template <typename Item, std::size_t N>
  Value(const std::array<Item, N>& list) : Value(std::vector<Value>(list.begin(), list.end())) {}  // NOLINT
  /// A list of lists of `width` numbers: `numbers` row by row.
  static Value rows(std::span<const double> numbers, std::size_t width);
  static Value rows(std::span<const std::uint32_t> numbers, std::size_t width);

  /// As it stands in a text of the language.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  std::string text_;
  bool is_finite_ = true;
  Value() = default;
  void append(const Value& item);
  friend class Expression;
};

/// An argument of a node, by name.
using Arguments = std::vector<std::pair<std::string, Value>>;

/// A point, or lengths along the axes: as many numbers as there are dimensions.
using Vector = std::vector<double>;
using Points = std::vector<Vector>;

/// How many corners what is round has in OpenSCAD's nodes: `fn` of them; if that is 0, as many as a corner
/// each `fa` degrees makes, but none closer together than `fs`.
struct Corners {
  double fn = 0, fa = 12, fs = 2;
};

/// A solid of 1 to 6 dimensions as an expression: primitives, maps, Booleans, sums, ... It is immutable, and
/// a copy costs as much as that of a pointer. What several expressions have in common is shared.
///
/// A node that is not as it has to be is told when the expression is evaluated, with the place in the text
/// that `to_text` gives; what can be told at once (dimensions, infinite numbers) is thrown at once.
class BSP2_API Expression {
 public:
  /// The empty solid of dimension 3.
  Expression();

  /// Any node of the language: `node("grow", {{"delta", 0.5}}, {solid})`. The functions below are this with
  /// names. @param dimension that it has; none: that of the first operand.
  static Expression node(const std::string& name, const Arguments& arguments = {},
                         const std::vector<Expression>& operands = {}, std::optional<int> dimension = {});

  [[nodiscard]] int dimension() const;

  // Maps. Angles are in degrees. D is the dimension of this solid.

  /// @param by D lengths.
  [[nodiscard]] Expression translate(const Vector& by) const;
  /// In the plane around the origin, in space around z.
  [[nodiscard]] Expression rotate(double degrees) const;
  /// In space: around x, then around y, then around z.
  [[nodiscard]] Expression rotate(const std::array<double, 3>& degrees) const;
  /// In space: around an axis through the origin.
  [[nodiscard]] Expression rotate(double degrees, const std::array<double, 3>& axis) const;
  /// In any dimension: axis `from` turns towards axis `to`, which count from 1.
  [[nodiscard]] Expression rotate_plane(double degrees, int from, int to) const;
  [[nodiscard]] Expression scale(double factor) const;
  [[nodiscard]] Expression scale(const Vector& factors) const;
  /// At the hyperplane through the origin with this normal of D numbers.
  [[nodiscard]] Expression mirror(const Vector& normal) const;
  /// x becomes A x + b. @param matrix (D+1) x (D+1) row by row, [A b; 0 ... 0 1]. A 4 x 4 one may be had for
  /// D = 2, too.
  [[nodiscard]] Expression transform(std::span<const double> matrix) const;
  [[nodiscard]] Expression transform(const std::vector<Vector>& rows) const;
  /// x becomes (A x + b) / (c x + d). @param matrix (D+1) x (D+1) row by row, [A b; c d].
  [[nodiscard]] Expression projective(std::span<const double> matrix) const;
  /// OpenSCAD's: what is 0 stays, or is scaled along where `automatic` says.
  [[nodiscard]] Expression resize(const std::array<double, 3>& size,
                                  const std::array<bool, 3>& automatic = {}) const;

  // Names and colours: the same points.

  [[nodiscard]] Expression part(const std::string& name) const;
  [[nodiscard]] Expression measure(const std::string& name) const;
  /// @param name as CSS has them, or #rrggbb.
  [[nodiscard]] Expression color(const std::string& name, double alpha = 1) const;
  /// Each in [0, 1].
  [[nodiscard]] Expression color(double red, double green, double blue, double opacity = 1) const;

  /// The expression in the language of .csg files, with all digits: it means the same wherever it stands,
  /// since files are named by absolute paths. What is shared here is written as often as it occurs. @throws
  /// Error if that is more than a text can be (4 GB).
  [[nodiscard]] std::string to_text() const;
  /// How long that text is at most, in bytes; it may be more than could be written.
  [[nodiscard]] std::uint64_t text_bytes() const;

  class Node;
  /// For the library.
  explicit Expression(std::shared_ptr<const Node> made) : node_(std::move(made)) {}
  [[nodiscard]] const std::shared_ptr<const Node>& root() const { return node_; }

 private:
  std::shared_ptr<const Node> node_;
  static Expression made(std::string name, std::string arguments, const Expression* operands,
                         std::size_t count, int dimension);
};

/// What a file holds: a model (.csg; .scad, which the program openscad translates), a mesh (.stl, .off, .obj,
/// .ply, .3mf, .amf, .glb, .gltf, .vtp, .msh), the solids of a CAD program (.step, .iges, .brep) or a drawing
/// (.dxf, .svg), by its ending. The text of a model is read now; all else when it is evaluated, by each rank.
/// @throws Error if it cannot be read, or is no model.
BSP2_API Expression load(const std::filesystem::path& path);

/// A model in the language of .csg files. @param name that it has in messages; what it names by relative
/// paths is found from the folder of that.
/// @throws Error "name:line:column: ..." if it is none.
BSP2_API Expression parse(std::string_view text, const std::string& name = "model");

// Booleans. All operands have one dimension, but those of a product.

BSP2_API Expression unite(const std::vector<Expression>& operands);
BSP2_API Expression intersect(const std::vector<Expression>& operands);
/// The first without all others.
BSP2_API Expression subtract(const std::vector<Expression>& operands);
/// What is in an odd number of them.
BSP2_API Expression symmetric_difference(const std::vector<Expression>& operands);
BSP2_API Expression complement(const Expression& operand);
/// All (x_1, x_2, ...) with x_i in operand i.
BSP2_API Expression product(const std::vector<Expression>& operands);

BSP2_API Expression operator+(const Expression& a, const Expression& b);  ///< union
BSP2_API Expression operator-(const Expression& a, const Expression& b);  ///< difference
BSP2_API Expression operator&(const Expression& a, const Expression& b);  ///< intersection
BSP2_API Expression operator^(const Expression& a, const Expression& b);  ///< symmetric difference
BSP2_API Expression operator*(const Expression& a, const Expression& b);  ///< product
BSP2_API Expression operator~(const Expression& a);                       ///< complement
inline Expression& operator+=(Expression& a, const Expression& b) { return a = a + b; }
inline Expression& operator-=(Expression& a, const Expression& b) { return a = a - b; }
inline Expression& operator&=(Expression& a, const Expression& b) { return a = a & b; }
inline Expression& operator^=(Expression& a, const Expression& b) { return a = a ^ b; }

// Primitives of the plane and of space, as OpenSCAD has them: polyhedra, unless Options::curved.

BSP2_API Expression cube(double size = 1, bool center = false);
BSP2_API Expression square(double size = 1, bool center = false);
BSP2_API Expression sphere(double r = 1, Corners corners = {});
BSP2_API Expression cylinder(double h, double r, bool center = false, Corners corners = {});
/// A frustum; a radius of 0 is an apex.
BSP2_API Expression cylinder(double h, double r1, double r2, bool center = false, Corners corners = {});
BSP2_API Expression circle(double r = 1, Corners corners = {});
/// What is inside of an odd number of the paths, which name points from 0; none: one through all points.
BSP2_API Expression polygon(const Points& points, const std::vector<std::vector<std::uint32_t>>& paths = {});
/// @param faces corners of each, clockwise as seen from outside, from 0.
BSP2_API Expression polyhedron(const Points& points, const std::vector<std::vector<std::uint32_t>>& faces);
/// What a triangle mesh bounds. @param points 3 numbers each. @param triangles 3 indices each, counter-
/// clockwise as seen from outside, as nearly all programs but OpenSCAD have them.
BSP2_API Expression mesh(std::span<const double> points, std::span<const std::uint32_t> triangles);
/// @param more of OpenSCAD's arguments: font, halign, valign, spacing, direction, language, script.
BSP2_API Expression text(const std::string& text, double size = 10, const Arguments& more = {},
                         Corners corners = {});
/// A mesh or a drawing of a file; the path is taken from the current folder. @param more layer, origin,
/// scale, dpi, id, center.
BSP2_API Expression imported(const std::filesystem::path& path, const Arguments& more = {});
/// Heights of a picture or of a table.
BSP2_API Expression surface(const std::filesystem::path& path, bool center = false, bool invert = false);

// Primitives of any dimension, truly round.

/// The box [0, size], or around 0. D = size.size().
BSP2_API Expression cuboid(const Vector& size, bool center = false);
/// All x with x_i >= 0 and x_1 + ... + x_D <= size.
BSP2_API Expression simplex(int dimension = 3, double size = 1);
BSP2_API Expression simplex(const Points& corners);
/// The convex hull of points.
BSP2_API Expression polytope(const Points& points);
/// @param points `dimension` numbers each.
BSP2_API Expression polytope(std::span<const double> points, int dimension);
/// @param fn corners of the polytopes that enclose it in sums, hulls and the like; 0: the usual number. So of
/// all that is round.
BSP2_API Expression ball(int dimension = 3, double r = 1, unsigned fn = 0);
/// A ball times the box [0, h], or around 0.
BSP2_API Expression d_cylinder(int dimension, double r, const Vector& h, bool center = false,
                               unsigned fn = 0);
BSP2_API Expression cone(double h = 1, double r1 = 1, double r2 = 0, bool center = false, unsigned fn = 0);
/// Around z. @param R of the circle, r around it.
BSP2_API Expression torus(double R = 2, double r = 1, unsigned fn = 0);
/// The truly round dish of the points whose distance to the last axis is at most r sqrt(z / h), 0 <= z <= h.
BSP2_API Expression paraboloid(double h = 1, double r = 1, int dimension = 3, unsigned fn = 0);

// Splines: control points in lists in lists, for as many parameters as there are levels above the points.

BSP2_API Expression bezier(const Value& points, const std::optional<Value>& weights = {});
/// @param more degree, knots, weights, closed.
BSP2_API Expression bspline(const Value& points, const Arguments& more = {});
/// @param scheme catmull-clark or loop.
BSP2_API Expression subdivision(const Points& points, const std::vector<std::vector<std::uint32_t>>& faces,
                                const std::string& scheme = "catmull-clark");

// Constructs. Several operands are united first, but for `minkowski`.

BSP2_API Expression hull(const std::vector<Expression>& operands);
BSP2_API Expression minkowski(const std::vector<Expression>& operands);
/// The polygons without their holes.
BSP2_API Expression fill(const Expression& plane);
enum class Join : std::uint8_t { round, mitre, chamfer };
BSP2_API Expression offset(const Expression& plane, double distance, Join join = Join::round,
                           Corners corners = {});
struct LinearExtrusion {
  double height = 100;
  bool center = false;
  double twist = 0;  ///< degrees
  std::array<double, 2> scale{1, 1};
  unsigned slices = 0;  ///< 0: by the corners
  Corners corners{};
};
BSP2_API Expression linear_extrude(const Expression& plane, const LinearExtrusion& how);
inline Expression linear_extrude(const Expression& plane, double height, bool center = false) {
  return linear_extrude(plane, LinearExtrusion{.height = height, .center = center});
}
BSP2_API Expression rotate_extrude(const Expression& plane, double degrees = 360, Corners corners = {});
BSP2_API Expression roof(const Expression& plane, bool straight = false, Corners corners = {});
/// The shadow on the plane z = 0; or what is there, if `cut`.
BSP2_API Expression projection(const Expression& solid, bool cut = false);
/// The product with a box of these lengths.
BSP2_API Expression extrude(const Expression& operand, const Vector& h, bool center = false);
BSP2_API Expression embed(const Expression& operand, int dimension, double thickness);
/// The shadow on the first axes.
BSP2_API Expression project(const Expression& operand, int dimension);
/// The shadow on these axes, which count from 1.
BSP2_API Expression project(const Expression& operand, const std::vector<int>& axes);
/// What is at x_axis = at, without that axis, which counts from 1.
BSP2_API Expression section(const Expression& operand, int axis, double at = 0);
/// All points within `delta` along the axes.
BSP2_API Expression grow(const Expression& operand, double delta);
/// All points within about `r`.
BSP2_API Expression grow_round(const Expression& operand, double r, Corners corners = {});
BSP2_API Expression shrink(const Expression& operand, double delta);
BSP2_API Expression shrink_round(const Expression& operand, double r, Corners corners = {});
/// All sums of a point of the operand and one of the polyline.
BSP2_API Expression sweep(const Expression& operand, const Points& path);

}  // namespace bsp2
