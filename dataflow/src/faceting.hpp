#pragma once

#include "bsp2/dataflow/network.hpp"
#include "bsp2/model/expression.hpp"

namespace bsp2::dataflow {

/// A polyhedron, or several, in the place of a curved primitive, for constructs that need corners: inscribed, with as many corners around
/// as OpenSCAD gives what has its size. Above three dimensions they are coarse: circles have 16 corners, those of balls of four and more dimensions 8.
/// @throws bsp2::Error for what has no such polyhedron: splines, subdivision surfaces, and sections and prisms of curved solids.
model::Expression faceted_primitive(const model::Primitive& primitive, int dimension, const CompileOptions& options);

}  // namespace bsp2::dataflow
