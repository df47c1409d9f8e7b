#include "bsp2/supersteps/render/hidden_facets.hpp"

#include <bit>

#include "bsp2/geometry/support/interruption.hpp"

namespace bsp2::supersteps {
namespace {

using geometry::CellBatch;

std::uint64_t mixed(std::uint64_t h) {
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93U;
  h = (h ^ (h >> 32)) * 0xd6e8feb86659fd93U;
  return h ^ (h >> 32);
}

std::uint8_t side_of(const CellBatch& batch, std::size_t facet) {
  return batch.facet_hyperplane[facet] < 0 ? 2 : 1;
}

}  // namespace

/// Equal for the facets of two cells that are the same polygon, whatever corner they begin with and whichever
/// way they go.
std::uint64_t HiddenFacets::name_of(const CellBatch& batch, std::size_t cell, std::size_t facet) const {
  const std::int32_t plane = batch.facet_hyperplane[facet];
  std::uint64_t name = mixed((std::uint64_t{batch.region[cell]} << 32) +
                             static_cast<std::uint32_t>(plane < 0 ? ~plane : plane));
  const double* points = batch.cell_points(cell).data();
  for (const std::uint16_t v : batch.vertices_of_facet(facet)) {
    std::uint64_t corner = 0;
    for (int axis = 0; axis < 3; ++axis)
      corner = mixed(corner + std::bit_cast<std::uint64_t>(points[3 * v + axis] + 0.0));  // -0 is 0
    name += corner;
  }
  return by_part_ ? mixed(name + static_cast<std::uint32_t>(batch.part[cell])) : name;
}

HiddenFacets::HiddenFacets(const SolidMesh& mesh, geometry::Label label, bool by_part)
    : label_(label), by_part_(by_part) {
  if (mesh.dimension != 3) return;
  for (const auto& batch : mesh.batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (batch->label[cell] != label_) continue;
      geometry::Interruption::check();
      for (std::size_t f = batch->facet_offset[cell]; f < batch->facet_offset[cell + 1]; ++f)
        sides_[name_of(*batch, cell, f)] |= side_of(*batch, f);
    }
}

bool HiddenFacets::contains(const CellBatch& batch, std::size_t cell, std::size_t facet) const {
  if (batch.label[cell] != label_) return false;
  const auto found = sides_.find(name_of(batch, cell, facet));
  return found != sides_.end() && found->second == 3;
}

}  // namespace bsp2::supersteps
