#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/surface/boundary.hpp"

namespace bsp2::model {

/// What is too short or too thin to be kept. In model units.
struct CleanLength {
  double length = 0;         ///< everywhere
  double of_coordinate = 0;  ///< and besides, this share of the largest coordinate at the place

  [[nodiscard]] double at(double coordinate) const { return length + of_coordinate * coordinate; }
};

/// What cleaning did to a surface. Lengths in model units.
struct Cleaning {
  double length = 0;                ///< what is shorter or thinner was to go; where that differs the largest
  std::uint64_t merged_points = 0;  ///< became one with another corner
  std::uint64_t slivers = 0;        ///< triangles thinner than the length that were taken in by neighbours
  std::uint64_t left_out = 0;       ///< corners in a face or a straight edge, as far as the length tells
  std::uint64_t left = 0;           ///< edges and triangles that could not go without spoiling others
  double moved = 0;                 ///< the farthest that a corner came
  double volume = 0;                ///< inside now, less what was inside before
  bool has_given_up = false;        ///< it would have crossed itself, or been inside out: it is as it was
  /// Triangles that cross others near to what has changed, and did so before: of each such pair one.
  std::vector<std::array<std::array<double, 3>, 3>> crossing_before;
  std::vector<std::int32_t> vanished;  ///< parts of which nothing is left, ascending

  [[nodiscard]] bool is_changed() const { return merged_points + slivers + left_out > 0; }
};

struct CleanSurface {
  geometry::TriangleSurface surface;
  Cleaning cleaning;
};

/// A surface without edges shorter than a length, and without triangles thinner than it, for programs that
/// stumble over what is exact.
///
/// Corners that are nearer become one of them, the one that leaves the faces around where they are. A
/// triangle thinner than the length goes into its neighbours at its longest side. Then corners that lie in a
/// face, or in the middle of an edge, are left out around what has changed. No corner moves farther than the
/// length, nor does a face at such a triangle. The result is as closed as the surface was; where it closes
/// parts, what is between two of them moves for both. Where it would cross itself by what has changed, which
/// is looked for exactly, that stays as it was; where that is too much, everything. A piece that would be
/// turned inside out stays, too.
/// @param threads that look for crossings; the result is the same for any number.
/// @return nothing changed: the surface itself.
[[nodiscard]] CleanSurface cleaned(geometry::TriangleSurface surface, const CleanLength& length,
                                   unsigned threads = 1);

}  // namespace bsp2::model
