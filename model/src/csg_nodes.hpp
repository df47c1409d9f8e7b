#pragma once

#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "csg_scanner.hpp"
#include "node_pool.hpp"

namespace bsp2::model {

/// What a node of the language means.
enum class NodeKind : std::uint8_t {
  group,  ///< also union, color and render: all unite their children
  difference,
  intersection,
  multmatrix,
  cube,
  sphere,
  cylinder,
  polyhedron,
  unsupported,  ///< a node of the language that is not read yet
  unknown
};

NodeKind node_kind(std::string_view name);
/// Why a node of kind `unsupported` or `unknown` cannot be read, with a hint.
std::string why_not(std::string_view name, NodeKind kind);

/// The arguments of one node, by name or by place.
class Arguments {
 public:
  Arguments(std::span<const Argument> arguments, std::span<const Value> tape)
      : arguments_(arguments), tape_(tape) {}
  /// The value named `name`, else the positional one at `place` (< 0: none), else null. The last of several
  /// counts.
  [[nodiscard]] const Value* find(std::string_view name, int place = -1) const;
  /// The number of that name; `missing` if there is none or if it is no number.
  [[nodiscard]] double number(std::string_view name, int place, double missing) const;
  [[nodiscard]] bool flag(std::string_view name, int place) const;

 private:
  std::span<const Argument> arguments_;
  std::span<const Value> tape_;
};

using Warn = std::function<void(std::string)>;

/// The solid of a primitive, with OpenSCAD's meaning of bad arguments: what has no size is empty.
/// @throws bsp2::Error without a position, for more sides than anybody needs and for open polyhedra.
Expression make_primitive(NodeKind kind, const Arguments& arguments, NodePool& pool, const Warn& warn);

/// The affine matrix of a multmatrix node; empty if its children vanish.
std::vector<double> read_matrix(const Arguments& arguments, const Warn& warn);

}  // namespace bsp2::model
