#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bsp2/error.hpp"

/// Solids as expressions, evaluated to convex cells: the one header of whoever uses the library. Manual:
/// docs/api.md; what the nodes mean: docs/model.md and docs/expressions.md.
///
/// Threads: an Expression may be used by any number of threads, also at once. A Result is one thread's at a
/// time. Any number of evaluations may run at once, each with a Result of its own. With more than one rank
/// (Ranks) all calls are of the main thread, and those marked collective are made by all ranks in the same
/// order.
///
/// Errors: all that is thrown is a bsp2::Error, or std::bad_alloc.
///
/// Versions: semantic. Until 1.0 a new minor version may change what is declared here.
namespace bsp2 {

/// "major.minor.patch" of the library that is loaded.
BSP2_API std::string version();

// --- Expressions ---

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

// --- Evaluation ---

/// The processes that evaluate together. See docs/api.md, "Ranks".
class BSP2_API Ranks {
 public:
  /// This process alone. MPI is not touched.
  Ranks();
  /// All processes that a launcher (mpirun, srun) started with this one; alone, if there is none. MPI is
  /// started, if nobody has done that yet, and ended when the process exits.
  static Ranks launched();
  [[nodiscard]] int rank() const;
  [[nodiscard]] int count() const;
  [[nodiscard]] bool is_master() const { return rank() == 0; }

  class Implementation;
  [[nodiscard]] const std::shared_ptr<Implementation>& implementation() const { return implementation_; }

