#include "bsp2/geometry/surface/plane_names.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "bsp2/geometry/exact/exact.hpp"

namespace bsp2::geometry {
namespace {

constexpr double slightly_more = 1 + 0x1p-40;

HyperplaneId end_of_families() { return HyperplaneTable<3>::axis_hyperplane(0, 0); }
bool is_of_family(const HyperplaneTable<3>& table, HyperplaneId id) {
  return id >= table.size() && id < end_of_families();
}

/// The axis that a normal is parallel to but for rounding, or -1.
int axis_of(const Hyperplane<3>& h) {
  int axis = 0;
  double rest = 0;
  for (int k = 1; k < 3; ++k)
    if (std::fabs(h.normal[k]) > std::fabs(h.normal[axis])) axis = k;
  for (int k = 0; k < 3; ++k)
    if (k != axis) rest += std::fabs(h.normal[k]);
  return rest < 0x1p-45 ? axis : -1;
}

void sort_and_unite(std::vector<HyperplaneId>& ids) {
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
}

}  // namespace

bool has_families(const HyperplaneTable<3>& table) {
  return table.free_ids() < end_of_families() - table.size();
}

std::vector<HyperplaneId> family_planes(const HyperplaneTable<3>& table,
                                        std::span<const std::shared_ptr<const CellBatch>> batches) {
  std::vector<HyperplaneId> found;
  if (!has_families(table)) return found;
  std::size_t many = std::size_t{1} << 16;
  for (const auto& batch : batches)
    for (std::size_t cell = 0; cell < batch->size(); ++cell) {
      if (batch->label[cell] != Label::in) continue;
      for (std::uint32_t facet = batch->facet_offset[cell]; facet < batch->facet_offset[cell + 1]; ++facet) {
        const std::int32_t code = batch->facet_hyperplane[facet];
        const auto id = static_cast<HyperplaneId>(code < 0 ? ~code : code);
        if (is_of_family(table, id)) found.push_back(id);
      }
      if (found.size() < many) continue;
      sort_and_unite(found);
      many = std::max(many, 2 * found.size());
    }
  sort_and_unite(found);
  return found;
}

PlaneNames::PlaneNames(const HyperplaneTable<3>& table, std::vector<HyperplaneId> of_families)
    : table_(table) {
  for (int k = 0; k < 3; ++k) {  // a point that is in no special place of any model
    constexpr std::array<double, 3> share{0.5698402909980532, 0.7548776662466927, 0.4301597090019468};
    eye_[k] = table.axis_value(k, static_cast<std::uint32_t>(share[k] * HyperplaneTable<3>::axis_steps));
  }
  for (HyperplaneId id = 0; id < table.size(); ++id) add_axis_parallel(id);
  sort_and_unite(of_families);
  std::vector<Alias> aliases;
  std::vector<Plane> planes = unite(of_families, aliases);
  name_by_primitives(planes);
  for (const Plane& plane : planes) {
    if (is_of_family(table, plane.name.id())) add_axis_parallel(plane.name.id());
    if (plane.name != oriented(plane.first)) renamed_.emplace(plane.first, plane.name);
  }
  for (const Alias& alias : aliases) {
    const OrientedHyperplane name = planes[alias.plane].name;
    if (name.id() != alias.id.id())
      renamed_.emplace(alias.id.id(), alias.id.flipped() ? name.opposite() : name);
  }
  std::sort(axis_parallel_.begin(), axis_parallel_.end(), [](const AxisParallel& a, const AxisParallel& b) {
    return std::tie(a.axis, a.value, a.id) < std::tie(b.axis, b.value, b.id);
  });
}

void PlaneNames::add_axis_parallel(HyperplaneId id) {
  const auto h = table_.rounded(id);
  if (const int axis = axis_of(h); axis >= 0)
    axis_parallel_.push_back({axis, -h.offset / h.normal[axis], id});
}

/// Each plane once, in the order of their keys, by the lowest of the ids. @param aliases gets the ids that
/// are not the first of their plane.
auto PlaneNames::unite(std::span<const HyperplaneId> ids, std::vector<Alias>& aliases) const
    -> std::vector<Plane> {
  std::vector<Plane> planes;
  planes.reserve(ids.size());
  double largest_error = 0;
  for (const HyperplaneId id : ids) {
    const auto h = table_.rounded(id);
    planes.push_back({std::fabs(h.at(eye_)), h, id, oriented(id)});
    largest_error = std::max(largest_error, h.error);
  }
  std::sort(planes.begin(), planes.end(), [](const Plane& a, const Plane& b) {
    return std::tie(a.key, a.first) < std::tie(b.key, b.first);
  });
  std::size_t kept = 0;
  for (const Plane& plane : planes) {
    const double lowest = plane.key - (plane.rounded.error + largest_error) * slightly_more;
    bool opposite = false;
    std::size_t k = kept;
    while (k > 0 && planes[k - 1].key >= lowest &&
           !are_equal(planes[k - 1].first, planes[k - 1].rounded, plane.first, plane.rounded, opposite))
      --k;
    if (k == 0 || planes[k - 1].key < lowest) {
      planes[kept++] = plane;
      continue;
    }
    Plane& known = planes[k - 1];
    aliases.push_back({k - 1, oriented(plane.first, opposite)});
    if (plane.first < known.name.id()) known.name = oriented(plane.first, opposite);
  }
  planes.resize(kept);
  return planes;
}

/// Where a primitive's hyperplane is one of the planes, it gives the name. @param planes in the order of
/// their keys.
void PlaneNames::name_by_primitives(std::vector<Plane>& planes) const {
  if (planes.empty()) return;
  double largest_error = 0;
  for (const Plane& plane : planes) largest_error = std::max(largest_error, plane.rounded.error);
  for (HyperplaneId id = 0; id < table_.size(); ++id) {
    const Hyperplane<3>& h = table_.rounded()[id];
    const double key = std::fabs(h.at(eye_)), reach = (h.error + largest_error) * slightly_more;
    auto at = std::lower_bound(planes.begin(), planes.end(), key - reach,
                               [](const Plane& plane, double x) { return plane.key < x; });
    for (; at != planes.end() && at->key <= key + reach; ++at) {
      bool opposite = false;
      if (at->name.id() > id && are_equal(at->first, at->rounded, id, h, opposite))
        at->name = oriented(id, opposite);
    }
  }
}

/// Exactly: one covector is a multiple of the other. Most that are not equal are told apart by their rounded
/// normals.
bool PlaneNames::are_equal(HyperplaneId a, const Hyperplane<3>& a_rounded, HyperplaneId b,
                           const Hyperplane<3>& b_rounded, bool& opposite) const {
  constexpr double too_much = 0x1p-24;  // by far more than rounding does
  double dot = 0;
  for (int k = 0; k < 3; ++k) dot += a_rounded.normal[k] * b_rounded.normal[k];
  opposite = dot < 0;
  int pivot = 0;
  for (int k = 0; k < 3; ++k) {
    if (std::fabs(a_rounded.normal[k] + (opposite ? 1 : -1) * b_rounded.normal[k]) > too_much) return false;
    if (std::fabs(a_rounded.normal[k]) > std::fabs(a_rounded.normal[pivot])) pivot = k;
  }
  const auto u = table_.exact(a), v = table_.exact(b);
  for (int k = 0; k <= 3; ++k)
    if (u[k] * v[pivot] != v[k] * u[pivot]) return false;
  return !u[pivot].is_zero() && !v[pivot].is_zero();
}

OrientedHyperplane PlaneNames::find_cut(HyperplaneId cut) const {
  const auto h = table_.rounded(cut);
  const int axis = axis_of(h);
  const double value = -h.offset / h.normal[axis], slack = 0x1p-40 * table_.radius();
  auto at = std::lower_bound(
      axis_parallel_.begin(), axis_parallel_.end(), std::pair(axis, value - slack),
      [](const AxisParallel& p, const auto& key) { return std::pair(p.axis, p.value) < key; });
  for (; at != axis_parallel_.end() && at->axis == axis && at->value <= value + slack; ++at) {
    bool opposite = false;
    if (are_equal(cut, h, at->id, table_.rounded(at->id), opposite)) return oriented(at->id, opposite);
  }
  return oriented(cut);
}

OrientedHyperplane PlaneNames::find(HyperplaneId id) const {
  if (id < table_.size()) return oriented(id);
  if (!is_of_family(table_, id)) return find_cut(id);
  const auto renamed = renamed_.find(id);
  return renamed == renamed_.end() ? oriented(id) : renamed->second;
}

}  // namespace bsp2::geometry
