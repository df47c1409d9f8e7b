#include "operands/refined_parts.hpp"

#include <cmath>

#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {
namespace {

/// So that a sum with them ends in seconds: it has a polytope for each cell.
Fineness fineness_of(int dimension) {
  if (dimension == 2) return {1.0 / 256, 6};
  if (dimension == 3) return {1.0 / 16, 6};
  return {dimension == 4 ? 1.0 / 8 : 1.0 / 4, 4};
}

/// A convex solid a millionth larger about its middle: more than the rounding of its corners, if it is not
/// thinner than 1e-9 of its coordinates.
Points enlarged(Points corners, std::size_t dimension) {
  constexpr double factor = 1 + 1e-6;
  const std::size_t count = corners.size() / dimension;
  for (std::size_t axis = 0; axis < dimension; ++axis) {
    double middle = 0;
    for (std::size_t i = axis; i < corners.size(); i += dimension)
      middle += corners[i] / static_cast<double>(count);
    for (std::size_t i = axis; i < corners.size(); i += dimension)
      corners[i] = middle + factor * (corners[i] - middle);
  }
  return corners;
}

}  // namespace

std::vector<Points> refined_parts(const model::Primitive& primitive, int dimension,
                                  const CompileOptions& options, Facets facets) {
  RefinedCells cells = refined_cells(make(dimension, primitive), fineness_of(dimension), options);
  if (facets == Facets::inside)
    return std::move(cells.in);  // without gaps between them: what is shrunk goes by these
  std::vector<Points> parts;
  for (const auto* some : {&cells.in, &cells.fuzzy})
    for (const Points& corners : *some) parts.push_back(enlarged(corners, size(dimension)));
  return parts;
}

}  // namespace bsp2::dataflow
