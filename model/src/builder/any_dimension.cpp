// Builders of what has no fixed dimension.

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/tessellation.hpp"
#include "builder/node_making.hpp"
#include "builder/polytope.hpp"

namespace bsp2::model {
namespace {

using geometry::most_dimensions;

void require_dimension(int dimension, const char* what) {
  if (!geometry::is_dimension(dimension))
    throw Error(std::string(what) + ": " + counted(dimension, "# dimension[s]; it takes 1 to ") +
                std::to_string(most_dimensions));
}

void require_axis(int axis, int dimension, const char* what) {
  if (axis < 0 || axis >= dimension)
    throw Error(std::string(what) + ": there is no axis " + std::to_string(axis + 1) + " in " +
                counted(dimension, "# dimension[s]"));
}

/// The interval that these numbers reach over.
Expression interval(std::span<const double> points) {
  if (points.empty()) return Expression(1);
  const auto [low, high] = std::minmax_element(points.begin(), points.end());
  const double size = *high - *low;
  if (!(size > 0)) return Expression(1);
  return transform(std::vector<double>{1, *low, 0, 1}, cuboid({size}));
}

template <int D>
Expression hull_of(std::span<const double> points) {
  std::vector<std::array<double, D>> list(points.size() / D);
  for (std::size_t i = 0; i < points.size(); ++i) list[i / D][i % D] = points[i];
  return convex_hull(list);
}

/// The dimension of a construct's value. @throws bsp2::Error for operands that it cannot take.
struct Dimension {
  const std::vector<Expression>& operands;
  [[nodiscard]] int first() const { return operands.front().dimension(); }

