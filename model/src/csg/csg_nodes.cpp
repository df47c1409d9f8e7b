#include "csg/csg_nodes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "bsp2/geometry/support/suggestion.hpp"
#include "bsp2/model/expression/colour.hpp"
#include "builder/matrix.hpp"
#include "csg/csg_construct_nodes.hpp"
#include "csg/csg_primitive_nodes.hpp"

namespace bsp2::model {
namespace {

using enum NodeCategory;
using Kind = NodeKind;

/// OpenSCAD's nodes.
constexpr NodeRow openscad_nodes[] = {
    {"group", group},
    {"union", group},
    {"render", group},
    {"echo", group},
    {"color", colour},
    {"multmatrix", map},
    {"difference", boolean, Operation::subtract},
    {"intersection", boolean, Operation::intersect},
    {"intersection_for", boolean, Operation::intersect},
    {"hull", construct, read_hull, {}, Kind::hull},
    {"minkowski", construct, read_minkowski, {}, Kind::minkowski},
    {"fill", construct, read_fill, {}, {}, 2},
    {"offset", construct, read_offset, {}, Kind::offset, 2, 2, "; grow and shrink take any dimension"},
    {"projection",
     construct,
     read_projection,
     {},
     Kind::projection,
     3,
     2,
     "; project and section take any dimension"},
    {"resize", construct, read_resize},
    {"linear_extrude", construct, read_linear_extrude, {}, {}, 2, 3, "; extrude takes any dimension"},
    {"rotate_extrude", construct, read_rotate_extrude, {}, {}, 2, 3},
    {"roof", construct, read_roof, {}, {}, 2, 3},
    {"cube", primitive, make_cube},
    {"sphere", primitive, make_sphere},
    {"cylinder", primitive, make_cylinder},
    {"polyhedron", primitive, make_polyhedron, {}, Kind::polyhedron},
    {"square", primitive, make_square},
    {"circle", primitive, make_circle},
    {"polygon", primitive, make_polygon},
    {"text", primitive, make_text, {}, Kind::text},
    {"import", primitive, make_import, {}, Kind::import},
    {"surface", primitive, make_surface, {}, Kind::surface},
};
static_assert(std::ranges::all_of(openscad_nodes, &NodeRow::is_sound));

constexpr NodeRow no_node{};

/// Calls use(row) for all nodes until it says true.
template <typename Use>
void for_each_node(const Use& use) {
  for (const auto rows : {std::span<const NodeRow>(openscad_nodes), nodes_of_any_dimension(), spline_nodes()})
    for (const NodeRow& row : rows)
      if (use(row)) return;
}

constexpr std::string_view source_words[] = {"translate", "rotate",  "scale",    "mirror", "module",
                                             "function",  "for",     "if",       "else",   "let",
                                             "use",       "include", "children", "assert", "each"};

bool contains(std::span<const std::string_view> names, std::string_view name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace

bool is_source_at(std::string_view text, std::size_t offset, std::string_view node) {
  if (contains(source_words, node)) return true;
  // Assignments, expressions and ranges: none of them stands in a .csg file.
  return !node.empty() && offset < text.size() &&
         std::string_view("=+-*/%^:?<>").find(text[offset]) != std::string_view::npos;
}

const NodeRow& node_named(std::string_view name) {
  const NodeRow* found = &no_node;
  for_each_node([&](const NodeRow& row) {
    if (row.name == name) found = &row;
    return row.name == name;
  });
  return *found;
}

std::string why_not(std::string_view name) {
  const std::string quoted = "'" + std::string(name.substr(0, 60)) + "'";
  if (contains(source_words, name)) return quoted + " is no node of a .csg file" + std::string(source_hint);
  std::vector<std::string_view> names;
  for_each_node([&](const NodeRow& row) {
    names.push_back(row.name);
    return false;
  });
  return "there is no node " + quoted + suggestion(name.substr(0, 60), names);
}

Expression make_primitive(const NodeRow& row, const PrimitiveText& text) {
  if (const auto* read = std::get_if<ReadPrimitive>(&row.read)) return (*read)(text);
  const StrictArguments arguments(row.name, *row.arguments, text.arguments);
  return text.pool.adopt(std::get<ReadOwnPrimitive>(row.read)(arguments));
}

std::array<double, 16> read_matrix(const Arguments& arguments) {
  std::array<double, 16> matrix{1, 0, 0, 0, 0, 1, 0, 0,
                                0, 0, 1, 0, 0, 0, 0, 1};  // OpenSCAD's default for what is missing
  if (const Value* rows = arguments.find("m", 0); rows && rows->kind == Value::vector) {
    const Value* row = rows + 1;
    for (std::uint32_t i = 0; i < std::min(rows->size, 4u); row += row->span, ++i) {
      if (row->kind != Value::vector) continue;
      const Value* entry = row + 1;
      for (std::uint32_t j = 0; j < std::min(row->size, 4u); entry += entry->span, ++j)
        if (entry->kind == Value::number) matrix[i * 4 + j] = entry->as_number;
    }
  }
  return matrix;
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

std::optional<Colour> read_colour(const Arguments& arguments, const Warn& warn) {
  const Value* channels = arguments.find("c", 0);
  if (channels && channels->kind == Value::text) {
    const std::string name = arguments.string("c", 0, "");
    std::optional<Colour> colour = colour_named(name);
    if (!colour) {
      warn("'" + name.substr(0, 60) +
           "' is no colour: it is no name that CSS knows, nor #rgb, #rgba, #rrggbb or #rrggbbaa");
      return std::nullopt;
    }
    const double alpha = arguments.number("alpha", 1, (*colour)[3]);
    if (!(alpha >= 0)) return std::nullopt;
    (*colour)[3] = std::min(alpha, 1.0);
    return colour;
  }
  if (!channels || channels->kind != Value::vector || channels->size < 3 || channels->size > 4 ||
      channels->span != channels->size + 1)
    return std::nullopt;
  Colour colour{0, 0, 0, arguments.number("alpha", 1, 1)};
  for (std::uint32_t i = 0; i < channels->size; ++i) {
    if (channels[i + 1].kind != Value::number) return std::nullopt;
    colour[i] = channels[i + 1].as_number;
  }
  for (double& channel : colour) {
    if (!(channel >= 0)) return std::nullopt;  // -1: OpenSCAD's word for none
    channel = std::min(channel, 1.0);
  }
  return colour;
}

std::vector<double> matrix_of_dimension(const std::array<double, 16>& m, int dimension) {
  const bool all_finite = std::all_of(m.begin(), m.end(), [](double x) { return std::isfinite(x); });
  if (dimension == 2 && all_finite) return {m[0], m[1], m[3], m[4], m[5], m[7], m[12], m[13], m[15]};
  return {m.begin(), m.end()};
}

}  // namespace bsp2::model
