#include "bsp2/model/builder/builder.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/tessellation.hpp"
#include "builder/convex_hull.hpp"
#include "builder/matrix.hpp"
#include "builder/node_making.hpp"
#include "builder/polygon.hpp"

namespace bsp2::model {
namespace {

void require_sides(std::uint32_t sides, const char* what) {
  if (sides < 3 || sides > max_sides)
    throw Error(std::string(what) + ": " + counted(sides, "# side[s]; it takes 3 to ") +
                std::to_string(max_sides));
}

void require_fineness(std::uint32_t fineness, const char* what) {
  if (fineness != 0) require_sides(fineness, what);
}

int common_dimension(const std::vector<Expression>& operands, const char* what) {
  for (const Expression& operand : operands)
    if (operand.dimension() != operands.front().dimension())
      throw Error(std::string(what) + ": operands of " + std::to_string(operands.front().dimension()) +
                  " and " + counted(operand.dimension(), "# dimension[s]"));
  return operands.front().dimension();
}

Expression boolean(Operation operation, std::vector<Expression> operands, const char* what) {
  if (operands.empty()) throw Error(std::string(what) + ": no operands");
  const int dimension = common_dimension(operands, what);
  return make_node(dimension, Boolean{operation, std::move(operands)});
}

}  // namespace

Expression cuboid(std::span<const double> size, bool center) {
  if (size.empty()) throw Error("cuboid: no lengths");
  require_finite(size, "cuboid");
  const int dimension = static_cast<int>(size.size());
  if (std::any_of(size.begin(), size.end(), [](double length) { return length <= 0; }))
    return Expression(dimension);
  const Expression box = make_node(dimension, Cuboid{{size.begin(), size.end()}});
  if (!center) return box;
  const std::size_t stride = size.size() + 1;
  std::vector<double> matrix(stride * stride);
  for (std::size_t i = 0; i < stride; ++i) matrix[i * stride + i] = 1;
  for (std::size_t i = 0; i < size.size(); ++i) matrix[i * stride + size.size()] = -size[i] / 2;
  return make_node(dimension, Transform{std::move(matrix), box});
}

Expression cuboid(std::initializer_list<double> size, bool center) {
  return cuboid(std::span<const double>(size.begin(), size.size()), center);
}

Expression cylinder(double height, double radius_bottom, double radius_top, std::uint32_t sides,
                    bool center) {
  const double numbers[] = {height, radius_bottom, radius_top};
  require_finite(numbers, "cylinder");
  require_sides(sides, "cylinder");
  const double low = center ? -height / 2 : 0, high = center ? height / 2 : height;
  if (radius_bottom < 0 || radius_top < 0 || (radius_bottom == 0 && radius_top == 0) || low >= high)
    return Expression(3);
  return make_node(3, Lathe{sides, {{radius_bottom, low}, {radius_top, high}}});
}

Expression sphere(double radius, std::uint32_t sides) {
  require_finite({&radius, 1}, "sphere");
  require_sides(sides, "sphere");
  if (radius <= 0) return Expression(3);
  const std::uint32_t rings = ring_count(sides);
  if (std::uint64_t{rings} * sides > max_sphere_facets)
    throw Error("sphere: " + counted(sides, "# side[s] in ") +
                counted(rings, "# ring[s] [is|are] more than ") + std::to_string(max_sphere_facets) +
                " facets");
  Lathe lathe{sides, {}};
  lathe.rings.reserve(rings);
  for (std::uint32_t i = rings; i-- > 0;) {
    const double angle = 180 * (i + 0.5) / rings;
    lathe.rings.push_back({radius * sine(angle), radius * cosine(angle)});
  }
  // A radius near the smallest double leaves no room for rings.
  for (std::size_t i = 1; i < lathe.rings.size(); ++i)
    if (lathe.rings[i - 1].z >= lathe.rings[i].z) return Expression(3);
  return make_node(3, std::move(lathe));
}

Expression round_cylinder(int dimension, double radius, std::span<const double> lengths,
                          std::uint32_t fineness) {
  const int all = dimension + static_cast<int>(lengths.size());
  if (dimension < 1 || all > geometry::most_dimensions)
    throw Error("ball: " + counted(all, "# dimension[s]; it takes 1 to ") +
                std::to_string(geometry::most_dimensions));
  require_finite({&radius, 1}, "ball");
  require_finite(lengths, "ball");
  require_fineness(fineness, "ball");
  if (radius <= 0 || std::any_of(lengths.begin(), lengths.end(), [](double length) { return length <= 0; }))
    return Expression(all);
  if (dimension > 1)
    return make_node(all, Round{radius, radius, {lengths.begin(), lengths.end()}, 0, fineness});
  std::vector<double> size{2 * radius}, matrix(static_cast<std::size_t>((all + 1) * (all + 1)));
  size.insert(size.end(), lengths.begin(), lengths.end());
  for (int i = 0; i <= all; ++i) matrix[static_cast<std::size_t>(i * (all + 2))] = 1;
  matrix[static_cast<std::size_t>(all)] = -radius;
  return make_node(all, Transform{std::move(matrix), make_node(all, Cuboid{std::move(size)})});
}

Expression round_cylinder(int dimension, double radius, std::initializer_list<double> lengths,
                          std::uint32_t fineness) {
  return round_cylinder(dimension, radius, std::span<const double>(lengths.begin(), lengths.size()),
                        fineness);
}

Expression ball(int dimension, double radius, std::uint32_t fineness) {
  return round_cylinder(dimension, radius, std::span<const double>(), fineness);
}

Expression cone(double height, double radius_bottom, double radius_top, std::uint32_t fineness) {
  const double numbers[] = {height, radius_bottom, radius_top};
  require_finite(numbers, "cone");
  require_fineness(fineness, "cone");
  if (radius_bottom < 0 || radius_top < 0 || (radius_bottom == 0 && radius_top == 0) || height <= 0)
    return Expression(3);
  return make_node(3, Round{radius_bottom, radius_top, {height}, 0, fineness});
}

Expression torus(double major, double minor, std::uint32_t fineness) {
  const double numbers[] = {major, minor};
  require_finite(numbers, "torus");
  require_fineness(fineness, "torus");
  if (major <= 0 || minor <= 0) return Expression(3);
  if (minor > major)
    throw Error("torus: its tube would cross the axis: r is larger than R; it takes r up to R");
  return make_node(3, Torus{major, minor, fineness});
}

Expression paraboloid(int dimension, double height, double radius, std::uint32_t fineness) {
  if (dimension < 2 || dimension > geometry::most_dimensions)
    throw Error("paraboloid: " + counted(dimension, "# dimension[s]; it takes 2 to ") +
                std::to_string(geometry::most_dimensions));
  const double numbers[] = {height, radius};
  require_finite(numbers, "paraboloid");
  require_fineness(fineness, "paraboloid");
  if (height <= 0 || radius <= 0) return Expression(dimension);
  return make_node(dimension, Paraboloid{height, radius, fineness});
}

Expression circle(double radius, std::uint32_t sides) {
  require_finite({&radius, 1}, "circle");
  require_sides(sides, "circle");
  if (radius <= 0) return Expression(2);
  return make_node(2, RegularPolygon{sides, radius});
}

Expression polygon(const std::vector<std::array<double, 2>>& points,
                   const std::vector<std::vector<std::uint32_t>>& paths) {
  for (const auto& point : points) require_finite(point, "polygon");
  FaceCycles cycles;
  for (const auto& path : paths) {
    for (const std::uint32_t corner : path)
      if (corner >= points.size()) throw Error("polygon: there is no point " + std::to_string(corner));
    cycles.corners.insert(cycles.corners.end(), path.begin(), path.end());
    cycles.end_face();
  }
  if (paths.empty()) {
    for (std::uint32_t i = 0; i < points.size(); ++i) cycles.corners.push_back(i);
    cycles.end_face();
  }
  PolygonPieces polygon = convex_pieces(points, cycles);
  std::vector<Expression> pieces;
  for (ConvexPolygon& piece : polygon.pieces) pieces.push_back(make_node(2, std::move(piece)));
  if (pieces.empty()) return Expression(2);
  if (pieces.size() == 1) return pieces.front();
  return make_node(2, Boolean{polygon.disjoint ? Operation::unite : Operation::symmetric_difference,
                              std::move(pieces), 1});
}

Expression convex_hull(const std::vector<std::array<double, 2>>& points) {
  ConvexPolygon polygon{hull_corners(points), 1};
  if (polygon.points.size() < 3) return Expression(2);
  polygon.scale = scale_of(polygon.points);
  return make_node(2, std::move(polygon));
}

Expression convex_hull(const std::vector<std::array<double, 3>>& points) {
  auto mesh = hull_mesh(points);
  return mesh ? make_node(3, std::move(*mesh)) : Expression(3);
}

Expression unite(std::vector<Expression> operands) {
  if (operands.empty()) return Expression();
  return boolean(Operation::unite, std::move(operands), "unite");
}

Expression intersect(std::vector<Expression> operands) {
  return boolean(Operation::intersect, std::move(operands), "intersect");
}

Expression subtract(std::vector<Expression> operands) {
  return boolean(Operation::subtract, std::move(operands), "subtract");
}

Expression symmetric_difference(std::vector<Expression> operands) {
  return boolean(Operation::symmetric_difference, std::move(operands), "symmetric_difference");
}

Expression complement(Expression operand) {
  return boolean(Operation::complement, {std::move(operand)}, "complement");
}

Expression transform(std::span<const double> matrix, Expression operand) {
  const int dimension = operand.dimension();
  const auto stride = static_cast<std::size_t>(dimension) + 1;
  if (matrix.size() != stride * stride)
    throw Error("transform: a matrix of " + counted(matrix.size(), "# entr[y|ies] for a solid of ") +
                counted(dimension, "# dimension[s], which takes ") + std::to_string(stride * stride));
  std::vector<double> affine(matrix.begin(), matrix.end());
  switch (normalize_affine(affine)) {
    case MatrixKind::not_finite:
      throw Error("transform: the matrix holds or yields a number that is not finite");
    case MatrixKind::singular:
      return Expression(dimension);
    case MatrixKind::regular:
      break;
  }
  return make_node(dimension, Transform{std::move(affine), std::move(operand)});
}

Expression colour(const Colour& rgba, Expression operand) {
  for (const double channel : rgba)
    if (!(channel >= 0 && channel <= 1)) throw Error("colour: channels lie between 0 and 1");
  const int dimension = operand.dimension();
  return Expression(std::make_shared<Node>(dimension, Coloured{rgba, std::move(operand)}));
}

}  // namespace bsp2::model
