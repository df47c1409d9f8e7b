#pragma once

#include <span>
#include <vector>

#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Where points are, from the BSP tree of a result. Not collective: for the master, which has all cells.
/// @param points D numbers each.
template <int D>
std::vector<Answer> querying(const geometry::HyperplaneTable<D>& table, const RunResult& result,
                             std::span<const double> points, unsigned threads);

}  // namespace bsp2::supersteps
