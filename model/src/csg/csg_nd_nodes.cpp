#include "csg/csg_nd_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/geometry/support/dimensions.hpp"
#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/tessellation.hpp"

namespace bsp2::model {
namespace {

struct Signature {
  NodeKind kind;
  std::string_view name;
  std::vector<std::string_view> arguments;  // in their order
};

const std::vector<Signature>& signatures() {
  static const std::vector<Signature> all = {
      {NodeKind::complement, "complement", {}},
      {NodeKind::symmetric_difference, "symmetric_difference", {}},
      {NodeKind::part, "part", {"name"}},
      {NodeKind::measure, "measure", {"name"}},
      {NodeKind::product, "product", {}},
      {NodeKind::extrude, "extrude", {"h", "center"}},
      {NodeKind::embed, "embed", {"dimension", "thickness"}},
      {NodeKind::project, "project", {"dimension", "axes"}},
      {NodeKind::section, "section", {"axis", "at"}},
      {NodeKind::projective, "projective", {"m"}},
      {NodeKind::grow, "grow", {"delta", "r", "$fn", "$fa", "$fs"}},
      {NodeKind::shrink, "shrink", {"delta", "r", "$fn", "$fa", "$fs"}},
      {NodeKind::sweep, "sweep", {"path"}},
      {NodeKind::simplex, "simplex", {"dimension", "size", "points"}},
      {NodeKind::polytope, "polytope", {"points"}},
      {NodeKind::cuboid, "cuboid", {"size", "center"}},
      {NodeKind::ball, "ball", {"dimension", "r", "d", "$fn"}},
      {NodeKind::d_cylinder, "d_cylinder", {"dimension", "r", "h", "d", "center", "$fn"}},
      {NodeKind::cone, "cone", {"h", "r1", "r2", "center", "$fn"}},
      {NodeKind::torus, "torus", {"R", "r", "$fn"}},
  };
  return all;
}

const Signature* signature_of(NodeKind kind) {
  for (const Signature& signature : signatures())
    if (signature.kind == kind) return &signature;
  return nullptr;
}

/// The arguments of a node, strictly: what is unknown, missing or of another kind is an error that names it.
class Strict {
 public:
  Strict(NodeKind kind, const Arguments& arguments) : signature_(*signature_of(kind)), arguments_(arguments) {
    std::size_t positional = 0;
    for (const Argument& argument : arguments.all()) {
      if (argument.name.empty()) {
        if (++positional > signature_.arguments.size())
          fail("takes at most " + counted(signature_.arguments.size(), "# argument[s]") + known());
        continue;
      }
      if (std::find(signature_.arguments.begin(), signature_.arguments.end(), argument.name) ==
          signature_.arguments.end())
        fail("has no argument '" + std::string(argument.name.substr(0, 60)) + "'" + known());
    }
  }

  [[nodiscard]] const Value* find(std::string_view name) const {
    const auto& names = signature_.arguments;
    return arguments_.find(name,
                           static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin()));
  }
  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }

  [[nodiscard]] double number(std::string_view name, std::optional<double> missing = std::nullopt) const {
    const Value* value = find(name);
    if (!value && missing) return *missing;
    if (!value) fail("needs the argument '" + std::string(name) + "'" + known());
    if (value->kind != Value::number || !std::isfinite(value->as_number))
      fail(quoted(name) + " has to be a finite number");
    return value->as_number;
  }
  [[nodiscard]] int integer(std::string_view name, std::optional<double> missing = std::nullopt) const {
    const double x = number(name, missing);
    if (x != std::trunc(x) || std::fabs(x) > 1000) fail(quoted(name) + " has to be a small whole number");
    return static_cast<int>(x);
  }
  [[nodiscard]] int dimension(std::optional<double> missing = std::nullopt) const {
    const int d = integer("dimension", missing);
    if (!geometry::is_dimension(d))
      fail("has " + counted(d, "# dimension[s]; 1 to ") + std::to_string(NodePool::most_dimensions) +
           " are possible");
    return d;
  }
  /// A number counts as a list of one.
  [[nodiscard]] std::vector<double> numbers(std::string_view name, bool one_is_enough = true) const {
    const Value* value = find(name);
    if (!value) fail("needs the argument '" + std::string(name) + "'" + known());
    if (value->kind == Value::number && one_is_enough) return {number(name)};
    if (auto list = list_of(value)) return *list;
    fail(quoted(name) + " has to be a list of finite numbers");
  }
  [[nodiscard]] std::vector<std::vector<double>> lists(std::string_view name) const {
    const Value* value = find(name);
    if (!value) fail("needs the argument '" + std::string(name) + "'" + known());
    std::vector<std::vector<double>> lists;
    if (value->kind == Value::vector) {
      const Value* at = value + 1;
      for (std::uint32_t i = 0; i < value->size; at += at->span, ++i) {
        auto list = list_of(at);
        if (!list || list->empty() || (!lists.empty() && list->size() != lists.front().size())) break;
        lists.push_back(std::move(*list));
      }
    }
    if (lists.empty() || lists.size() != value->size)
      fail(quoted(name) + " has to be a list of lists of finite numbers, all of the same length");
    return lists;
  }
  [[nodiscard]] bool flag(std::string_view name) const {
    const Value* value = find(name);
    if (value && value->kind != Value::boolean) fail(quoted(name) + " has to be true or false");
    return value && value->as_number != 0;
  }
  [[nodiscard]] std::string text(std::string_view name) const {
    const Value* value = find(name);
    if (!value || value->kind != Value::text || value->size == 0)
      fail("needs a name, as in " + std::string(signature_.name) + "(\"shaft\")");
    return arguments_.string(name, 0, "");
  }
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(std::string(signature_.name) + ": " + text);
  }

 private:
  const Signature& signature_;
  const Arguments& arguments_;

  static std::string quoted(std::string_view name) { return "'" + std::string(name) + "'"; }
  [[nodiscard]] std::string known() const {
    if (signature_.arguments.empty()) return "; it takes none";
    std::string text = "; it takes ";
    for (const std::string_view name : signature_.arguments)
      text += (name == signature_.arguments.front() ? "" : ", ") + std::string(name);
    return text;
  }
  static std::optional<std::vector<double>> list_of(const Value* value) {
    if (value->kind != Value::vector || value->span != value->size + 1) return std::nullopt;
    std::vector<double> list;
    for (std::uint32_t i = 1; i <= value->size; ++i) {
      if (value[i].kind != Value::number || !std::isfinite(value[i].as_number)) return std::nullopt;
      list.push_back(value[i].as_number);
    }
    return list;
  }
};

double radius_of(const Strict& arguments) {
  if (arguments.has("d") && arguments.has("r")) arguments.fail("has both 'r' and 'd'; one is enough");
  return arguments.has("d") ? arguments.number("d") / 2 : arguments.number("r", 1);
}

/// How finely it is enclosed where corners are needed; 0 if nobody says.
std::uint32_t fineness_of(const Strict& arguments) {
  const double sides = arguments.number("$fn", 0);
  if (sides != std::trunc(sides) || sides < 0 || (sides > 0 && sides < 3) || sides > 1000)
    arguments.fail("'$fn' is a whole number from 3 to 1000, or 0");
  return static_cast<std::uint32_t>(sides);
}

std::vector<double> flattened(const std::vector<std::vector<double>>& lists) {
  std::vector<double> flat;
  for (const auto& list : lists) flat.insert(flat.end(), list.begin(), list.end());
  return flat;
}

/// Moved so that the middle of [0, lengths] along the last axes is at 0.
Expression centred(Expression solid, std::span<const double> lengths) {
  const auto d = static_cast<std::size_t>(solid.dimension());
  std::vector<double> matrix((d + 1) * (d + 1));
  for (std::size_t i = 0; i <= d; ++i) matrix[i * (d + 2)] = 1;
  for (std::size_t i = 0; i < lengths.size(); ++i)
    matrix[(d - lengths.size() + i) * (d + 1) + d] = -lengths[i] / 2;
  return transform(matrix, std::move(solid));
}

