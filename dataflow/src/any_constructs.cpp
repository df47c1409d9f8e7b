#include "any_constructs.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "bsp2/geometry/error.hpp"
#include "bsp2/model/bottom_up.hpp"
#include "bsp2/model/bounds.hpp"
#include "bsp2/model/builder.hpp"
#include "nested.hpp"

namespace bsp2::dataflow {

bool is_empty(const model::Expression& solid) {
  const auto* boolean = std::get_if<model::Boolean>(&solid.node().value);
  return boolean != nullptr && boolean->children.empty();
}

namespace {

using model::Expression;
using model::Node;
using Real = long double;

std::size_t size(int dimension) { return static_cast<std::size_t>(dimension); }

Expression make(int dimension, Node::Value value) { return Expression(std::make_shared<Node>(dimension, std::move(value))); }

Expression united(int dimension, std::vector<Expression> solids) {
  std::erase_if(solids, [](const Expression& solid) { return solid.node().parts == 0; });
  if (solids.empty()) return Expression(dimension);
  return solids.size() == 1 ? solids[0] : model::unite(std::move(solids));
}

const model::Round* ball_of(const model::Primitive& primitive) {
  const auto* round = std::get_if<model::Round>(&primitive);
  return round != nullptr && round->lengths.empty() ? round : nullptr;
}

/// A (D+1) x (D+1) matrix, the identity at first.
struct Affine {
  std::size_t d;
  std::vector<double> entries;
  explicit Affine(std::size_t dimension) : d(dimension), entries((d + 1) * (d + 1)) {
    for (std::size_t i = 0; i <= d; ++i) entries[i * (d + 2)] = 1;
  }
  Affine(std::size_t dimension, std::vector<double> given) : d(dimension), entries(std::move(given)) {}
  double& at(std::size_t i, std::size_t j) { return entries[i * (d + 1) + j]; }
  [[nodiscard]] double at(std::size_t i, std::size_t j) const { return entries[i * (d + 1) + j]; }
};

Expression moved(const Expression& solid, std::span<const double> by) {
  Affine map(by.size());
  for (std::size_t i = 0; i < by.size(); ++i) map.at(i, by.size()) = by[i];
  return model::transform(map.entries, solid);
}

/// The ellipsoid around `centre` whose points are centre + L y, |y| <= 1, with L L^T = `square`.
Expression ellipsoid(const std::vector<Real>& centre, std::vector<Real> square) {
  const std::size_t d = centre.size();
  Affine map(d);
  for (std::size_t j = 0; j < d; ++j) {  // Cholesky
    for (std::size_t i = j; i < d; ++i) {
      Real sum = square[i * d + j];
      for (std::size_t k = 0; k < j; ++k) sum -= static_cast<Real>(map.at(i, k)) * static_cast<Real>(map.at(j, k));
      if (i == j && !(sum > 0)) return Expression(static_cast<int>(d));
      map.at(i, j) = static_cast<double>(i == j ? std::sqrt(sum) : sum / static_cast<Real>(map.at(j, j)));
    }
    map.at(j, d) = static_cast<double>(centre[j]);
  }
  return model::transform(map.entries, model::ball(static_cast<int>(d), 1));
}

// --- products ----------------------------------------------------------------------------------------------------------------

struct AxisBox {
  std::vector<double> lower, upper;
  [[nodiscard]] std::vector<double> lengths() const {
    std::vector<double> result;
    for (std::size_t i = 0; i < lower.size(); ++i) result.push_back(upper[i] - lower[i]);
    return result;
  }
};

/// The box that a solid is, if it is one whose map keeps the axes.
std::optional<AxisBox> axis_box(const Expression& solid) {
  const Node* node = &solid.node();
  const std::size_t d = size(node->dimension);
  std::vector<const model::Transform*> maps;
  while (const auto* map = std::get_if<model::Transform>(&node->value)) {
    for (std::size_t i = 0; i < d; ++i)
      for (std::size_t j = 0; j < d; ++j)
        if (i != j && map->matrix[i * (d + 1) + j] != 0) return std::nullopt;
    maps.push_back(map);
    node = &map->child.node();
  }
  const auto* primitive = std::get_if<model::Primitive>(&node->value);
  const auto* cuboid = primitive != nullptr ? std::get_if<model::Cuboid>(primitive) : nullptr;
  if (cuboid == nullptr) return std::nullopt;
  AxisBox box{std::vector<double>(d), cuboid->size};
  for (std::size_t m = maps.size(); m-- > 0;)
    for (std::size_t i = 0; i < d; ++i) {
      const double factor = maps[m]->matrix[i * (d + 2)], translation = maps[m]->matrix[i * (d + 1) + d];
      for (double* end : {&box.lower[i], &box.upper[i]}) *end = factor * *end + translation;
      if (box.lower[i] > box.upper[i]) std::swap(box.lower[i], box.upper[i]);
    }
  return box;
}

/// The product of one primitive with [0, length].
class Prism {
 public:
  Prism(int dimension, double length, const ConstructContext& context) : dimension_(dimension), length_(length), context_(context) {}

