#include "axis_aliases.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace bsp2::geometry {
namespace {

/// The axis that a normal is parallel to but for rounding, or -1.
template <int D>
int axis_of(const Hyperplane<D>& h) {
  int axis = 0;
  double rest = 0;
  for (int k = 1; k < D; ++k)
    if (std::fabs(h.normal[k]) > std::fabs(h.normal[axis])) axis = k;
  for (int k = 0; k < D; ++k)
    if (k != axis) rest += std::fabs(h.normal[k]);
  return rest < 0x1p-45 ? axis : -1;
}

}  // namespace

template <int D>
AxisAliases<D>::AxisAliases(const HyperplaneTable<D>& table) : table_(table) {
  for (HyperplaneId id = 0; id < table.size(); ++id) {
    const auto h = table.rounded(id);
    if (const int axis = axis_of<D>(h); axis >= 0) primitives_.push_back({axis, -h.offset / h.normal[axis], id});
  }
  std::sort(primitives_.begin(), primitives_.end(),
            [](const AxisParallel& a, const AxisParallel& b) { return std::tie(a.axis, a.value, a.id) < std::tie(b.axis, b.value, b.id); });
}

template <int D>
bool AxisAliases<D>::equal(HyperplaneId cut, HyperplaneId other, int axis, bool& opposite) const {
  const auto a = table_.exact(cut), b = table_.exact(other);
  for (int k = 0; k < D; ++k)
    if (k != axis && !b[k].is_zero()) return false;
  opposite = a[axis].sign() != b[axis].sign();
  return a[axis] * b[D] == a[D] * b[axis];
}

template <int D>
OrientedHyperplane AxisAliases<D>::find(HyperplaneId cut) const {
  const auto h = table_.rounded(cut);
  const int axis = axis_of<D>(h);
  if (axis < 0) return oriented(cut);  // of a round solid
  const double value = -h.offset / h.normal[axis], slack = 0x1p-40 * table_.radius();
  auto at = std::lower_bound(primitives_.begin(), primitives_.end(), std::pair(axis, value - slack),
                             [](const AxisParallel& p, const auto& key) { return std::pair(p.axis, p.value) < key; });
  for (; at != primitives_.end() && at->axis == axis && at->value <= value + slack; ++at) {
    bool opposite = false;
    if (equal(cut, at->id, axis, opposite)) return oriented(at->id, opposite);
  }
  return oriented(cut);
}

template <int D>
HyperplaneId AxisAliases<D>::add(HyperplaneId id) {
  if (id < table_.size()) return id;
  const auto [entry, is_new] = known_.try_emplace(id);
  if (is_new) entry->second = find(id);
  return entry->second.id();
}

template <int D>
OrientedHyperplane AxisAliases<D>::canonical(OrientedHyperplane hyperplane) const {
  if (hyperplane.id() < table_.size()) return hyperplane;
  const OrientedHyperplane name = known_.find(hyperplane.id())->second;
  return hyperplane.flipped() ? name.opposite() : name;
}

template class AxisAliases<2>;
template class AxisAliases<3>;

}  // namespace bsp2::geometry
