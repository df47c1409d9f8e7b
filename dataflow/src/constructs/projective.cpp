// Projective images of solids: those of polytopes, ellipsoids and splines are known; other round solids are
// enclosed, each for itself.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/builder/flat.hpp"
#include "operands/enclosure.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;

namespace {

constexpr const char* meets_infinity =
    "projective: the plane at infinity meets the solid: the last row of the matrix has to give a value above "
    "0 in all of it; cut away what is on the other "
    "side, or change the sign of the matrix";

/// The images of points; nothing if one of them is not on the positive side of the plane at infinity.
std::optional<Points> mapped(const std::vector<double>& matrix, const Points& points, std::size_t d) {
  Points images;
  for (std::size_t p = 0; p < points.size(); p += d) {
    std::vector<Real> y(d + 1);
    for (std::size_t i = 0; i <= d; ++i) {
      y[i] = static_cast<Real>(matrix[i * (d + 1) + d]);
      for (std::size_t j = 0; j < d; ++j)
        y[i] += static_cast<Real>(matrix[i * (d + 1) + j]) * static_cast<Real>(points[p + j]);
    }
    if (!(y[d] > 0)) return std::nullopt;
    for (std::size_t i = 0; i < d; ++i) images.push_back(static_cast<double>(y[i] / y[d]));
  }
  return images;
}

/// The image of a placed ball, an ellipsoid; nothing if the plane at infinity meets it.
///
/// In the frame of the unit ball, turned so that the denominator is w + s x_n, the image is b / w + M z with
/// z = x / (w + s x_n): z runs through an ellipsoid along the axes. Nothing cancels here, however far away or
/// thin the image is.
std::optional<Expression> mapped_ball(const std::vector<double>& matrix, const PlacedPrimitive& ball) {
  const std::size_t d = size(ball.dimension), n = d + 1, last = d - 1;
  const Affine place(d, ball.matrix);
  std::vector<Real> h(n * n);
  const auto radius = static_cast<Real>(ball_of(*ball.primitive)->bottom);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t j = 0; j < n; ++j)
        h[i * n + j] +=
            static_cast<Real>(matrix[i * n + k]) * static_cast<Real>(place.at(k, j)) * (j < d ? radius : 1);
  std::vector<Real> slope(h.begin() + static_cast<std::ptrdiff_t>(d * n), h.end() - 1);
  Real s = 0;
  for (const Real x : slope) s += x * x;
  s = std::sqrt(s);
  const Real w = h[d * n + d];
  if (!(w > s)) return std::nullopt;
  for (std::size_t j = 0; j < d; ++j) slope[j] = s > 0 ? slope[j] / s : static_cast<Real>(j == last ? 1 : 0);
  const std::vector<Real> turn = reflection_to(slope);
  const Real across = (w - s) * (w + s), middle = -s / across;
  Affine image(d);
  for (std::size_t i = 0; i < d; ++i) {
    const Real at_middle = h[i * n + d] / w;
    for (std::size_t j = 0; j < d; ++j) {
      Real entry = j == last ? -at_middle * s : 0;
      for (std::size_t k = 0; k < d; ++k) entry += h[i * n + k] * turn[k * d + j];
      image.at(i, j) = static_cast<double>(j == last ? entry * w / across : entry / std::sqrt(across));
      if (j == last) image.at(i, d) = static_cast<double>(at_middle + entry * middle);
    }
  }
  return model::transform(image.entries, model::ball(ball.dimension, 1));
}

// --- splines ---

using Piece = model::Spline::Piece;

/// How often the spans of a spline are halved until all weights of its image are positive: control points are
/// 2^6 times as near to it then, and more.
constexpr int most_refinements = 6;
constexpr std::size_t most_numbers = 4'000'000;

/// Weights of images, as far as splines can have them: 2^20 is `model::spline`'s limit.
bool are_good(const std::vector<Piece>& pieces, std::size_t d) {
  double least = std::numeric_limits<double>::infinity(), most = 0;
  for (const Piece& piece : pieces)
    for (std::size_t at = d; at < piece.points.size(); at += d + 1) {
      least = std::min(least, piece.points[at]);
      most = std::max(most, piece.points[at]);
    }
  return least > 0 && most <= 0x1p20 * least;
}

