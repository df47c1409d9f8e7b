// Shadows and sections of solids.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/bounds.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "operands/enclosure.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;

namespace {

/// Rows of the map from a section's space to the own space of what is placed there, constants last: the
/// inverse of the placement.
std::vector<std::vector<Real>> rows_into_primitive(const model::Section& section,
                                                   const PlacedPrimitive& placed) {
  const std::size_t d = size(placed.dimension), axis = size(section.axis);
  const Affine map(d, placed.matrix);
  std::vector<std::vector<Real>> rows(
      d, std::vector<Real>(2 * d + 1));  // of the linear part, the unit matrix, the translation
  for (std::size_t i = 0; i < d; ++i) {
    for (std::size_t j = 0; j < d; ++j) rows[i][j] = static_cast<Real>(map.at(i, j));
    rows[i][d + i] = 1;
    rows[i][2 * d] = -static_cast<Real>(map.at(i, d));
  }
  for (std::size_t k = 0; k < d; ++k) {  // Gauss and Jordan
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < d; ++i)
      if (std::fabs(rows[i][k]) > std::fabs(rows[pivot][k])) pivot = i;
    std::swap(rows[k], rows[pivot]);
    const Real factor = rows[k][k];
    for (Real& x : rows[k]) x /= factor;
    for (std::size_t i = 0; i < d; ++i) {
      if (i == k || rows[i][k] == 0) continue;
      const Real times = rows[i][k];
      for (std::size_t j = 0; j <= 2 * d; ++j) rows[i][j] -= times * rows[k][j];
    }
  }
  std::vector<std::vector<Real>> result;
  for (const auto& row : rows) {
    auto& entries = result.emplace_back();
    for (std::size_t j = 0; j < d; ++j)
      if (j != axis) entries.push_back(row[d + j]);
    entries.push_back(row[2 * d] + row[d + axis] * static_cast<Real>(section.at));
  }
  return result;
}

/// The points of a box at which low <= row . x <= high, the row's constant last: a parallelepiped, and more
/// room along all other axes. Nothing if the row is constant and out of range, everything (no expression) if
/// it is within.
std::optional<Expression> slab(const std::vector<Real>& row, Real low, Real high, const AxisBox& room) {
  const std::size_t d = row.size() - 1;
  std::size_t along = 0;
  Real reach = std::fabs(row[d]);
  for (std::size_t i = 0; i < d; ++i) {
    if (std::fabs(row[i]) > std::fabs(row[along])) along = i;
    reach += std::fabs(row[i]) * std::max(std::fabs(static_cast<Real>(room.lower[i])),
                                          std::fabs(static_cast<Real>(room.upper[i])));
  }
  if (std::fabs(row[along]) * static_cast<Real>(room.upper[along] - room.lower[along]) <= 0x1p-48L * reach) {
    if (row[d] < low || row[d] > high) return Expression(static_cast<int>(d));
    return std::nullopt;
  }
  std::vector<double> lengths = room.lengths();
  lengths[along] = static_cast<double>(high - low);
  Affine map(d);
  Real constant = low - row[d];
  for (std::size_t i = 0; i < d; ++i) {
    if (i == along) continue;
    map.at(i, d) = room.lower[i];
    map.at(along, i) = static_cast<double>(-row[i] / row[along]);
    constant -= row[i] * static_cast<Real>(room.lower[i]);
  }
  map.at(along, along) = static_cast<double>(1 / row[along]);
  map.at(along, d) = static_cast<double>(constant / row[along]);
  return model::transform(map.entries, model::cuboid(lengths));
}

