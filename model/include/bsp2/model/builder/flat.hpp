#pragma once

#include <span>

#include "bsp2/model/expression/expression.hpp"

/// Sets of points in one hyperplane. They have no inside, so they are no solids; but hulls, sums and shadows
/// take their points.
namespace bsp2::model {

/// The hull of points that lie in a hyperplane, on a line or in one place: a polytope of corners that has no
/// half-spaces.
///
/// @param points `dimension` coordinates each, not none; they may be off the hyperplane by rounding.
/// @param undecided as of a Polytope: only what is outside of it is known.
Polytope flat_polytope(int dimension, std::span<const double> points, bool undecided = false);

/// Whether a primitive is such a set.
bool is_flat(const Primitive& primitive);

/// Where the points of such a set lie, for messages: "in one plane" of space, "on one line" of the plane,
/// else "in one hyperplane".
const char* flat_place(int dimension);

}  // namespace bsp2::model
