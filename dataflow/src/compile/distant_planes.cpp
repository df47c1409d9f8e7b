#include "compile/distant_planes.hpp"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/parallel.hpp"

namespace bsp2::dataflow {
namespace {

using geometry::HyperplaneTable;
using geometry::OrientedHyperplane;

/// Solids of fewer facets are cut as they are.
constexpr std::size_t many_facets = 64;
/// Of a solid the share of facets that others represent by chance is no greater; where it is, the model was
/// built so.
constexpr double most_by_chance = 1.0 / 4;

template <int D>
class DistantPlanes {
 public:
  DistantPlanes(HyperplaneTable<D>& table, std::span<const PlacedPlanes<D>> solids, double tolerance)
      : table_(table), solids_(solids), tolerance_(tolerance), is_asked_(table.size()) {}

  void part(unsigned threads) {
    for (std::uint32_t i = 0; i < solids_.size(); ++i)
      if (solids_[i].is_convex && solids_[i].planes.size() >= many_facets) add(i);
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

  using Source = typename HyperplaneTable<D>::Source;
  static Source source_of(const PlacedPlanes<D>& solid, std::size_t facet) {
    return {solid.map, static_cast<std::uint32_t>(solid.first_covector + facet)};
  }
  [[nodiscard]] bool is_own(const PlacedPlanes<D>& solid, std::size_t facet) const {
    return table_.source(solid.planes[facet].id())->map == solid.map;
  }

  void add(std::uint32_t i) {
    const PlacedPlanes<D>& solid = solids_[i];
    bool has_any = false;
    for (std::size_t facet = 0; facet < solid.planes.size(); ++facet)
      if (!is_own(solid, facet)) has_any = is_asked_[solid.planes[facet].id()] = true;
    if (has_any) asked_.push_back(i);
  }

  void find_users() {
    for (std::uint32_t i = 0; i < solids_.size(); ++i)
      for (const OrientedHyperplane plane : solids_[i].planes)
        if (is_asked_[plane.id()]) users_.push_back({plane.id(), i});
    std::ranges::sort(users_);
  }

  [[nodiscard]] bool are_near(std::uint32_t a, std::uint32_t b) const {
    Box<D> around = *solids_[a].box;
    for (int i = 0; i < D; ++i) {
      around.lower[i] -= tolerance_;
      around.upper[i] += tolerance_;
    }
    return !around.misses(*solids_[b].box);
  }

  /// The facets of a solid that are to be parted.
  [[nodiscard]] std::vector<std::uint32_t> distant(std::uint32_t i) const {
    const PlacedPlanes<D>& solid = solids_[i];
    std::vector<std::uint32_t> result;
    for (std::uint32_t facet = 0; facet < solid.planes.size(); ++facet) {
      if (is_own(solid, facet)) continue;
      const auto users = std::ranges::equal_range(users_, solid.planes[facet].id(), {}, &User::id);
      if (std::ranges::any_of(users,
                              [&](const User& user) { return user.solid != i && are_near(i, user.solid); }))
        continue;
      if (!table_.is_equal(solid.planes[facet].id(), source_of(solid, facet))) result.push_back(facet);
    }
    if (static_cast<double>(result.size()) > most_by_chance * static_cast<double>(solid.planes.size()))
      result.clear();
    return result;
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
