#pragma once

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/supersteps/state/run_options.hpp"

namespace bsp2::supersteps {

/// How far a run evaluates, for the model and for the measured parts of it alike.
inline dataflow::EvaluateOptions limits_of(const RunOptions& options, unsigned threads) {
  dataflow::EvaluateOptions evaluate;
  evaluate.threads = threads;
  evaluate.level = options.level;
  evaluate.tolerance = options.tolerance;
  evaluate.tolerance_shares = options.tolerance_shares;
  evaluate.budget_seconds = options.budget_seconds;
  evaluate.cells = options.cells;
  evaluate.interrupted = options.interrupted;
  return evaluate;
}

}  // namespace bsp2::supersteps
