#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "mesh/predicates.hpp"

namespace bsp2::model {

/// A balanced tree over points in the plane that come and go, to find one in a triangle without looking at
/// all of them, not even at those of the triangle's box: a thin one across a drawing has many.
class PlaneTree {
 public:
  struct Entry {
    Point2 at;
    std::uint32_t name;  ///< below the number of names
  };

  /// All entries are there. At most one a name.
  void build(std::vector<Entry> entries, std::size_t names) {
    entries_ = std::move(entries);
    nodes_.clear();
    slots_.assign(names, none);
    if (!entries_.empty()) build(0, entries_);
    for (std::uint32_t i = 0; i < entries_.size(); ++i) slots_[entries_[i].name] = i;
  }

  /// An entry goes (by = -1) or comes back (by = 1). Names without an entry change nothing.
  void count(std::uint32_t name, int by) {
    if (slots_[name] == none) return;
    std::size_t begin = 0, size = entries_.size();
    for (std::size_t node = 0;;) {
      nodes_[node].present += static_cast<std::uint32_t>(by);
      if (size <= most_in_leaf) return;
      const std::size_t half = size / 2;
      const bool right = slots_[name] >= begin + half;
      node = 2 * node + (right ? 2 : 1);
      begin += right ? half : 0;
      size = right ? size - half : half;
    }
  }

  /// A name that accept() takes, of the entries in a triangle that is wound to the left, and of some beside
  /// it: in its interior, and with `rim` on its edges, too. Exact.
  template <class Accept>
  [[nodiscard]] std::optional<std::uint32_t> find_in(const std::array<Point2, 3>& triangle, bool rim,
                                                     Accept&& accept) const {
    if (entries_.empty()) return {};
    return find_in(0, entries_, triangle, rim ? 0 : 1, accept);
  }

 private:
  struct Node {
    Point2 low, high;
    std::uint32_t present;
  };
  static constexpr std::uint32_t none = ~0u;
  static constexpr std::size_t most_in_leaf = 8;

  void build(std::size_t node, std::span<Entry> entries) {  // depth: log2 of the number of entries
    if (node >= nodes_.size()) nodes_.resize(node + 1);
    Point2 low = entries[0].at, high = low;
    for (const Entry& entry : entries) {
      low = {std::min(low.u, entry.at.u), std::min(low.v, entry.at.v)};
      high = {std::max(high.u, entry.at.u), std::max(high.v, entry.at.v)};
    }
    nodes_[node] = {low, high, static_cast<std::uint32_t>(entries.size())};
    if (entries.size() <= most_in_leaf) return;
    const auto axis = high.u - low.u >= high.v - low.v ? &Point2::u : &Point2::v;
    const std::size_t half = entries.size() / 2;
    std::nth_element(entries.begin(), entries.begin() + static_cast<std::ptrdiff_t>(half), entries.end(),
                     [axis](const Entry& a, const Entry& b) { return a.at.*axis < b.at.*axis; });
    build(2 * node + 1, entries.first(half));
    build(2 * node + 2, entries.subspan(half));
  }

  /// Whether the corner of a box that is farthest to the left of an edge is beyond it, and so all of the box.
  static bool is_beyond(const Node& node, const Point2& from, const Point2& to, int least) {
    const Point2 farthest{to.v > from.v ? node.low.u : node.high.u, to.u > from.u ? node.high.v : node.low.v};
    return orientation(from, to, farthest) < least;
  }

  static bool is_apart(const Node& node, const std::array<Point2, 3>& triangle, int least) {
    const auto& [a, b, c] = triangle;
    const auto [u_low, u_high] = std::minmax({a.u, b.u, c.u});
    const auto [v_low, v_high] = std::minmax({a.v, b.v, c.v});
    return node.high.u < u_low || node.low.u > u_high || node.high.v < v_low || node.low.v > v_high ||
           is_beyond(node, a, b, least) || is_beyond(node, b, c, least) || is_beyond(node, c, a, least);
  }

  template <class Accept>
  std::optional<std::uint32_t> find_in(std::size_t node, std::span<const Entry> entries,
                                       const std::array<Point2, 3>& triangle, int least,
                                       Accept& accept) const {
    if (nodes_[node].present == 0 || is_apart(nodes_[node], triangle, least)) return {};
    if (entries.size() <= most_in_leaf) {
      for (const Entry& entry : entries)
        if (accept(entry.name)) return entry.name;
      return {};
    }
    const std::size_t half = entries.size() / 2;
    if (const auto found = find_in(2 * node + 1, entries.first(half), triangle, least, accept)) return found;
    return find_in(2 * node + 2, entries.subspan(half), triangle, least, accept);
  }

  std::vector<Entry> entries_;
  std::vector<Node> nodes_;           ///< node i has the children 2 i + 1 and 2 i + 2
  std::vector<std::uint32_t> slots_;  ///< by name: where its entry is
};

}  // namespace bsp2::model