  Expression operator()(const model::Cuboid& cuboid) const {
    model::Cuboid prism = cuboid;
    prism.size.push_back(length_);
    return make(dimension_ + 1, prism);
  }
  Expression operator()(const model::Round& round) const {
    if (round.bottom != round.top) throw Error("product: a cone has none; a pyramid of many sides has one: cylinder() without --curved");
    model::Round prism = round;
    prism.lengths.push_back(length_);
    if (dimension_ >= 3) prism.sides = 0;
    return make(dimension_ + 1, prism);
  }
  Expression operator()(const model::RegularPolygon& polygon) const {
    return make(3, model::Lathe{polygon.sides, {{polygon.radius, 0}, {polygon.radius, length_}}});
  }
  Expression operator()(const model::ConvexPolygon& polygon) const {
    if (dimension_ == 3) return of_corners(polygon);
    return model::transform(std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, length_, 0, 0, 0, 0, 1}, make(3, polygon));
  }
  Expression operator()(const model::Lathe& lathe) const { return of_corners(lathe); }
  Expression operator()(const model::TriangleMesh& mesh) const { return of_corners(mesh); }
  Expression operator()(const model::Torus&) const { throw Error("product: a torus has none"); }
  Expression operator()(const model::Spline&) const { throw Error("product: a spline has none; a spline of one more parameter may do"); }
  Expression operator()(const model::SubdivisionSurface&) const { throw Error("product: a subdivision surface has none"); }
  Expression operator()(const model::Polytope& polytope) const {
    const std::size_t d = size(dimension_);
    model::Polytope prism;
    for (const double end : {0.0, length_})
      for (std::size_t i = 0; i < polytope.corners.size(); i += d) add_point(prism.corners, {polytope.corners.data() + i, d}, end);
    for (std::size_t i = 0; i < polytope.half_spaces.size(); i += d + 1) {
      add_point(prism.half_spaces, {polytope.half_spaces.data() + i, d}, 0);
      prism.half_spaces.push_back(polytope.half_spaces[i + d]);
    }
    for (const double sign : {-1.0, 1.0}) {
      prism.half_spaces.insert(prism.half_spaces.end(), d, 0.0);
      prism.half_spaces.push_back(sign);
      prism.half_spaces.push_back(sign < 0 ? 0 : -length_);
    }
    prism.content = polytope.content * length_;
    return make(dimension_ + 1, std::move(prism));
  }

 private:
  int dimension_;
  double length_;
  const ConstructContext& context_;

