#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include "bsp2/geometry/support/counted.hpp"
#include "bsp2/model/builder/builder.hpp"
#include "bsp2/model/expression/tessellation.hpp"
#include "csg/csg_construct_nodes.hpp"

namespace bsp2::model {
namespace {

double radius_of(const StrictArguments& arguments) {
  if (arguments.has("d") && arguments.has("r")) arguments.fail("has both 'r' and 'd'; one is enough");
  return arguments.has("d") ? arguments.number("d") / 2 : arguments.number("r", 1);
}

/// How finely it is enclosed where corners are needed; 0 if nobody says.
std::uint32_t fineness_of(const StrictArguments& arguments) {
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

Expression read_simplex(const StrictArguments& arguments) {
  if (!arguments.has("points")) return simplex(arguments.dimension(3), arguments.number("size", 1));
  const auto points = arguments.lists("points");
  if (arguments.has("dimension") && static_cast<std::size_t>(arguments.dimension()) != points.front().size())
    arguments.fail("has points of " +
                   counted(points.front().size(), "# coordinate[s], and 'dimension' says otherwise"));
  return simplex(static_cast<int>(points.front().size()), flattened(points));
}

Expression read_polytope(const StrictArguments& arguments) {
  const auto points = arguments.lists("points");
  return convex_hull(static_cast<int>(points.front().size()), flattened(points));
}

Expression read_cuboid(const StrictArguments& arguments) {
  const auto size = arguments.numbers("size");
  if (size.empty() || size.size() > NodePool::most_dimensions)
    arguments.fail("has " + counted(size.size(), "# length[s]; 1 to ") +
                   std::to_string(NodePool::most_dimensions) + " are possible");
  return cuboid(size, arguments.flag("center"));
}

Expression read_ball(const StrictArguments& arguments) {
  return ball(arguments.dimension(3), radius_of(arguments), fineness_of(arguments));
}

Expression read_round_cylinder(const StrictArguments& arguments) {
  const std::vector<double> lengths = arguments.has("h") ? arguments.numbers("h") : std::vector<double>{1};
  const int d = arguments.dimension(3), axes = d - static_cast<int>(lengths.size());
  if (axes < 1)
    arguments.fail("has " + counted(lengths.size(), "# length[s] in ") +
                   counted(d, "# dimension[s]; one axis at least has to be round"));
  const Expression solid = round_cylinder(axes, radius_of(arguments), lengths, fineness_of(arguments));
  return arguments.flag("center") ? centred(solid, lengths) : solid;
}

Expression read_cone(const StrictArguments& arguments) {
  const double length[] = {arguments.number("h", 1)};
  const Expression solid =
      cone(length[0], arguments.number("r1", 1), arguments.number("r2", 0), fineness_of(arguments));
  return arguments.flag("center") ? centred(solid, length) : solid;
}

Expression read_torus(const StrictArguments& arguments) {
  return torus(arguments.number("R", 2), arguments.number("r", 1), fineness_of(arguments));
}

Expression read_paraboloid(const StrictArguments& arguments) {
  return paraboloid(arguments.dimension(3), arguments.number("h", 1), radius_of(arguments),
                    fineness_of(arguments));
}

Growth growth_of(const StrictArguments& arguments, std::string_view opposite) {
  const bool round = arguments.has("r");
  if (round && arguments.has("delta"))
    arguments.fail("has both 'r' and 'delta'; r is for a round distance, delta for that along the axes");
  Growth growth{.distance = arguments.number(round ? "r" : "delta")};
  if (growth.distance < 0)
    arguments.fail("has a distance below 0; " + std::string(opposite) + " is for that");
  if (round) {
    growth.ball = Growth::Ball::round;
    const double sides = side_count(growth.distance, resolution_of(arguments.all()));
    if (!(sides <= max_sides)) arguments.fail("asks for more than " + std::to_string(max_sides) + " sides");
    growth.sides = static_cast<std::uint32_t>(sides);
  }
  return growth;
}

std::vector<int> kept_axes(const StrictArguments& arguments) {
  std::vector<int> axes;
  for (const double axis : arguments.numbers("axes")) {
    if (axis != std::trunc(axis) || axis < 1 || axis > NodePool::most_dimensions)
      arguments.fail("'axes' are whole numbers from 1");
    axes.push_back(static_cast<int>(axis) - 1);
  }
  return axes;
}

/// The builder checks the dimensions; equal nodes are made one here.
Expression pooled(NodePool& pool, const Construct& what, const std::vector<Expression>& operands) {
  const int dimension = construct(what, operands).dimension();
  return pool.construction(what, dimension, operands);
}

Expression times_box(NodePool& pool, const Expression& operand, std::span<const double> lengths,
                     bool center) {
  return pooled(pool, Product{}, {operand, pool.adopt(cuboid(lengths, center))});
}

MakeOwn constructs(const Construct& what) {
  return [what](std::span<const Expression> operands, NodePool& pool) {
    return pooled(pool, what, {operands.front()});
  };
}

template <Operation operation>
MakeOwn read_operation(const StrictArguments&) {
  return [](std::span<const Expression> operands, NodePool& pool) {
    return pool.boolean(operation, operands.front().dimension(), operands);
  };
}

template <Named::Role role>
MakeOwn read_named(const StrictArguments& arguments) {
  return [name = arguments.text("name")](std::span<const Expression> operands, NodePool& pool) {
    return pool.named(role, name, operands.front());
  };
}

MakeOwn read_product(const StrictArguments&) {
  return [](std::span<const Expression> operands, NodePool& pool) {
    Expression all = operands.front();
    for (const Expression& next : operands.subspan(1)) all = pooled(pool, Product{}, {all, next});
    return all;
  };
}

MakeOwn read_extrude(const StrictArguments& arguments) {
  const std::vector<double> lengths = arguments.numbers("h");
  const bool center = arguments.flag("center");
  if (lengths.empty() || std::any_of(lengths.begin(), lengths.end(), [](double h) { return !(h > 0); }))
    arguments.fail("'h' is a length above 0, or several");
  return [lengths, center](std::span<const Expression> operands, NodePool& pool) {
    return times_box(pool, operands.front(), lengths, center);
  };
}

MakeOwn read_embed(const StrictArguments& arguments) {
  const int dimension = arguments.dimension();
  const double thickness = arguments.number("thickness");
  return [dimension, thickness](std::span<const Expression> operands, NodePool& pool) {
    const Expression& operand = operands.front();
    embed(operand, dimension, thickness);  // for its checks
    const std::vector<double> lengths(static_cast<std::size_t>(dimension - operand.dimension()), thickness);
    return lengths.empty() ? operand : times_box(pool, operand, lengths, true);
  };
}

MakeOwn read_project(const StrictArguments& arguments) {
  if (arguments.has("axes") == arguments.has("dimension"))
    arguments.fail("takes either 'dimension', how many axes are kept, or 'axes', which ones");
  if (arguments.has("axes")) return constructs(Shadow{kept_axes(arguments)});
  Shadow shadow;
  for (int axis = 0, end = arguments.dimension(); axis < end; ++axis) shadow.axes.push_back(axis);
  return constructs(shadow);
}

MakeOwn read_section(const StrictArguments& arguments) {
  return constructs(Section{arguments.integer("axis") - 1, arguments.number("at", 0)});
}

MakeOwn read_projective(const StrictArguments& arguments) {
  return constructs(ProjectiveMap{flattened(arguments.lists("m"))});
}

MakeOwn read_grow(const StrictArguments& arguments) { return constructs(growth_of(arguments, "shrink")); }

MakeOwn read_shrink(const StrictArguments& arguments) {
  Growth growth = growth_of(arguments, "grow");
  growth.distance = -growth.distance;
  return constructs(growth);
}

MakeOwn read_sweep(const StrictArguments& arguments) { return constructs(Sweep{arguments.lists("path")}); }

}  // namespace

std::span<const NodeRow> nodes_of_any_dimension() {
  using enum NodeCategory;
  static constexpr NodeRow rows[] = {
      {"complement", operation, read_operation<Operation::complement>, ""},
      {"symmetric_difference", operation, read_operation<Operation::symmetric_difference>, "",
       NodeKind::symmetric_difference},
      {"part", operation, read_named<Named::Role::part>, "name"},
      {"measure", operation, read_named<Named::Role::measure>, "name"},
      {"product", construct, read_product, "", NodeKind::product},
      {"extrude", construct, read_extrude, "h center"},
      {"embed", construct, read_embed, "dimension thickness"},
      {"project", construct, read_project, "dimension axes"},
      {"section", construct, read_section, "axis at"},
      {"projective", construct, read_projective, "m"},
      {"grow", construct, read_grow, "delta r $fn $fa $fs"},
      {"shrink", construct, read_shrink, "delta r $fn $fa $fs"},
      {"sweep", construct, read_sweep, "path"},
      {"simplex", primitive, read_simplex, "dimension size points"},
      {"polytope", primitive, read_polytope, "points"},
      {"cuboid", primitive, read_cuboid, "size center"},
      {"ball", primitive, read_ball, "dimension r d $fn"},
      {"d_cylinder", primitive, read_round_cylinder, "dimension r h d center $fn"},
      {"cone", primitive, read_cone, "h r1 r2 center $fn"},
      {"torus", primitive, read_torus, "R r $fn"},
      {"paraboloid", primitive, read_paraboloid, "h r dimension d $fn"},
  };
  static_assert(std::ranges::all_of(rows, &NodeRow::is_sound));
  return rows;
}

}  // namespace bsp2::model
