#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>

#include "bsp2/dataflow/localizer.hpp"

namespace bsp2::dataflow {

/// The primitive that two halves of a cell are in together, if one of theirs has both: then the cut between them was not needed.
/// @param whole_cell says the cell they are halves of; asked only if they name different primitives, of which one may contain both.
template <int D, typename WholeCell>
std::optional<std::int32_t> part_of_both(const Network<D>& network, Localizer<D>& localizer, std::int32_t one, std::int32_t other,
                                         const WholeCell& whole_cell) {
  if (one == other) return one;
  for (const std::int32_t part : {std::min(one, other), std::max(one, other)})
    if (part >= 0 && localizer.contains(network.producers[static_cast<std::size_t>(part)], whole_cell())) return part;
  return std::nullopt;
}

}  // namespace bsp2::dataflow
