#pragma once

#include <optional>

#include "loop/tracing.hpp"

namespace bsp2::supersteps {

/// The boundary that the snapshot holds from which the run goes on, if it is that of this run: all was
/// decided there, to the same limits, and its faces are there if they are wanted. Collective.
/// @param parts of the model; a model without any is one.
std::optional<TracedBoundary> kept_boundary(Ranks& ranks, const RunOptions& options, std::size_t parts);

/// Whether a snapshot with its boundary has all that is asked for, so that no cells need be read.
bool is_boundary_enough(const RunOptions& options);

/// Puts the boundary that was found into the snapshot that this run has written; if that fails a warning says
/// so, also where warnings are errors: the snapshot is whole without it, and has been written. Collective.
/// @param step of the superstep.
void keep_boundary(Ranks& ranks, const RunOptions& options, unsigned step, RunResult& result);

}  // namespace bsp2::supersteps
