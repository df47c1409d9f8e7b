#pragma once

#include "csg_nodes.hpp"

namespace bsp2::model {

/// The solid or thin set of a bezier, bspline (also called nurbs) or subdivision node: docs/curved.md has their arguments.
/// @throws bsp2::Error without a position, also for arguments that it does not know.
Expression make_spline_node(NodeKind kind, const Arguments& arguments, NodePool& pool);

}  // namespace bsp2::model
