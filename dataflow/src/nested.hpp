#pragma once

#include <array>
#include <functional>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/geometry/cell_batch.hpp"
#include "bsp2/model/expression.hpp"

/// Sub-expressions that are evaluated during compilation, for the constructs that need to know what comes out.
/// Expressions are resolved here: no construct is left in them. D = 2 and 3.
namespace bsp2::dataflow {

/// The IN cells, in an order that is always the same.
template <int D>
std::vector<geometry::CellBatch> evaluate_cells(const model::Expression& solid, const CompileOptions& options);

template <int D>
using PointSet = std::vector<std::array<double, D>>;

/// Points whose convex hull is that of the solid.
template <int D>
PointSet<D> spanning_points(const model::Expression& solid, const CompileOptions& options);

/// Point sets whose convex hulls make up the solid together. They may overlap.
template <int D>
std::vector<PointSet<D>> convex_parts(const model::Expression& solid, const CompileOptions& options);

/// The Boolean expression of a plane solid with other primitives in the places of its own.
/// @param leaf makes the substitute of a convex primitive with these corners, in the frame of the solid.
model::Expression with_primitives_replaced(const model::Expression& solid, const std::function<model::Expression(const PointSet<2>&)>& leaf);

}  // namespace bsp2::dataflow
