#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "bsp2/geometry/support/error.hpp"
#include "bsp2/model/expression/csg.hpp"
#include "builder/node_pool.hpp"
#include "csg/strict_arguments.hpp"
#include "text/csg_arguments.hpp"

namespace bsp2::model {

/// What the reader does with a node.
enum class NodeCategory : std::uint8_t {
  group,      ///< unites its children
  boolean,    ///< combines them otherwise
  colour,     ///< unites them, in a colour
  map,        ///< unites them and moves them
  operation,  ///< what OpenSCAD does not have and is no construct: names, complements, ...
  construct,  ///< makes another solid of them
  primitive,  ///< its children take no part
  unknown     ///< neither do those of what is no node
};

/// Nodes for which the reader has rules that their rows do not tell.
enum class NodeKind : std::uint8_t {
  other,
  hull,
  minkowski,
  offset,
  projection,
  symmetric_difference,
  product,
  polyhedron,
  text,
  import,
  surface
};

/// A primitive as it stands in the text, and what it is made with.
struct PrimitiveText {
  std::string_view node;  ///< its name
  const Arguments& arguments;
  const std::filesystem::path& folder;  ///< what the names of files are relative to
  const CsgOptions& options;
  NodePool& pool;
  const Warn& warn;
  const Warn& note;  ///< is told what is right and good to know, such as the units of a file
};

/// The solid of a primitive, with OpenSCAD's meaning of bad arguments: what has no size is empty.
/// @throws bsp2::Error without a position, for more sides than anybody needs; HollowPolyhedron.
using ReadPrimitive = Expression (*)(const PrimitiveText& text);

/// The solid of a primitive that OpenSCAD does not have. @throws bsp2::Error without a position.
using ReadOwnPrimitive = Expression (*)(const StrictArguments& arguments);

/// What a construct of OpenSCAD does to its operand; nothing if what comes out is empty whatever that is.
/// @throws bsp2::Error without a position.
using ReadConstruct = std::optional<Construct> (*)(const Arguments& arguments, const Warn& warn);

/// What a node that OpenSCAD does not have makes of its operands, none of them empty or of no dimension, and
/// one but for product and symmetric_difference. @throws bsp2::Error without a position, for operands of
/// dimensions that it cannot take.
using MakeOwn = std::function<Expression(std::span<const Expression> operands, NodePool& pool)>;
using ReadOwn = MakeOwn (*)(const StrictArguments& arguments);

/// All that there is to say about a node of the language.
struct NodeRow {
  std::string_view name;
  NodeCategory category = NodeCategory::unknown;
  std::variant<std::monostate, Operation, ReadConstruct, ReadOwn, ReadPrimitive, ReadOwnPrimitive> read;
  /// Of nodes that OpenSCAD does not have: the names of all arguments, with spaces between them.
  std::optional<std::string_view> arguments;
  NodeKind kind = NodeKind::other;
  int operands = 0;  ///< dimension of those that it takes: 2, 3, or 0 for that of its first child
  int result = 0;    ///< dimension of what it makes of them; 0: the same
  std::string_view instead =
      "; extrude, embed, project and section change the dimension";  ///< which nodes do the same in other
                                                                     ///< dimensions

  /// Whether OpenSCAD does not have it.
  [[nodiscard]] constexpr bool is_own() const { return arguments.has_value(); }
  [[nodiscard]] bool takes_children() const {
    return category != NodeCategory::primitive && category != NodeCategory::unknown;
  }
  /// Whether it is read as nodes of its category are: what rows are wrong does not compile.
  [[nodiscard]] constexpr bool is_sound() const {
    switch (category) {
      case NodeCategory::boolean:
        return std::holds_alternative<Operation>(read);
      case NodeCategory::operation:
        return std::holds_alternative<ReadOwn>(read) && is_own();
      case NodeCategory::construct:
        return std::holds_alternative<ReadConstruct>(read) ||
               (std::holds_alternative<ReadOwn>(read) && is_own());
      case NodeCategory::primitive:
        return std::holds_alternative<ReadPrimitive>(read) ||
               (std::holds_alternative<ReadOwnPrimitive>(read) && is_own());
      case NodeCategory::group:
      case NodeCategory::colour:
      case NodeCategory::map:
      case NodeCategory::unknown:
        return std::holds_alternative<std::monostate>(read);
    }
    return false;
  }
  /// Whether it unites its children, and no more than moves them.
  [[nodiscard]] bool only_unites() const {
    return category == NodeCategory::group || category == NodeCategory::colour ||
           category == NodeCategory::map;
  }
};

/// The row of a name, or that of what is no node.
const NodeRow& node_named(std::string_view name);
/// What to do with a text in OpenSCAD's own language.
inline constexpr std::string_view source_hint =
    "; if this is OpenSCAD's own language, name the file .scad, and the program openscad will translate it";
/// Whether what the reader cannot read there, after the name `node`, looks like OpenSCAD's own language.
bool is_source_at(std::string_view text, std::size_t offset, std::string_view node);
/// Why there is no node of this name, with a hint.
std::string why_not(std::string_view name);

/// A polyhedron whose faces bound no solid. What that means depends on where it stands.
class HollowPolyhedron : public Error {
 public:
  HollowPolyhedron(const std::string& text, std::vector<std::array<double, 3>> points_, bool is_open_)
      : Error(text), points(std::move(points_)), is_open(is_open_) {}
  std::vector<std::array<double, 3>> points;
  bool is_open;  ///< else its faces are flat
};

/// @throws as what reads the node does. @pre row.category is primitive.
Expression make_primitive(const NodeRow& row, const PrimitiveText& text);

/// The 4 x 4 matrix of a multmatrix node, row-major.
std::array<double, 16> read_matrix(const Arguments& arguments);

/// The square matrix of a multmatrix node, row-major; empty if it is not square, or for children of two or
/// three dimensions, whose matrix OpenSCAD reads in its own way.
std::vector<double> read_square_matrix(const Arguments& arguments);

/// The colour of a color node: numbers, or a name as CSS has them, and `alpha`; nothing if it is none.
std::optional<Colour> read_colour(const Arguments& arguments, const Warn& warn);

/// What it does to solids of a dimension: 2 takes the rows and columns of x, y and the translation, if all
/// numbers are finite.
std::vector<double> matrix_of_dimension(const std::array<double, 16>& matrix, int dimension);

}  // namespace bsp2::model
