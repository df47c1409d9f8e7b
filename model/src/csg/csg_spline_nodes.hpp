#pragma once

#include "csg/csg_nodes.hpp"

namespace bsp2::model {

/// Whether a node of this kind is read by the function here.
bool is_spline_node(NodeKind kind);

/// The solid or thin set of a bezier, bspline, nurbs or subdivision node: docs/curved.md has their arguments.
/// @throws bsp2::Error without a position, also for arguments that it does not know.
Expression make_spline_node(NodeKind kind, const Arguments& arguments, NodePool& pool);

}  // namespace bsp2::model
