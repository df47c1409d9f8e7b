#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bsp2/model/expression/tessellation.hpp"

namespace bsp2::model {

/// The box [0, size_0] x ... x [0, size_{D-1}].
struct Cuboid {
  std::vector<double> size;  ///< D lengths, all > 0
  friend bool operator==(const Cuboid&, const Cuboid&) = default;
};

/// The convex solid between regular polygons ("rings") stacked along +z: prisms, cones, and OpenSCAD's
/// spheres.
///
/// Vertex j of ring i is (radius_i * cos(360 j / sides), radius_i * sin(360 j / sides), z_i), degrees. The
/// caller guarantees that the rings ascend in z and that the stack is convex. A ring of radius 0 (an apex)
/// may be the first or the last one.
struct Lathe {
  struct Ring {
    double radius, z;
    friend bool operator==(const Ring&, const Ring&) = default;
  };
  std::uint32_t sides = 3;  ///< >= 3
  std::vector<Ring> rings;  ///< >= 2
  friend bool operator==(const Lathe&, const Lathe&) = default;
};

/// The regular polygon with the corners (radius * cos(360 j / sides), radius * sin(360 j / sides)), degrees.
/// D = 2.
struct RegularPolygon {
  std::uint32_t sides = 3;  ///< >= 3
  double radius = 1;        ///< > 0
  friend bool operator==(const RegularPolygon&, const RegularPolygon&) = default;
};

/// The convex polygon with these corners, counter-clockwise; in a node of dimension 3, its prism over z in
/// [0, 1].
///
/// The pieces of one larger polygon have the same `scale`, so that they fit together exactly.
struct ConvexPolygon {
  std::vector<std::array<double, 2>> points;  ///< >= 3
  double scale = 1;  ///< a power of two >= all |coordinates|; they are taken as multiples of scale * 2^-53
  friend bool operator==(const ConvexPolygon&, const ConvexPolygon&) = default;
};

/// The solid enclosed by a closed triangle mesh: the points around which the mesh winds a non-zero number of
/// times.
///
/// Triangles are counter-clockwise seen from outside; every edge is used equally often in both directions.
/// Built by `polyhedron()`, which repairs and checks its input.
struct TriangleMesh {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  bool convex = false;  ///< known to be the intersection of its triangles' half-spaces
  friend bool operator==(const TriangleMesh&, const TriangleMesh&) = default;
};

/// A truly round solid: |(x_1 .. x_K)| <= radius times the box [0, length] of each other axis, K = D -
/// lengths.size().
///
/// A ball (K = D), a cylinder, or a cone times a box: its radius goes linearly from `bottom` to `top` along
/// the axis after the round ones.
struct Round {
  double bottom = 1, top = 1;   ///< >= 0, not both 0; equal but for cones
  std::vector<double> lengths;  ///< > 0; at most D - 2
  std::uint32_t sides = 0;  ///< of the polygons that take its place where a construct needs corners; 0: none
                            ///< can, it is enclosed
  std::uint32_t fineness = 0;  ///< of the polytopes in it and around it that enclose it there: corners of a
                               ///< circle; 0: what is usual
  [[nodiscard]] int round_axes(int dimension) const { return dimension - static_cast<int>(lengths.size()); }
  friend bool operator==(const Round&, const Round&) = default;
};

/// A truly round torus around z: the points within `minor` of the circle of radius `major` in z = 0. D = 3.
struct Torus {
  double major = 2, minor = 1;  ///< > 0; minor <= major
  std::uint32_t fineness = 0;   ///< as of a Round
  [[nodiscard]] static int round_axes(int dimension) { return dimension; }
  friend bool operator==(const Torus&, const Torus&) = default;
};

/// A truly round dish that opens along +x_D, D >= 2: the points with
/// |(x_1 .. x_{D-1})|^2 <= radius^2 x_D / height and x_D <= height.
struct Paraboloid {
  double height = 1, radius = 1;  ///< > 0
  std::uint32_t fineness = 0;     ///< as of a Round
  [[nodiscard]] static int round_axes(int dimension) { return dimension; }
  [[nodiscard]] std::vector<double> numbers() const { return {height, radius}; }
  /// With x = radius t u, |u| = 1, and x_D = height t^2: least and most of a t + b t^2, 0 <= t <= 1.
  [[nodiscard]] std::array<long double, 2> range(std::span<const long double> row) const {
    long double square = 0;
    for (const long double x : row.first(row.size() - 1)) square += x * x;
    const long double a = std::sqrt(square) * static_cast<long double>(radius),
                      b = row.back() * static_cast<long double>(height);
    const long double turn = a < 2 * std::fabs(b) ? a * a / (4 * std::fabs(b)) : 0;
    return {std::min({0.0L, b - a, b > 0 ? -turn : 0.0L}), std::max({0.0L, b + a, b < 0 ? turn : 0.0L})};
  }
  friend bool operator==(const Paraboloid&, const Paraboloid&) = default;
};

/// A convex polytope of any dimension, both as the hull of its corners and as an intersection of half-spaces.
///
/// The half-spaces are what is evaluated; the corners are within rounding of theirs. Built by `convex_hull`
/// and `simplex`.
struct Polytope {
  std::vector<double> corners;  ///< D coordinates each
  std::vector<double>
      half_spaces;         ///< D + 1 numbers each: normal . x + constant <= 0 inside, the constant last
  double content = 0;      ///< its D-dimensional volume, within rounding
  bool undecided = false;  ///< only what is outside is known: cells inside stay FUZZY
  friend bool operator==(const Polytope&, const Polytope&) = default;
};

/// The image of a box of parameters under tensor-product B-splines of k parameters, k < D: a curve, a
/// surface, ... Or the image of a box of D parameters: a solid, as far as its boundary winds around it.
///
/// Where pieces of D - 1 parameters, D = 2 or 3, together have no boundary they bound a solid: the points
/// around which they wind a non-zero number of times. Otherwise the set has no inside. Built by `spline()`
/// and `bezier()`, which check their input.
struct Spline {
  struct Piece {
    std::vector<std::uint32_t> degrees;      ///< >= 1, of each parameter
    std::vector<std::vector<double>> knots;  ///< of each parameter, ascending
    std::vector<double>
        points;  ///< D coordinates and a weight > 0 each; the last parameter's are next to each other
    friend bool operator==(const Piece&, const Piece&) = default;
  };
  std::vector<Piece> pieces;  ///< of one number of parameters
  friend bool operator==(const Spline&, const Spline&) = default;
};

/// The limit of a closed mesh that is subdivided again and again, and for D = 3 the points that it winds
/// around.
struct SubdivisionSurface {
  enum class Scheme : std::uint8_t { catmull_clark, loop };
  Scheme scheme = Scheme::catmull_clark;
  std::vector<double> points;  ///< D coordinates each
  std::vector<std::vector<std::uint32_t>>
      faces;  ///< each edge in both directions, once each; triangles for `loop`
  friend bool operator==(const SubdivisionSurface&, const SubdivisionSurface&) = default;
};

/// The points x of E^D that the affine map A x + b takes into a curved solid of another space E^F: prisms
/// over it (F < D) and its sections (F > D). Of a `Round` only |(y_1 .. y_K)| <= radius counts, not where it
/// ends along its other axes.
///
/// It is only known within the box; whoever makes one has it intersected with something that lies in there,
/// if it goes on outside.
struct Preimage {
  using Solid = std::variant<Round, Torus, Spline, SubdivisionSurface>;
  Solid solid;
  int dimension = 3;                 ///< F
  std::vector<double> map;           ///< F x (D + 1), row-major: A b
  std::vector<double> lower, upper;  ///< D coordinates each
  friend bool operator==(const Preimage&, const Preimage&) = default;
};

using Primitive = std::variant<Cuboid, Lathe, TriangleMesh, RegularPolygon, ConvexPolygon, Round, Torus,
                               Polytope, Spline, SubdivisionSurface, Preimage, Paraboloid>;

/// Those that lie between polytopes in them and around them, as fine as they say.
template <typename Shape>
concept HasFineness = requires(const Shape& shape, int dimension) {
  { shape.fineness } -> std::convertible_to<std::uint32_t>;
  { shape.round_axes(dimension) } -> std::convertible_to<int>;  // of the ball that corners are taken from
};

/// Those that tell of themselves what others ask of a convex primitive.
template <typename Shape>
concept TellsOfItself = requires(const Shape& shape, std::span<const long double> row) {
  { shape.numbers() } -> std::convertible_to<std::vector<double>>;          // all that it is made of
  { shape.range(row) } -> std::convertible_to<std::array<long double, 2>>;  // least and most of row . x in it
};

/// Whether it is refined without end: all but polytopes and meshes.
bool is_curved(const Primitive& primitive);

/// The sweep of a plane solid along `direction`, z_0 > 0; its image at the fraction t is turned by -twist * t
/// degrees and scaled by 1 - (1 - scale) t.
struct LinearExtrusion {
  std::array<double, 3> direction{0, 0, 1};
  bool center = false;  ///< begins at -direction / 2 rather than at 0
  double twist = 0;     ///< degrees, clockwise seen from above
  std::array<double, 2> scale{1, 1};
  std::uint32_t slices = 0;  ///< 0: from the resolution
  Resolution resolution;
  [[nodiscard]] bool is_straight() const { return twist == 0 && scale[0] == 1 && scale[1] == 1; }
  friend bool operator==(const LinearExtrusion&, const LinearExtrusion&) = default;
};

/// The turn of a plane solid, which lies on one side of the axis x = 0, around z: (x, y) becomes radius x,
/// height y.
struct RotateExtrusion {
  double angle = 360;  ///< degrees, -360 to 360, not 0
  double start = 180;  ///< degrees from +x
  Resolution resolution;
  friend bool operator==(const RotateExtrusion&, const RotateExtrusion&) = default;
};

/// All points within `distance` of a plane solid (negative: all farther than that from its complement).
struct Offset {
  enum class Join : std::uint8_t { round, mitre, square };
  double distance = 0;
  Join join = Join::round;
  Resolution resolution;
  friend bool operator==(const Offset&, const Offset&) = default;
};

struct Hull {
  friend bool operator==(const Hull&, const Hull&) = default;
};

/// All sums of a point of one operand and one of the other.
struct MinkowskiSum {
  bool passes_over_empty = false;  ///< with an empty operand it is the other one, and not nothing
  friend bool operator==(const MinkowskiSum&, const MinkowskiSum&) = default;
};

/// The shadow of a solid on z = 0, or its section there.
struct Projection {
  bool cut = false;
  friend bool operator==(const Projection&, const Projection&) = default;
};

/// Scales about the origin so that the bounding box gets this size.
struct Resize {
  std::array<double, 3> size{};     ///< <= 0: not given
  std::array<bool, 3> automatic{};  ///< scaled like the axis with the largest given size, where not given
  friend bool operator==(const Resize&, const Resize&) = default;
};

/// A plane solid without its holes.
struct Fill {
  friend bool operator==(const Fill&, const Fill&) = default;
};

/// A plane solid under a roof whose faces rise at 45 degrees from its edges.
struct Roof {
  enum class Method : std::uint8_t {
    voronoi,  ///< as high as a point is far from the outline
    straight  ///< flat faces only: the straight skeleton
  };
  Method method = Method::voronoi;
  Resolution resolution;  ///< of the cones over reflex corners (voronoi)
  friend bool operator==(const Roof&, const Roof&) = default;
};

/// All points (x, y), x of the first operand and y of the second: of as many dimensions as both together.
struct Product {
  friend bool operator==(const Product&, const Product&) = default;
};

/// The shadow of a solid on the space of some of its axes.
struct Shadow {
  std::vector<int> axes;  ///< that are kept, from 0, in the order of the result
  friend bool operator==(const Shadow&, const Shadow&) = default;
};

/// What a solid has in the hyperplane x_axis = at, as a solid of the other axes.
struct Section {
  int axis = 0;  ///< from 0
  double at = 0;
  friend bool operator==(const Section&, const Section&) = default;
};

/// The image under x -> (A x + b) / (c . x + d), where c . x + d is above 0 in all of the solid.
struct ProjectiveMap {
  std::vector<double> matrix;  ///< (D+1) x (D+1), row-major: A b, and c d in the last row; not singular
  friend bool operator==(const ProjectiveMap&, const ProjectiveMap&) = default;
};

/// All sums of a point of the solid and one of a polyline.
struct Sweep {
  std::vector<std::vector<double>> path;  ///< two points or more, of D coordinates
  friend bool operator==(const Sweep&, const Sweep&) = default;
};

/// All sums of a point of the solid and one of a polytope in the place of a ball; or all points that are that
/// far inside.
struct Growth {
  enum class Ball : std::uint8_t {
    cube,  ///< [-distance, distance]^D: the ball of the maximum norm
    round  ///< a polytope in the ball, see `ball_polytope`
  };
  double distance = 0;  ///< below 0: shrinks
  Ball ball = Ball::cube;
  std::uint32_t sides = 0;  ///< of its circles (round)
  friend bool operator==(const Growth&, const Growth&) = default;
};

/// A solid that is made from others by other means than Booleans and maps. Which points it has is known only
/// once the operands are evaluated; compilation does that and replaces it by primitives.
using Construct = std::variant<LinearExtrusion, RotateExtrusion, Offset, Hull, MinkowskiSum, Projection,
                               Resize, Fill, Roof, Product, Shadow, Section, ProjectiveMap, Sweep, Growth>;

enum class Operation : std::uint8_t { unite, intersect, subtract, symmetric_difference, complement };

struct Node;

/// An immutable generative expression of a solid in E^D: a DAG whose nodes are shared, never changed.
///
/// A value: copying copies a pointer. Equal sub-expressions that come from one builder call or one file are
/// one node. Thread rule: any number of threads may read. Source: the paper, sections 1 and 4.1.
class Expression {
 public:
  /// The empty solid of dimension `dimension` (a union of nothing).
  explicit Expression(int dimension = 3);
  explicit Expression(std::shared_ptr<const Node> node)
      : node_(std::move(node)) {}  // shared: a DAG has many parents
  [[nodiscard]] const Node& node() const { return *node_; }
  [[nodiscard]] int dimension() const;
  /// Whether both are the same node (not whether they are the same solid).
  [[nodiscard]] bool same_node(const Expression& other) const { return node_ == other.node_; }

