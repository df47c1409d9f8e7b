#pragma once

#include <array>
#include <functional>
#include <vector>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/geometry/cells/cell_batch.hpp"
#include "bsp2/model/expression/expression.hpp"

/// Sub-expressions that are evaluated during compilation, for the constructs that need to know what comes
/// out. Expressions are resolved here: no construct is left in them.
namespace bsp2::dataflow {

/// Evaluates a plane solid and shows its IN cells, in an order that is always the same, with what they were
/// made of.
using UseCells = std::function<void(const Network<2>&, const std::vector<geometry::CellBatch>&)>;
void evaluate_plane_cells(const model::Expression& solid, const CompileOptions& options, const UseCells& use);

template <int D>
using PointSet = std::vector<std::array<double, D>>;

bool is_convex(const model::Primitive& primitive);

/// Points of any dimension, one after the other.
using Points = std::vector<double>;

/// Corners of cells, one cell after the other.
struct RefinedCells {
  std::vector<Points> in, fuzzy;  ///< IN cells are put together where their union is convex
};

/// How far a curved solid is refined.
struct Fineness {
  double thickness;  ///< of FUZZY cells, as a share of the side of the root cell
  unsigned cuts;  ///< into 2^cuts regions at first: FUZZY cells may be thin and long, but none is longer than
                  ///< its region
};

/// The cells of a curved solid.
RefinedCells refined_cells(const model::Expression& solid, const Fineness& fineness,
                           const CompileOptions& options);

/// Points whose convex hull is that of the solid.
template <int D>
PointSet<D> spanning_points(const model::Expression& solid, const CompileOptions& options);
Points spanning_points(const model::Expression& solid, const CompileOptions& options);

/// Point sets whose convex hulls make up the solid together. They may overlap.
template <int D>
std::vector<PointSet<D>> convex_parts(const model::Expression& solid, const CompileOptions& options);
std::vector<Points> convex_parts(const model::Expression& solid, const CompileOptions& options);

/// A primitive where it is in a solid, with the product of all maps above it.
struct PlacedPrimitive {
  const model::Primitive* primitive;
  int dimension;
  std::vector<double> matrix;       ///< (D+1) x (D+1), row-major
  bool negated = false;             ///< what is in it is not in the solid
  bool both = false;                ///< it is an operand of a symmetric difference: negated or not by turns
  std::function<Points()> corners;  ///< of the placed primitive, if it has any
};

/// Whether a solid is nothing but a union of primitives.
bool is_union(const model::Expression& solid);

/// A Boolean expression with other solids, of this dimension, in the places of the primitives.
model::Expression with_primitives_replaced(
    const model::Expression& solid, int dimension,
    const std::function<model::Expression(const PlacedPrimitive&)>& leaf);

}  // namespace bsp2::dataflow
