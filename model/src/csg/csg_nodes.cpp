#include "csg/csg_nodes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "bsp2/model/expression/suggestion.hpp"
#include "builder/matrix.hpp"
#include "csg/csg_nd_nodes.hpp"
#include "csg/csg_primitive_nodes.hpp"
#include "csg/csg_spline_nodes.hpp"
#include "text/colour_names.hpp"

namespace bsp2::model {
namespace {

constexpr std::pair<std::string_view, NodeKind> kinds[] = {
    {"group", NodeKind::group},
    {"union", NodeKind::group},
    {"color", NodeKind::color},
    {"render", NodeKind::group},
    {"multmatrix", NodeKind::multmatrix},
    {"cube", NodeKind::cube},
    {"cylinder", NodeKind::cylinder},
    {"difference", NodeKind::difference},
    {"intersection", NodeKind::intersection},
    {"sphere", NodeKind::sphere},
    {"polyhedron", NodeKind::polyhedron},
    {"square", NodeKind::square},
    {"circle", NodeKind::circle},
    {"polygon", NodeKind::polygon},
    {"text", NodeKind::text},
    {"import", NodeKind::import},
    {"surface", NodeKind::surface},
    {"linear_extrude", NodeKind::linear_extrude},
    {"rotate_extrude", NodeKind::rotate_extrude},
    {"roof", NodeKind::roof},
    {"hull", NodeKind::hull},
    {"minkowski", NodeKind::minkowski},
    {"offset", NodeKind::offset},
    {"projection", NodeKind::projection},
    {"resize", NodeKind::resize},
    {"fill", NodeKind::fill},
    {"intersection_for", NodeKind::intersection},
    {"echo", NodeKind::group},
    {"complement", NodeKind::complement},
    {"symmetric_difference", NodeKind::symmetric_difference},
    {"part", NodeKind::part},
    {"measure", NodeKind::measure},
    {"product", NodeKind::product},
    {"extrude", NodeKind::extrude},
    {"embed", NodeKind::embed},
    {"project", NodeKind::project},
    {"section", NodeKind::section},
    {"projective", NodeKind::projective},
    {"grow", NodeKind::grow},
    {"shrink", NodeKind::shrink},
    {"sweep", NodeKind::sweep},
    {"simplex", NodeKind::simplex},
    {"polytope", NodeKind::polytope},
    {"cuboid", NodeKind::cuboid},
    {"ball", NodeKind::ball},
    {"d_cylinder", NodeKind::d_cylinder},
    {"cone", NodeKind::cone},
    {"torus", NodeKind::torus},
    {"bezier", NodeKind::bezier},
    {"bspline", NodeKind::bspline},
    {"nurbs", NodeKind::nurbs},
    {"subdivision", NodeKind::subdivision},
};

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

NodeKind node_kind(std::string_view name) {
  for (const auto& [known, kind] : kinds)
    if (known == name) return kind;
  return NodeKind::unknown;
}

std::string why_not(std::string_view name) {
  const std::string quoted = "'" + std::string(name.substr(0, 60)) + "'";
  if (contains(source_words, name)) return quoted + " is no node of a .csg file" + std::string(source_hint);
  std::vector<std::string_view> names;
  for (const auto& entry : kinds) names.push_back(entry.first);
  return "there is no node " + quoted + suggestion(name.substr(0, 60), names);
}

Expression make_primitive(NodeKind kind, const Arguments& arguments, const std::filesystem::path& folder,
                          const CsgOptions& options, NodePool& pool, const Warn& warn, const Warn& note) {
  if (kind >= NodeKind::simplex) return make_any_primitive(kind, arguments, pool);
  switch (kind) {
    case NodeKind::cube:
      return make_cube(arguments, pool, warn);
    case NodeKind::sphere:
      return make_sphere(arguments, options, pool, warn);
    case NodeKind::cylinder:
      return make_cylinder(arguments, options, pool, warn);
    case NodeKind::square:
      return make_square(arguments, pool, warn);
    case NodeKind::circle:
      return make_circle(arguments, options, pool, warn);
    case NodeKind::polygon:
      return make_polygon(arguments, pool, warn);
    case NodeKind::text:
      return make_text(arguments, pool, warn);
    case NodeKind::import:
      return make_import(arguments, folder, pool, warn, note);
    case NodeKind::surface:
      return make_surface(arguments, folder, pool, warn);
    case NodeKind::bezier:
    case NodeKind::bspline:
    case NodeKind::nurbs:
    case NodeKind::subdivision:
      return make_spline_node(kind, arguments, pool);
    default:
      return make_polyhedron(arguments, pool, warn);
  }
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