 private:
  friend struct Node;                 // whose destructor takes chains apart
  std::shared_ptr<const Node> node_;  // shared: a DAG has many parents
};

/// An n-ary Boolean. `subtract` is its first child without the others, `complement` has one child; a union of
/// no children is empty.
struct Boolean {
  Operation operation;
  std::vector<Expression> children;
  std::uint64_t parts =
      0;  ///< not 0: all that is in it is one part of the model, the first of so many that it stands for
};

/// The image of the child under an affine map.
struct Transform {
  std::vector<double> matrix;  ///< (D+1) x (D+1), row-major; the last row is 0 ... 0 1; not singular
  Expression child;
};

/// A construct applied to its operands: two for MinkowskiSum and Product, otherwise one.
struct Construction {
  Construct construct;
  std::vector<Expression> operands;
};

/// Red, green, blue and opacity, each in [0, 1].
using Colour = std::array<double, 4>;

/// The child, whose primitives have this colour unless a node above gives them another: the outermost one
/// counts, as in OpenSCAD. The same points.
struct Coloured {
  Colour colour;
  Expression child;
};

/// The child, with a name in the results. The same points.
struct Named {
  enum class Role : std::uint8_t {
    part,    ///< all that is in it is one part of the model, called so
    measure  ///< its volume and moments are reported, by themselves
  };
  Role role;
  std::string name;
  Expression child;
};

struct Node {
  using Value = std::variant<Primitive, Boolean, Transform, Construction, Coloured, Named>;
  int dimension;
  bool resolved;  ///< there is no Construction in it
  bool faceted;   ///< there is no round primitive in it
  /// Parts of the model in it: occurrences of primitives in the expanded tree, in source order. What a
  /// primitive or a construct of the source is made of is one part (Boolean::parts).
  std::uint64_t parts;
  Value value;
  Node(int dimension_, Value value_);
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node();  ///< releases deep chains without recursion
  /// The sub-expressions right below it.
  [[nodiscard]] std::span<const Expression> children() const;
};

inline int Expression::dimension() const { return node_->dimension; }

}  // namespace bsp2::model