 private:
  explicit Ranks(std::shared_ptr<Implementation> implementation);
  std::shared_ptr<Implementation> implementation_;
};

/// What is known of the points of a cell.
namespace label {
inline constexpr std::uint8_t out = 0, in = 1, fuzzy = 2;
}

/// How far an evaluation is.
struct Progress {
  std::string superstep;    ///< "compilation", "computation", ...
  double done = 0;          ///< share of the computation, in [0, 1]
  std::uint64_t cells = 0;  ///< so far
};

enum class Order : std::uint8_t { depth, priority };

/// What to find, and how far to go. As the options of `bsp2 run` of the same name; the same on all ranks.
struct Options {
  unsigned threads = 0;             ///< of each rank; 0: one a core
  std::optional<unsigned> regions;  ///< rounded up to a power of two; none: by the model
  std::optional<unsigned> level;    ///< stop after so many cuts in a row; the rest stays FUZZY
  std::optional<double> tolerance;  ///< round solids are refined until FUZZY cells are thinner
  /// x, y, z and a length, of which the nearest counts, in space: the tolerance is that of edges as long as
  /// `size` (none: as the largest length), and less by the square of what is shorter here, so what is round
  /// gets facets that are shorter in the same measure.
  std::vector<std::array<double, 4>> size_field;
  std::optional<double> size;
  std::optional<double> angle;         ///< or are seen thinner from `eye`, in degrees
  std::vector<double> eye;             ///< D numbers
  Order order = Order::depth;          ///< what is refined first
  std::optional<double> budget;        ///< seconds for the computation; the rest stays FUZZY
  std::optional<std::uint64_t> cells;  ///< end at about so many, FUZZY ones counted
  std::optional<unsigned> steps;       ///< end after so many computations as long as `budget`; 0: at once
  bool curved = false;                 ///< spheres, cylinders and circles are truly round
  double coincidence = 1e-9;           ///< hyperplanes closer than this share of the model are one
  bool parts_by_colour = false;        ///< each colour is a part; else each `part` node
  bool keep_in = true, keep_fuzzy = true, keep_out = false;  ///< which cells are held
  bool strict = false;                                       ///< a warning is an error
  bool measures_only = false;                                ///< no cells are held: only figures
  bool surface = false;  ///< the surface is found with the cells: with several ranks it cannot
                         ///< be found later
  /// Only the surface and figures are wanted of a solid of space: where it can be found without cells, none
  /// are made.
  bool surface_only = false;
  bool faces = false;     ///< its faces, too, which files for CAD programs hold; likewise
  bool contacts = false;  ///< which cells touch; likewise
  std::optional<std::filesystem::path> snapshot;  ///< written at the end, or whenever a budget has passed
  std::optional<double> timeout;  ///< after which a silent rank ends all, in seconds; of this evaluation
  /// Told about ten times a second, on the master, by the thread that evaluates.
  std::function<void(const Progress&)> progress;
  /// Asked up to twenty times a second, on several ranks more often, by the thread that evaluates (on each
  /// rank): true ends the evaluation soon. The result is then not complete, and has no cells; a snapshot has
  /// what there is. If it comes while the surface is found, the cells are there, and the surface is not.
  std::function<bool()> stop;
};

/// Between which values a number of the solid is: equal where nothing is left FUZZY.
struct Interval {
  double least = 0, most = 0;
};

/// Integrals over a solid of dimension D. Lengths are in the model's units.
struct Measures {
  Interval volume;
  Vector centroid;              ///< D numbers, of the IN cells; empty if there are none
  std::vector<Vector> inertia;  ///< (D+1) x (D+1): integrals of x_i x_j with x_0 = 1, over the IN cells
  std::vector<Vector> inertia_least, inertia_most;  ///< of the solid; empty where nothing is FUZZY
};

/// A part of the model that has a name; its number is in the cells.
struct Part {
  std::int32_t number = 0;
  std::string name;
  std::optional<std::array<std::uint8_t, 4>> color;  ///< red, green, blue, opacity, if all of it has one
  double volume = 0;                                 ///< of its IN cells
};

/// The cells, as flat arrays: n cells with p points, f faces and v corners of faces in all.
struct Cells {
  int dimension = 3;
  std::span<const double> points;                     ///< p x D, each cell's own
  std::span<const std::uint32_t> point_offset;        ///< n + 1: cell i has points [offset[i], offset[i + 1])
  std::span<const std::uint32_t> face_offset;         ///< n + 1: likewise its faces (of dimension D - 1)
  std::span<const std::uint32_t> face_vertex_offset;  ///< f + 1: face j has these corners
  /// v: 0 is the first point of the cell. In space counter-clockwise as seen from outside; above, a set.
  std::span<const std::uint16_t> face_vertices;
  std::span<const std::uint8_t> labels;      ///< n: label::in, label::fuzzy or label::out
  std::span<const std::int32_t> primitives;  ///< n: which primitive of the source it belongs to; -1: none
  std::span<const std::int32_t> parts;       ///< n: which part; 0 where nothing has a name, -1: none
  std::span<const std::uint32_t> regions;    ///< n: which region of the partition
  std::span<const std::uint16_t> levels;     ///< n: cuts that made it
  std::span<const double> volumes;           ///< n: content of dimension D
  [[nodiscard]] std::size_t size() const { return labels.size(); }
};

/// The surface of the IN cells, watertight: triangles, counter-clockwise as seen from outside.
struct Surface {
  std::span<const double> points;            ///< 3 numbers each
  std::span<const std::uint32_t> triangles;  ///< 3 indices of points each
  std::span<const std::int32_t> parts;       ///< of each triangle: the part behind it
  double area = 0;
  bool closed = false;  ///< each edge is used equally often in both directions
  std::string digest;
  std::shared_ptr<const void> owner;  ///< of the arrays: they live as long as this
};

/// The surface as maximal plane faces, maximal straight edges and vertices, and what they bound: what
/// programs for CAD and for drawings build on. p points, e edges, f faces with l loops and u sides of faces
/// on edges, s solids with h shells, t triangles. Where parts of the solid meet, their interface is a face,
/// too. Non-manifold where it must be: any number of faces may meet in an edge, an even one where no parts
/// meet. The combinatorics are exact; numbers are rounded.
struct Brep {
  static constexpr std::int32_t outside = -2;  ///< where no part of the solid is, whatever its number

