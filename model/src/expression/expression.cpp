#include "bsp2/model/expression/expression.hpp"

#include <algorithm>
#include <utility>

namespace bsp2::model {

Expression::Expression(int dimension)
    : node_(std::make_shared<Node>(dimension, Boolean{Operation::unite, {}})) {}

bool is_curved(const Primitive& primitive) {
  constexpr auto is_flat = []<typename Shape>(const Shape&) {
    return std::is_same_v<Shape, Cuboid> || std::is_same_v<Shape, Lathe> ||
           std::is_same_v<Shape, TriangleMesh> || std::is_same_v<Shape, RegularPolygon> ||
           std::is_same_v<Shape, ConvexPolygon> || std::is_same_v<Shape, Polytope>;
  };
  return !std::visit(is_flat, primitive);
}

Node::Node(int dimension_, Value value_)
    : dimension(dimension_), resolved(true), faceted(true), parts(0), value(std::move(value_)) {
  constexpr std::uint64_t most = std::uint64_t{1} << 62;  // a graph may stand for more than anybody can count
  const auto add = [&](const Expression& child) {
    resolved = resolved && child.node().resolved;
    faceted = faceted && child.node().faceted;
    parts = std::min(parts + child.node().parts, most);
  };
  for (const Expression& child : children()) add(child);
  if (const auto* boolean = std::get_if<Boolean>(&value)) {
    if (boolean->parts != 0) parts = boolean->parts;
  } else if (std::holds_alternative<Construction>(value)) {
    resolved = false;
  } else if (const auto* primitive = std::get_if<Primitive>(&value)) {
    faceted = !is_curved(*primitive);
    parts = 1;
  }
}

std::span<const Expression> Node::children() const {
  if (const auto* boolean = std::get_if<Boolean>(&value)) return boolean->children;
  if (const auto* transform = std::get_if<Transform>(&value)) return {&transform->child, 1};
  if (const auto* coloured = std::get_if<Coloured>(&value)) return {&coloured->child, 1};
  if (const auto* named = std::get_if<Named>(&value)) return {&named->child, 1};
  if (const auto* construction = std::get_if<Construction>(&value)) return construction->operands;
  return {};
}

namespace {
using Owner = std::shared_ptr<const Node>;
thread_local std::vector<Owner>* pending = nullptr;  // of the outermost ~Node that runs on this thread
}  // namespace

// The outermost destructor releases everything; the ones it sets off only hand over their children. So the
// depth of the call stack is two, whatever the depth of the expression.
Node::~Node() {
  const auto hand_over = [this](std::vector<Owner>& to) {
    for (const Expression& child : children())
      to.push_back(std::move(const_cast<Expression&>(child).node_));  // nobody else looks at them any more
  };
  if (std::holds_alternative<Primitive>(value)) return;
  if (pending) {
    hand_over(*pending);
    return;
  }
  std::vector<Owner> owners;
  pending = &owners;
  hand_over(owners);
  while (!owners.empty()) {
    const Owner released = std::move(owners.back());
    owners.pop_back();
  }
  pending = nullptr;
}

}  // namespace bsp2::model
