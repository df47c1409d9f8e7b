#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"
#include "bsp2/meshing/sizes/size_field.hpp"

namespace bsp2::meshing {

/// A plane piece of the outside or of the interface between two parts: all of it on one plane and one side.
struct PlaneSide {
  static constexpr std::int32_t nothing = -2;  ///< no solid: no part, and not `no_part` either
  std::uint32_t plane;                         ///< as in Complex
  std::int32_t part, other;  ///< `part` is behind `outward`; other: `nothing`, or a higher part
  Point outward;
  friend bool operator==(const PlaneSide&, const PlaneSide&) = default;
};

/// Tetrahedra that meet face to face.
///
/// Shape, for t tetrahedra and s triangles: `tetrahedra` are four points each, right side out: of a b c d,
/// (b-a) x (c-a) points to d. `triangles` are those of the outside and of interfaces, counter-clockwise seen
/// from the side that `sides[side].outward` points to; each once. No point is unused.
struct Tetrahedra {
  std::vector<Point> points;
  std::vector<std::array<std::uint32_t, 4>> tetrahedra;
  std::vector<std::int32_t> part;  ///< of each tetrahedron
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<std::uint32_t> side;  ///< of each triangle: index into `sides`
  std::vector<PlaneSide> sides;
};

/// How a mesh is made of good shape. Lengths in model units.
struct ShapeOptions {
  double clean = 0;  ///< what is shorter is absorbed by moves of at most this in all; 0: nothing
  /// If that is more than `clean`, and `size` above 0: up to so much is absorbed where angles below 1 degree
  /// are left that the solid does not have, as far as that leaves fewer of them and a thousandth of no part
  /// is lost; not with `clean_by_place`.
  double most_clean = 0;
  SizeField clean_by_place;  ///< where it is not empty: of the nearest place, if that is less than `clean`
  double size = 0;           ///< wanted length of edges; 0: the cells' own tetrahedra stay, but for `clean`
  std::vector<double> size_of_part;  ///< by part; 0 or missing: `size`
  SizeField field;                   ///< nor longer than this, where it is not empty
  double growth = 0.6;  ///< by which share of the distance edges may be longer than those they lead to
  double steepest_growth = growth;  ///< that instead where else thin details would add too many tetrahedra
  /// About so many tetrahedra at most are added for the sake of thin details; and as many again, up to three
  /// times, where more than 1 % have an angle below 10 degrees then.
  double most = 250000;
  /// Where a point of the surface belongs that is on these planes; none: where it is. Asked at the end, with
  /// `size` above 0: of what is round, points come from the facets to its true surface.
  std::function<std::optional<Point>(std::span<const std::uint32_t> planes, const Point& point)> true_place;
  unsigned threads = 1;  ///< parts may be shaped at a time; the mesh is the same with any number
  /// Where so many tetrahedra are to be expected, each part is shaped by itself, and then what is between
  /// them: that is faster, also with one thread.
  double by_parts_from = 40000;

  /// The wanted length in a part, where there is no field.
  [[nodiscard]] double size_in(std::int32_t part) const;
};

/// About so many tetrahedra with edges of this length, above 0, fill a volume.
double count_of_size(double volume, double size);

/// About so many tetrahedra a mesh of wanted lengths has, with `size` above 0; and the length of most of
/// them.
struct ExpectedCount {
  double tetrahedra = 0, length = 0;
};
/// Without details and growth; of a field what some thousand places of the solid say.
ExpectedCount expected_count(const Tetrahedra& mesh, const ShapeOptions& options);

/// What was done.
struct ShapeReport {
  std::uint64_t tetrahedra_at_first = 0;
  std::uint64_t turned_at_first = 0;  ///< that rounding had made flat or turned over
  std::uint64_t turned = 0;           ///< that are so still: above 0 the mesh is of no use
  double clean = 0;                   ///< what is shorter than that was absorbed
  std::uint64_t thin_spared =
      0;  ///< so many angles below 1 degree less are left since that is more than asked
  std::uint64_t moved_points = 0;  ///< corners of the solid that were moved
  std::uint64_t bent_edges = 0;    ///< edges of the surface that lead through a point that they passed by
  double largest_move = 0;
  std::uint64_t taken_away = 0;  ///< flat ones, and outer ones that are thinner than is cleaned
  double detail = 0;             ///< as fine as this share of the wanted length details are refined for
  double too_many = 0;         ///< as many tetrahedra finer ones would have made; 0: there are no finer ones
  std::uint64_t placed = 0;    ///< points that were moved to their true place, or towards it
  double largest_placing = 0;  ///< how far, at most
};

/// Each face becomes a fan about a point in its middle, each cell a cone from a point in its middle over its
/// faces; triangles and tetrahedra that nothing touches stay whole. Conforming by construction. Where cells
/// are thinner than their corners are rounded, tetrahedra may be flat or turned over: see `shape`.
Tetrahedra tetrahedra_of(const Complex& complex);

/// Cleans a mesh and makes it one of good shape. Plane sides, interfaces and edges stay where they are, but
/// for what `clean` moves. No step leaves a tetrahedron flat or turned over that was not before, which is
/// decided exactly of the rounded points.
ShapeReport shape(Tetrahedra& mesh, const ShapeOptions& options);

/// Tetrahedra as cells with faces, of which those on a side know their plane. @param triangle_of_face gets,
/// for each face on a side, its place among the mesh's triangles; else none.
Complex complex_of(const Tetrahedra& mesh, std::vector<std::uint32_t>& triangle_of_face);

/// How good the shapes are.
struct Quality {
  double smallest_angle = 180, largest_angle = 0;   ///< dihedral, in degrees
  double mean_smallest_angle = 0;                   ///< of the smallest of each tetrahedron
  std::array<std::uint64_t, 18> histogram{};        ///< dihedral angles in steps of 10 degrees
  std::array<std::uint64_t, 3> tetrahedra_below{};  ///< whose smallest angle is below 1, 5 and 10 degrees
  /// Of these, those whose angles below that are all of edges at which the solid itself is as sharp.
  std::array<std::uint64_t, 3> of_solid{};
  /// The radius of the inscribed ball by the longest edge, as a share of that of a regular tetrahedron: from
  /// 0 (flat, or turned over) to 1.
  double smallest_aspect = 1, mean_aspect = 0;
  std::uint64_t turned = 0;  ///< flat or turned over, decided exactly
};
Quality quality_of(const Tetrahedra& mesh);

/// How often faces are used, and what is wrong with that.
struct FaceUse {
  std::uint64_t once = 0, twice = 0, more = 0;  ///< by so many tetrahedra
  std::uint64_t folded = 0;   ///< of those used twice: with both tetrahedra on the same side
  std::uint64_t strange = 0;  ///< triangles of the mesh that are no face of a tetrahedron
};
/// @param mesh any, also one whose tetrahedra are turned over or do not meet. Takes n log n steps.
FaceUse face_use(const Tetrahedra& mesh);

/// The volume of each part, by number; of no part: the last one.
std::vector<double> volumes_of(const Tetrahedra& mesh, std::size_t parts);

}  // namespace bsp2::meshing
