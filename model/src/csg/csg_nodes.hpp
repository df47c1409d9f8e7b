#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/node_pool.hpp"
#include "text/csg_arguments.hpp"

namespace bsp2::model {

/// What a node of the language means.
enum class NodeKind : std::uint8_t {
  group,  ///< also union and render: all unite their children
  color,
  difference,
  intersection,
  multmatrix,
  complement,
  symmetric_difference,
  part,
  measure,
  hull,  ///< from here on: constructs
  minkowski,
  fill,
  offset,
  projection,
  resize,
  linear_extrude,
  rotate_extrude,
  roof,
  product,
  extrude,
  embed,
  project,
  section,
  projective,
  grow,
  shrink,
  sweep,
  cube,  ///< from here on: primitives, whose children take no part
  sphere,
  cylinder,
  polyhedron,
  square,
  circle,
  polygon,
  text,
  import,
  surface,
  bezier,
  bspline,
  nurbs,
  subdivision,
  simplex,
  polytope,
  cuboid,
  ball,
  d_cylinder,
  cone,
  torus,
  unknown
};

NodeKind node_kind(std::string_view name);
/// What to do with a text in OpenSCAD's own language.
inline constexpr std::string_view source_hint =
    "; if this is OpenSCAD's own language, name the file .scad, and the program openscad will translate it";
/// Whether what the reader cannot read there, after the name `node`, looks like OpenSCAD's own language.
bool is_source_at(std::string_view text, std::size_t offset, std::string_view node);
/// Why a node of kind `unknown` cannot be read, with a hint.
std::string why_not(std::string_view name);

/// A polyhedron whose faces bound no solid. What that means depends on where it stands.
class HollowPolyhedron : public Error {
 public:
  HollowPolyhedron(const std::string& text, std::vector<std::array<double, 3>> points_, bool is_open_)
      : Error(text), points(std::move(points_)), is_open(is_open_) {}
  std::vector<std::array<double, 3>> points;
  bool is_open;  ///< else its faces are flat
};

/// The solid of a primitive, with OpenSCAD's meaning of bad arguments: what has no size is empty.
/// @throws bsp2::Error without a position, for more sides than anybody needs; HollowPolyhedron.
/// @param folder what the names of files are relative to. @param note is told what needs no warning.
Expression make_primitive(NodeKind kind, const Arguments& arguments, const std::filesystem::path& folder,
                          const CsgOptions& options, NodePool& pool, const Warn& warn, const Warn& note);

/// The 4 x 4 matrix of a multmatrix node, row-major.
std::array<double, 16> read_matrix(const Arguments& arguments);

/// The colour of a color node: numbers, or a name as CSS has them, and `alpha`; nothing if it is none.
std::optional<Colour> read_colour(const Arguments& arguments, const Warn& warn);

/// What it does to solids of a dimension: 2 takes the rows and columns of x, y and the translation, if all
/// numbers are finite.
std::vector<double> matrix_of_dimension(const std::array<double, 16>& matrix, int dimension);

/// What a node of kind hull to roof does to its operand; nothing if what comes out is empty whatever that is.
/// @throws bsp2::Error without a position.
std::optional<Construct> read_construct(NodeKind kind, const Arguments& arguments, const Warn& warn);

/// Dimension of the operands that such a node takes: 2, 3, or 0 for that of its first child.
int operand_dimension(NodeKind kind);
/// Which nodes do the same to solids of other dimensions, to end a message with.
std::string advice_for_dimension(NodeKind kind);

}  // namespace bsp2::model
