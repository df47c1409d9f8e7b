#pragma once

#include "evaluate/crew.hpp"

namespace bsp2::dataflow {

/// What a crew has done, as one result: its nodes as one BSP tree a region, and the regions in which
/// something is left.
template <int D>
void assemble(Crew<D>& crew, Evaluation<D>& result);

}  // namespace bsp2::dataflow
