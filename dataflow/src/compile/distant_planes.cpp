#include "compile/distant_planes.hpp"

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::HyperplaneTable;
using geometry::OrientedHyperplane;

/// What more have in common was meant so; and each is held against all.
constexpr std::size_t most_users = 1024;

template <int D>
class DistantPlanes {
 public:
  DistantPlanes(HyperplaneTable<D>& table, std::span<const PlacedPlanes<D>> solids, double tolerance)
      : table_(table), solids_(solids), tolerance_(tolerance), is_asked_(table.size()) {}

  void part(unsigned threads) {
    for (std::uint32_t i = 0; i < solids_.size(); ++i)
      if (solids_[i].is_convex && solids_[i].planes.size() >= facets_to_part) add(i);
    if (asked_.empty()) return;
    find_users();
    std::vector<std::vector<std::uint32_t>> parted(asked_.size());
    constexpr std::size_t grain = 4;
    geometry::for_each_range(asked_.size(), grain, threads, [&](std::size_t first, std::size_t end) {
      for (std::size_t k = first; k < end; ++k) parted[k] = distant(asked_[k]);
    });
    typename HyperplaneTable<D>::Unmerging unmerge(table_);
    for (std::size_t k = 0; k < asked_.size(); ++k) {
      const PlacedPlanes<D>& solid = solids_[asked_[k]];
      for (const std::uint32_t facet : parted[k]) solid.planes[facet] = unmerge(source_of(solid, facet));
    }
  }

 private:
  struct User {
    geometry::HyperplaneId id;
    std::uint32_t solid;
    auto operator<=>(const User&) const = default;
  };
  HyperplaneTable<D>& table_;
  std::span<const PlacedPlanes<D>> solids_;
  double tolerance_;
  std::vector<std::uint32_t> asked_;  // solids, facets of which others represent
  std::vector<bool> is_asked_;        // by hyperplane: whether it represents one of these
  std::vector<User> users_;           // of these hyperplanes, ascending
  std::vector<std::pair<geometry::HyperplaneId, std::uint64_t>> marks_;  // of these hyperplanes, ascending

  /// Where others represent more facets of a solid, the model was built so.
  static std::size_t most_by_chance(const PlacedPlanes<D>& solid) { return solid.planes.size() / 2; }

  using Source = typename HyperplaneTable<D>::Source;
  static Source source_of(const PlacedPlanes<D>& solid, std::size_t facet) {
    return {solid.map, static_cast<std::uint32_t>(solid.first_covector + facet)};
  }
  [[nodiscard]] bool is_own(const PlacedPlanes<D>& solid, std::size_t facet) const {
    return table_.source(solid.planes[facet].id())->map == solid.map;
  }

  /// If few of its facets are others', of which it may be that all are equal.
  void add(std::uint32_t i) {
    const PlacedPlanes<D>& solid = solids_[i];
    std::size_t count = 0;
    for (std::size_t facet = 0; facet < solid.planes.size(); ++facet) count += is_own(solid, facet) ? 0 : 1;
    if (count == 0 || count > most_by_chance(solid)) return;
    asked_.push_back(i);
    for (std::size_t facet = 0; facet < solid.planes.size(); ++facet)
      if (!is_own(solid, facet)) is_asked_[solid.planes[facet].id()] = true;
  }

  void find_users() {
    for (std::uint32_t i = 0; i < solids_.size(); ++i)
      for (const OrientedHyperplane plane : solids_[i].planes)
        if (is_asked_[plane.id()]) users_.push_back({plane.id(), i});
    std::ranges::sort(users_);
    typename HyperplaneTable<D>::Marks mark_of(table_);
    for (const User& user : users_)
      if (marks_.empty() || marks_.back().first != user.id)
        marks_.emplace_back(user.id, mark_of(*table_.source(user.id)));
  }

  /// Whether one that represents a facet surely is another one. @param mark of the facet's own.
  [[nodiscard]] bool differs(geometry::HyperplaneId id, std::uint64_t mark) const {
    const std::uint64_t other =
        std::ranges::lower_bound(marks_, id, {}, [](const auto& m) { return m.first; })->second;
    return mark != 0 && other != 0 && mark != other;
  }

  /// Where solids are that are near to one.
  [[nodiscard]] Box<D> around(std::uint32_t i) const {
    Box<D> box = *solids_[i].box;
    for (int axis = 0; axis < D; ++axis) {
      box.lower[axis] -= tolerance_;
      box.upper[axis] += tolerance_;
    }
    return box;
  }

  /// The facets of a solid that are to be parted.
  [[nodiscard]] std::vector<std::uint32_t> distant(std::uint32_t i) const {
    const PlacedPlanes<D>& solid = solids_[i];
    const Box<D> near = around(i);
    typename HyperplaneTable<D>::Marks mark_of(table_);
    std::vector<std::uint32_t> result;
    for (std::uint32_t facet = 0; facet < solid.planes.size(); ++facet) {
      if (is_own(solid, facet)) continue;
      const geometry::HyperplaneId id = solid.planes[facet].id();
      if (differs(id, mark_of(source_of(solid, facet))) && is_alone(i, id, near)) result.push_back(facet);
    }
    return result;
  }

  /// Whether a solid has a hyperplane once, and none near it has it.
  [[nodiscard]] bool is_alone(std::uint32_t i, geometry::HyperplaneId id, const Box<D>& near) const {
    const auto users = std::ranges::equal_range(users_, id, {}, &User::id);
    if (users.size() > most_users) return false;
    int own = 0;
    return std::ranges::none_of(users, [&](const User& user) {
      return user.solid == i ? ++own > 1 : !near.misses(*solids_[user.solid].box);
    });
  }
};

}  // namespace

template <int D>
void part_distant_planes(HyperplaneTable<D>& table, std::span<const PlacedPlanes<D>> solids, double tolerance,
                         unsigned threads) {
  DistantPlanes<D>(table, solids, tolerance).part(threads);
}

#define BSP2_INSTANTIATE(D)                                                                           \
  template void part_distant_planes<D>(HyperplaneTable<D>&, std::span<const PlacedPlanes<D>>, double, \
                                       unsigned);

BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