/// The control points, times their weights, under a (D+1) x (D+1) matrix: a spline is the image of a
/// polynomial one in E^(D+1) from 0, so its projective image is the spline of these. Weights may come out 0
/// or negative.
Piece image_of_net(const std::vector<Real>& matrix, const Piece& piece, std::size_t d) {
  Piece image = piece;
  std::vector<Real> y(d + 1);
  for (std::size_t p = 0; p < piece.points.size(); p += d + 1) {
    for (std::size_t i = 0; i <= d; ++i) {
      y[i] = matrix[i * (d + 1) + d];
      for (std::size_t j = 0; j < d; ++j)
        y[i] += matrix[i * (d + 1) + j] * static_cast<Real>(piece.points[p + j]);
    }
    for (std::size_t i = 0; i < d; ++i) image.points[p + i] = static_cast<double>(y[i] / y[d]);
    image.points[p + d] = static_cast<double>(y[d] * static_cast<Real>(piece.points[p + d]));
  }
  return image;
}

/// Gives a spline one knot more along a parameter; it stays as it is. Source: W. Boehm, Inserting New Knots
/// into B-spline Curves (1980).
void insert_knot(Piece& piece, std::size_t parameter, double t, std::size_t stride) {
  auto& knots = piece.knots[parameter];
  const std::size_t degree = piece.degrees[parameter], count = knots.size() - degree - 1;
  const auto span =
      static_cast<std::size_t>(std::upper_bound(knots.begin(), knots.end(), t) - knots.begin()) - 1;
  std::size_t inner = 1;
  for (std::size_t j = parameter + 1; j < piece.degrees.size(); ++j)
    inner *= piece.knots[j].size() - piece.degrees[j] - 1;
  const std::size_t outer = piece.points.size() / (count * inner * stride);
  std::vector<double> points;
  points.reserve(outer * (count + 1) * inner * stride);
  for (std::size_t o = 0; o < outer; ++o)
    for (std::size_t i = 0; i <= count; ++i) {
      const auto between = [&] {
        return (static_cast<Real>(t) - static_cast<Real>(knots[i])) /
               (static_cast<Real>(knots[i + degree]) - static_cast<Real>(knots[i]));
      };
      const Real share = i + degree <= span ? 1 : i > span ? 0 : between();
      for (std::size_t k = 0; k < inner; ++k) {
        const auto at = [&](std::size_t row) {
          return piece.points.data() + ((o * count + row) * inner + k) * stride;
        };
        const double* const here = at(std::min(i, count - 1));
        const double* const before = at(i == 0 ? 0 : i - 1);
        const Real a = share * static_cast<Real>(here[stride - 1]),
                   b = (1 - share) * static_cast<Real>(before[stride - 1]);
        for (std::size_t c = 0; c + 1 < stride; ++c)
          points.push_back(static_cast<double>(
              (a * static_cast<Real>(here[c]) + b * static_cast<Real>(before[c])) / (a + b)));
        points.push_back(static_cast<double>(a + b));
      }
    }
  piece.points = std::move(points);
  knots.insert(knots.begin() + static_cast<std::ptrdiff_t>(span) + 1, t);
}

/// Halves every span of a spline's domain; it stays as it is, and edges that fit together still do.
void halve_spans(Piece& piece, std::size_t stride) {
  for (std::size_t j = 0; j < piece.degrees.size(); ++j) {
    const std::vector<double> knots = piece.knots[j];
    for (std::size_t s = piece.degrees[j]; s + piece.degrees[j] + 1 < knots.size(); ++s)
      if (const double middle = std::midpoint(knots[s], knots[s + 1]);
          knots[s] < middle && middle < knots[s + 1])
        insert_knot(piece, j, middle, stride);
  }
}

/// The image of a placed spline; nothing if the plane at infinity meets it, or is so near that weights get
/// too far apart. The plane may be among control points that are off the spline: then spans are halved, which
/// brings them nearer to it.
std::optional<Expression> mapped_spline(const std::vector<double>& matrix, const PlacedPrimitive& placed,
                                        const model::Spline& spline) {
  const std::size_t d = size(placed.dimension), n = d + 1;
  const Affine place(d, placed.matrix);
  std::vector<Real> whole(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t j = 0; j < n; ++j)
        whole[i * n + j] += static_cast<Real>(matrix[i * n + k]) * static_cast<Real>(place.at(k, j));
  std::vector<Piece> pieces = spline.pieces;
  for (int halvings = 0;; ++halvings) {
    std::vector<Piece> images;
    std::size_t numbers = 0;
    for (const Piece& piece : pieces) {
      images.push_back(image_of_net(whole, piece, d));
      numbers += piece.points.size();
    }
    if (are_good(images, d)) return model::spline(placed.dimension, std::move(images));
    if (halvings == most_refinements || numbers << spline.pieces[0].degrees.size() > most_numbers)
      return std::nullopt;
    for (Piece& piece : pieces) halve_spans(piece, n);
  }
}

// --- what there is ---

