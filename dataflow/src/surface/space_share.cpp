#include "surface/space_share.hpp"

#include <algorithm>
#include <optional>
#include <vector>

namespace bsp2::dataflow {

using Table = geometry::HyperplaneTable<3>;

namespace {

struct Cut {
  std::size_t axis;
  std::uint32_t position;
};

/// Looks for a cut across each axis among some places between what is to be shared.
class CutFinder {
 public:
  CutFinder(const Network<3>& network, const SpaceShare& space, std::span<const SharedItem> items)
      : network_(network), space_(space), items_(items) {}

  /// The one that gives each of the two the least of what is in it, over how many share that. What is on both
  /// sides counts on each.
  [[nodiscard]] std::optional<Cut> find(unsigned below, unsigned above) {
    std::optional<Cut> best;
    double least = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      count(axis);
      for (const Place& place : places(below, above)) {
        if (best && place.cost >= least) break;
        const auto position = free_position(network_, static_cast<int>(axis), space_.low[axis],
                                            space_.high[axis], low_ + (high_ - low_) * place.bin / bins);
        if (!position) continue;
        best = Cut{axis, *position};
        least = place.cost;
        break;
      }
    }
    return best;
  }

 private:
  static constexpr unsigned bins = 1024;
  struct Place {
    double cost;
    unsigned bin;  ///< before which the cut is
  };
  const Network<3>& network_;
  const SpaceShare& space_;
  std::span<const SharedItem> items_;
  double low_ = 0, high_ = 0;  // of what is in the space
  std::array<double, bins + 1> begun_{}, ended_{};

  void count(std::size_t axis) {
    const Box<3> space = space_.bounds(network_.table);
    low_ = space.upper[axis];
    high_ = space.lower[axis];
    for (const SharedItem& item : items_) {
      low_ = std::min(low_, std::max(item.box.lower[axis], space.lower[axis]));
      high_ = std::max(high_, std::min(item.box.upper[axis], space.upper[axis]));
    }
    begun_.fill(0);
    ended_.fill(0);
    if (!(low_ < high_)) return;
    const double scale = bins / (high_ - low_);
    const auto bin = [&](double x) {
      return static_cast<std::size_t>(std::clamp((x - low_) * scale, 0.0, double{bins - 1}));
    };
    for (const SharedItem& item : items_) {
      begun_[bin(item.box.lower[axis])] += item.weight;
      ended_[bin(item.box.upper[axis])] += item.weight;
    }
  }

  /// The best ones first, some of them.
  [[nodiscard]] std::vector<Place> places(unsigned below, unsigned above) const {
    constexpr std::size_t most = 8;
    std::vector<Place> places;
    if (!(low_ < high_)) return places;
    double total = 0, begun = 0, ended = 0;
    for (const double weight : begun_) total += weight;
    for (unsigned i = 1; i < bins; ++i) {
      begun += begun_[i - 1];
      ended += ended_[i - 1];
      places.push_back({std::max(begun / below, (total - ended) / above), i});
    }
    const auto is_better = [](const Place& a, const Place& b) {
      return a.cost != b.cost ? a.cost < b.cost : a.bin < b.bin;
    };
    std::partial_sort(places.begin(), places.begin() + most, places.end(), is_better);
    places.resize(most);
    return places;
  }
};

}  // namespace

std::optional<std::uint32_t> free_position(const Network<3>& network, int axis, std::uint32_t low,
                                           std::uint32_t high, double at) {
  constexpr std::uint32_t tries = 8;
  const std::uint32_t middle = network.table.axis_position(axis, at);
  for (std::uint32_t i = 0; i < tries; ++i) {
    const std::uint32_t away = (i + 1) / 2 * 2, position = i % 2 == 0 ? middle + away : middle - away;
    if (position <= low || position >= high) continue;
    if (network.axial_planes.cut(network.table, axis, position) >= network.table.size()) return position;
  }
  return std::nullopt;
}

SpaceShare SpaceShare::whole() {
  SpaceShare space;
  space.high.fill(Table::axis_steps);
  return space;
}

bool SpaceShare::is_empty() const {
  for (std::size_t k = 0; k < 3; ++k)
    if (low[k] >= high[k]) return true;
  return false;
}

Box<3> SpaceShare::bounds(const Table& table) const {
  const double margin = 0x1p-40 * table.radius();
  Box<3> box = Box<3>::empty();
  if (is_empty()) return box;
  for (std::size_t k = 0; k < 3; ++k) {
    box.lower[k] = table.axis_value(static_cast<int>(k), low[k]) - margin;
    box.upper[k] = table.axis_value(static_cast<int>(k), high[k]) + margin;
  }
  return box;
}

SpaceShare share_of_space(const Network<3>& network, std::span<const SharedItem> items, unsigned share,
                          unsigned shares) {
  SpaceShare space = SpaceShare::whole();
  std::vector<SharedItem> here(items.begin(), items.end());
  for (unsigned first = 0, count = shares; count > 1;) {
    const unsigned below = count / 2;
    const bool is_upper = share >= first + below;
    const auto cut = CutFinder(network, space, here).find(below, count - below);
    if (cut) {
      (is_upper ? space.low : space.high)[cut->axis] = cut->position;
    } else if (is_upper) {  // all is the first one's
      space.high = space.low;
      return space;
    }
    if (is_upper) first += below;
    count = is_upper ? count - below : below;
    const Box<3> bounds = space.bounds(network.table);
    std::erase_if(here, [&](const SharedItem& item) { return item.box.misses(bounds); });
  }
  return space;
}

}  // namespace bsp2::dataflow
