#include "bsp2/model/builder/bounds.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/model/expression/bottom_up.hpp"

namespace bsp2::model {
namespace {

using Real = long double;
constexpr double infinity = std::numeric_limits<double>::infinity();
using Row = std::span<const Real>;  // of the linear part of a map

Bounds box(int dimension, double lower, double upper) {
  const auto d = static_cast<std::size_t>(dimension);
  return {std::vector<double>(d, lower), std::vector<double>(d, upper), false};
}
Bounds nothing(int dimension) {
  Bounds empty = box(dimension, infinity, -infinity);
  empty.exact = true;
  return empty;
}
Bounds everything(int dimension) { return box(dimension, -infinity, infinity); }

struct Range {
  Real low = std::numeric_limits<Real>::infinity(), high = -std::numeric_limits<Real>::infinity();
  void add(Real x) {
    low = std::min(low, x);
    high = std::max(high, x);
  }
};

/// What `row . corner` ranges over for the corners of a regular polygon of radius 1.
Range range_of_polygon(Row row, std::uint32_t sides) {
  Range range;
  for (std::uint32_t j = 0; j < sides; ++j) {
    const auto [c, s] = geometry::corner_direction(j, sides);
    range.add((row[0] * static_cast<Real>(c) + row[1] * static_cast<Real>(s)) * 0x1p-53L);
  }
  return range;
}

// What `row . x` ranges over for the points x of a primitive.

Range range_over(Row row, const Cuboid& cuboid) {
  Range range{0, 0};
  for (std::size_t i = 0; i < row.size(); ++i)
    (row[i] < 0 ? range.low : range.high) += row[i] * static_cast<Real>(cuboid.size[i]);
  return range;
}

Range range_over(Row row, const Lathe& lathe) {
  const Range across = range_of_polygon(row, lathe.sides);
  Range range;
  for (const auto& [radius, z] : lathe.rings) {
    range.add(row[2] * static_cast<Real>(z) + across.low * static_cast<Real>(radius));
    range.add(row[2] * static_cast<Real>(z) + across.high * static_cast<Real>(radius));
  }
  return range;
}

Range range_over(Row row, const TriangleMesh& mesh) {
  Range range;
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle) {
      const auto& p = mesh.points[corner];
      range.add(row[0] * static_cast<Real>(p[0]) + row[1] * static_cast<Real>(p[1]) +
                row[2] * static_cast<Real>(p[2]));
    }
  return range;
}

Range range_over(Row row, const RegularPolygon& polygon) {
  const Range unit = range_of_polygon(row, polygon.sides);
  return {unit.low * static_cast<Real>(polygon.radius), unit.high * static_cast<Real>(polygon.radius)};
}

Range range_over(Row row, const ConvexPolygon& polygon) {
  Range range;
  for (const auto& p : polygon.points) {
    const Real value = row[0] * static_cast<Real>(p[0]) + row[1] * static_cast<Real>(p[1]);
    range.add(value);
    if (row.size() == 3) range.add(value + row[2]);
  }
  return range;
}

Range range_over(Row row, const Round& round) {
  const std::size_t axes = row.size() - round.lengths.size();
  Real square = 0;
  for (std::size_t i = 0; i < axes; ++i) square += row[i] * row[i];
  const Real across = std::sqrt(square);
  if (round.bottom != round.top) {  // a cone
    Range range;
    for (const auto& [radius, z] : {std::pair(round.bottom, 0.0), std::pair(round.top, round.lengths[0])})
      for (const int sign : {-1, 1})
        range.add(row[axes] * static_cast<Real>(z) + sign * across * static_cast<Real>(radius));
    for (std::size_t i = axes + 1; i < row.size(); ++i)
      (row[i] < 0 ? range.low : range.high) += row[i] * static_cast<Real>(round.lengths[i - axes]);
    return range;
  }
  Range range{-across * static_cast<Real>(round.bottom), across * static_cast<Real>(round.bottom)};
  for (std::size_t i = axes; i < row.size(); ++i)
    (row[i] < 0 ? range.low : range.high) += row[i] * static_cast<Real>(round.lengths[i - axes]);
  return range;
}

Range range_over(Row row, const Torus& torus) {
  const Real across = std::sqrt(row[0] * row[0] + row[1] * row[1]);
  const Real reach = across * static_cast<Real>(torus.major) +
                     std::sqrt(across * across + row[2] * row[2]) * static_cast<Real>(torus.minor);
  return {-reach, reach};
}

Range range_over(Row row, const TellsOfItself auto& shape) {
  const auto [low, high] = shape.range(row);
  return {low, high};
}

/// Of points that follow each other at a stride.
Range range_over(Row row, std::span<const double> points, std::size_t stride) {
  Range range;
  for (std::size_t i = 0; i < points.size(); i += stride) {
    Real value = 0;
    for (std::size_t k = 0; k < row.size(); ++k) value += row[k] * static_cast<Real>(points[i + k]);
    range.add(value);
  }
  return range;
}

Range range_over(Row row, const Polytope& polytope) { return range_over(row, polytope.corners, row.size()); }

/// Of the control points, whose hull contains it.
Range range_over(Row row, const Spline& spline) {
  Range range;
  for (const auto& piece : spline.pieces) {
    const Range of_piece = range_over(row, piece.points, row.size() + 1);
    range.add(of_piece.low);
    range.add(of_piece.high);
  }
  return range;
}

Range range_over(Row row, const SubdivisionSurface& surface) {
  return range_over(row, surface.points, row.size());
}

Range range_over(Row row, const Preimage& preimage) {
  Range range{0, 0};
  for (std::size_t i = 0; i < row.size(); ++i) {
    const Real a = row[i] * static_cast<Real>(preimage.lower[i]),
               b = row[i] * static_cast<Real>(preimage.upper[i]);
    range.low += std::min(a, b);
    range.high += std::max(a, b);
  }
  return range;
}

using Map = std::vector<Real>;  // (D+1) x (D+1)

Map identity(std::size_t d) {
  Map map((d + 1) * (d + 1));
  for (std::size_t i = 0; i <= d; ++i) map[i * (d + 2)] = 1;
  return map;
}

Map product_of(const Map& a, const std::vector<double>& b, std::size_t stride) {
  Map c(stride * stride);
  for (std::size_t i = 0; i < stride; ++i)
    for (std::size_t k = 0; k < stride; ++k)
      for (std::size_t j = 0; j < stride; ++j)
        c[i * stride + j] += a[i * stride + k] * static_cast<Real>(b[k * stride + j]);
  return c;
}

void set_outward(Bounds& bounds, std::size_t axis, Range range) {
  const Real slack = 0x1p-50L * std::max(std::fabs(range.low), std::fabs(range.high));
  bounds.lower[axis] = static_cast<double>(range.low - slack);
  bounds.upper[axis] = static_cast<double>(range.high + slack);
}

Bounds image(const Primitive& primitive, const Map& map, int dimension) {
  const auto d = static_cast<std::size_t>(dimension);
  Bounds result = nothing(dimension);
  result.exact = !std::holds_alternative<Spline>(primitive) &&
                 !std::holds_alternative<SubdivisionSurface>(primitive) &&
                 !std::holds_alternative<Preimage>(primitive);
  for (std::size_t i = 0; i < d; ++i) {
    Range range = std::visit(
        [&](const auto& shape) { return range_over(Row(map.data() + i * (d + 1), d), shape); }, primitive);
    const Real translation = map[i * (d + 1) + d];
    set_outward(result, i, {range.low + translation, range.high + translation});
  }
  return result;
}

/// The box around the image of a box.
Bounds image(const Bounds& child, const std::vector<double>& matrix) {
  if (child.is_empty()) return child;
  const std::size_t d = child.lower.size();
  Bounds result = child;
  result.exact = child.exact;
  for (std::size_t i = 0; i < d; ++i) {
    const auto translation = static_cast<Real>(matrix[i * (d + 1) + d]);
    Range range{translation, translation};
    int terms = 0;
    for (std::size_t j = 0; j < d; ++j) {
      const auto factor = static_cast<Real>(matrix[i * (d + 1) + j]);
      if (factor == 0) continue;
      ++terms;
      range.low += factor * static_cast<Real>(factor < 0 ? child.upper[j] : child.lower[j]);
      range.high += factor * static_cast<Real>(factor < 0 ? child.lower[j] : child.upper[j]);
    }
    if (terms > 1) result.exact = false;
    set_outward(result, i, range);
  }
  return result;
}

void unite(Bounds& a, const Bounds& b) {
  if (b.is_empty()) return;
  if (a.is_empty()) {
    a = b;
    return;
  }
  for (std::size_t i = 0; i < a.lower.size(); ++i) {
    a.lower[i] = std::min(a.lower[i], b.lower[i]);
    a.upper[i] = std::max(a.upper[i], b.upper[i]);
  }
  a.exact = a.exact && b.exact;
}

void intersect(Bounds& a, const Bounds& b) {
  for (std::size_t i = 0; i < a.lower.size(); ++i) {
    a.lower[i] = std::max(a.lower[i], b.lower[i]);
    a.upper[i] = std::min(a.upper[i], b.upper[i]);
  }
  a.exact = false;
}

Bounds sum(Bounds a, const Bounds& b) {
  if (a.is_empty() || b.is_empty()) return nothing(static_cast<int>(a.lower.size()));
  for (std::size_t i = 0; i < a.lower.size(); ++i)
    set_outward(a, i,
                {static_cast<Real>(a.lower[i]) + b.lower[i], static_cast<Real>(a.upper[i]) + b.upper[i]});
  a.exact = a.exact && b.exact;
  return a;
}

/// All axes alike.
Bounds widened(Bounds a, double by) {
  if (a.is_empty()) return a;
  for (std::size_t i = 0; i < a.lower.size(); ++i)
    set_outward(a, i, {static_cast<Real>(a.lower[i]) - by, static_cast<Real>(a.upper[i]) + by});
  a.exact = false;
  return a;
}

/// The bounds of a construct from those of its operands, none of which is empty.
struct OfConstruct {
  const std::vector<Bounds>& operands;
  int dimension;
  [[nodiscard]] const Bounds& first() const { return operands.front(); }

