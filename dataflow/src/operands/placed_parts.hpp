#pragma once

// What the constructs of any dimension (nd_constructs.hpp) share: maps, and what is done to one placed
// primitive after the other.

#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "bsp2/model/builder/builder.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/nested.hpp"

namespace bsp2::dataflow {

using Real = long double;

inline std::size_t size(int dimension) { return static_cast<std::size_t>(dimension); }

model::Expression make(int dimension, model::Node::Value value);

/// A union without the solids that are nothing.
model::Expression united(int dimension, std::vector<model::Expression> solids);

/// The hull of points, one at least; where they lie in a hyperplane, a flat polytope (bsp2/model/flat.hpp).
model::Expression spanned(int dimension, const Points& points);

/// The ball that a primitive is, or null.
const model::Round* ball_of(const model::Primitive& primitive);

/// A (D+1) x (D+1) matrix, the identity at first.
struct Affine {
  std::size_t d;
  std::vector<double> entries;
  explicit Affine(std::size_t dimension) : d(dimension), entries((d + 1) * (d + 1)) {
    for (std::size_t i = 0; i <= d; ++i) entries[i * (d + 2)] = 1;
  }
  Affine(std::size_t dimension, std::vector<double> given) : d(dimension), entries(std::move(given)) {}
  double& at(std::size_t i, std::size_t j) { return entries[i * (d + 1) + j]; }
  [[nodiscard]] double at(std::size_t i, std::size_t j) const { return entries[i * (d + 1) + j]; }
};

model::Expression moved(const model::Expression& solid, std::span<const double> by);

struct AxisBox {
  std::vector<double> lower, upper;
  [[nodiscard]] std::vector<double> lengths() const {
    std::vector<double> result;
    for (std::size_t i = 0; i < lower.size(); ++i) result.push_back(upper[i] - lower[i]);
    return result;
  }
};

/// The ellipsoid of all points centre + A y, |y| <= 1. @param rows of A, as many as `centre` has coordinates
/// and at least as long.
model::Expression ellipsoid(const std::vector<Real>& centre, std::vector<Real> rows);

/// A symmetric orthogonal matrix that maps the last unit vector to `u`, of length 1.
std::vector<Real> reflection_to(const std::vector<Real>& u);

/// Calls use(corners) for convex solids that make up the placed primitive together.
void for_convex_parts(const PlacedPrimitive& placed, const ConstructContext& context,
                      const std::function<void(const Points&)>& use);

/// The solid, or with polyhedra in the place of what is round if there is anything round but balls in it.
model::Expression of_polytopes_and_balls(const model::Expression& solid, const ConstructContext& context);

/// A union of what `make_image` makes of the primitives of a union, else of the convex parts of the solid.
/// @param make_image takes the corners of a convex solid; @param ball_image a placed ball.
model::Expression distributed(const model::Expression& operand, int dimension,
                              const ConstructContext& context,
                              const std::function<model::Expression(const Points&)>& make_image,
                              const std::function<model::Expression(const PlacedPrimitive&)>& ball_image);

}  // namespace bsp2::dataflow