  static void add_point(std::vector<double>& to, std::span<const double> first, double last) {
    to.insert(to.end(), first.begin(), first.end());
    to.push_back(last);
  }
  [[nodiscard]] Expression of_corners(const model::Primitive& primitive) const {
    std::vector<Expression> prisms;
    for (const Points& part : convex_parts(make(dimension_, primitive), context_.options)) {
      Points corners;
      for (const double end : {0.0, length_})
        for (std::size_t i = 0; i < part.size(); i += size(dimension_)) add_point(corners, {part.data() + i, size(dimension_)}, end);
      prisms.push_back(model::convex_hull(dimension_ + 1, corners));
    }
    return united(dimension_ + 1, std::move(prisms));
  }
};

/// The product of a bounded solid with [0, length] along a new last axis: every primitive becomes a prism, all else stays. For
/// outside of all primitives the solid is not.
Expression lifted(const Expression& solid, double length, const ConstructContext& context) {
  return model::BottomUp<Expression>().run(
      solid, [](const Expression&) -> std::optional<Expression> { return std::nullopt; },
      [&](const Node& node, std::vector<Expression>&& images) -> Expression {
        if (const auto* boolean = std::get_if<model::Boolean>(&node.value)) return make(node.dimension + 1, model::Boolean{boolean->operation, std::move(images)});
        if (const auto* transform = std::get_if<model::Transform>(&node.value)) {
          const std::size_t d = size(node.dimension);
          const Affine before(d, transform->matrix);
          Affine after(d + 1);
          for (std::size_t i = 0; i < d; ++i) {
            for (std::size_t j = 0; j < d; ++j) after.at(i, j) = before.at(i, j);
            after.at(i, d + 1) = before.at(i, d);
          }
          return make(node.dimension + 1, model::Transform{after.entries, images[0]});
        }
        if (!images.empty()) return images[0];  // a colour or a name: a construct has those around it
        return std::visit(Prism(node.dimension, length, context), std::get<model::Primitive>(node.value));
      });
}

Expression times_box(Expression solid, const AxisBox& box, const ConstructContext& context) {
  std::vector<double> corner(size(solid.dimension()));
  for (const double length : box.lengths()) solid = lifted(solid, length, context);
  corner.insert(corner.end(), box.lower.begin(), box.lower.end());
  return moved(solid, corner);
}

/// The last `count` axes become the first ones.
Expression rotated_axes(const Expression& solid, std::size_t count) {
  const std::size_t d = size(solid.dimension());
  Affine map(d);
  for (std::size_t i = 0; i < d; ++i) {
    map.at(i, i) = 0;
    map.at(i, (i + d - count) % d) = 1;
  }
  return model::transform(map.entries, solid);
}

/// The bounds of a solid with some room around them, so that no facet of theirs lies in one of its own.
AxisBox roomy_bounds(const Expression& solid) {
  const model::Bounds bounds = model::bounds(solid);
  if (!bounds.is_finite()) throw Error("product: an operand has no bounds; intersect it with something that has");
  AxisBox box{bounds.lower, bounds.upper};
  for (std::size_t i = 0; i < box.lower.size(); ++i) {
    const double room = (bounds.upper[i] - bounds.lower[i]) / 8;
    box.lower[i] -= room;
    box.upper[i] += room;
  }
  return box;
}

// --- what is done to one primitive after the other -----------------------------------------------------------------------------

/// Calls use(corners) for convex solids that make up the placed primitive together.
template <typename Use>
void for_convex_parts(const PlacedPrimitive& placed, const ConstructContext& context, Use&& use) {
  const auto* mesh = std::get_if<model::TriangleMesh>(placed.primitive);
  if (mesh == nullptr || mesh->convex) return use(placed.corners());
  for (const Points& part : convex_parts(model::transform(placed.matrix, make(placed.dimension, *placed.primitive)), context.options)) use(part);
}

/// Whether a primitive has corners, or is a ball, for which most constructs are known.
bool is_polytope_or_ball(const model::Primitive& primitive) {
  return ball_of(primitive) != nullptr || !(std::holds_alternative<model::Round>(primitive) || std::holds_alternative<model::Torus>(primitive));
}

/// The solid, or with polyhedra in the place of what is round if there is anything round but balls in it.
Expression of_polytopes_and_balls(const Expression& solid, const ConstructContext& context) {
  bool all = true;
  with_primitives_replaced(solid, solid.dimension(), [&](const PlacedPrimitive& placed) {
    all = all && is_polytope_or_ball(*placed.primitive);
    return Expression(placed.dimension);
  });
  return all ? solid : context.faceted(solid);
}

/// A union of what `make_image` makes of the primitives of a union, else of the convex parts of the solid.
/// @param make_image takes the corners of a convex solid; @param ball_image a placed ball.
Expression distributed(const Expression& operand, int dimension, const ConstructContext& context, const std::function<Expression(const Points&)>& make_image,
                       const std::function<Expression(const PlacedPrimitive&)>& ball_image) {
  std::vector<Expression> images;
  if (!is_union(operand)) {
    for (const Points& part : convex_parts(context.faceted(operand), context.options)) images.push_back(make_image(part));
    return united(dimension, std::move(images));
  }
  with_primitives_replaced(of_polytopes_and_balls(operand, context), operand.dimension(), [&](const PlacedPrimitive& placed) {
    if (ball_of(*placed.primitive) != nullptr)
      images.push_back(ball_image(placed));
    else
      for_convex_parts(placed, context, [&](const Points& corners) { images.push_back(make_image(corners)); });
    return Expression(placed.dimension);
  });
  return united(dimension, std::move(images));
}

/// A A^T of the linear part of a placed ball, times its radius squared.
std::vector<Real> square_of(const PlacedPrimitive& ball) {
  const std::size_t d = size(ball.dimension);
  const Affine map(d, ball.matrix);
  const auto radius = static_cast<Real>(ball_of(*ball.primitive)->bottom);
  std::vector<Real> square(d * d);
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j < d; ++j)
      for (std::size_t k = 0; k < d; ++k) square[i * d + j] += static_cast<Real>(map.at(i, k)) * static_cast<Real>(map.at(j, k)) * radius * radius;
  return square;
}

