#pragma once

#include <vector>

#include "bsp2/model/expression/expression.hpp"

namespace bsp2::model {

/// An axis-parallel box that holds a solid.
struct Bounds {
  std::vector<double> lower,
      upper;           ///< D coordinates each; lower > upper: the solid is empty; infinite: nothing bounds it
  bool exact = false;  ///< the solid reaches all sides of the box, but for rounding
  [[nodiscard]] bool is_empty() const;
  [[nodiscard]] bool is_finite() const;  ///< also if it is empty
};

/// The bounds of an expression, without evaluating it: what TOP, ALIGN and SIZE of PLaSM need.
///
/// Exact (but for outward rounding by 2^-50 of the coordinates) for primitives under any maps, and for
/// unions, products, sums, hulls, shadows, sweeps and straight extrusions of such. Else the box may be too
/// large: an intersection has what the boxes of its operands have in common, a difference has the box of its
/// first operand, a map of a Boolean the box around the mapped box. Where nothing bounds it (complements,
/// `resize` of what is not known exactly, mitred offsets, a projective map whose plane at infinity meets the
/// box) it is infinite. Time is linear in the nodes and the corners of the primitives.
Bounds bounds(const Expression& expression);

}  // namespace bsp2::model
