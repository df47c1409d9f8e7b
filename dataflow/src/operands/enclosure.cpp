#include "operands/enclosure.hpp"

#include <algorithm>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "bsp2/model/expression/bottom_up.hpp"
#include "operands/nested.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;

namespace {

bool is_undecided(const model::Primitive& primitive) {
  const auto* polytope = std::get_if<model::Polytope>(&primitive);
  return polytope != nullptr && polytope->undecided;
}

/// Round as the user meant it; OpenSCAD's solids that --curved makes round are polyhedra in constructs, as
/// OpenSCAD says.
bool is_truly_round(const model::Primitive& primitive) {
  const auto* round = std::get_if<model::Round>(&primitive);
  return std::visit([]<typename Shape>(const Shape&) { return model::HasFineness<Shape>; }, primitive) &&
         (round == nullptr || round->sides == 0);
}

/// Nobody knows polytopes for it but by evaluating it.
bool is_refined(const model::Primitive& primitive) {
  return std::holds_alternative<model::Spline>(primitive) ||
         std::holds_alternative<model::SubdivisionSurface>(primitive) ||
         std::holds_alternative<model::Preimage>(primitive);
}

bool is_only_enclosed(const model::Primitive& primitive) {
  return is_truly_round(primitive) || is_refined(primitive) || is_undecided(primitive);
}

bool contains(const Expression& solid, bool (*is_meant)(const model::Primitive&)) {
  bool found = false;
  with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
    found = found || is_meant(*placed.primitive);
    return Expression(placed.dimension);
  });
  return found;
}

/// A solid in which no operand of a symmetric difference is round: where each primitive helps, or each takes
/// away, and none does both.
struct Ordered {
  Expression solid;
  double primitives;  // of the expanded expression
  bool is_round;
};

Ordered differing(const Ordered& a, const Ordered& b) {
  constexpr double most = 500;
  Ordered result{model::unite({model::subtract({a.solid, b.solid}), model::subtract({b.solid, a.solid})}),
                 2 * (a.primitives + b.primitives), true};
  if (result.primitives > most)
    throw Error(
        "symmetric_difference: of round solids in a construct it is a union of differences, which doubles "
        "with each operand; these are too many");
  return result;
}

/// Symmetric differences of round solids as unions of differences.
Expression by_differences(const Expression& solid) {
  using model::Node;
  return model::BottomUp<Ordered>()
      .run(
          solid, [](const Expression&) -> std::optional<Ordered> { return std::nullopt; },
          [](const Node& node, std::vector<Ordered>&& images) -> Ordered {
            if (const auto* primitive = std::get_if<model::Primitive>(&node.value))
              return {make(node.dimension, *primitive), 1, is_only_enclosed(*primitive)};
            Ordered result{Expression(node.dimension), 0, false};
            std::vector<Expression> children;
            for (const Ordered& image : images) {
              result.primitives += image.primitives;
              result.is_round = result.is_round || image.is_round;
              children.push_back(image.solid);
            }
            if (const auto* boolean = std::get_if<model::Boolean>(&node.value)) {
              if (boolean->operation != model::Operation::symmetric_difference || !result.is_round) {
                result.solid = make(node.dimension,
                                    model::Boolean{boolean->operation, std::move(children), boolean->parts});
                return result;
              }
              Ordered all = images[0];
              for (std::size_t i = 1; i < images.size(); ++i) all = differing(all, images[i]);
              return all;
            }
            if (const auto* transform = std::get_if<model::Transform>(&node.value))
              result.solid = make(node.dimension, model::Transform{transform->matrix, children[0]});
            else
              result.solid = children[0];  // the construct has the colour and the name around it
            return result;
          })
      .solid;
}

}  // namespace

bool is_only_enclosed(const Expression& solid) { return contains(solid, is_only_enclosed); }

bool is_refined(const Expression& solid) { return contains(solid, is_refined); }

bool has_prisms(const Expression& solid) {
  return !contains(solid, [](const model::Primitive& primitive) {
    return std::visit([]<typename Shape>(const Shape&) { return model::TellsOfItself<Shape>; }, primitive);
  });
}

Expression with_facets(const Expression& solid, Facets facets, const CompileOptions& options) {
  return with_primitives_replaced(by_differences(solid), solid.dimension(),
                                  [&](const PlacedPrimitive& placed) -> Expression {
                                    const int dimension = placed.dimension;
                                    const bool unknown = is_undecided(*placed.primitive);
                                    const bool around = (facets == Facets::around) != placed.negated;
                                    const auto put = [&](Expression primitive) {
                                      return model::transform(placed.matrix, std::move(primitive));
                                    };
                                    if (unknown && !around) return Expression(dimension);
                                    if (unknown) {
                                      auto polytope = std::get<model::Polytope>(*placed.primitive);
                                      polytope.undecided = false;
                                      return put(make(dimension, std::move(polytope)));
                                    }
                                    if (model::is_curved(*placed.primitive))
                                      return put(faceted_primitive(*placed.primitive, dimension, options,
                                                                   around ? Facets::around : Facets::inside));
                                    return put(make(dimension, *placed.primitive));
                                  });
}

std::string circle_corners_text(const std::vector<Expression>& solids) {
  std::set<std::uint32_t> counts;
  for (const Expression& solid : solids)
    with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
      if (is_truly_round(*placed.primitive))
        counts.insert(corners_of_circles(*placed.primitive, placed.dimension));
      return Expression(placed.dimension);
    });
  std::string text;
  for (const std::uint32_t count : counts) text += (text.empty() ? "" : " and ") + std::to_string(count);
  return text;
}

Expression with_fewer_corners(const Expression& solid, std::uint32_t corners) {
  return with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
    model::Primitive primitive = *placed.primitive;
    const auto limit = [&](std::uint32_t& fineness) {
      if (fineness == 0) fineness = std::min(corners, corners_of_circles(primitive, placed.dimension));
    };
    if (is_truly_round(primitive))
      std::visit(
          [&]<typename Shape>(Shape& shape) {
            if constexpr (model::HasFineness<Shape>) limit(shape.fineness);
          },
          primitive);
    return model::transform(placed.matrix, make(placed.dimension, std::move(primitive)));
  });
}

Expression undecided(const Expression& solid, const CompileOptions& options) {
  std::vector<Expression> parts;
  for (const Points& corners : convex_parts(solid, options)) {
    const Expression hull = model::undecided_hull(solid.dimension(), corners);
    parts.push_back(is_empty(hull)
                        ? make(solid.dimension(), model::flat_polytope(solid.dimension(), corners, true))
                        : hull);
  }
  return united(solid.dimension(), std::move(parts));
}

Expression between(const Expression& inside, const Expression& around, const CompileOptions& options) {
  return united(around.dimension(), {inside, undecided(around, options)});
}

}  // namespace bsp2::dataflow