/// The section of any curved solid: the points that the section's space takes into it.
Expression section_of_curved(const model::Section& section, const PlacedPrimitive& placed) {
  const int dimension = placed.dimension - 1;
  const std::size_t axis = size(section.axis);
  model::Bounds bounds =
      model::bounds(model::transform(placed.matrix, make(placed.dimension, *placed.primitive)));
  if (section.at < bounds.lower[axis] || section.at > bounds.upper[axis]) return Expression(dimension);
  bounds.lower.erase(bounds.lower.begin() + static_cast<std::ptrdiff_t>(axis));
  bounds.upper.erase(bounds.upper.begin() + static_cast<std::ptrdiff_t>(axis));
  std::vector<std::vector<Real>> rows = rows_into_primitive(section, placed);
  model::Preimage preimage{{}, placed.dimension, {}, bounds.lower, bounds.upper};
  std::vector<Expression> parts;
  if (const auto* inner = std::get_if<model::Preimage>(placed.primitive)) {
    preimage.solid = inner->solid;
    preimage.dimension = inner->dimension;
    const std::size_t from = rows.size();
    std::vector<std::vector<Real>> whole;
    for (std::size_t i = 0; i < inner->map.size(); i += from + 1) {
      auto& row = whole.emplace_back(rows[0].size());
      row.back() = static_cast<Real>(inner->map[i + from]);
      for (std::size_t j = 0; j < from; ++j)
        for (std::size_t k = 0; k < row.size(); ++k)
          row[k] += static_cast<Real>(inner->map[i + j]) * rows[j][k];
    }
    rows = std::move(whole);
  } else if (const auto* round = std::get_if<model::Round>(placed.primitive)) {
    preimage.solid = *round;
    AxisBox room{bounds.lower, bounds.upper};
    for (std::size_t i = 0; i < room.lower.size(); ++i) {
      const double side = (room.upper[i] - room.lower[i]) / 8;
      room.lower[i] -= side;
      room.upper[i] += side;
    }
    const std::size_t axes = rows.size() - round->lengths.size();
    for (std::size_t j = axes; j < rows.size(); ++j)
      if (auto between = slab(rows[j], 0, static_cast<Real>(round->lengths[j - axes]), room))
        parts.push_back(*std::move(between));
  } else {
    preimage.solid = std::visit(
        []<typename Shape>(const Shape& shape) -> model::Preimage::Solid {
          if constexpr (std::is_constructible_v<model::Preimage::Solid, const Shape&>)
            return shape;
          else
            throw std::logic_error("its sections are not known");
        },
        *placed.primitive);
  }
  if (std::any_of(parts.begin(), parts.end(), is_empty)) return Expression(dimension);
  for (const auto& row : rows)
    for (const Real x : row) preimage.map.push_back(static_cast<double>(x));
  parts.insert(parts.begin(), make(dimension, std::move(preimage)));
  return parts.size() == 1 ? parts[0] : model::intersect(std::move(parts));
}

/// The section of a placed ball or cylinder: x_axis depends either on one of its straight axes alone, or on
/// its round ones.
Expression section_of_round(const model::Section& section, const PlacedPrimitive& placed,
                            const model::Round& round) {
  const std::size_t d = size(placed.dimension), axes = d - round.lengths.size(), axis = size(section.axis);
  const Affine map(d, placed.matrix);
  std::vector<std::size_t> straight;
  std::vector<Real> u(axes);
  Real norm = 0;
  for (std::size_t j = 0; j < d; ++j) {
    const auto entry = static_cast<Real>(map.at(axis, j));
    if (j < axes) {
      u[j] = entry;
      norm += entry * entry;
    } else if (entry != 0) {
      straight.push_back(j);
    }
  }
  norm = std::sqrt(norm);
  const Real rest = static_cast<Real>(section.at) - static_cast<Real>(map.at(axis, d));
  if (straight.size() > 1 || (norm > 0 && !straight.empty())) return section_of_curved(section, placed);
  // The columns that stay, and where the one that goes is.
  std::vector<std::vector<Real>> columns;
  std::vector<Real> origin(d);
  for (std::size_t i = 0; i < d; ++i) origin[i] = static_cast<Real>(map.at(i, d));
  const auto column = [&](std::size_t j) {
    std::vector<Real> entries(d);
    for (std::size_t i = 0; i < d; ++i) entries[i] = static_cast<Real>(map.at(i, j));
    return entries;
  };
  model::Round cut = round;
  const int result = placed.dimension - 1;
  double radius = round.bottom;
  if (!straight.empty()) {
    const std::size_t j = straight[0];
    if (round.bottom != round.top && j > axes)
      return section_of_curved(section, placed);  // along the axis of a cone's prism
    const Real y = rest / static_cast<Real>(map.at(axis, j));
    if (y < 0 || y > static_cast<Real>(round.lengths[j - axes])) return Expression(result);
    cut.lengths.erase(cut.lengths.begin() + static_cast<std::ptrdiff_t>(j - axes));
    radius = static_cast<double>(static_cast<Real>(round.bottom) +
                                 (static_cast<Real>(round.top) - static_cast<Real>(round.bottom)) * y /
                                     static_cast<Real>(round.lengths[j - axes]));
    for (std::size_t i = 0; i < d; ++i) origin[i] += static_cast<Real>(map.at(i, j)) * y;
    for (std::size_t k = 0; k < d; ++k)
      if (k != j) columns.push_back(column(k));
  } else {
    if (round.bottom != round.top) return section_of_curved(section, placed);
    const Real y = rest / norm;
    if (std::fabs(y) >= static_cast<Real>(radius)) return Expression(result);
    radius = static_cast<double>(std::sqrt(static_cast<Real>(radius) * static_cast<Real>(radius) - y * y));
    for (Real& entry : u) entry /= norm;
    const std::vector<Real> turn = reflection_to(u);
    for (std::size_t k = 0; k < axes; ++k) {
      std::vector<Real> entries(d);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < axes; ++j)
          entries[i] += static_cast<Real>(map.at(i, j)) * turn[j * axes + k];
      if (k + 1 < axes)
        columns.push_back(entries);
      else
        for (std::size_t i = 0; i < d; ++i) origin[i] += entries[i] * y;
    }
    for (std::size_t k = axes; k < d; ++k) columns.push_back(column(k));
  }
  Affine image(d - 1);
  for (std::size_t i = 0, row = 0; i < d; ++i) {
    if (i == axis) continue;
    for (std::size_t k = 0; k + 1 < d; ++k) image.at(row, k) = static_cast<double>(columns[k][i]);
    image.at(row++, d - 1) = static_cast<double>(origin[i]);
  }
  return model::transform(image.entries, model::round_cylinder(result - static_cast<int>(cut.lengths.size()),
                                                               radius, cut.lengths));
}

