#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/hyperplane_table.hpp"

namespace bsp2::geometry {

/// One name for hyperplanes that have two: an axis-parallel cut may happen to be a primitive's hyperplane, exactly.
///
/// The kernel need not care, for a cell never has facets on both. Facets of different cells may.
/// Thread rule: one thread at a time.
template <int D>
class AxisAliases {
 public:
  explicit AxisAliases(const HyperplaneTable<D>& table);
  /// The primitive's hyperplane that equals this one, or this one itself.
  OrientedHyperplane canonical(OrientedHyperplane hyperplane);

 private:
  struct AxisParallel {
    int axis;
    double value;
    HyperplaneId id;
  };
  const HyperplaneTable<D>& table_;
  std::vector<AxisParallel> primitives_;  // by axis and value
  std::unordered_map<HyperplaneId, OrientedHyperplane> known_;

  [[nodiscard]] OrientedHyperplane find(HyperplaneId cut) const;
  [[nodiscard]] bool equal(HyperplaneId cut, HyperplaneId other, int axis, bool& opposite) const;
};

}  // namespace bsp2::geometry