  Bounds operator()(const Hull&) const { return first(); }
  Bounds operator()(const Fill&) const { return first(); }
  Bounds operator()(const MinkowskiSum&) const { return sum(first(), operands[1]); }

  Bounds operator()(const LinearExtrusion& extrusion) const {
    Bounds bottom = first();
    if (extrusion.twist != 0) {  // within the circle around all its corners
      double reach = 0;
      for (const double x : {bottom.lower[0], bottom.upper[0]})
        for (const double y : {bottom.lower[1], bottom.upper[1]})
          reach = std::max(reach, std::hypot(x, y) * (1 + 0x1p-40));
      bottom = box(2, -reach, reach);
    }
    const double wide = extrusion.twist != 0 ? std::max(extrusion.scale[0], extrusion.scale[1]) : 0;
    const auto level = [&](double t, const std::array<double, 2>& scale) {
      Bounds at = bottom;
      for (std::size_t i = 0; i < 2; ++i) {
        const Real move = static_cast<Real>(extrusion.direction[i]) * (t - (extrusion.center ? 0.5 : 0));
        set_outward(at, i,
                    {static_cast<Real>(bottom.lower[i]) * scale[i] + move,
                     static_cast<Real>(bottom.upper[i]) * scale[i] + move});
      }
      const double z = extrusion.direction[2] * (t - (extrusion.center ? 0.5 : 0));
      at.lower.push_back(z);
      at.upper.push_back(z);
      return at;
    };
    Bounds all = level(0, {1, 1});
    unite(all, level(1, extrusion.twist != 0 ? std::array<double, 2>{wide, wide} : extrusion.scale));
    return all;
  }

