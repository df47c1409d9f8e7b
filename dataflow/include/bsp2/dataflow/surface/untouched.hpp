#pragma once

#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/surface/round_solid.hpp"

namespace bsp2::dataflow {

/// The truly round solids that are in the model as they are: they stand below unions alone, and the box of
/// each misses those of all other primitives. What a map has stretched, so that a ball is none any more, is
/// left out. In the order of the network.
[[nodiscard]] std::vector<geometry::RoundSolid> untouched_rounds(const Network<3>& network);

}  // namespace bsp2::dataflow
