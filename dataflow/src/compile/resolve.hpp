#pragma once

#include <string>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// The expression with every construct (hulls, extrusions, offsets, ...) replaced by primitives, maps and
/// Booleans.
///
/// What a construct needs to know about its operands (their points, convex parts or outlines) comes from
/// evaluating them on one thread, or from their primitives where they are simply united. Equal subtrees are
/// resolved once. The result depends on the arguments alone, so all ranks get the same.
/// @param warnings gets a text for each construct that comes out empty because its operand does not allow it.
model::Expression resolve(const model::Expression& expression, const CompileOptions& options,
                          std::vector<std::string>& warnings);

}  // namespace bsp2::dataflow
