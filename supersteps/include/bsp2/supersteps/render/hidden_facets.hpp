#pragma once

#include <cstdint>
#include <unordered_map>

#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Facets that nobody sees, since another cell covers exactly the same piece of their hyperplane from the
/// other side. D = 3.
///
/// Cells of one region only, so that it does not depend on who holds which regions, and of one label. Most of
/// the inner facets of a solid are of that kind: vector pictures need not have them.
class HiddenFacets {
 public:
  /// @param by_part only those behind which there is the same part: others are seen where one is hidden.
  explicit HiddenFacets(const SolidMesh& mesh, geometry::Label label = geometry::Label::in,
                        bool by_part = false);
  [[nodiscard]] bool contains(const geometry::CellBatch& batch, std::size_t cell, std::size_t facet) const;

 private:
  geometry::Label label_;
  bool by_part_;

  [[nodiscard]] std::uint64_t name_of(const geometry::CellBatch& batch, std::size_t cell,
                                      std::size_t facet) const;
  std::unordered_map<std::uint64_t, std::uint8_t> sides_;  // 1: negative, 2: positive
};

}  // namespace bsp2::supersteps
