#pragma once

#include <array>
#include <vector>

#include "bsp2/dataflow/network.hpp"
#include "bsp2/model/expression.hpp"

namespace bsp2::dataflow {

/// Closed paths around a plane solid, which lies on their left: outer ones counter-clockwise, holes clockwise. They may
/// touch themselves and each other in points, never cross. No corner lies between two edges of one line.
using Outline = std::vector<std::vector<std::array<double, 2>>>;

/// The outline of a resolved expression of dimension 2: those edges of its cells that do not cancel.
Outline outline_of(const model::Expression& solid, const CompileOptions& options);

/// Twice the area is the sum over the edges of x_i y_{i+1} - x_{i+1} y_i.
double signed_area(const std::vector<std::array<double, 2>>& path);

}  // namespace bsp2::dataflow
