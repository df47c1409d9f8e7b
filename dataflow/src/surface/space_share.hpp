#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "bsp2/dataflow/network/network.hpp"

namespace bsp2::dataflow {

/// A box between planes across the axes that no operand ends in, by positions on the table's grid.
struct SpaceShare {
  std::array<std::uint32_t, 3> low{}, high{};

  [[nodiscard]] static SpaceShare whole();
  [[nodiscard]] bool is_empty() const;
  /// Bounds that hold it for certain.
  [[nodiscard]] Box<3> bounds(const geometry::HyperplaneTable<3>& table) const;
};

/// A position on an axis, at about `at` and within an interval, where no operand has a facet across the axis.
std::optional<std::uint32_t> free_position(const Network<3>& network, int axis, std::uint32_t low,
                                           std::uint32_t high, double at);

/// What is to be shared: the bounds of an operand, or of a facet, and how many facets that counts for.
struct SharedItem {
  Box<3> box;
  double weight;
};

/// The part of space that one of several finds the surface in: one box each, so that little of the surface
/// crosses its sides. Space is halved, and so are those who share it, and so on; on each way only what is in
/// the own half is looked at. The same cuts are found by all, in their own processes.
/// @return an empty box where no cut was found that gives this one any.
SpaceShare share_of_space(const Network<3>& network, std::span<const SharedItem> items, unsigned share,
                          unsigned shares);

}  // namespace bsp2::dataflow
