#pragma once

#include <string>
#include <vector>

#include "outputs/single_precision.hpp"
#include "surfaces/labels.hpp"
#include "surfaces/manifold.hpp"

namespace bsp2::io {

/// Triangles of one part, with the points that they use.
struct PartPiece {
  std::int32_t owner = 0;
  std::vector<std::uint32_t> points;     ///< of the whole
  std::vector<CornerIndices> triangles;  ///< indices into `points`
  std::vector<std::uint32_t> of_whole;   ///< of each triangle, which one of the whole it is
};

/// The triangles of each part by themselves, in the order of the parts.
std::vector<PartPiece> pieces_by_part(std::size_t points, const std::vector<CornerIndices>& triangles,
                                      const std::vector<std::int32_t>& owner);

/// What is an object of its own for a printer: the closed surface of a part.
struct PrintedObject {
  ManifoldMesh<float> mesh;
  std::int32_t owner = 0;
  std::string name;
};

/// Each part by itself, rounded to single precision; those that vanish by it are left out.
/// @param surface closes parts that touch.
/// @param notes as `to_3mf`.
std::vector<PrintedObject> printed_objects(const geometry::TriangleSurface& surface, const PartLabels& labels,
                                           std::vector<std::string>& notes);

}  // namespace bsp2::io