  std::vector<double> points;              ///< 3 p
  std::vector<std::uint32_t> edges;        ///< 2 e: the points at their ends
  std::vector<double> normals;             ///< 3 f: of unit length, out of the part behind the face
  std::vector<double> offsets;             ///< f: normal * x + offset = 0 on the face
  std::vector<std::int32_t> parts;         ///< 2 f: behind it, and in front: `outside`, or a part
  std::vector<std::uint32_t> loop_offset;  ///< f + 1: face i has loops [offset[i], offset[i + 1]), first the
                                           ///< outer one, then those of holes
  std::vector<std::uint32_t> use_offset;   ///< l + 1: likewise the edges of a loop, in its order
  std::vector<std::uint32_t> uses;         ///< u: an edge
  std::vector<std::uint8_t> forward;       ///< u: 1 from its first end to its second. The face is on the left
  std::vector<double> angles;              ///< u: about the edge, from this face to the next; radians
  std::vector<std::uint32_t> around_offset;  ///< e + 1: edge i has [offset[i], offset[i + 1]) of `around`
  std::vector<std::uint32_t> around;         ///< u: indices of `uses`, counter-clockwise about their edge as
                                             ///< seen from its second end
  std::vector<std::int32_t> solid_parts;     ///< s: the part that it is a connected piece of
  std::vector<double> solid_volumes;         ///< s
  std::vector<std::uint32_t> shell_offset;   ///< s + 1: first the outer shell, then those of cavities
  std::vector<double> shell_volumes;         ///< h: below 0 of a cavity
  std::vector<std::uint32_t> side_offset;    ///< h + 1: shell i has faces [offset[i], offset[i + 1])
  std::vector<std::uint32_t> sides;          ///< a face; one that is an interface is in two shells
  std::vector<std::uint8_t> is_front;        ///< likewise: 1 if the shell's part is in front of the face
  std::vector<std::uint32_t> triangles;      ///< 3 t, face by face, counter-clockwise seen against the normal
  std::vector<std::uint32_t> triangle_faces;  ///< t
  bool closed = false;                        ///< all faces about each edge agree on what is between them
};

/// Two IN cells that touch in more than an edge.
struct Contact {
  std::array<std::uint64_t, 2> cell;
  std::array<std::uint16_t, 2> face;  ///< of each cell, from 0
  double area = 0;
};

/// Where n points are: an entry a point.
struct Locations {
  std::vector<std::uint8_t> labels;             ///< of the cell that it is in
  std::vector<std::int32_t> primitives, parts;  ///< likewise; -1: none
  std::vector<double> distances;  ///< to the nearest point that has, or may have, another label; < 0 inside
  std::vector<double> nearest;    ///< n x D: such a point
};

/// How pictures look.
struct View {
  int width = 1000, height = 1000;            ///< pixels
  std::string shade = "color";                ///< or part, rank, region, label, level
  std::string edges = "none";                 ///< or feature: those of the solid, cells: of all cells
  bool legend = true;                         ///< what the colours tell, but for "color"
  bool axes = false;                          ///< where they point, and without an eye a bar for the scale
  bool transparent = false;                   ///< without a background
  std::optional<std::array<double, 3>> eye;   ///< none: a parallel projection
  std::optional<std::array<double, 3>> look;  ///< what is in the middle
  double explode = 0;  ///< regions move apart by so many times their way from the middle
};

struct WriteOptions {
  bool tets = false;  ///< a .pvtu of simplices
  /// Of a surface of triangles: without shorter edges and thinner triangles, in model units; 0: as it is;
  /// none: what the format can tell apart. See docs/formats.md.
  std::optional<double> clean;
  View view;
};

/// What a mesh for solvers is like. Lengths in model units. See docs/meshing.md.
struct SolverMeshOptions {
  std::optional<double> size;  ///< of edges; 0: the cells' own tetrahedra; none: a twentieth of the diagonal
  std::vector<std::pair<std::string, double>> part_sizes;  ///< likewise in parts, by name
  /// x, y, z and size: edges are no longer than the size at the nearest of these places; without `size` as
  /// long. Options::size_field refines what is round alike.
  std::vector<std::array<double, 4>> size_field;
  double growth = 0.6;              ///< by which share of the distance edges may grow from fine to coarse
  std::optional<double> clean;      ///< what is shorter is absorbed; none: a millionth of the smallest part
  std::vector<std::string> groups;  ///< faces by name: "NAME=WHERE", see docs/meshing.md
  bool polyhedra = false;           ///< the cells as they are instead: for files, there are no arrays of them
  bool dual = false;  ///< polyhedra about the points of the tetrahedra instead, for finite volumes: likewise
};

/// Reads a size field: rows of x, y, z and a length above 0. Of a .vtu it is the array `size` of points or
/// cells (which count where their middle is), or the only one of one number each; of a .msh the first data of
/// one number of nodes or elements; all else is a text of such rows. @throws Error if there is none.
BSP2_API std::vector<std::array<double, 4>> read_size_field(const std::filesystem::path& path);

/// A mesh of tetrahedra that meet face to face, right side out, with names of volumes and of faces.
class BSP2_API SolverMesh {
 public:
  // The arrays live as long as the mesh: p points, t tetrahedra, s triangles of the outside and of
  // interfaces.
  [[nodiscard]] std::span<const double> points() const;                ///< 3 p
  [[nodiscard]] std::span<const std::uint32_t> tetrahedra() const;     ///< 4 t: (b-a) x (c-a) points to d
  [[nodiscard]] std::span<const std::int32_t> volumes() const;         ///< t: as in volume_names()
  [[nodiscard]] std::span<const std::uint32_t> triangles() const;      ///< 3 s
  [[nodiscard]] std::span<const std::int32_t> groups() const;          ///< s: as in group_names()
  [[nodiscard]] const std::vector<std::string>& volume_names() const;  ///< of parts; else "solid"
  [[nodiscard]] const std::vector<std::string>& group_names() const;   ///< "steel|outside", ...
  [[nodiscard]] double volume() const;
  [[nodiscard]] double smallest_angle() const;  ///< dihedral, in degrees
  [[nodiscard]] double largest_angle() const;
  [[nodiscard]] const std::vector<std::string>& warnings() const;
  [[nodiscard]] const std::vector<std::string>& notes() const;  ///< what is as it should be

