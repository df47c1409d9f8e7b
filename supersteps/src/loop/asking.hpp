#pragma once

#include <memory>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/dataflow/regions/partition.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Tells of the boundary in the report, if there is one.
void describe_boundary(RunResult& result);

/// What answers questions about the cells of a finished run that the master holds. Not collective.
/// @param partition that the cells were found by; its regions are not needed.
template <int D>
std::shared_ptr<const Asked> asked(std::shared_ptr<const dataflow::Network<D>> network,
                                   const dataflow::Partition<D>& partition, unsigned threads);

}  // namespace bsp2::supersteps
