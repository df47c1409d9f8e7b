#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "bsp2/dataflow/evaluate/localizer.hpp"

namespace bsp2::dataflow {

/// What cells that are given back carry, since nobody needs to know more of them yet: a producer that
/// contains the cell, though parts of the cell are cut away from it in the model and are in other operands.
/// Which one the cell belongs to, if to any, is found once it is emitted.
struct Container {
  static constexpr bool is_one(std::int32_t owner) { return owner < no_owner; }
  static constexpr std::int32_t from(std::int32_t producer) { return no_owner - 1 - producer; }
  /// The producer that contains the cell, whether the cell belongs to it or not.
  static constexpr std::int32_t producer(std::int32_t owner) { return is_one(owner) ? from(owner) : owner; }
};

/// What two halves of a cell, of which at least one is IN and both are alike, belong to together; nothing if
/// the cut between them is needed.
///
/// It is not if a producer contains both. Where there are several parts or colours, the whole has to belong
/// to that producer, and to one part.
/// @param whole_cell says the cell they are halves of; asked only if they have different owners, of which one
/// may contain both.
template <int D, typename WholeCell>
std::optional<std::int32_t> owner_of_both(const Network<D>& network, Localizer<D>& localizer,
                                          std::int32_t one, std::int32_t other, const WholeCell& whole_cell) {
  if (one == other) return one;
  if (network.part_of(Container::producer(one)) != network.part_of(Container::producer(other)))
    return std::nullopt;
  const bool shows = network.is_divided() || network.has_colours;
  const std::int32_t first = Container::producer(one), second = Container::producer(other);
  if (first == second) return Container::from(first);
  for (const std::int32_t owner : {std::min(first, second), std::max(first, second)}) {
    if (owner < 0) continue;
    const auto& producer = network.producers[static_cast<std::size_t>(owner)];
    if (!localizer.contains(producer, whole_cell())) continue;
    const bool is_cut_away = one == Container::from(owner) || other == Container::from(owner);
    if (!is_cut_away && localizer.is_left(producer, whole_cell())) return owner;
    if (!shows) return Container::from(owner);
  }
  return std::nullopt;
}

}  // namespace bsp2::dataflow