// --- sections --------------------------------------------------------------------------------------------------------------------

/// A symmetric orthogonal matrix that maps the last unit vector to `u`, of length 1.
std::vector<Real> reflection_to(const std::vector<Real>& u) {
  const std::size_t n = u.size();
  std::vector<Real> v = u, matrix(n * n);
  v[n - 1] -= 1;
  Real square = 0;
  for (const Real x : v) square += x * x;
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) matrix[i * n + j] = (i == j ? 1 : 0) - (square > 0 ? 2 * v[i] * v[j] / square : 0);
  return matrix;
}

/// The section of a placed ball or cylinder: x_axis depends either on one of its straight axes alone, or on its round ones.
Expression section_of_round(const model::Section& section, const PlacedPrimitive& placed, const model::Round& round) {
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
  if (straight.size() > 1 || (norm > 0 && !straight.empty()))
    throw Error("section: it cuts a cylinder or cone at an angle; only sections across its axis and along it are known");
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
    const Real y = rest / static_cast<Real>(map.at(axis, j));
    if (y < 0 || y > static_cast<Real>(round.lengths[j - axes])) return Expression(result);
    cut.lengths.erase(cut.lengths.begin() + static_cast<std::ptrdiff_t>(j - axes));
    radius = static_cast<double>(static_cast<Real>(round.bottom) + (static_cast<Real>(round.top) - static_cast<Real>(round.bottom)) * y / static_cast<Real>(round.lengths[j - axes]));
    for (std::size_t i = 0; i < d; ++i) origin[i] += static_cast<Real>(map.at(i, j)) * y;
    for (std::size_t k = 0; k < d; ++k)
      if (k != j) columns.push_back(column(k));
  } else {
    if (round.bottom != round.top) throw Error("section: it cuts a cone along its axis; only sections across the axis are known");
    const Real y = rest / norm;
    if (std::fabs(y) >= static_cast<Real>(radius)) return Expression(result);
    radius = static_cast<double>(std::sqrt(static_cast<Real>(radius) * static_cast<Real>(radius) - y * y));
    for (Real& entry : u) entry /= norm;
    const std::vector<Real> turn = reflection_to(u);
    for (std::size_t k = 0; k < axes; ++k) {
      std::vector<Real> entries(d);
      for (std::size_t i = 0; i < d; ++i)
        for (std::size_t j = 0; j < axes; ++j) entries[i] += static_cast<Real>(map.at(i, j)) * turn[j * axes + k];
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
  return model::transform(image.entries, model::round_cylinder(result - static_cast<int>(cut.lengths.size()), radius, cut.lengths));
}

/// The section of a convex hull: the points on the hyperplane, and where segments between points of both sides cross it. A
/// face that lies there counts.
Expression section_of_hull(const model::Section& section, const Points& corners, int dimension) {
  const std::size_t d = size(dimension), axis = size(section.axis), count = corners.size() / d;
  double reach = std::fabs(section.at);
  for (const double x : corners) reach = std::max(reach, std::fabs(x));
  const double grid = reach * 0x1p-44;  // above the rounding of the points
  std::vector<std::size_t> below, above;
  Points cut;
  const auto add = [&](std::size_t p, std::size_t q, Real t) {
    for (std::size_t k = 0; k < d; ++k)
      if (k != axis) cut.push_back(static_cast<double>(static_cast<Real>(corners[p * d + k]) + t * (static_cast<Real>(corners[q * d + k]) - static_cast<Real>(corners[p * d + k]))));
  };
  for (std::size_t p = 0; p < count; ++p) {
    const double height = corners[p * d + axis] - section.at;
    if (height > grid)
      above.push_back(p);
    else if (height < -grid)
      below.push_back(p);
    else
      add(p, p, 0);
  }
  if (above.size() * below.size() > 4'000'000) throw Error("section: a convex part has too many corners; give it fewer sides");
  for (const std::size_t p : below)
    for (const std::size_t q : above) {
      const Real low = static_cast<Real>(corners[p * d + axis]) - static_cast<Real>(section.at), high = static_cast<Real>(corners[q * d + axis]) - static_cast<Real>(section.at);
      add(p, q, low / (low - high));
    }
  return model::convex_hull(dimension - 1, cut);
}

// --- projective maps -------------------------------------------------------------------------------------------------------------

/// The images of points; nothing if one of them is not on the positive side of the plane at infinity.
std::optional<Points> mapped(const std::vector<double>& matrix, const Points& points, std::size_t d) {
  Points images;
  for (std::size_t p = 0; p < points.size(); p += d) {
    std::vector<Real> y(d + 1);
    for (std::size_t i = 0; i <= d; ++i) {
      y[i] = static_cast<Real>(matrix[i * (d + 1) + d]);
      for (std::size_t j = 0; j < d; ++j) y[i] += static_cast<Real>(matrix[i * (d + 1) + j]) * static_cast<Real>(points[p + j]);
    }
    if (!(y[d] > 0)) return std::nullopt;
    for (std::size_t i = 0; i < d; ++i) images.push_back(static_cast<double>(y[i] / y[d]));
  }
  return images;
}

/// The image of a placed ball, an ellipsoid, by its dual quadric; nothing if the plane at infinity meets it.
std::optional<Expression> mapped_ball(const std::vector<double>& matrix, const PlacedPrimitive& ball) {
  const std::size_t d = size(ball.dimension), n = d + 1;
  const Affine place(d, ball.matrix);
  std::vector<Real> h(n * n);
  const auto radius = static_cast<Real>(ball_of(*ball.primitive)->bottom);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t k = 0; k < n; ++k)
      for (std::size_t j = 0; j < n; ++j) h[i * n + j] += static_cast<Real>(matrix[i * n + k]) * static_cast<Real>(place.at(k, j)) * (j < d ? radius : 1);
  Real slope = 0;
  for (std::size_t j = 0; j < d; ++j) slope += h[d * n + j] * h[d * n + j];
  if (!(h[d * n + d] > 0) || !(h[d * n + d] * h[d * n + d] > slope)) return std::nullopt;
  // C = H diag(1, ..., 1, -1) H^T; of an ellipsoid around m with square Q it is a multiple of [Q - m m^T, -m; -m^T, -1].
  std::vector<Real> c(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j)
      for (std::size_t k = 0; k < n; ++k) c[i * n + j] += h[i * n + k] * h[j * n + k] * (k < d ? 1 : -1);
  const Real scale = -c[d * n + d];
  std::vector<Real> centre(d), square(d * d);
  for (std::size_t i = 0; i < d; ++i) centre[i] = -c[i * n + d] / scale;
  for (std::size_t i = 0; i < d; ++i)
    for (std::size_t j = 0; j < d; ++j) square[i * d + j] = c[i * n + j] / scale + centre[i] * centre[j];
  return ellipsoid(centre, std::move(square));
}

