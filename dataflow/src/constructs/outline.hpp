#pragma once

#include <array>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// Closed paths around a plane solid, which lies on their left: outer ones counter-clockwise, holes
/// clockwise. They may touch themselves and each other in points, never cross. No corner lies between two
/// edges of one line.
using Outline = std::vector<std::vector<std::array<double, 2>>>;

/// What hyperplanes of plane solids are merged by whose outline is traced, as a share of the bounding box:
/// whatever CompileOptions say, since edges that differ by rounding alone would leave gaps and slivers of
/// which no construct could make anything.
constexpr double outline_coincidence = 1e-9;

/// The outline of a resolved expression of dimension 2: those edges of its cells that do not cancel.
/// @throws std::logic_error that names the place if they do not close.
Outline outline_of(const model::Expression& solid, const CompileOptions& options);

/// Twice the area is the sum over the edges of x_i y_{i+1} - x_{i+1} y_i.
double signed_area(const std::vector<std::array<double, 2>>& path);

}  // namespace bsp2::dataflow
