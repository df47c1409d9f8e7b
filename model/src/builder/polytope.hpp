#pragma once

#include <optional>
#include <span>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// The convex hull of points with `dimension` >= 2 coordinates each, by Qhull; nothing where it is flat.
/// Source: Barber, Dobkin, Huhdanpaa, "The Quickhull algorithm for convex hulls" (1996).
std::optional<Polytope> hull_polytope(int dimension, std::span<const double> points);

}  // namespace bsp2::model