// --- sums ------------------------------------------------------------------------------------------------------------------------

/// Points of a sum of two convex sets before its hull is taken: 1.2 GB of them in space.
constexpr std::size_t most_sums = 50'000'000;

Expression sum_of_parts(const std::vector<Points>& a, const std::vector<Points>& b, int dimension, const char* what) {
  const std::size_t d = size(dimension);
  std::vector<Expression> sums;
  for (const Points& p : a)
    for (const Points& q : b) {
      if (q.size() / d > most_sums / (p.size() / d))
        throw Error(std::string(what) + ": operands of " + std::to_string(p.size() / d) + " and " + std::to_string(q.size() / d) +
                    " points have too many sums; give them fewer sides");
      Points points;
      points.reserve(p.size() * (q.size() / d));
      for (std::size_t i = 0; i < p.size(); i += d)
        for (std::size_t j = 0; j < q.size(); ++j) points.push_back(p[i + j % d] + q[j]);
      sums.push_back(model::convex_hull(dimension, points));
    }
  return united(dimension, std::move(sums));
}

}  // namespace

Expression image_of(const model::Product&, const std::vector<Expression>& operands, const ConstructContext& context) {
  const Expression &a = operands[0], &b = operands[1];
  if (model::bounds(a).is_empty() || model::bounds(b).is_empty()) return Expression(a.dimension() + b.dimension());
  const AxisBox a_room = roomy_bounds(a), b_room = roomy_bounds(b);
  if (const auto box = axis_box(b)) return times_box(a, *box, context);
  if (const auto box = axis_box(a)) return rotated_axes(times_box(b, *box, context), size(a.dimension()));
  // The paper: embed both, then intersect.
  return model::intersect({times_box(a, b_room, context), rotated_axes(times_box(b, a_room, context), size(a.dimension()))});
}

