#pragma once

#include <functional>
#include <optional>

#include "bsp2/supersteps/ranks/ranks.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// Evaluates a model: the loop of supersteps. The cells depend on the model and the options, not on the
/// number of ranks. A snapshot that cannot be written and a boundary that cannot be found are told in the
/// report; the rest is there. Collective, within Ranks::together; the options are the same on all ranks.
/// @throws bsp2::Error for the user's mistakes. Source: the paper, section 4.2.
RunResult run(const RunOptions& options, Ranks& ranks);

/// Evaluates a model by this process alone.
RunResult run(const RunOptions& options);

/// Makes one output of several, so that it takes nothing else along if it fails. Collective; with several
/// ranks, only what they agreed on (Ranks::agree, of which `work` is made) can be got over, and all else is
/// thrown.
/// @return how it failed, alike on all ranks; nothing if it did not.
std::optional<FailedOutput> attempt(const Ranks& ranks, const std::function<void()>& work);

/// Fills in what the run cost up to now: the supersteps, time and memory of all ranks, on the master.
/// Collective.
void record_costs(Ranks& ranks, RunReport& report);

}  // namespace bsp2::supersteps
