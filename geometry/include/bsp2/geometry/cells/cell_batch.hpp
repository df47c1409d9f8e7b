#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace bsp2::geometry {

/// What is known about all points of a cell.
enum class Label : std::uint8_t { out = 0, in = 1, fuzzy = 2 };

/// Of a cell that is in no operand of the source as a whole (cells of a complement, FUZZY and OUT cells).
inline constexpr std::int32_t no_primitive = -1;
/// Of a cell that belongs to nothing with a name, where something has one (and of FUZZY and OUT cells).
inline constexpr std::int32_t no_part = -1;

/// Convex cells of any dimension D as flat typed arrays: the form in which cells leave the kernel, travel and
/// are written. A solid mesh is a sequence of batches.
///
/// Shape, for n cells with p points, f facets and v facet vertices in total:
///   points             p x D   coordinates, in the units of the model
///   point_offset       n + 1   cell i owns points [point_offset[i], point_offset[i+1])
///   facet_offset       n + 1   cell i owns facets [facet_offset[i], facet_offset[i+1])
///   facet_vertex_offset f + 1  facet j owns facet_vertices [facet_vertex_offset[j],
///   facet_vertex_offset[j+1]) facet_vertices     v       indices into the *cell's own* points (0 is the
///   cell's first point) facet_hyperplane   f       id of the hyperplane that carries the facet; ~id where
///   the cell is on its positive side label, primitive, part, region, level, volume: n each
/// Order: in D = 3 the vertices of a facet go around it, counter-clockwise seen from outside. In D = 2 a
/// facet is an edge (2 vertices), in D = 1 a point (1 vertex); in D > 3 the vertices of a facet are a set.
struct CellBatch {
  int dimension = 3;
  std::vector<double> points;
  std::vector<std::uint32_t> point_offset{0};
  std::vector<std::uint32_t> facet_offset{0};
  std::vector<std::uint32_t> facet_vertex_offset{0};
  std::vector<std::uint16_t> facet_vertices;
  std::vector<std::int32_t> facet_hyperplane;
  std::vector<Label> label;
  std::vector<std::int32_t>
      primitive;  ///< number of the primitive, in the order of the source, that the whole cell belongs to
  std::vector<std::int32_t>
      part;  ///< number of the named part, in the order of the source; 0 where nothing has a name
  std::vector<std::uint32_t> region;  ///< leaf of the partition that produced the cell
  std::vector<std::uint16_t> level;   ///< number of hyperplanes on the cell's BSP path
  std::vector<double> volume;         ///< D-dimensional content, in model units

  [[nodiscard]] std::size_t size() const { return label.size(); }
  [[nodiscard]] bool empty() const { return label.empty(); }
  [[nodiscard]] std::size_t point_count(std::size_t cell) const {
    return point_offset[cell + 1] - point_offset[cell];
  }
  [[nodiscard]] std::size_t facet_count(std::size_t cell) const {
    return facet_offset[cell + 1] - facet_offset[cell];
  }
  /// Takes in copies of cells of another batch of the same dimension.
  void append(const CellBatch& from, std::size_t first, std::size_t count);
  /// Gives back memory that growing has left over.
  void shrink_to_fit();
  /// Coordinates of the cell's points, D numbers each.
  [[nodiscard]] std::span<const double> cell_points(std::size_t cell) const {
    const auto d = static_cast<std::size_t>(dimension);
    return {points.data() + point_offset[cell] * d, point_count(cell) * d};
  }
  /// Vertices of facet `facet` (an index into all facets of the batch), as indices into its cell's points.
  [[nodiscard]] std::span<const std::uint16_t> vertices_of_facet(std::size_t facet) const {
    return {facet_vertices.data() + facet_vertex_offset[facet],
            facet_vertex_offset[facet + 1] - facet_vertex_offset[facet]};
  }
};

}  // namespace bsp2::geometry
