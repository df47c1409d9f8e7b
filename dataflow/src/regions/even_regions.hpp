#pragma once

#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/network/network.hpp"

namespace bsp2::dataflow {

/// Regions that are short: the root cell is cut `cuts` times in two across the longest axis, in the middle of
/// what is undecided. A region in which nothing is undecided is not cut further.
template <int D>
std::vector<Region<D>> even_regions(const Network<D>& network, unsigned cuts);

}  // namespace bsp2::dataflow
