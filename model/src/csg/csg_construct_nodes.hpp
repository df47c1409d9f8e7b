#pragma once

#include "csg/csg_nodes.hpp"

/// The nodes that make another solid of their children, and those that OpenSCAD does not have.
namespace bsp2::model {

std::optional<Construct> read_hull(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_minkowski(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_fill(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_offset(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_projection(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_resize(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_linear_extrude(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_rotate_extrude(const Arguments& arguments, const Warn& warn);
std::optional<Construct> read_roof(const Arguments& arguments, const Warn& warn);

/// The nodes of any dimension (docs/expressions.md). Unlike OpenSCAD's they accept only arguments that they
/// know.
std::span<const NodeRow> nodes_of_any_dimension();
/// docs/curved.md has their arguments.
std::span<const NodeRow> spline_nodes();

}  // namespace bsp2::model
