#pragma once

#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"
#include "operands/faceting.hpp"
#include "operands/nested.hpp"

namespace bsp2::dataflow {

/// Corners of convex solids in the place of a curved primitive that has no polytopes of its own: its cells,
/// refined to a 256th of its box in the plane, a 16th in space, an 8th in four dimensions and a 4th above.
/// Those that are IN (Facets::inside), or those that are IN or FUZZY (Facets::around). Those around are a
/// millionth larger than the cells.
std::vector<Points> refined_parts(const model::Primitive& primitive, int dimension,
                                  const CompileOptions& options, Facets facets);

}  // namespace bsp2::dataflow
