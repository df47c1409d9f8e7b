#pragma once

#include "bsp2/model/expression/expression.hpp"
#include "constructs/outline.hpp"

namespace bsp2::dataflow {

/// The outline moved outwards (inwards for a negative distance), by the Clipper library, as OpenSCAD 2021.01
/// does, but on a grid of 2^-45 of the largest coordinate.
Outline offset_outline(const model::Offset& offset, const Outline& outline);

}  // namespace bsp2::dataflow
