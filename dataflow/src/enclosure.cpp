#include "enclosure.hpp"

#include <utility>
#include <vector>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/builder.hpp"
#include "nested.hpp"
#include "placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;

namespace {

bool is_undecided(const model::Primitive& primitive) {
  const auto* polytope = std::get_if<model::Polytope>(&primitive);
  return polytope != nullptr && polytope->undecided;
}

/// Round as the user meant it; OpenSCAD's solids that --curved makes round are polyhedra in constructs, as OpenSCAD says.
bool is_truly_round(const model::Primitive& primitive) {
  const auto* round = std::get_if<model::Round>(&primitive);
  return std::holds_alternative<model::Torus>(primitive) || (round != nullptr && round->sides == 0);
}

}  // namespace

bool is_only_enclosed(const Expression& solid) {
  bool found = false;
  with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
    found = found || is_truly_round(*placed.primitive) || is_undecided(*placed.primitive);
    return Expression(placed.dimension);
  });
  return found;
}

Expression with_facets(const Expression& solid, Facets facets, const CompileOptions& options) {
  return with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) -> Expression {
    const int dimension = placed.dimension;
    const bool round = is_truly_round(*placed.primitive), unknown = is_undecided(*placed.primitive);
    if ((round || unknown) && placed.both)
      throw Error("a symmetric difference of round solids can not be enclosed between polytopes; write it as the difference of a union and an intersection");
    const bool around = (facets == Facets::around) != placed.negated;
    const auto put = [&](Expression primitive) { return model::transform(placed.matrix, std::move(primitive)); };
    if (unknown && !around) return Expression(dimension);
    if (unknown) {
      auto polytope = std::get<model::Polytope>(*placed.primitive);
      polytope.undecided = false;
      return put(make(dimension, std::move(polytope)));
    }
    if (model::is_curved(*placed.primitive)) return put(faceted_primitive(*placed.primitive, dimension, options, around ? Facets::around : Facets::inside));
    return put(make(dimension, *placed.primitive));
  });
}

Expression undecided(const Expression& solid, const CompileOptions& options) {
  std::vector<Expression> parts;
  for (const Points& corners : convex_parts(solid, options)) parts.push_back(model::undecided_hull(solid.dimension(), corners));
  return united(solid.dimension(), std::move(parts));
}

Expression between(const Expression& inside, const Expression& around, const CompileOptions& options) {
  return united(around.dimension(), {inside, undecided(around, options)});
}

}  // namespace bsp2::dataflow