Expression any_primitive(NodeKind kind, const Strict& arguments) {
  switch (kind) {
    case NodeKind::simplex: {
      if (!arguments.has("points")) return simplex(arguments.dimension(3), arguments.number("size", 1));
      const auto points = arguments.lists("points");
      if (arguments.has("dimension") &&
          static_cast<std::size_t>(arguments.dimension()) != points.front().size())
        arguments.fail("has points of " +
                       counted(points.front().size(), "# coordinate[s], and 'dimension' says otherwise"));
      return simplex(static_cast<int>(points.front().size()), flattened(points));
    }
    case NodeKind::polytope: {
      const auto points = arguments.lists("points");
      return convex_hull(static_cast<int>(points.front().size()), flattened(points));
    }
    case NodeKind::cuboid: {
      const auto size = arguments.numbers("size");
      if (size.empty() || size.size() > NodePool::most_dimensions)
        arguments.fail("has " + counted(size.size(), "# length[s]; 1 to ") +
                       std::to_string(NodePool::most_dimensions) + " are possible");
      return cuboid(size, arguments.flag("center"));
    }
    case NodeKind::ball:
      return ball(arguments.dimension(3), radius_of(arguments), fineness_of(arguments));
    case NodeKind::d_cylinder: {
      const std::vector<double> lengths =
          arguments.has("h") ? arguments.numbers("h") : std::vector<double>{1};
      const int d = arguments.dimension(3), axes = d - static_cast<int>(lengths.size());
      if (axes < 1)
        arguments.fail("has " + counted(lengths.size(), "# length[s] in ") +
                       counted(d, "# dimension[s]; one axis at least has to be round"));
      const Expression solid = round_cylinder(axes, radius_of(arguments), lengths, fineness_of(arguments));
      return arguments.flag("center") ? centred(solid, lengths) : solid;
    }
    case NodeKind::cone: {
      const double length[] = {arguments.number("h", 1)};
      const Expression solid =
          cone(length[0], arguments.number("r1", 1), arguments.number("r2", 0), fineness_of(arguments));
      return arguments.flag("center") ? centred(solid, length) : solid;
    }
    default:
      return torus(arguments.number("R", 2), arguments.number("r", 1), fineness_of(arguments));
  }
}

Construct growth_of(NodeKind kind, const Strict& arguments, const Arguments& all) {
  const bool round = arguments.has("r");
  if (round && arguments.has("delta"))
    arguments.fail("has both 'r' and 'delta'; r is for a round distance, delta for that along the axes");
  Growth growth{.distance = arguments.number(round ? "r" : "delta")};
  if (growth.distance < 0)
    arguments.fail(std::string("has a distance below 0; ") + (kind == NodeKind::grow ? "shrink" : "grow") +
                   " is for that");
  if (round) {
    growth.ball = Growth::Ball::round;
    const double sides = side_count(growth.distance, resolution_of(all));
    if (!(sides <= max_sides)) arguments.fail("asks for more than " + std::to_string(max_sides) + " sides");
    growth.sides = static_cast<std::uint32_t>(sides);
  }
  if (kind == NodeKind::shrink) growth.distance = -growth.distance;
  return growth;
}

std::vector<int> kept_axes(const Strict& arguments) {
  std::vector<int> axes;
  for (const double axis : arguments.numbers("axes")) {
    if (axis != std::trunc(axis) || axis < 1 || axis > NodePool::most_dimensions)
      arguments.fail("'axes' are whole numbers from 1");
    axes.push_back(static_cast<int>(axis) - 1);
  }
  return axes;
}

}  // namespace

bool is_any_node(NodeKind kind) { return signature_of(kind) != nullptr; }

Expression make_any_primitive(NodeKind kind, const Arguments& arguments, NodePool& pool) {
  return pool.adopt(any_primitive(kind, Strict(kind, arguments)));
}

