// Polyhedra in the place of curved primitives.
#include "operands/faceting.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <type_traits>
#include <vector>

#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "operands/nested.hpp"
#include "operands/placed_parts.hpp"
#include "operands/refined_parts.hpp"

namespace bsp2::dataflow {
namespace {

using model::Expression;

constexpr double surely = 1 + 1e-9;  // what is around stays so after rounding

/// @param axes of the ball; a torus has three.
std::uint32_t corners_around(std::uint32_t fineness, int axes) {
  if (fineness != 0) return fineness;
  return axes == 2 ? 128 : axes == 3 ? 64 : axes == 4 ? 12 : 8;
}

/// The radius of the largest ball around the origin in the hull of points.
double radius_inside(int dimension, const Points& points) {
  const Expression hull = model::undecided_hull(dimension, points);
  const auto& half_spaces =
      std::get<model::Polytope>(std::get<model::Primitive>(hull.node().value)).half_spaces;
  const std::size_t d = size(dimension);
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < half_spaces.size(); i += d + 1) {
    double square = 0;
    for (std::size_t k = 0; k < d; ++k) square += half_spaces[i + k] * half_spaces[i + k];
    least = std::min(least, -half_spaces[i + d] / std::sqrt(square));
  }
  return least;
}

/// The hull of a ball's corners at both ends of each other axis.
Expression of_corners(const model::Round& round, int dimension, const CompileOptions& options,
                      Facets facets) {
  const int axes = dimension - static_cast<int>(round.lengths.size());
  const std::size_t d = size(dimension), ball_axes = size(axes);
  Points ball = spanning_points(model::ball_polytope(axes, 1, corners_around(round.fineness, axes)), options);
  if (facets == Facets::around) {
    const double factor = surely / radius_inside(axes, ball);
    for (double& x : ball) x *= factor;
  }
  Points corners;
  for (std::size_t end = 0; end < std::size_t{1} << round.lengths.size(); ++end)
    for (std::size_t at = 0; at < ball.size(); at += ball_axes) {
      const double radius = (end & 1) == 0 ? round.bottom : round.top;
      for (std::size_t i = 0; i < ball_axes; ++i) corners.push_back(radius * ball[at + i]);
      for (std::size_t i = ball_axes; i < d; ++i)
        corners.push_back((end >> (i - ball_axes) & 1) == 0 ? 0 : round.lengths[i - ball_axes]);
    }
  return model::convex_hull(dimension, corners);
}

/// Segments around the axis, each the hull of two polygons across the tube. At an angle in between, a segment
/// has the polygon with its distances from the axis times c, cos(h) <= c <= 1, h half the angle of the
/// segment.
///
/// Those inside are inscribed to the circle of radius r - R (1 - cos h) / (1 + cos h) around 2 R / (1 + cos
/// h), so that at no c they leave the tube; those around it hold the tube and what it is times 1 / cos h.
/// Where these would reach beyond the axis they are cut off there: behind it they would cross all others.
Expression of_segments(const model::Torus& torus, Facets facets) {
  const std::uint32_t around = corners_around(torus.fineness, 3), across = around;
  const bool outside = facets == Facets::around;
  const auto direction = [](std::uint32_t corner, std::uint32_t count) {
    const auto [c, s] = geometry::corner_direction(corner % count, count);
    return std::pair(std::ldexp(static_cast<double>(c), -53), std::ldexp(static_cast<double>(s), -53));
  };
  const double half = std::cos(std::numbers::pi / around);
  const double middle = outside ? torus.major : torus.major * 2 / (1 + half);
  const double minor = outside ? surely * torus.minor / std::cos(std::numbers::pi / across)
                               : torus.minor - surely * torus.major * (1 - half) / (1 + half);
  const double reach = outside ? surely * (torus.major + minor) * (1 / half - 1) : 0;
  if (minor <= 0) return Expression(3);        // too thin for so few segments
  std::vector<std::array<double, 2>> polygon;  // distance from the axis, height
  for (std::uint32_t j = 0; j < across; ++j) {
    const auto corner = [&](std::uint32_t number) {
      const auto [out, up] = direction(number, across);
      return std::array{middle + minor * out, minor * up};
    };
    const auto here = corner(j), next = corner(j + 1);
    if (here[0] >= 0) polygon.push_back(here);
    if ((here[0] < 0) != (next[0] < 0))
      polygon.push_back({0, surely * (here[1] + (next[1] - here[1]) * here[0] / (here[0] - next[0]))});
  }
  std::vector<Expression> segments;
  for (std::uint32_t i = 0; i < around; ++i) {
    PointSet<3> corners;
    for (const std::uint32_t end : {i, i + 1}) {
      const auto [c, s] = direction(end, around);
      for (const auto& [rho, z] : polygon) {
        corners.push_back({rho * c, rho * s, z});
        if (outside) corners.push_back({(rho + reach) * c, (rho + reach) * s, z});
      }
    }
    segments.push_back(model::convex_hull(corners));
  }
  return model::unite(std::move(segments));
}

/// How much larger a polytope about a point in it has to be so that a convex solid lies in it.
double enlargement(const Points& corners, const Points& middle, const model::TellsOfItself auto& solid) {
  const std::size_t d = middle.size();
  const Expression hull = model::undecided_hull(static_cast<int>(d), corners);
  const auto& half_spaces =
      std::get<model::Polytope>(std::get<model::Primitive>(hull.node().value)).half_spaces;
  Real most = 1;
  for (std::size_t i = 0; i < half_spaces.size(); i += d + 1) {
    const std::vector<Real> normal(half_spaces.data() + i, half_spaces.data() + i + d);
    Real within = -static_cast<Real>(half_spaces[i + d]), reach = solid.range(normal)[1];
    for (std::size_t k = 0; k < d; ++k) {
      within -= normal[k] * static_cast<Real>(middle[k]);
      reach -= normal[k] * static_cast<Real>(middle[k]);
    }
    most = std::max(most, reach / within);
  }
  return static_cast<double>(most) * surely;
}

/// A solid of revolution about its last axis: the hull of a ball's corners on some of its circles; around it,
/// the same enlarged about its middle.
Expression faceted(const model::TellsOfItself auto& solid, int dimension, const CompileOptions& options,
                   Facets facets) {
  const std::uint32_t count = corners_around(solid.fineness, solid.round_axes(dimension));
  const Points ball = spanning_points(model::ball_polytope(dimension - 1, 1, count), options);
  const std::size_t d = size(dimension);
  Points corners, middle(d);
  for (const auto& [radius, z] : Placed<3, std::remove_cvref_t<decltype(solid)>>::profile(solid, count))
    for (std::size_t at = 0; at < ball.size(); at += d - 1) {
      for (std::size_t i = 0; i + 1 < d; ++i) corners.push_back(radius * ball[at + i]);
      corners.push_back(z);
    }
  const std::size_t rows = corners.size() / d;
  for (std::size_t i = 0; i < corners.size(); ++i) middle[i % d] += corners[i] / static_cast<double>(rows);
  if (facets == Facets::around) {
    const double factor = enlargement(corners, middle, solid);
    for (std::size_t i = 0; i < corners.size(); ++i)
      corners[i] = middle[i % d] + factor * (corners[i] - middle[i % d]);
  }
  return model::convex_hull(dimension, corners);
}

Expression faceted(const model::Torus& torus, int, const CompileOptions&, Facets facets) {
  return of_segments(torus, facets);
}

Expression faceted(const model::Round& round, int dimension, const CompileOptions& options, Facets facets) {
  if (round.sides == 0) return of_corners(round, dimension, options, facets);
  if (dimension == 2) return model::circle(round.bottom, round.sides);
  return round.lengths.empty() ? model::sphere(round.bottom, round.sides)
                               : model::cylinder(round.lengths[0], round.bottom, round.top, round.sides);
}

/// Its cells.
Expression faceted(const auto& primitive, int dimension, const CompileOptions& options, Facets facets) {
  std::vector<Expression> parts;
  for (const Points& corners : refined_parts(primitive, dimension, options, facets))
    parts.push_back(model::convex_hull(dimension, corners));
  return united(dimension, std::move(parts));
}

}  // namespace

std::uint32_t corners_of_circles(const model::Primitive& primitive, int dimension) {
  return std::visit(
      [&]<typename Shape>(const Shape& shape) -> std::uint32_t {
        if constexpr (model::HasFineness<Shape>)
          return corners_around(shape.fineness, shape.round_axes(dimension));
        else
          throw std::logic_error("it has no circles");
      },
      primitive);
}

Expression faceted_primitive(const model::Primitive& primitive, int dimension, const CompileOptions& options,
                             Facets facets) {
  return std::visit([&](const auto& shape) { return faceted(shape, dimension, options, facets); }, primitive);
}

}  // namespace bsp2::dataflow
