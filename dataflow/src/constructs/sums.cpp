// Sums of solids with others: Minkowski sums, sweeps, growing and shrinking; and hulls.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/bounds.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "constructs/convex_sum.hpp"
#include "constructs/erosion.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;

namespace {

/// Pairs of corners of two convex sets, whose sums may be corners of theirs.
constexpr std::size_t most_sums = 50'000'000;

Expression sum_of_parts(const std::vector<Points>& a, const std::vector<Points>& b, int dimension,
                        const char* what) {
  const std::size_t d = size(dimension);
  std::vector<Expression> sums;
  for (const Points& p : a)
    for (const Points& q : b) {
      if (q.size() / d > most_sums / (p.size() / d))
        throw Error(std::string(what) + ": operands of " + std::to_string(p.size() / d) + " and " +
                    counted(q.size() / d, "# point[s] [has|have] too many sums; give them fewer sides"));
      sums.push_back(spanned(dimension, sums_of_corners(dimension, p, q)));
    }
  return united(dimension, std::move(sums));
}

/// One convex primitive, wherever it is placed, without its colour: it is its own hull. What is no more than
/// that from some node on stays, so that hulls in each other share it.
std::optional<Expression> single_convex(const Expression& solid) {
  std::vector<const model::Transform*> maps;  // around what stays
  const Expression *at = &solid, *stays = &solid;
  std::size_t maps_in_it = 0;
  for (;;) {
    const auto& value = at->node().value;
    if (const auto* primitive = std::get_if<model::Primitive>(&value)) {
      const auto* polytope = std::get_if<model::Polytope>(primitive);
      const bool round = std::visit(
          []<typename Shape>(const Shape&) {
            return std::is_same_v<Shape, model::Round> || model::TellsOfItself<Shape>;
          },
          *primitive);
      if (!is_convex(*primitive) || (model::is_curved(*primitive) && !round) ||
          (polytope != nullptr && polytope->undecided))
        return std::nullopt;
      break;
    }
    const Expression* only = nullptr;
    for (const Expression& child : at->node().children()) {
      if (is_empty(child)) continue;
      if (only != nullptr) return std::nullopt;
      only = &child;
    }
    const auto* boolean = std::get_if<model::Boolean>(&value);
    if (only == nullptr || (boolean != nullptr && boolean->operation != model::Operation::unite))
      return std::nullopt;
    const auto* transform = std::get_if<model::Transform>(&value);
    if (transform != nullptr) maps.push_back(transform);
    maps_in_it = transform != nullptr ? maps_in_it + 1 : 0;
    at = only;
    if (transform == nullptr) stays = at;
  }
  Expression result = *stays;
  for (std::size_t i = maps.size() - maps_in_it; i-- > 0;)
    result = make(solid.dimension(), model::Transform{maps[i]->matrix, std::move(result)});
  return result;
}

/// One of the convex sets, if it holds all others: what is enclosed by polytopes is a union of those inside
/// and those around.
std::optional<Points> holder_of_all(const std::vector<Points>& parts, int dimension) {
  const std::size_t d = size(dimension);
  const auto is_in = [&](const std::vector<double>& half_spaces, const Points& points) {
    for (std::size_t at = 0; at < half_spaces.size(); at += d + 1)
      for (std::size_t p = 0; p < points.size(); p += d) {
        double value = half_spaces[at + d];
        for (std::size_t k = 0; k < d; ++k) value += half_spaces[at + k] * points[p + k];
        if (value > 0) return false;
      }
    return true;
  };
  for (const Points& part : parts) {
    const Expression hull = model::undecided_hull(dimension, part);
    const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
    if (primitive == nullptr) continue;
    const auto& half_spaces = std::get<model::Polytope>(*primitive).half_spaces;
    if (std::all_of(parts.begin(), parts.end(),
                    [&](const Points& other) { return &other == &part || is_in(half_spaces, other); }))
      return part;
  }
  return std::nullopt;
}

/// The corners of a solid of four dimensions or more that is known to be convex.
std::optional<Points> convex_corners(const Expression& solid, const ConstructContext& context) {
  constexpr std::size_t few = 8;
  if (solid.dimension() < 4 || (!single_convex(solid) && !is_union(solid))) return std::nullopt;
  std::vector<Points> parts = convex_parts(single_convex(solid).value_or(solid), context.options);
  if (parts.size() == 1) return std::move(parts[0]);
  return parts.size() <= few ? holder_of_all(parts, solid.dimension()) : std::nullopt;
}

}  // namespace