  Bounds operator()(const RotateExtrusion& extrusion) const {
    const double reach = std::max(std::fabs(first().lower[0]), std::fabs(first().upper[0]));
    Bounds all = box(3, -reach, reach);
    all.lower[2] = first().lower[1];
    all.upper[2] = first().upper[1];
    (void)extrusion;
    return all;
  }

  Bounds operator()(const Offset& offset) const {
    if (offset.distance > 0 && offset.join == Offset::Join::mitre)
      return everything(2);  // a corner may be as sharp as it likes
    return offset.distance > 0 ? widened(first(), offset.distance * 1.5) : widened(first(), 0);
  }

  Bounds operator()(const Projection& projection) const {
    Bounds plane = first();
    plane.lower.pop_back();
    plane.upper.pop_back();
    plane.exact = plane.exact && !projection.cut;
    return plane;
  }

  Bounds operator()(const Resize& resize) const {
    if (!first().exact) return everything(dimension);
    Bounds result = first();
    std::size_t largest = 0;
    const auto d = static_cast<std::size_t>(dimension);
    for (std::size_t i = 1; i < d; ++i)
      if (resize.size[i] > resize.size[largest]) largest = i;
    const auto length = [&](std::size_t i) {
      return static_cast<Real>(first().upper[i]) - static_cast<Real>(first().lower[i]);
    };
    const Real automatic = resize.size[largest] > 0 ? resize.size[largest] / length(largest) : 1;
    for (std::size_t i = 0; i < d; ++i) {
      const Real factor = resize.size[i] > 0    ? resize.size[i] / length(i)
                          : resize.automatic[i] ? automatic
                                                : 1;
      set_outward(result, i, {first().lower[i] * factor, first().upper[i] * factor});
    }
    return result;
  }

