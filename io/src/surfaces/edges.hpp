#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace bsp2::io {

/// Half-edge 3 t + k runs from corner k of triangle t to the next corner.
using HalfEdge = std::uint32_t;
inline constexpr HalfEdge no_half_edge = std::numeric_limits<HalfEdge>::max();

using CornerIndices = std::array<std::uint32_t, 3>;
template <typename Real>
using Point3Of = std::array<Real, 3>;
using SinglePoint3 = Point3Of<float>;

/// The next half-edge of the same triangle; it begins where this one ends.
inline HalfEdge next_of(HalfEdge h) { return h % 3 == 2 ? h - 2 : h + 1; }

/// What is on the other side of the edges of a surface.
struct EdgePairs {
  std::vector<HalfEdge> partner;    ///< of each half-edge, in the opposite direction; none where it is open
  std::vector<HalfEdge> crowded;    ///< half-edges on lines that more than two triangles share
  std::uint64_t crowded_edges = 0;  ///< of which there are so many
};

/// Pairs half-edges. Where more than two triangles share an edge, those are partners that bound one wedge of
/// the solid, so that solids that touch there come apart.
/// Real is float or double.
template <typename Real>
EdgePairs pair_edges(const std::vector<Point3Of<Real>>& points, std::span<const CornerIndices> triangles);

}  // namespace bsp2::io
