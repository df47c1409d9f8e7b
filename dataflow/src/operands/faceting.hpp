#pragma once

#include <cstdint>

#include "bsp2/dataflow/network/network.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// Which polytopes take the place of a truly round solid.
enum class Facets : std::uint8_t {
  inside,  ///< inscribed
  around   ///< circumscribed
};

/// How many corners the circles of the polyhedra have that take the place of a ball, cylinder, cone or torus.
std::uint32_t corners_of_circles(const model::Primitive& primitive, int dimension);

/// A polyhedron, or several, in the place of a curved primitive, for constructs that need corners. Circles
/// have as many corners as the primitive says; else 128 in the plane, 64 in space and 12 and 8 above. What
/// reads as OpenSCAD's (Round::sides) has its polyhedra, on either side. Splines, subdivision surfaces, and
/// sections and prisms of curved solids become their cells (refined_parts.hpp).
model::Expression faceted_primitive(const model::Primitive& primitive, int dimension,
                                    const CompileOptions& options, Facets facets = Facets::inside);

}  // namespace bsp2::dataflow
