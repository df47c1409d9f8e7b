#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "bsp2/geometry/cells/measures.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/geometry/surface/contact.hpp"

namespace bsp2::geometry {

/// The boundary of a solid: triangles, counter-clockwise seen from outside.
struct TriangleSurface {
  std::vector<std::array<double, 3>> points;            ///< rounded; model units
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< indices of points
  std::vector<std::int32_t> owner;                      ///< one a triangle: the part of the solid behind it
  /// Where parts touch, each has triangles of its own there, opposite to those of the other: so each is
  /// closed by itself. Else there is nothing between parts.
  bool closes_parts = false;

  [[nodiscard]] double area() const;
  /// Volume inside, by the divergence theorem.
  [[nodiscard]] double volume() const;
  /// Of what is inside, likewise.
  [[nodiscard]] Moments<3> moments() const;
  /// Whether every edge is used equally often in both directions.
  [[nodiscard]] bool is_closed() const;
};

/// Told now and then, by the thread that works, the share of it that is done, in [0, 1]; may be empty.
using ToldShare = std::function<void(double done)>;

/// Triangulates a skin.
///
/// The result is closed if the skin is that of a whole solid. It has no T-vertices: no vertex lies inside an
/// edge, not even where two parts of the surface merely touch. Vertices in the middle of a straight edge are
/// dropped, none is added. The result depends on the set of cells alone, not on their order nor on `threads`.
/// All decisions are exact; the points are rounded last. Source of the triangulation: Hertel, Mehlhorn, "Fast
/// triangulation of the plane with respect to simple polygons" (1985).
TriangleSurface triangulate(const HyperplaneTable<3>& table, Skin skin, const ToldShare& told = {},
                            unsigned threads = 1);

}  // namespace bsp2::geometry
