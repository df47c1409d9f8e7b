#include "bsp2/geometry/cells/cell_batch.hpp"

namespace bsp2::geometry {
namespace {

template <typename T>
void append_slice(std::vector<T>& to, const std::vector<T>& from, std::size_t begin, std::size_t end) {
  to.insert(to.end(), from.begin() + static_cast<std::ptrdiff_t>(begin),
            from.begin() + static_cast<std::ptrdiff_t>(end));
}

/// The ends of the parts [first, last), counted on from those that are there.
void append_ends(std::vector<std::uint32_t>& to, const std::vector<std::uint32_t>& from, std::size_t first,
                 std::size_t last) {
  const std::uint32_t base = to.back() - from[first];
  for (std::size_t i = first + 1; i <= last; ++i) to.push_back(base + from[i]);
}

}  // namespace

void CellBatch::append(const CellBatch& from, std::size_t first, std::size_t count) {
  const auto d = static_cast<std::size_t>(dimension);
  const std::size_t last = first + count, facet = from.facet_offset[first],
                    last_facet = from.facet_offset[last];
  append_slice(points, from.points, from.point_offset[first] * d, from.point_offset[last] * d);
  append_slice(facet_vertices, from.facet_vertices, from.facet_vertex_offset[facet],
               from.facet_vertex_offset[last_facet]);
  append_slice(facet_hyperplane, from.facet_hyperplane, facet, last_facet);
  append_ends(point_offset, from.point_offset, first, last);
  append_ends(facet_vertex_offset, from.facet_vertex_offset, facet, last_facet);
  append_ends(facet_offset, from.facet_offset, first, last);
  append_slice(label, from.label, first, last);
  append_slice(primitive, from.primitive, first, last);
  append_slice(part, from.part, first, last);
  append_slice(region, from.region, first, last);
  append_slice(level, from.level, first, last);
  append_slice(volume, from.volume, first, last);
}

void CellBatch::shrink_to_fit() {
  points.shrink_to_fit();
  point_offset.shrink_to_fit();
  facet_offset.shrink_to_fit();
  facet_vertex_offset.shrink_to_fit();
  facet_vertices.shrink_to_fit();
  facet_hyperplane.shrink_to_fit();
  label.shrink_to_fit();
  primitive.shrink_to_fit();
  part.shrink_to_fit();
  region.shrink_to_fit();
  level.shrink_to_fit();
  volume.shrink_to_fit();
}

}  // namespace bsp2::geometry
