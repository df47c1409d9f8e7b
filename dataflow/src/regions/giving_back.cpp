#include "bsp2/dataflow/regions/giving_back.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bsp2/dataflow/evaluate/localizer.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "evaluate/alike.hpp"
#include "evaluate/large_stack.hpp"

namespace bsp2::dataflow {

using geometry::Cell;

namespace {

template <int D>
class Giver {
 public:
  Giver(const Network<D>& network, Partition<D>& partition, std::span<const Whole> wholes,
        std::span<const std::uint32_t> unfinished)
      : partition_(partition),
        unfinished_(unfinished.begin(), unfinished.end()),
        network_(network),
        splitter_(network.table),
        localizer_(network, splitter_) {
    for (const Whole& whole : wholes) wholes_.emplace(whole.region, whole);
  }

  std::vector<Whole> run() {
    if (visit(partition_.root) == State::whole)
      wholes_.at(static_cast<std::uint32_t>(~partition_.root)).is_certain = true;
    std::vector<Whole> remaining;
    for (const auto& [region, whole] : wholes_) remaining.push_back(whole);
    return remaining;
  }

 private:
  enum class State : std::uint8_t { divided, unfinished, whole };
  Partition<D>& partition_;
  std::map<std::uint32_t, Whole> wholes_;
  std::set<std::uint32_t> unfinished_;
  const Network<D>& network_;
  geometry::Splitter<D> splitter_;
  Localizer<D> localizer_;
  std::vector<std::pair<std::int32_t, bool>> path_;  // nodes from the root; true: to the positive side

  /// @param child of a node, or the root: becomes a region where all below it is one.
  State visit(std::int32_t& child) {
    if (child < 0) {
      const auto region = static_cast<std::uint32_t>(~child);
      return wholes_.contains(region)       ? State::whole
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
      if (state == State::whole) wholes_.at(static_cast<std::uint32_t>(~side)).is_certain = true;
    return State::divided;
  }

  /// Makes one region of a node's two, if they are alike.
  bool join(std::int32_t& child) {
    auto& node = partition_.nodes[static_cast<std::size_t>(child)];
    Whole& first = wholes_.at(static_cast<std::uint32_t>(~node.negative));
    const Whole& second = wholes_.at(static_cast<std::uint32_t>(~node.positive));
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
    wholes_.erase(static_cast<std::uint32_t>(~node.positive));
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
std::optional<Whole> whole_of(const Region<D>& region) {
  const auto& nodes = region.frontier.nodes;
  if (nodes.size() != 1 || nodes[0].kind != Frontier::Kind::held) return std::nullopt;
  return Whole{region.number, nodes[0].label, nodes[0].value, region.level};
}

template <int D>
std::vector<Whole> give_back(const Network<D>& network, Partition<D>& partition,
                             std::span<const Whole> wholes, std::span<const std::uint32_t> unfinished) {
  std::vector<Whole> remaining;
  call_on_large_stack([&] { remaining = Giver<D>(network, partition, wholes, unfinished).run(); });
  return remaining;
}

#define BSP2_INSTANTIATE(D)                                                                          \
  template std::optional<Whole> whole_of<D>(const Region<D>&);                                       \
  template std::vector<Whole> give_back<D>(const Network<D>&, Partition<D>&, std::span<const Whole>, \
                                           std::span<const std::uint32_t>);
BSP2_FOR_EACH_DIMENSION(BSP2_INSTANTIATE)
#undef BSP2_INSTANTIATE

}  // namespace bsp2::dataflow
