#pragma once

#include <string>
#include <vector>

#include "surfaces/edges.hpp"

namespace bsp2::io {

/// A surface of which every edge has two triangles, and every point one ring of them.
template <typename Real>
struct ManifoldMesh {
  std::vector<Point3Of<Real>> points;
  std::vector<CornerIndices> triangles;
  std::vector<std::int32_t> owner;  ///< of each triangle
};

/// How often a surface touched itself.
struct Touching {
  std::uint64_t edges = 0;    ///< lines that more than two triangles shared
  std::uint64_t corners = 0;  ///< points, besides the ends of these, in which several rings of triangles met

  /// What is told of it; empty if it does not.
  [[nodiscard]] std::string told() const;
};

/// Makes a closed surface manifold, as programs for printers and others want it: where it touches itself in
/// an edge or a corner the points there are doubled, so that each wedge of the solid has its own. Places stay
/// as they are. Where two wedges have both ends of an edge in common all the same, each gets a point of its
/// own in the middle of it.
/// @param touching is added to.
template <typename Real>
void make_manifold(ManifoldMesh<Real>& mesh, Touching& touching);

}  // namespace bsp2::io
