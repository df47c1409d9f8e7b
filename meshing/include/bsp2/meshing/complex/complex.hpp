#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::meshing {

using Point = std::array<double, 3>;

/// Convex cells that meet face to face: each face belongs to two cells, or to one and to the outside.
///
/// Shape, for p points, f faces and c cells:
///   points       p      rounded, in model units; each exact point once
///   face_offset  f + 1  face i has face_points [face_offset[i], face_offset[i + 1])
///   face_points         a cycle, counter-clockwise seen from outside of its owner; a corner of another cell
///                       that lies on an edge is in it, so there may be angles of 180 degrees
///   owner        f      a cell
///   neighbour    f      a cell of a higher number, or `outside`
///   plane        f      name of the plane that carries the face; equal planes have equal names
///   outward      f      unit normal of the plane, out of the owner
///   part         c      as in CellBatch
/// Which points are one, which point is on which edge, and what two cells have in common is decided exactly;
/// only coordinates are rounded.
struct Complex {
  static constexpr std::int32_t outside = -1;
  std::vector<Point> points;
  std::vector<std::uint32_t> face_offset{0}, face_points;
  std::vector<std::int32_t> owner, neighbour;
  std::vector<std::uint32_t> plane;
  std::vector<Point> outward;
  std::vector<std::int32_t> part;

  [[nodiscard]] std::size_t faces() const { return owner.size(); }
  [[nodiscard]] std::size_t cells() const { return part.size(); }
  [[nodiscard]] std::span<const std::uint32_t> points_of(std::size_t face) const {
    return {face_points.data() + face_offset[face], face_offset[face + 1] - face_offset[face]};
  }
};

/// The IN cells of a mesh as a conforming complex.
///
/// Where a facet of one cell is touched by several others it is divided; what of it no cell touches is
/// divided into convex pieces. No point is made that is not a corner of cells or where edges of two cells on
/// one plane cross.
/// @param batches of dimension 3, and of the table.
/// @param threads that work; the result is the same for any number.
/// @throws std::logic_error if the cells do not fit together, which would be a mistake of ours.
Complex conforming_complex(const geometry::HyperplaneTable<3>& table,
                           std::span<const std::shared_ptr<const geometry::CellBatch>> batches,
                           unsigned threads = 1);

}  // namespace bsp2::meshing
