#include "operands/placed_parts.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "bsp2/model/expression/bottom_up.hpp"

namespace bsp2::dataflow {

using model::Expression;
using model::Node;

bool is_empty(const model::Expression& solid) {
  const auto* boolean = std::get_if<model::Boolean>(&solid.node().value);
  return boolean != nullptr && boolean->children.empty();
}

bool is_unbounded(const model::Expression& solid) {
  using model::Operation;
  return model::BottomUp<bool>().run(
      solid, [](const Expression&) -> std::optional<bool> { return std::nullopt; },
      [](const Node& node, std::vector<bool>&& children) {
        const auto* boolean = std::get_if<model::Boolean>(&node.value);
        if (boolean == nullptr) return !children.empty() && children[0];  // a primitive, or the only child
        const bool any = std::find(children.begin(), children.end(), true) != children.end();
        switch (boolean->operation) {
          case Operation::unite:
            return any;
          case Operation::intersect:
            return std::find(children.begin(), children.end(), false) == children.end();
          case Operation::subtract:
            return children[0] && std::find(children.begin() + 1, children.end(), true) == children.end();
          case Operation::symmetric_difference:
            return std::count(children.begin(), children.end(), true) % 2 == 1;
          case Operation::complement:
            return !children[0];
        }
        return false;
      });
}

Expression make(int dimension, Node::Value value) {
  return Expression(std::make_shared<Node>(dimension, std::move(value)));
}

Expression united(int dimension, std::vector<Expression> solids) {
  std::erase_if(solids, [](const Expression& solid) { return solid.node().parts == 0; });
  if (solids.empty()) return Expression(dimension);
  return solids.size() == 1 ? solids[0] : model::unite(std::move(solids));
}

Expression spanned(int dimension, const Points& points) {
  Expression hull = model::convex_hull(dimension, points);
  return is_empty(hull) ? make(dimension, model::flat_polytope(dimension, points)) : hull;
}

const model::Round* ball_of(const model::Primitive& primitive) {
  const auto* round = std::get_if<model::Round>(&primitive);
  return round != nullptr && round->lengths.empty() ? round : nullptr;
}

Expression moved(const Expression& solid, std::span<const double> by) {
  Affine map(by.size());
  for (std::size_t i = 0; i < by.size(); ++i) map.at(i, by.size()) = by[i];
  return model::transform(map.entries, solid);
}

Expression ellipsoid(const std::vector<Real>& centre, std::vector<Real> rows) {
  const std::size_t d = centre.size(), n = rows.size() / d;
  Affine map(d);
  for (std::size_t j = 0; j < d;
       ++j) {  // Gram and Schmidt, row after row: squares of lengths would lose the digits of what is thin
    const auto at = [&](std::size_t i, std::size_t k) -> Real& { return rows[i * n + k]; };
    Real length = 0;
    for (std::size_t k = 0; k < n; ++k) length += at(j, k) * at(j, k);
    length = std::sqrt(length);
    if (!(length > 0)) return Expression(static_cast<int>(d));
    for (std::size_t k = 0; k < n; ++k) at(j, k) /= length;
    map.at(j, j) = static_cast<double>(length);
    map.at(j, d) = static_cast<double>(centre[j]);
    for (std::size_t i = j + 1; i < d; ++i) {
      Real along = 0;
      for (std::size_t k = 0; k < n; ++k) along += at(i, k) * at(j, k);
      for (std::size_t k = 0; k < n; ++k) at(i, k) -= along * at(j, k);
      map.at(i, j) = static_cast<double>(along);
    }
  }
  return model::transform(map.entries, model::ball(static_cast<int>(d), 1));
}

std::vector<Real> reflection_to(const std::vector<Real>& u) {
  const std::size_t n = u.size();
  std::vector<Real> v = u, matrix(n * n);
  v[n - 1] -= 1;
  Real square = 0;
  for (const Real x : v) square += x * x;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      matrix[i * n + j] = (i == j ? 1 : 0) - (square > 0 ? 2 * v[i] * v[j] / square : 0);
  return matrix;
}

void for_convex_parts(const PlacedPrimitive& placed, const ConstructContext& context,
                      const std::function<void(const Points&)>& use) {
  const auto* mesh = std::get_if<model::TriangleMesh>(placed.primitive);
  if (mesh == nullptr || mesh->convex) return use(placed.corners());
  for (const Points& part : convex_parts(
           model::transform(placed.matrix, make(placed.dimension, *placed.primitive)), context.options))
    use(part);
}

namespace {

bool is_polytope_or_ball(const model::Primitive& primitive) {
  const auto* polytope = std::get_if<model::Polytope>(&primitive);
  return ball_of(primitive) != nullptr ||
         (!model::is_curved(primitive) && (polytope == nullptr || !polytope->undecided));
}

}  // namespace

bool is_of_polytopes_and_balls(const Expression& solid) {
  bool all = true;
  with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
    all = all && is_polytope_or_ball(*placed.primitive);
    return Expression(placed.dimension);
  });
  return all;
}

Expression of_polytopes_and_balls(const Expression& solid, const ConstructContext& context) {
  return is_of_polytopes_and_balls(solid) ? solid : context.faceted(solid);
}

Expression distributed(const Expression& operand, int dimension, const ConstructContext& context,
                       const std::function<Expression(const Points&)>& make_image,
                       const std::function<Expression(const PlacedPrimitive&)>& ball_image) {
  std::vector<Expression> images;
  if (!is_union(operand)) {
    for (const Points& part : convex_parts(context.faceted(operand), context.options))
      images.push_back(make_image(part));
    return united(dimension, std::move(images));
  }
  with_primitives_replaced(
      of_polytopes_and_balls(operand, context), operand.dimension(), [&](const PlacedPrimitive& placed) {
        if (ball_of(*placed.primitive) != nullptr)
          images.push_back(ball_image(placed));
        else
          for_convex_parts(placed, context,
                           [&](const Points& corners) { images.push_back(make_image(corners)); });
        return Expression(placed.dimension);
      });
  return united(dimension, std::move(images));
}

}  // namespace bsp2::dataflow
