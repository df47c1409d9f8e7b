#pragma once

#include <optional>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Finds the boundary without cells: each rank traces the surface in a box of space of its own, and all put
/// it together. The report has measures, but neither cells nor a digest of them. Collective.
/// @return nothing where too many operands meet in one place: then cells are found sooner.
/// @pre dataflow::has_plain_facets(network).
std::optional<RunResult> tracing(Ranks& ranks, dataflow::Network<3>& network, const RunOptions& options,
                                 const RunReport& report);

/// What has been found of the boundary before cells are made; on the master.
struct TracedBoundary {
  std::optional<geometry::TriangleSurface> boundary;
  std::optional<geometry::Brep> faces;
};

/// Finds the boundary in the same way where cells are wanted, too. Adds hyperplanes to the network.
/// Collective.
/// @return nothing where that cannot be done, or was interrupted. @pre dataflow::has_plain_facets(network).
std::optional<TracedBoundary> trace_boundary(Ranks& ranks, dataflow::Network<3>& network,
                                             const RunOptions& options, unsigned threads);

}  // namespace bsp2::supersteps