Expression image_of(const model::Shadow& shadow, const std::vector<Expression>& operands, const ConstructContext& context) {
  const std::size_t d = size(operands[0].dimension()), kept = shadow.axes.size();
  const auto of_corners = [&](const Points& corners) {
    Points flat;
    for (std::size_t i = 0; i < corners.size(); i += d)
      for (const int axis : shadow.axes) flat.push_back(corners[i + size(axis)]);
    return model::convex_hull(static_cast<int>(kept), flat);
  };
  const auto of_ball = [&](const PlacedPrimitive& ball) {
    const std::vector<Real> square = square_of(ball);
    std::vector<Real> centre, flat;
    for (const int i : shadow.axes) {
      centre.push_back(static_cast<Real>(ball.matrix[size(i) * (d + 1) + d]));
      for (const int j : shadow.axes) flat.push_back(square[size(i) * d + size(j)]);
    }
    return ellipsoid(centre, std::move(flat));
  };
  return distributed(operands[0], static_cast<int>(kept), context, of_corners, of_ball);
}

Expression image_of(const model::Section& section, const std::vector<Expression>& operands, const ConstructContext& context) {
  return with_primitives_replaced(operands[0], operands[0].dimension() - 1, [&](const PlacedPrimitive& placed) {
    if (const auto* round = std::get_if<model::Round>(placed.primitive)) return section_of_round(section, placed, *round);
    if (std::holds_alternative<model::Torus>(*placed.primitive)) throw Error("section: that of a torus is not known");
    std::vector<Expression> parts;
    for_convex_parts(placed, context, [&](const Points& corners) { parts.push_back(section_of_hull(section, corners, placed.dimension)); });
    return united(placed.dimension - 1, std::move(parts));
  });
}

Expression image_of(const model::ProjectiveMap& map, const std::vector<Expression>& operands, const ConstructContext& context) {
  const Expression operand = of_polytopes_and_balls(operands[0], context);
  const std::size_t d = size(operand.dimension());
  bool is_possible = true;
  const Expression image = with_primitives_replaced(operand, operand.dimension(), [&](const PlacedPrimitive& placed) {
    std::vector<Expression> parts;
    if (ball_of(*placed.primitive) != nullptr) {
      const auto mapped_one = mapped_ball(map.matrix, placed);
      is_possible = is_possible && mapped_one;
      if (mapped_one) parts.push_back(*mapped_one);
    } else {
      for_convex_parts(placed, context, [&](const Points& corners) {
        const auto points = mapped(map.matrix, corners, d);
        is_possible = is_possible && points;
        if (points) parts.push_back(model::convex_hull(static_cast<int>(d), *points));
      });
    }
    return united(static_cast<int>(d), std::move(parts));
  });
  if (is_possible) return image;
  const char* const reason =
      "projective: the plane at infinity meets the solid: the last row of the matrix has to give a value above 0 in all of it; cut away what is on the other "
      "side, or change the sign of the matrix";
  if (!operand.node().faceted) throw Error(reason);
  // A primitive reaches too far; perhaps what is left of it does not.
  std::vector<Expression> parts;
  for (const Points& part : convex_parts(operand, context.options)) {
    const auto points = mapped(map.matrix, part, d);
    if (!points) throw Error(reason);
    parts.push_back(model::convex_hull(static_cast<int>(d), *points));
  }
  return united(static_cast<int>(d), std::move(parts));
}