using Pairs = std::vector<std::array<std::size_t, 2>>;

Pairs all_pairs(const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  Pairs pairs;
  for (const std::size_t p : a)
    for (const std::size_t q : b) pairs.push_back({p, q});
  return pairs;
}

/// Pairs of corners of a polytope among which are the ends of all its edges from `a` to `b`: they have D - 1
/// facets in common. More do no harm.
Pairs edges_of_polytope(const model::Polytope& polytope, std::size_t d, double grid,
                        const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
  const auto on_facet = [&](const double* half_space, std::size_t p) {
    double value = half_space[d], norm = 0;
    for (std::size_t k = 0; k < d; ++k) {
      value += half_space[k] * polytope.corners[p * d + k];
      norm = std::max(norm, std::fabs(half_space[k]));
    }
    return std::fabs(value) <= grid * norm;
  };
  const std::size_t facets = polytope.half_spaces.size() / (d + 1);
  std::vector<std::vector<std::size_t>> of_facet(facets);
  std::vector<std::uint32_t> common(polytope.corners.size() / d);
  for (std::size_t f = 0; f < facets; ++f)
    for (const std::size_t q : b)
      if (on_facet(polytope.half_spaces.data() + f * (d + 1), q)) of_facet[f].push_back(q);
  Pairs pairs;
  for (const std::size_t p : a) {
    std::fill(common.begin(), common.end(), 0U);
    for (std::size_t f = 0; f < facets; ++f) {
      if (of_facet[f].empty() || !on_facet(polytope.half_spaces.data() + f * (d + 1), p)) continue;
      for (const std::size_t q : of_facet[f])
        if (++common[q] == d - 1) pairs.push_back({p, q});
    }
  }
  return pairs;
}

