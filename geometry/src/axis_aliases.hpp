#pragma once

#include <cstdint>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/hyperplane_table.hpp"

namespace bsp2::geometry {

/// One name for hyperplanes that have two: an axis-parallel cut may happen to be a primitive's hyperplane, exactly.
///
/// The kernel need not care, for a cell never has facets on both. Facets of different cells may.
/// Thread rule: `add` is called by one thread, then any number may read.
template <int D>
class AxisAliases {
 public:
  explicit AxisAliases(const HyperplaneTable<D>& table);
  /// Looks for another name of a hyperplane. @return the one it goes by.
  HyperplaneId add(HyperplaneId id);
  /// The primitive's hyperplane that equals this one, or this one itself. @pre it has been added.
  [[nodiscard]] OrientedHyperplane canonical(OrientedHyperplane hyperplane) const;

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
