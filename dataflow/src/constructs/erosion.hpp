#pragma once

#include <optional>

#include "operands/nested.hpp"

namespace bsp2::dataflow {

/// Where a convex set may be placed so that it lies in a convex polytope of 4 dimensions or more: the
/// polytope's half-spaces, moved inwards by as much as the set reaches towards each (its support function).
/// The Minkowski difference, within rounding.
/// @param polytope points of which it is the hull, D coordinates each; `set` likewise.
/// @return nothing where no inner point of the result was found, though it may not be empty.
std::optional<model::Expression> eroded(int dimension, const Points& polytope, const Points& set);

}  // namespace bsp2::dataflow
