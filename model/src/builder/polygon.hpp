#pragma once

#include <array>
#include <span>
#include <vector>

#include "bsp2/model/expression/expression.hpp"
#include "mesh/mesh_closing.hpp"

namespace bsp2::model {

/// A polygon as convex pieces: a point belongs to it if it lies in an odd number of them.
struct PolygonPieces {
  std::vector<ConvexPolygon> pieces;
  bool disjoint = true;  ///< certainly no two pieces overlap: they may be united as well
};

/// The smallest power of two above all coordinates: ConvexPolygon::scale.
double scale_of(const std::vector<std::array<double, 2>>& points);

/// The points that lie inside an odd number of paths (the even-odd rule); paths may touch and cross
/// themselves and each other. The corners of the pieces are points of the paths, unchanged. O(n log n) but
/// for paths that hardly extend along x.
/// @pre every index has a point, all coordinates are finite.
PolygonPieces convex_pieces(const std::vector<std::array<double, 2>>& points, const FaceCycles& paths);

}  // namespace bsp2::model
