#pragma once

#include <vector>

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "bsp2/supersteps/state/run_options.hpp"
#include "bsp2/supersteps/state/run_result.hpp"

namespace bsp2::supersteps {

/// The sums over the cells of an evaluation as intervals.
template <int D>
Measures measures_of(const dataflow::Totals<D>& totals);

/// Evaluates each sub-expression that the model measures by itself, as far as the run went: with its level
/// and the tolerance of its report, whatever an eye sees. Not collective.
std::vector<NamedMeasures> measuring(const model::Expression& model, const RunOptions& options,
                                     const RunReport& report);

}  // namespace bsp2::supersteps