  Bounds operator()(const Roof&) const {
    Bounds result = first();
    result.lower.push_back(0);
    result.upper.push_back(
        0.53 * std::min(first().upper[0] - first().lower[0], first().upper[1] - first().lower[1]));
    result.exact = false;
    return result;
  }

  Bounds operator()(const Product&) const {
    Bounds all = first();
    all.lower.insert(all.lower.end(), operands[1].lower.begin(), operands[1].lower.end());
    all.upper.insert(all.upper.end(), operands[1].upper.begin(), operands[1].upper.end());
    all.exact = all.exact && operands[1].exact;
    return all;
  }

  Bounds operator()(const Shadow& shadow) const {
    Bounds kept;
    for (const int axis : shadow.axes) {
      kept.lower.push_back(first().lower[static_cast<std::size_t>(axis)]);
      kept.upper.push_back(first().upper[static_cast<std::size_t>(axis)]);
    }
    kept.exact = first().exact;
    return kept;
  }

  Bounds operator()(const Section& section) const {
    const auto axis = static_cast<std::ptrdiff_t>(section.axis);
    Bounds rest = first();
    if (section.at < rest.lower[static_cast<std::size_t>(axis)] ||
        section.at > rest.upper[static_cast<std::size_t>(axis)])
      return nothing(dimension);
    rest.lower.erase(rest.lower.begin() + axis);
    rest.upper.erase(rest.upper.begin() + axis);
    rest.exact = false;
    return rest;
  }

