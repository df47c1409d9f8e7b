#pragma once

#include <optional>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Finds the boundary without cells: each rank traces the surface in some regions, and the master puts it
/// together. The report has measures, but neither cells nor a digest of them. Collective.
/// @return nothing where too many operands meet in one place: then cells are found sooner.
/// @pre dataflow::has_plain_facets(network).
std::optional<RunResult> tracing(Ranks& ranks, dataflow::Network<3>& network, const RunOptions& options,
                                 const RunReport& report);

}  // namespace bsp2::supersteps
