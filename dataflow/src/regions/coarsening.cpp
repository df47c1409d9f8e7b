#include "bsp2/dataflow/regions/coarsening.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "evaluate/common_owner.hpp"
#include "evaluate/large_stack.hpp"

namespace bsp2::dataflow {

using geometry::Cell;

namespace {

template <int D>
class Coarsener {
 public:
  Coarsener(const Network<D>& network, Partition<D>& partition, std::span<const UniformRegion> uniform,
            std::span<const std::uint32_t> unfinished)
      : partition_(partition),
        unfinished_(unfinished.begin(), unfinished.end()),
        network_(network),
        splitter_(network.table),
        localizer_(network, splitter_) {
    for (const UniformRegion& whole : uniform) uniform_.emplace(whole.region, whole);
  }

  std::vector<UniformRegion> run() {
    if (visit(partition_.root) == State::whole)
      uniform_.at(static_cast<std::uint32_t>(~partition_.root)).is_certain = true;
    std::vector<UniformRegion> remaining;
    for (const auto& [region, whole] : uniform_) remaining.push_back(whole);
    return remaining;
  }

 private:
  enum class State : std::uint8_t { divided, unfinished, whole };
  Partition<D>& partition_;
  std::map<std::uint32_t, UniformRegion> uniform_;
  std::set<std::uint32_t> unfinished_;
  const Network<D>& network_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  std::vector<std::pair<std::int32_t, bool>> path_;  // nodes from the root; true: to the positive side

  /// @param child of a node, or the root: becomes a region where all below it is one.
  State visit(std::int32_t& child) {
    if (child < 0) {
      const auto region = static_cast<std::uint32_t>(~child);
      return uniform_.contains(region)      ? State::whole
             : unfinished_.contains(region) ? State::unfinished
                                            : State::divided;
    }
    auto& node = partition_.nodes[static_cast<std::size_t>(child)];
    path_.emplace_back(child, false);
    const State negative = visit(node.negative);
    path_.back().second = true;
    const State positive = visit(node.positive);
    path_.pop_back();
    if (negative == State::whole && positive == State::whole && join(child)) return State::whole;
    if (negative == State::unfinished && positive != State::divided) return State::unfinished;
    if (positive == State::unfinished && negative != State::divided) return State::unfinished;
    for (const auto& [state, side] : {std::pair{negative, node.negative}, std::pair{positive, node.positive}})
      if (state == State::whole) uniform_.at(static_cast<std::uint32_t>(~side)).is_certain = true;
    return State::divided;
  }

  /// Makes one region of a node's two, if they are alike.
  bool join(std::int32_t& child) {
    auto& node = partition_.nodes[static_cast<std::size_t>(child)];
    UniformRegion& first = uniform_.at(static_cast<std::uint32_t>(~node.negative));
    const UniformRegion& second = uniform_.at(static_cast<std::uint32_t>(~node.positive));
    if (first.label != second.label) return false;
    std::optional<Cell<D>> cell;
    const auto owner =
        owner_of_both<D>(network_, localizer_, first.owner, second.owner, [&]() -> const Cell<D>& {
          if (!cell) cell = cell_of_path();
          return *cell;
        });
    if (!owner) return false;
    first.owner = *owner;
    first.level = static_cast<std::uint16_t>(path_.size());
    child = node.negative;
    node.negative = node.positive;  // the node is not reached any more, and names nobody who is
    uniform_.erase(static_cast<std::uint32_t>(~node.positive));
    return true;
  }

  Cell<D> cell_of_path() {
    Cell<D> cell = geometry::root_cell<D>(network_.table);
    for (const auto& [node, is_positive] : path_) {
      splitter_.classify(cell, partition_.nodes[static_cast<std::size_t>(node)].hyperplane);
      Cell<D> half;
      splitter_.split(cell, partition_.nodes[static_cast<std::size_t>(node)].hyperplane,
                      is_positive ? nullptr : &half, is_positive ? &half : nullptr);
      cell = std::move(half);
    }
    return cell;
  }
};

}  // namespace

template <int D>
std::optional<UniformRegion> uniform_region_of(const Region<D>& region) {
  const auto& nodes = region.frontier.nodes;
  if (nodes.size() != 1 || nodes[0].kind != Frontier::Kind::held) return std::nullopt;
  return UniformRegion{region.number, nodes[0].label, nodes[0].value, region.level};
}

template <int D>
std::vector<UniformRegion> coarsen(const Network<D>& network, Partition<D>& partition,
                                   std::span<const UniformRegion> uniform,
                                   std::span<const std::uint32_t> unfinished) {
  std::vector<UniformRegion> remaining;
  call_on_large_stack([&] { remaining = Coarsener<D>(network, partition, uniform, unfinished).run(); });
  return remaining;
}

#define BSP2_INSTANTIATE(D)                                                     \
  template std::optional<UniformRegion> uniform_region_of<D>(const Region<D>&); \
  template std::vector<UniformRegion> coarsen<D>(                               \
      const Network<D>&, Partition<D>&, std::span<const UniformRegion>, std::span<const std::uint32_t>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