/// The union of the images of convex solids; nothing if the plane at infinity meets one of them.
std::optional<Expression> mapped_parts(const std::vector<double>& matrix, const std::vector<Points>& parts,
                                       int dimension) {
  std::vector<Expression> images;
  for (const Points& corners : parts) {
    const auto points = mapped(matrix, corners, size(dimension));
    if (!points) return std::nullopt;
    images.push_back(model::convex_hull(dimension, *points));
  }
  return united(dimension, std::move(images));
}

/// The image of a placed primitive; nothing if the plane at infinity meets it. What has no image that is
/// known lies between those of polytopes: whatever Booleans make of it, they make of what lies between.
std::optional<Expression> mapped_primitive(const std::vector<double>& matrix, const PlacedPrimitive& placed,
                                           const ConstructContext& context) {
  if (ball_of(*placed.primitive) != nullptr) return mapped_ball(matrix, placed);
  if (const auto* spline = std::get_if<model::Spline>(placed.primitive))
    return mapped_spline(matrix, placed, *spline);
  const auto* polytope = std::get_if<model::Polytope>(placed.primitive);
  const bool is_unknown = polytope != nullptr && polytope->undecided;
  if (!model::is_curved(*placed.primitive) && !is_unknown) {
    std::vector<Points> parts;
    for_convex_parts(placed, context, [&](const Points& corners) { parts.push_back(corners); });
    return mapped_parts(matrix, parts, placed.dimension);
  }
  const auto image_with = [&](Facets facets) {
    const Expression alone = model::transform(placed.matrix, make(placed.dimension, *placed.primitive));
    return mapped_parts(matrix, convex_parts(with_facets(alone, facets, context.options), context.options),
                        placed.dimension);
  };
  const auto around = image_with(Facets::around);
  const auto* round = std::get_if<model::Round>(placed.primitive);
  if (!around || (round != nullptr && round->sides != 0))
    return around;  // OpenSCAD's is a polyhedron, on either side
  const auto inside = image_with(Facets::inside);
  if (!inside) return std::nullopt;
  return between(*inside, *around, context.options);
}

/// Of a solid of which less is left than of its primitives.
Expression image_of_cells(const std::vector<double>& matrix, const Expression& solid,
                          const ConstructContext& context) {
  if (auto image = mapped_parts(matrix, convex_parts(solid, context.options), solid.dimension()))
    return *std::move(image);
  throw Error(meets_infinity);
}

// --- what a singular map leaves ---

/// Flat polytopes, whose points count in hulls, sums and shadows.
Expression flattened(const std::vector<double>& matrix, const Expression& solid,
                     const ConstructContext& context) {
  std::vector<Expression> images;
  for (const Points& corners : convex_parts(solid, context.options))
    images.push_back(make(
        solid.dimension(),
        model::flat_polytope(solid.dimension(), mapped(matrix, corners, size(solid.dimension())).value())));
  return united(solid.dimension(), std::move(images));
}

Expression affine_image(const std::vector<double>& matrix, const Expression& solid,
                        const ConstructContext& context) {
  Expression image = model::transform(matrix, solid);
  if (!is_empty(image)) return image;  // else the map is singular
  if (is_unbounded(solid))
    throw Error("multmatrix: what it flattens has no bounds; intersect it with something that has");
  if (!is_only_enclosed(solid)) return flattened(matrix, context.faceted(solid), context);
  const auto image_with = [&](Facets facets) {
    return flattened(matrix, with_facets(solid, facets, context.options), context);
  };
  return between(image_with(Facets::inside), image_with(Facets::around), context.options);
}

}  // namespace

Expression image_of(const model::ProjectiveMap& map, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const Expression& operand = operands[0];
  const auto last_row = map.matrix.end() - operand.dimension() - 1;
  if (map.matrix.back() > 0 && std::all_of(last_row, map.matrix.end() - 1, [](double x) { return x == 0; }))
    return affine_image(map.matrix, operand, context);
  bool is_possible = true;
  const Expression image =
      with_primitives_replaced(operand, operand.dimension(), [&](const PlacedPrimitive& placed) {
        const auto mapped_one = is_possible ? mapped_primitive(map.matrix, placed, context) : std::nullopt;
        is_possible = mapped_one.has_value();
        return mapped_one.value_or(Expression(placed.dimension));
      });
  if (is_possible) return image;
  // A primitive reaches too far; perhaps what is left of it does not.
  if (!is_only_enclosed(operand)) return image_of_cells(map.matrix, context.faceted(operand), context);
  const auto image_with = [&](Facets facets) {
    return image_of_cells(map.matrix, with_facets(operand, facets, context.options), context);
  };
  return between(image_with(Facets::inside), image_with(Facets::around), context.options);
}

}  // namespace bsp2::dataflow
