#include "bsp2/dataflow/regions/portion.hpp"

#include <stdexcept>
#include <utility>
#include <vector>

#include "evaluate/tokens.hpp"

namespace bsp2::dataflow {
namespace {

using Kind = Frontier::Kind;
constexpr Frontier::Node elsewhere{Kind::elsewhere};

/// Weight of the open tokens below each node: a word more than their expressions, so that none weighs
/// nothing. Those that have ended do: they are in one half or the other, but there is nothing to do about
/// them, and however many they are each half gets something to do.
std::vector<std::uint64_t> weights(const Frontier& frontier, const UnfoldedFrontier& tree) {
  const auto& nodes = frontier.nodes;
  std::vector<std::uint64_t> weight(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {  // children come after their parents
    const auto node = static_cast<std::uint32_t>(i);
    if (nodes[i].kind == Kind::token && nodes[i].ended == 0)
      weight[i] = static_cast<std::uint64_t>(nodes[i].value) + 1;
    if (nodes[i].kind == Kind::split) weight[i] = weight[tree.negative(node)] + weight[tree.positive(node)];
  }
  return weight;
}

/// The way from the root, always to the heavier side, to the first subtree of at most two thirds of the
/// weight; each node with the side it was left on.
struct Way {
  std::vector<std::pair<std::uint32_t, bool>> splits;  // true: to the positive side
  std::uint32_t end = 0;
};

Way way_to_a_half(const Frontier& frontier, const UnfoldedFrontier& tree) {
  const std::vector<std::uint64_t> weight = weights(frontier, tree);
  Way way;
  while (frontier.nodes[way.end].kind == Kind::split && 3 * weight[way.end] > 2 * weight[0]) {
    const std::uint32_t negative = tree.negative(way.end), positive = tree.positive(way.end);
    const bool to_positive = weight[positive] > weight[negative];
    way.splits.emplace_back(way.end, to_positive);
    way.end = to_positive ? positive : negative;
  }
  return way;
}

Frontier without(const UnfoldedFrontier& tree, const Way& way) {
  Frontier rest;
  for (const auto& [split, to_positive] : way.splits) {
    rest.nodes.push_back(tree.node(split));
    if (to_positive) tree.copy(tree.negative(split), rest);
  }
  rest.nodes.push_back(elsewhere);
  for (auto split = way.splits.rbegin(); split != way.splits.rend(); ++split)
    if (!split->second) tree.copy(tree.positive(split->first), rest);
  return rest;
}

Frontier only(const UnfoldedFrontier& tree, const Way& way) {
  Frontier part;
  for (const auto& [split, to_positive] : way.splits) {
    part.nodes.push_back(tree.node(split));
    if (to_positive) part.nodes.push_back(elsewhere);
  }
  tree.copy(way.end, part);
  for (const auto& [split, to_positive] : way.splits)
    if (!to_positive) part.nodes.push_back(elsewhere);
  return part;
}

/// All leaves that have been emitted, or all others. A split that has only such of the other part is
/// elsewhere as a whole: the other may finish it.
Frontier part_of(const Frontier& frontier, const UnfoldedFrontier& tree, bool emitted) {
  const auto& nodes = frontier.nodes;
  // Whether something below a node is of this part, is of the other, has been emitted by whomever.
  std::vector<bool> is_mine(nodes.size()), is_others(nodes.size()), is_divided(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {  // children come after their parents
    const Kind kind = nodes[i].kind;
    const auto either = [&](const std::vector<bool>& of) {
      return of[tree.negative(static_cast<std::uint32_t>(i))] ||
             of[tree.positive(static_cast<std::uint32_t>(i))];
    };
    is_mine[i] =
        kind == Kind::split ? either(is_mine) : kind != Kind::elsewhere && (kind == Kind::emitted) == emitted;
    is_others[i] = kind == Kind::split ? either(is_others)
                                       : kind != Kind::elsewhere && (kind == Kind::emitted) != emitted;
    is_divided[i] = kind == Kind::split
                        ? either(is_divided)
                        : kind == Kind::emitted || (kind == Kind::elsewhere && nodes[i].value != 0);
  }
  Frontier part;
  std::vector<std::uint32_t> open{0};
  while (!open.empty()) {
    const std::uint32_t node = open.back();
    open.pop_back();
    if (!is_mine[node] && is_others[node]) {
      part.nodes.push_back({Kind::elsewhere, geometry::Label::fuzzy, 0, is_divided[node] ? 1 : 0});
    } else if (nodes[node].kind == Kind::split) {
      part.nodes.push_back(nodes[node]);
      open.push_back(tree.positive(node));
      open.push_back(tree.negative(node));
    } else {
      tree.copy(node, part);
    }
  }
  return part;
}

}  // namespace

Remains remains_of(const Frontier& frontier) {
  Remains remains;
  for (const Frontier::Node& node : frontier.nodes) {
    remains.tokens += node.kind == Kind::token ? 1 : 0;
    remains.open += node.kind == Kind::token && node.ended == 0 ? 1 : 0;
    remains.words += node.kind == Kind::token ? static_cast<std::uint64_t>(node.value) : 0;
    remains.elsewhere += node.kind == Kind::elsewhere ? 1 : 0;
  }
  return remains;
}

Separated separate_emitted(const Frontier& frontier) {
  if (frontier.empty()) return {};
  const UnfoldedFrontier tree(frontier);
  return {part_of(frontier, tree, true), part_of(frontier, tree, false)};
}

std::optional<std::array<Frontier, 2>> divide(const Frontier& frontier) {
  if (remains_of(frontier).open < 2) return std::nullopt;
  const UnfoldedFrontier tree(frontier);
  const Way way = way_to_a_half(frontier, tree);
  return std::array{without(tree, way), only(tree, way)};
}

Frontier overlay(const Frontier& a, const Frontier& b) {
  const UnfoldedFrontier left(a), right(b);
  Frontier whole;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> open{{0, 0}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    if (left.node(i).kind == Kind::elsewhere &&
        (left.node(i).value == 0 || right.node(j).kind != Kind::elsewhere)) {
      right.copy(j, whole);  // of two that are elsewhere, the one that knows more
    } else if (right.node(j).kind == Kind::elsewhere) {
      left.copy(i, whole);
    } else {
      if (left.node(i).kind != Kind::split || !(left.node(i) == right.node(j)))
        throw std::invalid_argument("these are no portions of one frontier");
      whole.nodes.push_back(left.node(i));
      open.emplace_back(left.positive(i), right.positive(j));
      open.emplace_back(left.negative(i), right.negative(j));
    }
  }
  return whole;
}

}  // namespace bsp2::dataflow