/// The section of a convex hull: the points on the hyperplane, and where segments between points of both
/// sides cross it. A face that lies there counts. Of many points only the edges of the hull are looked at.
Expression section_of_hull(const model::Section& section, Points corners, int dimension) {
  constexpr std::size_t many_pairs = 50'000;
  const std::size_t d = size(dimension), axis = size(section.axis);
  Expression hull(dimension);
  const model::TriangleMesh* mesh = nullptr;
  const model::Polytope* polytope = nullptr;
  const auto find_hull = [&] {
    hull = model::convex_hull(dimension, corners);
    const auto* primitive = std::get_if<model::Primitive>(&hull.node().value);
    if (primitive == nullptr) return;
    mesh = std::get_if<model::TriangleMesh>(primitive);
    polytope = std::get_if<model::Polytope>(primitive);
    if (polytope != nullptr) corners = polytope->corners;
    if (mesh == nullptr) return;
    corners.clear();
    for (const auto& point : mesh->points) corners.insert(corners.end(), point.begin(), point.end());
  };
  double reach = std::fabs(section.at);
  for (const double x : corners) reach = std::max(reach, std::fabs(x));
  const double grid = reach * 0x1p-44;  // above the rounding of the points
  std::vector<std::size_t> below, on, above;
  const auto sort_corners = [&] {
    for (auto* side : {&below, &on, &above}) side->clear();
    for (std::size_t p = 0; p < corners.size() / d; ++p) {
      const double height = corners[p * d + axis] - section.at;
      (height > grid ? above : height < -grid ? below : on).push_back(p);
    }
  };
  sort_corners();
  if (dimension >= 3 && below.size() * above.size() > many_pairs) {
    find_hull();
    sort_corners();
  }
  Pairs pairs;
  if (mesh != nullptr) {
    for (const auto& triangle : mesh->triangles)
      for (std::size_t i = 0; i < 3; ++i)
        pairs.push_back({triangle[i], triangle[(i + 1) % 3]});  // each edge both ways: one is from below
  } else if (polytope != nullptr) {
    pairs = edges_of_polytope(*polytope, d, reach * 0x1p-30, below, above);
  } else {
    pairs = all_pairs(below, above);
  }
  Points cut;
  const auto add = [&](std::size_t p, std::size_t q, Real t) {
    for (std::size_t k = 0; k < d; ++k)
      if (k != axis)
        cut.push_back(static_cast<double>(
            static_cast<Real>(corners[p * d + k]) +
            t * (static_cast<Real>(corners[q * d + k]) - static_cast<Real>(corners[p * d + k]))));
  };
  for (const std::size_t p : on) add(p, p, 0);
  for (const auto& [p, q] : pairs) {
    if (!(corners[p * d + axis] - section.at < -grid) || !(corners[q * d + axis] - section.at > grid))
      continue;
    const Real low = static_cast<Real>(corners[p * d + axis]) - static_cast<Real>(section.at),
               high = static_cast<Real>(corners[q * d + axis]) - static_cast<Real>(section.at);
    add(p, q, low / (low - high));
  }
  return model::convex_hull(dimension - 1, cut);
}

}  // namespace

Expression image_of(const model::Shadow& shadow, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const std::size_t d = size(operands[0].dimension()), kept = shadow.axes.size();
  const auto of_corners = [&](const Points& corners) {
    Points flat;
    for (std::size_t i = 0; i < corners.size(); i += d)
      for (const int axis : shadow.axes) flat.push_back(corners[i + size(axis)]);
    return model::convex_hull(static_cast<int>(kept), flat);
  };
  const auto of_ball = [&](const PlacedPrimitive& ball) {
    const auto radius = static_cast<Real>(ball_of(*ball.primitive)->bottom);
    std::vector<Real> centre, rows;
    for (const int i : shadow.axes) {
      centre.push_back(static_cast<Real>(ball.matrix[size(i) * (d + 1) + d]));
      for (std::size_t j = 0; j < d; ++j)
        rows.push_back(static_cast<Real>(ball.matrix[size(i) * (d + 1) + j]) * radius);
    }
    return ellipsoid(centre, std::move(rows));
  };
  return distributed(operands[0], static_cast<int>(kept), context, of_corners, of_ball);
}

Expression image_of(const model::Section& section, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  return with_primitives_replaced(
      operands[0], operands[0].dimension() - 1, [&](const PlacedPrimitive& placed) {
        if (const auto* round = std::get_if<model::Round>(placed.primitive))
          return section_of_round(section, placed, *round);
        if (model::is_curved(*placed.primitive)) return section_of_curved(section, placed);
        std::vector<Expression> parts;
        for_convex_parts(placed, context, [&](const Points& corners) {
          parts.push_back(section_of_hull(section, corners, placed.dimension));
        });
        const auto* polytope = std::get_if<model::Polytope>(placed.primitive);
        const Expression cut = united(placed.dimension - 1, std::move(parts));
        return polytope != nullptr && polytope->undecided ? undecided(cut, context.options) : cut;
      });
}

}  // namespace bsp2::dataflow
