// Products of solids: every primitive becomes a prism.
#include <algorithm>
#include <optional>
#include <utility>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/bounds.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/bottom_up.hpp"
#include "operands/nd_constructs.hpp"
#include "operands/placed_parts.hpp"

namespace bsp2::dataflow {

using model::Expression;
using model::Node;

namespace {

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
  Prism(int dimension, double length, const ConstructContext& context)
      : dimension_(dimension), length_(length), context_(context) {}

  Expression operator()(const model::Cuboid& cuboid) const {
    model::Cuboid prism = cuboid;
    prism.size.push_back(length_);
    return make(dimension_ + 1, prism);
  }
  Expression operator()(const model::Round& round) const {
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
    return model::transform(std::vector<double>{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, length_, 0, 0, 0, 0, 1},
                            make(3, polygon));
  }
  Expression operator()(const model::Lathe& lathe) const { return of_corners(lathe); }
  Expression operator()(const model::TriangleMesh& mesh) const { return of_corners(mesh); }
  Expression operator()(const model::Torus& torus) const { return of_preimage(itself(torus)); }
  Expression operator()(const model::Spline& spline) const { return of_preimage(itself(spline)); }
  Expression operator()(const model::SubdivisionSurface& surface) const {
    return of_preimage(itself(surface));
  }
  Expression operator()(const model::Preimage& preimage) const { return of_preimage(preimage); }
  Expression operator()(const model::TellsOfItself auto&) const {
    throw std::logic_error("it is enclosed before its prisms are asked for");
  }
  Expression operator()(const model::Polytope& polytope) const {
    if (polytope.half_spaces.empty()) return Expression(dimension_ + 1);  // flat: it encloses nothing
    const std::size_t d = size(dimension_);
    model::Polytope prism;
    for (const double end : {0.0, length_})
      for (std::size_t i = 0; i < polytope.corners.size(); i += d)
        add_point(prism.corners, {polytope.corners.data() + i, d}, end);
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
    prism.undecided = polytope.undecided;
    return make(dimension_ + 1, std::move(prism));
  }

 private:
  int dimension_;
  double length_;
  const ConstructContext& context_;

  /// The solid as the preimage of itself under the identity.
  template <typename Solid>
  [[nodiscard]] model::Preimage itself(const Solid& solid) const {
    const std::size_t d = size(dimension_);
    const model::Bounds bounds = model::bounds(make(dimension_, solid));
    model::Preimage preimage{solid, dimension_, std::vector<double>(d * (d + 1)), bounds.lower, bounds.upper};
    for (std::size_t i = 0; i < d; ++i) preimage.map[i * (d + 2)] = 1;
    return preimage;
  }
  /// The map does not look at the new axis; what lies beyond its ends is cut off.
  [[nodiscard]] Expression of_preimage(model::Preimage preimage) const {
    const std::size_t d = size(dimension_), rows = preimage.map.size() / (d + 1);
    for (std::size_t i = rows; i-- > 0;)
      preimage.map.insert(preimage.map.begin() + static_cast<std::ptrdiff_t>(i * (d + 1) + d), 0.0);
    AxisBox room{preimage.lower, preimage.upper};
    for (std::size_t i = 0; i < d; ++i) {
      const double side = (room.upper[i] - room.lower[i]) / 8;
      room.lower[i] -= side;
      room.upper[i] += side;
    }
    room.lower.push_back(0);
    room.upper.push_back(length_);
    preimage.lower.push_back(-length_ / 8);
    preimage.upper.push_back(length_ * 1.125);
    return model::intersect(
        {make(dimension_ + 1, std::move(preimage)), moved(model::cuboid(room.lengths()), room.lower)});
  }
  static void add_point(std::vector<double>& to, std::span<const double> first, double last) {
    to.insert(to.end(), first.begin(), first.end());
    to.push_back(last);
  }
  [[nodiscard]] Expression of_corners(const model::Primitive& primitive) const {
    std::vector<Expression> prisms;
    for (const Points& part : convex_parts(make(dimension_, primitive), context_.options)) {
      Points corners;
      for (const double end : {0.0, length_})
        for (std::size_t i = 0; i < part.size(); i += size(dimension_))
          add_point(corners, {part.data() + i, size(dimension_)}, end);
      prisms.push_back(model::convex_hull(dimension_ + 1, corners));
    }
    return united(dimension_ + 1, std::move(prisms));
  }
};

/// The product of a bounded solid with [0, length] along a new last axis: every primitive becomes a prism,
/// all else stays. For outside of all primitives the solid is not.
Expression lifted(const Expression& solid, double length, const ConstructContext& context) {
  return model::BottomUp<Expression>().run(
      solid, [](const Expression&) -> std::optional<Expression> { return std::nullopt; },
      [&](const Node& node, std::vector<Expression>&& images) -> Expression {
        if (const auto* boolean = std::get_if<model::Boolean>(&node.value))
          return make(node.dimension + 1, model::Boolean{boolean->operation, std::move(images)});
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
  if (!bounds.is_finite())
    throw Error("product: an operand has no bounds; intersect it with something that has");
  AxisBox box{bounds.lower, bounds.upper};
  for (std::size_t i = 0; i < box.lower.size(); ++i) {
    const double room = (bounds.upper[i] - bounds.lower[i]) / 8;
    box.lower[i] -= room;
    box.upper[i] += room;
  }
  return box;
}

}  // namespace

Expression image_of(const model::Product&, const std::vector<Expression>& operands,
                    const ConstructContext& context) {
  const Expression &a = operands[0], &b = operands[1];
  if (model::bounds(a).is_empty() || model::bounds(b).is_empty())
    return Expression(a.dimension() + b.dimension());
  const AxisBox a_room = roomy_bounds(a), b_room = roomy_bounds(b);
  if (const auto box = axis_box(b)) return times_box(a, *box, context);
  if (const auto box = axis_box(a)) return rotated_axes(times_box(b, *box, context), size(a.dimension()));
  // The paper: embed both, then intersect.
  return model::intersect(
      {times_box(a, b_room, context), rotated_axes(times_box(b, a_room, context), size(a.dimension()))});
}

}  // namespace bsp2::dataflow
