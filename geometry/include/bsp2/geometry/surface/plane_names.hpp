#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"

namespace bsp2::geometry {

/// Whether there are planes that only `family_planes` tells of.
[[nodiscard]] bool has_families(const HyperplaneTable<3>& table);

/// The planes of families that carry facets of the IN cells of a mesh, ascending, each once; nothing at once
/// if the table has no families.
std::vector<HyperplaneId> family_planes(const HyperplaneTable<3>& table,
                                        std::span<const std::shared_ptr<const CellBatch>> batches);

/// One name for planes that have several: an axis-parallel cut, or a plane of a family, may happen to be a
/// primitive's, or another family's, exactly.
///
/// The kernel need not care, for a cell never has facets on both. Facets of different cells may, and points
/// that share two planes are on one line only if these are two. The name is the lowest id of a primitive or
/// of the given planes of families; a cut keeps its own if it equals none. So it depends on the plane and on
/// the set of the given ones alone. Decided exactly. Thread rule: any number of threads may ask.
class PlaneNames {
 public:
  /// @param of_families in any order, maybe more than once: all planes of families that `find` will be asked
  /// about (family_planes). Cost: n log m for n hyperplanes of primitives and m planes of families; without
  /// these, n.
  explicit PlaneNames(const HyperplaneTable<3>& table, std::vector<HyperplaneId> of_families = {});
  [[nodiscard]] OrientedHyperplane find(HyperplaneId id) const;

 private:
  struct AxisParallel {
    int axis;
    double value;
    HyperplaneId id;
  };
  /// A plane of families.
  struct Plane {
    double key;  ///< distance from a point, which tells nearly all planes apart
    Hyperplane<3> rounded;
    HyperplaneId first;       ///< one of its ids
    OrientedHyperplane name;  ///< of the plane as `first` has it
  };
  /// Another id of a plane, as `first` has the plane.
  struct Alias {
    std::size_t plane;
    OrientedHyperplane id;
  };
  const HyperplaneTable<3>& table_;
  std::array<double, 3> eye_;                // the point
  std::vector<AxisParallel> axis_parallel_;  // by axis and value; each plane once
  std::unordered_map<HyperplaneId, OrientedHyperplane> renamed_;

  [[nodiscard]] std::vector<Plane> unite(std::span<const HyperplaneId> ids,
                                         std::vector<Alias>& aliases) const;
  void name_by_primitives(std::vector<Plane>& planes) const;
  void add_axis_parallel(HyperplaneId id);
  [[nodiscard]] OrientedHyperplane find_cut(HyperplaneId cut) const;
  [[nodiscard]] bool are_equal(HyperplaneId a, const Hyperplane<3>& a_rounded, HyperplaneId b,
                               const Hyperplane<3>& b_rounded, bool& opposite) const;
};

}  // namespace bsp2::geometry