  /// Writes .msh, .inp, .xdmf, .vtu or, as a folder, a case of OpenFOAM. @param second_order with points in
  /// the middle of edges. @param gmsh_version 41 or 22. @throws Error if it cannot be written.
  void write(const std::filesystem::path& path, bool second_order = false, int gmsh_version = 41) const;

  class Implementation;
  explicit SolverMesh(std::shared_ptr<const Implementation> implementation)
      : implementation_(std::move(implementation)) {}

 private:
  std::shared_ptr<const Implementation> implementation_;
};

/// What an engineering drawing shows, in the words of `bsp2 draw`. See docs/drawing.md.
struct DrawingOptions {
  std::vector<std::string> views{"front", "top", "left", "iso"};  ///< also back, right, bottom
  std::vector<std::string> sections;         ///< "A=x:10": cut there, seen as usual; "A=-x:10" the other way
  std::vector<std::string> dimensions;       ///< "front:0,0,0:40,0,0": the distance of two points in a view
  std::string hidden = "dashed";             ///< edges behind faces: dashed, none, all
  std::string smooth = "none";               ///< edges between facets of what is round: none, thin
  double smooth_angle = 30;                  ///< degrees: facets that meet in less are of something round
  bool centre_lines = true, overall = true;  ///< axes of what is round, and overall dimensions
  std::string sheet = "A3";                  ///< to A0
  std::string scale = "auto";                ///< "1:2", ...; auto: the largest usual one that fits
  std::string projection = "first";          ///< or third
  std::string title = "model", author, number, material, date;  ///< no date: today
};

/// What an evaluation has found. With several ranks the master has all, the others know what is marked
/// collective, unless the cells stay where they were found (`is_collected`).
class BSP2_API Result {
 public:
  [[nodiscard]] int dimension() const;
  [[nodiscard]] bool is_complete() const;     ///< nothing is undecided but what a level leaves
  [[nodiscard]] bool is_interrupted() const;  ///< by Options::stop
  [[nodiscard]] bool is_collected() const;    ///< the master has all cells; else each rank its own
  [[nodiscard]] bool has_cells() const;       ///< they were made, and are held
  [[nodiscard]] std::string digest() const;   ///< of the set of cells; empty if none were made

  /// The arrays live as long as the result.
  [[nodiscard]] const Cells& cells() const;
  [[nodiscard]] const Measures& measures() const;
  [[nodiscard]] Interval volume() const { return measures().volume; }
  /// What the `measure` nodes found, by name.
  [[nodiscard]] std::map<std::string, Measures> named_measures() const;
  /// Corners of the bounding box of the IN cells; empty if there are none.
  [[nodiscard]] std::pair<Vector, Vector> bounds() const;
  [[nodiscard]] std::vector<Part> parts() const;

