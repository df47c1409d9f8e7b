// Polyhedra in the place of curved primitives.
#include "faceting.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "bsp2/geometry/covector.hpp"
#include "bsp2/geometry/error.hpp"
#include "bsp2/model/builder.hpp"
#include "bsp2/model/tessellation.hpp"
#include "nested.hpp"
#include "placed_parts.hpp"

namespace bsp2::dataflow {
namespace {

using model::Expression;

/// The hull of a ball's corners at both ends of each other axis.
Expression of_corners(const model::Round& round, int dimension, const CompileOptions& options) {
  const int axes = dimension - static_cast<int>(round.lengths.size());
  const std::size_t d = size(dimension), ball_axes = size(axes);
  const Points ball = spanning_points(model::ball_polytope(axes, 1, axes > 3 ? 8 : 16), options);
  Points corners;
  for (std::size_t end = 0; end < std::size_t{1} << round.lengths.size(); ++end)
    for (std::size_t at = 0; at < ball.size(); at += ball_axes) {
      const double radius = (end & 1) == 0 ? round.bottom : round.top;
      for (std::size_t i = 0; i < ball_axes; ++i) corners.push_back(radius * ball[at + i]);
      for (std::size_t i = ball_axes; i < d; ++i) corners.push_back((end >> (i - ball_axes) & 1) == 0 ? 0 : round.lengths[i - ball_axes]);
    }
  return model::convex_hull(dimension, corners);
}

std::uint32_t corners_around(double radius) { return static_cast<std::uint32_t>(std::min(model::side_count(radius, model::Resolution{}), double{model::max_sides})); }

/// Segments around the axis, each the hull of two polygons across the tube.
Expression of_segments(const model::Torus& torus) {
  const std::uint32_t around = corners_around(torus.major + torus.minor), across = corners_around(torus.minor);
  const auto direction = [](std::uint32_t corner, std::uint32_t count) {
    const auto [c, s] = geometry::corner_direction(corner % count, count);
    return std::pair(std::ldexp(static_cast<double>(c), -53), std::ldexp(static_cast<double>(s), -53));
  };
  std::vector<Expression> segments;
  for (std::uint32_t i = 0; i < around; ++i) {
    PointSet<3> corners;
    for (const std::uint32_t end : {i, i + 1})
      for (std::uint32_t j = 0; j < across; ++j) {
        const auto [c, s] = direction(end, around);
        const auto [out, up] = direction(j, across);
        const double rho = torus.major + torus.minor * out;
        corners.push_back({rho * c, rho * s, torus.minor * up});
      }
    segments.push_back(model::convex_hull(corners));
  }
  return model::unite(std::move(segments));
}

}  // namespace

Expression faceted_primitive(const model::Primitive& primitive, int dimension, const CompileOptions& options) {
  if (const auto* torus = std::get_if<model::Torus>(&primitive)) return of_segments(*torus);
  if (std::holds_alternative<model::Preimage>(primitive))
    throw Error("a section or product of a torus, cone or spline has no corners: hull, minkowski and the like cannot take it");
  const auto* round = std::get_if<model::Round>(&primitive);
  if (round == nullptr) throw Error("a spline or a subdivision surface has no corners: hull, minkowski and the like cannot take it");
  if (round->sides == 0) return of_corners(*round, dimension, options);
  if (dimension == 2) return model::circle(round->bottom, round->sides);
  return round->lengths.empty() ? model::sphere(round->bottom, round->sides) : model::cylinder(round->lengths[0], round->bottom, round->top, round->sides);
}

}  // namespace bsp2::dataflow
