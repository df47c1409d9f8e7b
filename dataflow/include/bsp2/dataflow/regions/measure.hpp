#pragma once

#include "bsp2/dataflow/evaluate/evaluate.hpp"
#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// The integration filter: evaluates a solid and keeps nothing but its volume and its first and second
/// moments, as intervals while FUZZY cells remain (see Totals). Round solids need a level, a tolerance or a
/// budget in `how`. Thread rule: as `evaluate`. @pre solid.dimension() == D. Source: the paper, section 4.1,
/// "integration filters".
template <int D>
Totals<D> measure(const model::Expression& solid, const EvaluateOptions& how,
                  const CompileOptions& options = {});

}  // namespace bsp2::dataflow