  /// The surface; found now, if it was not. Of the master. @throws Error unless the dimension is 3 and the
  /// IN cells are held.
  [[nodiscard]] Surface surface() const;
  /// Its faces, edges and solids. Likewise.
  [[nodiscard]] Brep faces() const;
  /// Likewise.
  [[nodiscard]] std::vector<Contact> contacts() const;
  /// Where points are. Of the master. @param points D numbers each. @throws Error unless IN and FUZZY cells
  /// are held.
  [[nodiscard]] Locations locate(std::span<const double> points) const;

  /// A mesh for solvers of the IN cells. Likewise. @throws Error also if no valid mesh is found.
  [[nodiscard]] SolverMesh solver_mesh(const SolverMeshOptions& options = {}) const;

  /// Writes a file in the format that its ending names: .pvtu and .vtu (the cells), .stl, .ply, .obj, .vtp
  /// and what else there is for surfaces, .png, .svg, .pdf (a picture), .json (the report), .csg (the model),
  /// .h5 (the snapshot, if Options::snapshot had one made). Collective. It is there when it is complete.
  /// @return warnings. @throws Error if it cannot be written.
  std::vector<std::string> write(const std::filesystem::path& path, const WriteOptions& options = {}) const;
  /// A picture as the bytes of a file. Collective; empty but on the master. @param format png, svg or pdf.
  [[nodiscard]] std::string picture(const std::string& format = "png", const View& view = {}) const;

  /// report.json, see docs/report.md.
  [[nodiscard]] std::string report() const;
  [[nodiscard]] std::vector<std::string> warnings() const;
  [[nodiscard]] std::vector<std::string> notes() const;  ///< what is as it should be, but may surprise

  class Implementation;
  explicit Result(std::shared_ptr<Implementation> implementation)
      : implementation_(std::move(implementation)) {}

 private:
  std::shared_ptr<Implementation> implementation_;
};

/// While one lives, what its thread asks of the library ends soon once `stop` says so: a text that is read,
/// an evaluation, a surface, contacts, a mesh for solvers. It ends with an Error, "interrupted"; nothing is
/// half done then, and it can be asked for again. Thread rule: made and gone on the thread that asks.
class BSP2_API Stoppable {
 public:
  /// @param stop asked at most twenty times a second, by the thread that made this.
  explicit Stoppable(std::function<bool()> stop);
  ~Stoppable();
  Stoppable(const Stoppable&) = delete;
  Stoppable& operator=(const Stoppable&) = delete;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Evaluates an expression. The cells depend on it and on the options, not on ranks and threads. Collective:
/// all ranks give the same expression and options.
/// @throws Error for a model that cannot be evaluated, options that make no sense, files that cannot be read.
/// After an error that arose with several ranks, nothing more can be done with them.
BSP2_API Result evaluate(const Expression& expression, const Options& options = {}, const Ranks& ranks = {});

/// Goes on from a snapshot, whoever wrote it: model, regions, coincidence, curved, parts and keep are its
/// own. Collective.
BSP2_API Result resume(const std::filesystem::path& snapshot, const Options& options = {},
                       const Ranks& ranks = {});

/// Makes an engineering drawing of a solid of space and writes it. Collective. @param files .svg, .pdf, .dxf.
/// @return what there is to say about it. @throws Error as `evaluate`, and for a drawing that makes no sense.
BSP2_API std::vector<std::string> draw(const Expression& expression,
                                       const std::vector<std::filesystem::path>& files,
                                       const DrawingOptions& drawing = {}, const Options& options = {},
                                       const Ranks& ranks = {});

// --- A queue of jobs: machines that come and go, none of which waits for another. See docs/slurm.md ---

/// One job of a queue, as its folder tells of it now.
struct Job {
  enum class State : std::uint8_t { waiting, running, lost, divided, finished };
  std::string name;  ///< "17"; what it was divided into is called "17.0" and "17.1"
  double work = 0;   ///< share of the estimated work of all
  State state = State::waiting;
  int halves = 0;               ///< of a divided one: 2, or 1 if one job goes on with what it left
  std::uint64_t cells = 0;      ///< IN cells that it found
  std::uint64_t undecided = 0;  ///< FUZZY cells that it left
  double seconds = 0;           ///< of its computation
  std::string owner;            ///< who is, or was last seen, at it: host and process
};

/// What a worker of a queue does.
struct WorkOptions {
  unsigned threads = 0;                ///< 0: one a core
  double budget = 60;                  ///< seconds after which a job is divided
  std::optional<std::uint64_t> cells;  ///< or when it has about so many
  std::optional<std::uint32_t> job;    ///< this one first, and what it is divided into
  bool until_empty = true;             ///< then all others; without `job` always
  double lease = 120;                  ///< seconds after which a job whose worker gave no sign is taken again
  std::function<bool()> stop;          ///< as Options::stop
  /// Told of each job that was evaluated here. @param is_new false: somebody else's result was there already,
  /// and is kept.
  std::function<void(const Job&, bool is_new)> done;
};

/// A model as a queue of jobs, in a folder that all machines see. Any number of processes work on one at the
/// same time; an object and its copies are one thread's at a time.
class BSP2_API JobQueue {
 public:
  /// Makes one. @param job_seconds regions share a job until it is about so much work for one thread; 0: a
  /// job a region. @param options regions, level, tolerance, coincidence, curved, parts and keep.
  /// @throws Error as `evaluate`, and if the folder is there and has something in it.
  static JobQueue split(const Expression& expression, const std::filesystem::path& folder,
                        double job_seconds = 1, const Options& options = {});
  /// Opens one. @throws Error if there is none.
  explicit JobQueue(std::filesystem::path folder);