  Bounds operator()(const ProjectiveMap& map) const {
    if (!first().is_finite()) return everything(dimension);
    const auto d = static_cast<std::size_t>(dimension), stride = d + 1;
    std::vector<Range> ranges(d);
    for (unsigned corner = 0; corner < 1U << d; ++corner) {
      std::vector<Real> y(stride);
      for (std::size_t i = 0; i < stride; ++i) {
        y[i] = static_cast<Real>(map.matrix[i * stride + d]);
        for (std::size_t j = 0; j < d; ++j)
          y[i] += static_cast<Real>(map.matrix[i * stride + j]) *
                  ((corner >> j & 1U) != 0 ? first().upper[j] : first().lower[j]);
      }
      if (!(y[d] > 0)) return everything(dimension);
      for (std::size_t i = 0; i < d; ++i) ranges[i].add(y[i] / y[d]);
    }
    Bounds result = box(dimension, 0, 0);
    for (std::size_t i = 0; i < d; ++i) set_outward(result, i, ranges[i]);
    return result;
  }

  Bounds operator()(const Sweep& sweep) const {
    Bounds path{sweep.path.front(), sweep.path.front(), true};
    for (const auto& point : sweep.path)
      for (std::size_t i = 0; i < point.size(); ++i) {
        path.lower[i] = std::min(path.lower[i], point[i]);
        path.upper[i] = std::max(path.upper[i], point[i]);
      }
    return sum(first(), path);
  }

  Bounds operator()(const Growth& growth) const {
    Bounds result = widened(first(), growth.distance > 0 ? growth.distance : 0);
    result.exact = first().exact && growth.distance >= 0 && growth.ball == Growth::Ball::cube;
    if (growth.distance >= 0 || growth.ball != Growth::Ball::cube) return result;
    return widened(first(), growth.distance);
  }
};

Bounds bounds_of(const Node& node, const std::vector<Bounds>& children) {
  const auto d = static_cast<std::size_t>(node.dimension);
  if (const auto* primitive = std::get_if<Primitive>(&node.value))
    return image(*primitive, identity(d), node.dimension);
  if (const auto* transform = std::get_if<Transform>(&node.value)) {
    Map map(transform->matrix.begin(), transform->matrix.end());
    const Node* below = &transform->child.node();
    while (const auto* inner = std::get_if<Transform>(&below->value)) {
      map = product_of(map, inner->matrix, d + 1);
      below = &inner->child.node();
    }
    if (const auto* primitive = std::get_if<Primitive>(&below->value))
      return image(*primitive, map, node.dimension);
    return image(children[0], transform->matrix);
  }
  if (const auto* construction = std::get_if<Construction>(&node.value)) {
    if (std::any_of(children.begin(), children.end(), [](const Bounds& b) { return b.is_empty(); }))
      return nothing(node.dimension);
    return std::visit(OfConstruct{children, node.dimension}, construction->construct);
  }
  const auto* boolean = std::get_if<Boolean>(&node.value);
  if (boolean == nullptr) return children[0];
  Bounds result = nothing(node.dimension);
  switch (boolean->operation) {
    case Operation::unite:
    case Operation::symmetric_difference:
      for (const Bounds& child : children) unite(result, child);
      if (boolean->operation == Operation::symmetric_difference) result.exact = children.size() <= 1;
      break;
    case Operation::intersect:
      result = everything(node.dimension);
      for (const Bounds& child : children) intersect(result, child);
      if (result.is_empty()) return nothing(node.dimension);
      break;
    case Operation::subtract:
      result = children[0];
      result.exact = result.exact && children.size() == 1;
      break;
    case Operation::complement:
      result = everything(node.dimension);
      break;
  }
  return result;
}

}  // namespace

bool Bounds::is_empty() const {
  for (std::size_t i = 0; i < lower.size(); ++i)
    if (lower[i] > upper[i]) return true;
  return false;
}

bool Bounds::is_finite() const {
  if (is_empty()) return true;
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(lower.begin(), lower.end(), finite) && std::all_of(upper.begin(), upper.end(), finite);
}

Bounds bounds(const Expression& expression) {
  return BottomUp<Bounds>().run(
      expression, [](const Expression&) -> std::optional<Bounds> { return std::nullopt; },
      [](const Node& node, std::vector<Bounds>&& children) { return bounds_of(node, children); });
}

}  // namespace bsp2::model