  [[nodiscard]] int exactly(int needed) const {
    if (first() != needed)
      throw Error("construct: an operand of dimension " + std::to_string(needed) + " is needed, not " +
                  std::to_string(first()));
    return needed;
  }
  int operator()(const LinearExtrusion&) const { return exactly(2) + 1; }
  int operator()(const RotateExtrusion&) const { return exactly(2) + 1; }
  int operator()(const Roof&) const { return exactly(2) + 1; }
  int operator()(const Offset&) const { return exactly(2); }
  int operator()(const Fill&) const { return exactly(2); }
  int operator()(const Projection&) const { return exactly(3) - 1; }
  int operator()(const Resize&) const {
    if (first() != 2 && first() != 3) throw Error("construct: operands of dimension 2 or 3 are needed");
    return first();
  }
  int operator()(const Hull&) const { return first(); }
  int operator()(const Growth& growth) const {
    require_finite({&growth.distance, 1}, "grow");
    return first();
  }
  int operator()(const MinkowskiSum&) const {
    if (operands[1].dimension() != first())
      throw Error("minkowski: operands of " + std::to_string(first()) + " and " +
                  counted(operands[1].dimension(), "# dimension[s]"));
    return first();
  }
  int operator()(const Product&) const {
    const int all = first() + operands[1].dimension();
    if (all > most_dimensions)
      throw Error("product: " + counted(all, "# dimension[s]; the limit is ") +
                  std::to_string(most_dimensions));
    return all;
  }
  int operator()(const Shadow& shadow) const {
    std::vector<int> sorted = shadow.axes;
    std::sort(sorted.begin(), sorted.end());
    if (sorted.empty() || std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end())
      throw Error("project: it keeps one axis or more, each once");
    for (const int axis : sorted) require_axis(axis, first(), "project");
    return static_cast<int>(sorted.size());
  }
  int operator()(const Section& section) const {
    require_axis(section.axis, first(), "section");
    require_finite({&section.at, 1}, "section");
    if (first() == 1) throw Error("section: of an interval there is none");
    return first() - 1;
  }
  int operator()(const ProjectiveMap& map) const {
    const auto stride = static_cast<std::size_t>(first()) + 1;
    if (map.matrix.size() != stride * stride)
      throw Error("projective: a matrix of " + std::to_string(stride) + " x " + std::to_string(stride) +
                  " is needed for a solid of " + counted(first(), "# dimension[s]"));
    require_finite(map.matrix, "projective");
    return first();
  }
  int operator()(const Sweep& sweep) const {
    if (sweep.path.size() < 2) throw Error("sweep: the path has fewer than two points");
    for (const auto& point : sweep.path) {
      require_finite(point, "sweep");
      if (static_cast<int>(point.size()) != first())
        throw Error("sweep: the path has a point of " +
                    counted(point.size(), "# coordinate[s], the solid has ") +
                    counted(first(), "# dimension[s]"));
    }
    return first();
  }
};

}  // namespace

Expression convex_hull(int dimension, std::span<const double> points) {
  require_dimension(dimension, "convex_hull");
  require_finite(points, "convex_hull");
  if (points.size() % static_cast<std::size_t>(dimension) != 0)
    throw Error("convex_hull: " + counted(points.size(), "# coordinate[s] [is|are] no points of ") +
                counted(dimension, "# dimension[s]"));
  switch (dimension) {
    case 1:
      return interval(points);
    case 2:
      return hull_of<2>(points);
    case 3:
      return hull_of<3>(points);
    default:
      break;
  }
  if (points.empty()) return Expression(dimension);
  auto polytope = hull_polytope(dimension, points);
  return polytope ? make_node(dimension, std::move(*polytope)) : Expression(dimension);
}

Expression undecided_hull(int dimension, std::span<const double> points) {
  require_dimension(dimension, "undecided_hull");
  require_finite(points, "undecided_hull");
  if (points.size() % static_cast<std::size_t>(dimension) != 0)
    throw Error("undecided_hull: there is a point with other than " + counted(dimension, "# coordinate[s]"));
  if (points.empty()) return Expression(dimension);
  std::optional<Polytope> polytope;
  if (dimension == 1) {
    const auto [low, high] = std::minmax_element(points.begin(), points.end());
    if (*low < *high) polytope = Polytope{{*low, *high}, {-1, *low, 1, -*high}, *high - *low};
  } else {
    polytope = hull_polytope(dimension, points);
  }
  if (!polytope) return Expression(dimension);
  polytope->undecided = true;
  return make_node(dimension, *std::move(polytope));
}

Expression simplex(int dimension, std::span<const double> points) {
  require_dimension(dimension, "simplex");
  if (points.size() != static_cast<std::size_t>((dimension + 1) * dimension))
    throw Error("simplex: it takes " + counted(dimension + 1, "# corner[s] of ") +
                counted(dimension, "# coordinate[s]"));
  return convex_hull(dimension, points);
}

Expression simplex(int dimension, double size) {
  require_dimension(dimension, "simplex");
  require_finite({&size, 1}, "simplex");
  if (size <= 0) return Expression(dimension);
  if (dimension == 1) return cuboid({size});
  const auto d = static_cast<std::size_t>(dimension);
  Polytope polytope;
  polytope.corners.resize((d + 1) * d);
  polytope.half_spaces.resize((d + 1) * (d + 1));
  for (std::size_t i = 0; i < d; ++i) {
    polytope.corners[(i + 1) * d + i] = size;
    polytope.half_spaces[i * (d + 1) + i] = -1;
    polytope.half_spaces[d * (d + 1) + i] = 1;
  }
  polytope.half_spaces.back() = -size;
  polytope.content = std::pow(size, dimension) / std::tgamma(dimension + 1.0);
  return make_node(dimension, std::move(polytope));
}

Expression ball_polytope(int dimension, double radius, std::uint32_t sides) {
  require_dimension(dimension, "ball_polytope");
  require_finite({&radius, 1}, "ball_polytope");
  if (radius <= 0) return Expression(dimension);
  if (dimension == 1) return ball(1, radius);
  if (dimension == 2) return circle(radius, sides);
  if (dimension == 3) return sphere(radius, sides);
  // So few at least that sums end in seconds, and so many that they are not boxes: 80 corners in four
  // dimensions, 42 in five, in six those of the axes.
  const auto least = dimension == 4 ? 2 : dimension == 5 ? 1 : 0;
  const auto steps = sides < 8 ? least : std::max<std::int64_t>(least, sides / 4);
  if (std::pow(static_cast<double>(steps + 1), dimension) -
          std::pow(static_cast<double>(steps - 1), dimension) >
      20000)
    throw Error("ball_polytope: " + counted(sides, "# side[s] in ") +
                counted(dimension, "# dimension[s] [is|are] more than 20,000 corners"));
  std::vector<double> points;
  std::vector<std::int64_t> at(static_cast<std::size_t>(dimension), 0);
  for (bool more = steps > 0; more;) {  // all points of the grid, of which those on the cube's surface count
    if (std::any_of(at.begin(), at.end(), [&](std::int64_t k) { return k == 0 || k == steps; })) {
      double square = 0;
      for (const std::int64_t k : at) square += std::pow(static_cast<double>(2 * k - steps), 2);
      for (const std::int64_t k : at)
        points.push_back(radius * static_cast<double>(2 * k - steps) / std::sqrt(square));
    }
    std::size_t digit = 0;
    while (digit < at.size() && ++at[digit] > steps) at[digit++] = 0;
    more = digit < at.size();
  }
  // The directions of the axes, which an even grid has: so the faces of a box move by the radius when the
  // polytope is added.
  for (std::size_t i = 0; (steps == 0 || steps % 2 == 1) && i < at.size(); ++i)
    for (const double sign : {-radius, radius}) {
      points.resize(points.size() + at.size());
      points[points.size() - at.size() + i] = sign;
    }
  return convex_hull(dimension, points);
}

Expression construct(Construct what, std::vector<Expression> operands) {
  const bool takes_two = std::holds_alternative<MinkowskiSum>(what) || std::holds_alternative<Product>(what);
  if (operands.size() != (takes_two ? 2 : 1))
    throw Error("construct: it takes " + std::string(takes_two ? "two operands" : "one operand"));
  const int dimension = std::visit(Dimension{operands}, what);
  return make_node(dimension, Construction{std::move(what), std::move(operands)});
}

Expression product(std::vector<Expression> operands) {
  if (operands.empty()) throw Error("product: no operands");
  Expression all = operands.front();
  for (std::size_t i = 1; i < operands.size(); ++i) all = construct(Product{}, {all, operands[i]});
  return all;
}

Expression extrude(Expression operand, std::span<const double> lengths, bool center) {
  return product({std::move(operand), cuboid(lengths, center)});
}

Expression extrude(Expression operand, std::initializer_list<double> lengths, bool center) {
  return extrude(std::move(operand), std::span<const double>(lengths.begin(), lengths.size()), center);
}

Expression embed(Expression operand, int dimension, double thickness) {
  require_dimension(dimension, "embed");
  if (dimension < operand.dimension())
    throw Error("embed: a solid of " + counted(operand.dimension(), "# dimension[s]") +
                " does not fit into " + std::to_string(dimension) + "; see project and section");
  if (!(thickness > 0)) throw Error("embed: the thickness has to be above 0: what is flat has no content");
  if (dimension == operand.dimension()) return operand;
  const std::vector<double> lengths(static_cast<std::size_t>(dimension - operand.dimension()), thickness);
  return extrude(std::move(operand), lengths, true);
}

Expression project(Expression operand, std::vector<int> kept) {
  return construct(Shadow{std::move(kept)}, {std::move(operand)});
}

Expression section(Expression operand, int axis, double at) {
  return construct(Section{axis, at}, {std::move(operand)});
}

Expression projective(std::span<const double> matrix, Expression operand) {
  return construct(ProjectiveMap{{matrix.begin(), matrix.end()}}, {std::move(operand)});
}

Expression minkowski(Expression a, Expression b) {
  return construct(MinkowskiSum{}, {std::move(a), std::move(b)});
}

Expression grow(Expression operand, double distance) {
  return construct(Growth{.distance = distance}, {std::move(operand)});
}

Expression grow_round(Expression operand, double distance, std::uint32_t sides) {
  if (sides < 3) throw Error("grow: " + counted(sides, "# side[s]; it takes 3 or more"));
  return construct(Growth{distance, Growth::Ball::round, sides}, {std::move(operand)});
}

Expression sweep(Expression operand, std::vector<std::vector<double>> path) {
  return construct(Sweep{std::move(path)}, {std::move(operand)});
}

Expression part(std::string name, Expression operand) {
  const int dimension = operand.dimension();
  return make_node(dimension, Named{Named::Role::part, std::move(name), std::move(operand)});
}

Expression measure(std::string name, Expression operand) {
  const int dimension = operand.dimension();
  return make_node(dimension, Named{Named::Role::measure, std::move(name), std::move(operand)});
}

}  // namespace bsp2::model