NdNode read_nd_node(NodeKind kind, const Arguments& all) {
  const Strict arguments(kind, all);
  NdNode node;
  switch (kind) {
    case NodeKind::part:
    case NodeKind::measure:
      node.name = arguments.text("name");
      break;
    case NodeKind::product:
      node.construct = Product{};
      break;
    case NodeKind::extrude:
      node.construct = Product{};
      node.lengths = arguments.numbers("h");
      node.center = arguments.flag("center");
      if (node.lengths.empty() ||
          std::any_of(node.lengths.begin(), node.lengths.end(), [](double h) { return !(h > 0); }))
        arguments.fail("'h' is a length above 0, or several");
      break;
    case NodeKind::embed:
      node.dimension = arguments.dimension();
      node.thickness = arguments.number("thickness");
      break;
    case NodeKind::project:
      if (arguments.has("axes") == arguments.has("dimension"))
        arguments.fail("takes either 'dimension', how many axes are kept, or 'axes', which ones");
      if (arguments.has("axes"))
        node.construct = Shadow{kept_axes(arguments)};
      else
        node.dimension = arguments.dimension();
      break;
    case NodeKind::section:
      node.construct = Section{arguments.integer("axis") - 1, arguments.number("at", 0)};
      break;
    case NodeKind::projective:
      node.construct = ProjectiveMap{flattened(arguments.lists("m"))};
      break;
    case NodeKind::grow:
    case NodeKind::shrink:
      node.construct = growth_of(kind, arguments, all);
      break;
    case NodeKind::sweep:
      node.construct = Sweep{arguments.lists("path")};
      break;
    default:
      break;
  }
  return node;
}

Expression make_nd_node(NodeKind kind, const NdNode& node, std::span<const Expression> operands,
                        NodePool& pool) {
  const Expression& operand = operands.front();
  // The builder checks the dimensions; equal nodes are made one here.
  const auto pooled = [&](const Construct& what, std::vector<Expression> of) {
    const int dimension = construct(what, of).dimension();
    return pool.construction(what, dimension, of);
  };
  const auto times_box = [&](std::span<const double> lengths, bool center) {
    return pooled(Product{}, {operand, pool.adopt(cuboid(lengths, center))});
  };
  switch (kind) {
    case NodeKind::complement:
      return pool.boolean(Operation::complement, operand.dimension(), operands);
    case NodeKind::symmetric_difference:
      return pool.boolean(Operation::symmetric_difference, operand.dimension(), operands);
    case NodeKind::part:
      return pool.named(Named::Role::part, node.name, operand);
    case NodeKind::measure:
      return pool.named(Named::Role::measure, node.name, operand);
    case NodeKind::product: {
      Expression all = operand;
      for (const Expression& next : operands.subspan(1)) all = pooled(Product{}, {all, next});
      return all;
    }
    case NodeKind::extrude:
      return times_box(node.lengths, node.center);
    case NodeKind::embed: {
      embed(operand, node.dimension, node.thickness);  // for its checks
      const std::vector<double> lengths(static_cast<std::size_t>(node.dimension - operand.dimension()),
                                        node.thickness);
      return lengths.empty() ? operand : times_box(lengths, true);
    }
    case NodeKind::project: {
      Shadow shadow;
      if (const auto* given = std::get_if<Shadow>(&node.construct)) shadow = *given;
      for (int axis = 0; axis < node.dimension; ++axis) shadow.axes.push_back(axis);
      return pooled(shadow, {operand});
    }
    default:
      return pooled(node.construct, {operand});
  }
}

std::vector<double> read_square_matrix(const Arguments& arguments) {
  const Value* rows = arguments.find("m", 0);
  if (!rows || rows->kind != Value::vector || rows->size == 3 || rows->size == 4) return {};
  std::vector<double> matrix;
  const Value* row = rows + 1;
  for (std::uint32_t i = 0; i < rows->size; row += row->span, ++i) {
    if (row->kind != Value::vector || row->size != rows->size || row->span != row->size + 1) return {};
    for (std::uint32_t j = 1; j <= row->size; ++j) {
      if (row[j].kind != Value::number) return {};
      matrix.push_back(row[j].as_number);
    }
  }
  return matrix;
}

}  // namespace bsp2::model