Expression image_of(const model::Sweep& sweep, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const int dimension = operands[0].dimension();
  const std::size_t d = size(dimension);
  const auto along_path = [&](const auto& of_segment) {
    std::vector<Expression> pieces;
    for (std::size_t i = 0; i + 1 < sweep.path.size(); ++i)
      pieces.push_back(of_segment(sweep.path[i], sweep.path[i + 1]));
    return united(dimension, std::move(pieces));
  };
  const auto of_corners = [&](const Points& corners) {
    return along_path([&](const std::vector<double>& from, const std::vector<double>& to) {
      Points both;
      for (const auto* end : {&from, &to})
        for (std::size_t i = 0; i < corners.size(); ++i) both.push_back(corners[i] + (*end)[i % d]);
      return model::convex_hull(dimension, both);
    });
  };
  // The sweep of a ball is a ball at each end and a cylinder between them, in the frame where it is a ball.
  const auto of_ball = [&](const PlacedPrimitive& placed) {
    const double radius = ball_of(*placed.primitive)->bottom;
    const Expression ball = make(dimension, *placed.primitive);
    return along_path([&](const std::vector<double>& from, const std::vector<double>& to) {
      Affine start(d, placed.matrix);
      for (std::size_t i = 0; i < d; ++i) start.at(i, d) += from[i];
      std::vector<std::vector<Real>> rows(d, std::vector<Real>(d + 1));  // A y = to - from, by elimination
      for (std::size_t i = 0; i < d; ++i) {
        for (std::size_t j = 0; j < d; ++j) rows[i][j] = static_cast<Real>(start.at(i, j));
        rows[i][d] = static_cast<Real>(to[i]) - static_cast<Real>(from[i]);
      }
      for (std::size_t k = 0; k < d; ++k) {
        std::size_t pivot = k;
        for (std::size_t i = k + 1; i < d; ++i)
          if (std::fabs(rows[i][k]) > std::fabs(rows[pivot][k])) pivot = i;
        std::swap(rows[k], rows[pivot]);
        for (std::size_t i = 0; i < d; ++i) {
          if (i == k) continue;
          const Real factor = rows[i][k] / rows[k][k];
          for (std::size_t j = k; j <= d; ++j) rows[i][j] -= factor * rows[k][j];
        }
      }
      std::vector<Real> direction;
      Real length = 0;
      for (std::size_t k = 0; k < d; ++k) {
        direction.push_back(rows[k][d] / rows[k][k]);
        length += direction[k] * direction[k];
      }
      length = std::sqrt(length);
      if (!(length > 0)) return model::transform(start.entries, ball);
      Affine turn(d), end(d);
      for (std::size_t k = 0; k < d; ++k) end.at(k, d) = static_cast<double>(direction[k]);
      for (Real& x : direction) x /= length;
      const std::vector<Real> reflection = reflection_to(direction);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < d; ++j) turn.at(i, j) = static_cast<double>(reflection[i * d + j]);
      const double lengths[] = {static_cast<double>(length)};
      return model::transform(
          start.entries, model::unite({ball, model::transform(end.entries, ball),
                                       model::transform(turn.entries, model::round_cylinder(
                                                                          dimension - 1, radius, lengths))}));
    });
  };
  return distributed(operands[0], dimension, context, of_corners, of_ball);
}

Expression image_of(const model::MinkowskiSum& sum, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const std::vector<Points> a = convex_parts(operands[0], context.options),
                            b = convex_parts(operands[1], context.options);
  if (sum.passes_over_empty && a.empty()) return operands[1];
  if (sum.passes_over_empty && b.empty()) return operands[0];
  return sum_of_parts(a, b, operands[0].dimension(), "minkowski");
}

Expression image_of(const model::Growth& growth, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const Expression& operand = operands[0];
  const int dimension = operand.dimension();
  if (growth.distance == 0) return operand;
  const double distance = std::fabs(growth.distance);
  const std::vector<double> lengths(size(dimension), 2 * distance);
  const Expression ball = growth.ball == model::Growth::Ball::cube
                              ? model::cuboid(lengths, true)
                              : model::ball_polytope(dimension, distance, growth.sides);
  std::vector<Points> ball_parts = convex_parts(ball, context.options);
  if (growth.distance > 0)
    return sum_of_parts(convex_parts(operand, context.options), ball_parts, dimension, "grow");
  // What is near to the outside goes. The ball is turned round: a point goes where its ball meets the
  // outside.
  const model::Bounds bounds = model::bounds(operand);
  if (bounds.is_empty()) return operand;
  if (!bounds.is_finite())
    throw Error("shrink: the solid has no bounds; intersect it with something that has");
  if (const auto corners = convex_corners(operand, context))
    if (auto itself = eroded(dimension, *corners, ball_parts[0])) return *std::move(itself);
  AxisBox around{bounds.lower, bounds.upper};
  for (std::size_t i = 0; i < around.lower.size(); ++i) {
    around.lower[i] -= 2 * distance;
    around.upper[i] += 2 * distance;
  }
  const Expression outside = model::subtract({moved(model::cuboid(around.lengths()), around.lower), operand});
  for (Points& part : ball_parts)
    for (double& x : part) x = -x;
  return model::subtract(
      {operand, sum_of_parts(convex_parts(outside, context.options), ball_parts, dimension, "shrink")});
}

bool is_convex_primitive(const Expression& solid) { return single_convex(solid).has_value(); }

Expression image_of(const model::Hull&, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  if (auto itself = single_convex(operands[0])) return *std::move(itself);
  const Points points = spanning_points(operands[0], context.options);
  return points.empty() ? Expression(operands[0].dimension()) : spanned(operands[0].dimension(), points);
}

}  // namespace bsp2::dataflow