  [[nodiscard]] const std::filesystem::path& folder() const;
  [[nodiscard]] std::size_t size() const;  ///< jobs that it was split into
  /// Each before those that it was divided into. Lost is one whose worker gave no sign for 120 s.
  [[nodiscard]] std::vector<Job> jobs() const;

  /// Claims and evaluates jobs until none is left to take.
  /// @return whether it was stopped: what was found until then is kept. @throws Error if a file cannot be
  /// read or written.
  bool work(const WorkOptions& options = {}) const;

  /// Puts all results together as a snapshot, with which `resume` has the cells of `evaluate`. @param partial
  /// what is missing is FUZZY there (with Options::steps = 0 it stays so).
  /// @throws Error that names the jobs that are missing, unless `partial`.
  void join(const std::filesystem::path& snapshot, bool partial = false) const;

  class Implementation;

 private:
  std::shared_ptr<Implementation> implementation_;
};

// --- Tables: how a model would do on a cluster ---

/// What one node of a cluster would find and need: the regions that it gets, evaluated alone.
struct NodeFigures {
  std::uint64_t cells = 0;                   ///< IN and FUZZY
  std::uint64_t facets = 0;                  ///< of their boundary; D = 3, else 0
  std::uint64_t splits = 0, predicates = 0;  ///< cells that were cut; questions on which side a point is
  double seconds = 0;  ///< of processor for the computation, for each thread; the least of up to five times
};

/// One resolution of a model.
struct ClusterTable {
  std::optional<unsigned> level;  ///< none: to the end
  unsigned regions = 0;
  std::vector<std::vector<NodeFigures>> nodes;  ///< for each number of nodes: of each
  /// For each number of nodes: seconds of processor of what a node does to find its regions; the most of up
  /// to eight nodes.
  std::vector<double> distribution_seconds;
};

/// The measurements behind tables 1 to 6 of the paper: the nodes of a cluster are measured one after the
/// other, by this process alone.
/// @param node_counts how many nodes. @param levels resolutions, none: to the end; empty: three, above two of
/// which 5 % and 25 % of the cells lie. @param with_facets count them, which takes longer than the solid.
/// @throws Error as `evaluate`.
BSP2_API std::vector<ClusterTable> measure_tables(const Expression& expression,
                                                  const std::vector<unsigned>& node_counts = {1, 2, 4, 8, 16},
                                                  const std::vector<std::optional<unsigned>>& levels = {},
                                                  bool with_facets = true, const Options& options = {});

}  // namespace bsp2
