#include "bsp2/geometry/cell_batch.hpp"

namespace bsp2::geometry {

void CellBatch::shrink_to_fit() {
  points.shrink_to_fit();
  point_offset.shrink_to_fit();
  facet_offset.shrink_to_fit();
  facet_vertex_offset.shrink_to_fit();
  facet_vertices.shrink_to_fit();
  facet_hyperplane.shrink_to_fit();
  label.shrink_to_fit();
  part.shrink_to_fit();
  region.shrink_to_fit();
  level.shrink_to_fit();
  volume.shrink_to_fit();
}

}  // namespace bsp2::geometry
