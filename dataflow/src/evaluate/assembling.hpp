#pragma once

#include "evaluate/evaluation_context.hpp"

namespace bsp2::dataflow {

/// What a context has done, as one result: its nodes as one BSP tree a region, and the regions in which
/// something is left.
template <int D>
void assemble(EvaluationContext<D>& context, Evaluation<D>& result);

}  // namespace bsp2::dataflow
