#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include "bsp2/model/expression/expression.hpp"

/// The C++ builder of expressions. Every function returns a new expression and throws bsp2::Error where an
/// argument makes no sense (NaN, infinite, mixed dimensions, no operands).
namespace bsp2::model {

/// The box [0, size]; with `center`, the box [-size/2, size/2]. D = size.size(). A size <= 0 gives the empty
/// solid.
Expression cuboid(std::span<const double> size, bool center = false);
Expression cuboid(std::initializer_list<double> size, bool center = false);

/// Cylinder or cone frustum along +z from 0 to `height` (with `center`, around 0), as a prism over regular
/// polygons of `sides` corners, the first on +x. A radius of 0 is an apex. Height <= 0 or both radii 0 give
/// the empty solid.
Expression cylinder(double height, double radius_bottom, double radius_top, std::uint32_t sides,
                    bool center = false);

/// OpenSCAD's sphere: (sides + 1) / 2 rings of `sides` corners, ring i at the polar angle 180 (i + 0.5) /
/// rings.
Expression sphere(double radius, std::uint32_t sides);

/// The truly round ball of dimension `dimension` (1: an interval, 2: a disk, ...) around the origin;
/// docs/curved.md. A radius
/// <= 0 gives the empty solid. @throws bsp2::Error for a dimension outside 1 .. 6.
/// @param fineness corners of the circles of the polytopes that enclose it in sums, hulls and the like, 3 or
/// more; 0: the usual ones.
Expression ball(int dimension, double radius, std::uint32_t fineness = 0);

/// The ball of dimension `dimension` times the box [0, lengths]. With one length and dimension 2: the round
/// cylinder.
Expression round_cylinder(int dimension, double radius, std::span<const double> lengths,
                          std::uint32_t fineness = 0);
Expression round_cylinder(int dimension, double radius, std::initializer_list<double> lengths,
                          std::uint32_t fineness = 0);

/// The truly round cone or frustum along +z from 0 to `height`, D = 3. Empty as `cylinder` is.
Expression cone(double height, double radius_bottom, double radius_top, std::uint32_t fineness = 0);

/// The truly round torus around z: all points within `minor` of the circle of radius `major`. @throws
/// bsp2::Error where minor > major. A radius <= 0 gives the empty solid.
/// @param fineness as of `ball`.
Expression torus(double major, double minor, std::uint32_t fineness = 0);

/// The truly round dish |(x_1 .. x_{D-1})|^2 <= radius^2 x_D / height, x_D <= height, D = 2 .. 6. A length <=
/// 0 gives the empty solid.
/// @param fineness as of `ball`.
Expression paraboloid(int dimension, double height, double radius, std::uint32_t fineness = 0);

/// The tensor-product B-spline with these pieces, in E^D, D = 2 .. 6: curves, surfaces, ... of k < D
/// parameters, or solids of D parameters, which count as their boundary. Weights other than 1 make it
/// rational (NURBS).
///
/// Pieces of D - 1 parameters, D = 2 or 3, whose ends or edges fit together (within 1e-9 of their size, with
/// the same degrees and knots on both sides, in any orientation) bound a solid: the points around which they
/// wind a non-zero number of times. All else is a thin set without inside, as FUZZY cells that hold it. A
/// single point is empty.
/// @throws bsp2::Error for counts that do not fit, degrees outside of 1 .. 15, knots that descend or where
/// the map is not continuous, weights that are not positive or differ by more than 2^20.
Expression spline(int dimension, std::vector<Spline::Piece> pieces);

/// The Bezier map with these control points, as in Spline::Piece, degree + 1 along each parameter.
Expression bezier(int dimension, std::vector<std::uint32_t> degrees, std::vector<double> points);

/// Knots that reach the first and the last control point, at equal distances: 0 degree + 1 times, 1, 2, ...
std::vector<double> clamped_knots(std::uint32_t degree, std::size_t count);

/// The limit surface of a closed mesh in E^D, D = 3 .. 6, under subdivision; for D = 3, the solid inside of
/// it. Faces are cycles of point indices, all clockwise or all counter-clockwise seen from outside.
/// @throws bsp2::Error that names the edge if the mesh does not close, and for faces that are no triangles
/// with `loop`.
Expression subdivision_surface(int dimension, SubdivisionSurface surface);

/// The regular polygon of D = 2 with `sides` corners, the first on +x. Radius <= 0 gives the empty solid.
Expression circle(double radius, std::uint32_t sides);

/// The plane solid of all points inside an odd number of the paths, which are cycles of indices of `points`
/// and may touch and cross themselves and each other. No paths: one through all points.
/// @throws bsp2::Error for an index without a point and coordinates that are not finite.
Expression polygon(const std::vector<std::array<double, 2>>& points,
                   const std::vector<std::vector<std::uint32_t>>& paths = {});

/// The smallest convex solid with all these points, D = 2 or 3. Points that lie outside of it by less than
/// 2^-46 of the coordinates count as its points: that is what rounding makes of points on a common line or
/// plane. Flat sets of points give the empty solid. O(n log n).
Expression convex_hull(const std::vector<std::array<double, 2>>& points);
Expression convex_hull(const std::vector<std::array<double, 3>>& points);

/// The smallest convex solid with all these points, in any dimension: `dimension` coordinates each.
///
/// D = 2 and 3: as above. Above, the facets are Qhull's: a point may lie outside of one by a few roundings of
/// the coordinates. Flat sets of points give the empty solid. For n points the cost grows like n^(D/2).
/// @throws bsp2::Error for a dimension outside 1 .. 6, and for coordinates that are not finite or not a
/// multiple of D.
Expression convex_hull(int dimension, std::span<const double> points);

/// The convex hull of points as a set of which only the outside is known: outside it is OUT, inside it stays
/// FUZZY. What encloses a solid is the union of a polytope in it and such a one around it. Flat sets of
/// points give the empty solid.
Expression undecided_hull(int dimension, std::span<const double> points);

/// The simplex with these dimension + 1 points as corners; flat ones give the empty solid.
Expression simplex(int dimension, std::span<const double> points);
/// The simplex of all x with x_i >= 0 and x_1 + ... + x_D <= size, exactly. A size <= 0 gives the empty
/// solid.
Expression simplex(int dimension, double size = 1);

/// A polytope inscribed to the ball: the interval, the regular polygon, OpenSCAD's sphere; above three
/// dimensions the hull of the directions to the grid points of a cube, whose great circles through the axes
/// have about `sides` corners, and of those of the axes; at least 80 corners in four dimensions, 42 in five,
/// 12 in six.
/// @throws bsp2::Error for more than 20,000 corners above three dimensions.
Expression ball_polytope(int dimension, double radius, std::uint32_t sides);

/// All (x_1, x_2, ...) with x_i in operand i: the Cartesian product, of as many dimensions as all together.
/// Round solids stay round; splines and subdivision surfaces have products if they are of the plane or of
/// space.
/// @throws bsp2::Error for more than six dimensions, and for no operands.
Expression product(std::vector<Expression> operands);

/// The product with a box of `lengths`: each adds a dimension, from 0 (with `center`, around 0) upwards.
Expression extrude(Expression operand, std::span<const double> lengths, bool center = false);
Expression extrude(Expression operand, std::initializer_list<double> lengths, bool center = false);

/// The operand put on the first axes of E^dimension, as a solid of this thickness around them: |x_i| <=
/// thickness / 2 for all further axes. What has no thickness has no content and is no solid.
Expression embed(Expression operand, int dimension, double thickness);

/// The shadow on the space of the axes `kept` (from 0, each once), in their order: all points that are in the
/// operand for some value of the other coordinates. Exact for polytopes and balls; other round solids become
/// polyhedra.
Expression project(Expression operand, std::vector<int> kept);

/// What the operand has in the hyperplane x_axis = at, as a solid of the other axes.
Expression section(Expression operand, int axis, double at);

/// The image under x -> (A x + b) / (c . x + d). @param matrix (D+1) x (D+1) row-major, [A b; c d].
/// The solid has to be where c . x + d > 0: compilation throws bsp2::Error where the plane at infinity meets
/// it.
Expression projective(std::span<const double> matrix, Expression operand);

/// All sums of a point of `a` and one of `b`. Round operands become polyhedra, coarse ones for D > 3.
Expression minkowski(Expression a, Expression b);

/// All points within `distance` of the operand in the maximum norm: its Minkowski sum with a cube. A negative
/// distance shrinks: what is left are the points whose cube lies in the operand.
Expression grow(Expression operand, double distance);
/// All points within `distance` of the operand in the Euclidean norm, or what is left when it shrinks, as
/// near as `ball_polytope` of so many sides is to the ball, from within.
Expression grow_round(Expression operand, double distance, std::uint32_t sides);

/// All sums of a point of the operand and one of a polyline. Balls stay round.
Expression sweep(Expression operand, std::vector<std::vector<double>> path);

/// The operand as one part of the model with a name: its number and name are in the results. Of nested parts
/// the outer counts.
Expression part(std::string name, Expression operand);

/// The operand; its volume and moments, in the coordinates that it has here, are reported under this name. In
/// C++ dataflow::measure() answers at once.
Expression measure(std::string name, Expression operand);

/// A construct of its operands; see expression.hpp for what the constructs are and how many operands they
/// take.
/// @throws bsp2::Error for operands of a dimension that the construct cannot take.
Expression construct(Construct what, std::vector<Expression> operands);

/// The solid inside closed faces, given as OpenSCAD does: each face a cycle of point indices, *clockwise*
/// seen from outside. Faces may be non-convex and not quite planar, vertices may lie on edges of neighbours
/// (T-vertices).
///
/// Gaps are closed with as little tolerance as it takes: none at first, then 2^-20 (of the model, if that is
/// smaller than 1), then the rounding of a text of six digits. Faces that are all flat enclose nothing: the
/// empty solid. Faces wound the wrong way round as a whole give the same solid. O(n log n).
/// @throws bsp2::Error that names the open edge if the faces do not close.
Expression polyhedron(const std::vector<std::array<double, 3>>& points,
                      const std::vector<std::vector<std::uint32_t>>& faces);

/// The solids of a file (import_format_table in csg.hpp has the formats), read and repaired as `import` of
/// the text form does (docs/model.md, "Polyhedra"), with the names and colours of its parts. Faces that
/// enclose nothing give the empty solid.
/// @param warn is told what was repaired, and what is odd, if it is there.
/// @throws bsp2::Error that names the file, and its line or byte, if it cannot be read.
Expression imported(const std::filesystem::path& path,
                    const std::function<void(const std::string&)>& warn = {});

/// No operands: the empty solid of dimension 3.
Expression unite(std::vector<Expression> operands);
Expression intersect(std::vector<Expression> operands);
/// The first operand without all others.
Expression subtract(std::vector<Expression> operands);
/// Points in an odd number of operands.
Expression symmetric_difference(std::vector<Expression> operands);
Expression complement(Expression operand);

/// The image under the affine map `matrix`, (D+1) x (D+1) row-major. The matrix is divided by its last entry;
/// the rest of the last row is ignored, as OpenSCAD does. A singular matrix gives the empty solid.
Expression transform(std::span<const double> matrix, Expression operand);

/// The operand, its primitives of this colour: red, green, blue and opacity. The same points.
/// @throws bsp2::Error for channels outside of [0, 1].
Expression colour(const Colour& rgba, Expression operand);

}  // namespace bsp2::model
