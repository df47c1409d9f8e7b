#include "bsp2/dataflow/network/axial_planes.hpp"

#include <algorithm>
#include <cmath>

#include "bsp2/geometry/support/dimensions.hpp"

namespace bsp2::dataflow {

using geometry::HyperplaneId;

template <int D>
AxialPlanes<D>::AxialPlanes(const geometry::HyperplaneTable<D>& table, double coincidence) {
  for (int axis = 0; axis < D; ++axis)
    reach_[axis] =
        std::max(coincidence * table.width(), 1.5 * (table.axis_value(axis, 1) - table.axis_value(axis, 0)));
  for (HyperplaneId id = 0; id < table.size(); ++id) {
    const auto h = table.rounded(id);
    double most = 0, all = 0;
    int axis = 0;
    for (int i = 0; i < D; ++i) {
      const double size = std::fabs(h.normal[i]);
      all += size;
      if (size <= most) continue;
      most = size;
      axis = i;
    }
    if ((all - most) * table.radius() <= coincidence * table.width() * most)
      planes_[axis].emplace_back(-h.offset / h.normal[axis], id);
  }
  for (auto& planes : planes_) std::sort(planes.begin(), planes.end());
}

template <int D>
HyperplaneId AxialPlanes<D>::cut(const geometry::HyperplaneTable<D>& table, int axis,
                                 std::uint32_t position) const {
  const double at = table.axis_value(axis, position);
  const auto& planes = planes_[axis];
  const auto distance = [&](const auto& plane) { return std::fabs(plane.first - at); };
  const auto next = std::lower_bound(planes.begin(), planes.end(), std::pair(at, HyperplaneId{0}));
  auto nearest = next;
  if (next == planes.end() || (next != planes.begin() && distance(*std::prev(next)) < distance(*next)))
    nearest = next == planes.begin() ? planes.end() : std::prev(next);
  return nearest != planes.end() && distance(*nearest) <= reach_[axis]
             ? nearest->second
             : table.axis_hyperplane(axis, position);
}

#define BSP2_INSTANTIATE(D) template class AxialPlanes<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
