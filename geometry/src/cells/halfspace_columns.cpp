#include "bsp2/geometry/cells/halfspace_columns.hpp"

#include <cstring>
#include <limits>

#include "bsp2/geometry/support/dimensions.hpp"
#include "support/vector_lanes.hpp"

namespace bsp2::geometry {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// @param columns of the normals, one an axis; all have room for `count`, a multiple of the lanes.
BSP2_VECTOR_CLONES std::size_t find_furthest(const double* const* columns, const double* offsets,
                                             std::size_t count, const double* point, int dimensions) {
  WideLanes index = {0, 1, 2, 3, 4, 5, 6, 7}, furthest_index = index, furthest = WideLanes{} - infinity;
  for (std::size_t at = 0; at < count; at += wide, index += static_cast<double>(wide)) {
    WideLanes value, normal;
    std::memcpy(&value, offsets + at, sizeof value);
    for (int axis = 0; axis < dimensions; ++axis) {
      std::memcpy(&normal, columns[axis] + at, sizeof normal);
      value += normal * point[axis];
    }
    furthest_index = value > furthest ? index : furthest_index;
    furthest = value > furthest ? value : furthest;
  }
  double most = furthest[0], first = infinity;  // of the furthest ones, the first; without branches
  for (std::size_t lane = 1; lane < wide; ++lane) most = furthest[lane] > most ? furthest[lane] : most;
  for (std::size_t lane = 0; lane < wide; ++lane) {
    const double candidate = furthest[lane] == most ? furthest_index[lane] : infinity;
    first = candidate < first ? candidate : first;
  }
  return static_cast<std::size_t>(first);
}

}  // namespace

template <int D>
void HalfspaceColumns<D>::assign(const HyperplaneTable<D>& table,
                                 std::span<const OrientedHyperplane> halfspaces) {
  left_ = halfspaces.size();
  const std::size_t padded = (left_ + wide - 1) / wide * wide;
  for (auto& column : normal_) column.resize(padded);
  offset_.resize(padded);
  for (std::size_t i = 0; i < padded; ++i) {
    const bool exists = i < left_;
    const Hyperplane<D> h = exists ? table.rounded(halfspaces[i].id()) : Hyperplane<D>{};
    const double sign = exists && halfspaces[i].flipped() ? -1 : 1;
    for (int axis = 0; axis < D; ++axis) normal_[axis][i] = sign * h.normal[axis];
    offset_[i] = exists ? sign * h.offset : -infinity;
  }
}

template <int D>
std::size_t HalfspaceColumns<D>::furthest(const std::array<double, D>& point) const {
  std::array<const double*, D> columns;
  for (int axis = 0; axis < D; ++axis) columns[axis] = normal_[axis].data();
  return find_furthest(columns.data(), offset_.data(), offset_.size(), point.data(), D);
}

template <int D>
void HalfspaceColumns<D>::remove(std::size_t index) {
  offset_[index] = -infinity;
  --left_;
}

#define BSP2_INSTANTIATE(D) template class HalfspaceColumns<D>;
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::geometry