Expression image_of(const model::Sweep& sweep, const std::vector<Expression>& operands, const ConstructContext& context) {
  const int dimension = operands[0].dimension();
  const std::size_t d = size(dimension);
  const auto along_path = [&](const auto& of_segment) {
    std::vector<Expression> pieces;
    for (std::size_t i = 0; i + 1 < sweep.path.size(); ++i) pieces.push_back(of_segment(sweep.path[i], sweep.path[i + 1]));
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
      return model::transform(start.entries, model::unite({ball, model::transform(end.entries, ball),
                                                           model::transform(turn.entries, model::round_cylinder(dimension - 1, radius, lengths))}));
    });
  };
  return distributed(operands[0], dimension, context, of_corners, of_ball);
}

Expression image_of(const model::MinkowskiSum&, const std::vector<Expression>& operands, const ConstructContext& context) {
  return sum_of_parts(convex_parts(operands[0], context.options), convex_parts(operands[1], context.options), operands[0].dimension(), "minkowski");
}

Expression image_of(const model::Growth& growth, const std::vector<Expression>& operands, const ConstructContext& context) {
  const Expression& operand = operands[0];
  const int dimension = operand.dimension();
  if (growth.distance == 0) return operand;
  const double distance = std::fabs(growth.distance);
  const std::vector<double> lengths(size(dimension), 2 * distance);
  const Expression ball = growth.ball == model::Growth::Ball::cube ? model::cuboid(lengths, true) : model::ball_polytope(dimension, distance, growth.sides);
  std::vector<Points> ball_parts = convex_parts(ball, context.options);
  if (growth.distance > 0) return sum_of_parts(convex_parts(operand, context.options), ball_parts, dimension, "grow");
  // What is near to the outside goes. The ball is turned round: a point goes where its ball meets the outside.
  const model::Bounds bounds = model::bounds(operand);
  if (bounds.is_empty()) return operand;
  if (!bounds.is_finite()) throw Error("shrink: the solid has no bounds; intersect it with something that has");
  AxisBox around{bounds.lower, bounds.upper};
  for (std::size_t i = 0; i < around.lower.size(); ++i) {
    around.lower[i] -= 2 * distance;
    around.upper[i] += 2 * distance;
  }
  const Expression outside = model::subtract({moved(model::cuboid(around.lengths()), around.lower), operand});
  for (Points& part : ball_parts)
    for (double& x : part) x = -x;
  return model::subtract({operand, sum_of_parts(convex_parts(outside, context.options), ball_parts, dimension, "shrink")});
}

namespace {

/// One convex primitive, wherever it is placed, without its colour: it is its own hull.
std::optional<Expression> single_convex(const Expression& solid) {
  std::vector<const model::Transform*> maps;
  const Expression* at = &solid;
  for (;;) {
    const auto& value = at->node().value;
    if (const auto* primitive = std::get_if<model::Primitive>(&value)) {
      if (!is_convex(*primitive)) return std::nullopt;
      break;
    }
    if (const auto* transform = std::get_if<model::Transform>(&value)) maps.push_back(transform);
    const Expression* only = nullptr;
    for (const Expression& child : at->node().children()) {
      if (is_empty(child)) continue;
      if (only != nullptr) return std::nullopt;
      only = &child;
    }
    const auto* boolean = std::get_if<model::Boolean>(&value);
    if (only == nullptr || (boolean != nullptr && boolean->operation != model::Operation::unite)) return std::nullopt;
    at = only;
  }
  Expression result = *at;
  for (std::size_t i = maps.size(); i-- > 0;) result = make(solid.dimension(), model::Transform{maps[i]->matrix, std::move(result)});
  return result;
}

}  // namespace

Expression image_of(const model::Hull&, const std::vector<Expression>& operands, const ConstructContext& context) {
  if (auto itself = single_convex(operands[0])) return *std::move(itself);
  return model::convex_hull(operands[0].dimension(), spanning_points(operands[0], context.options));
}

}  // namespace bsp2::dataflow
