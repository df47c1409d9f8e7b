#pragma once

#include <string>
#include <vector>

#include "csg/csg_nodes.hpp"

/// The nodes of the text form that OpenSCAD does not have: those of any dimension (docs/expressions.md).
/// Unlike the others they accept only arguments that they know.
namespace bsp2::model {

/// What a node with children says before they are read; which fields count depends on its kind.
struct NdNode {
  Construct construct;
  std::vector<double> lengths;  ///< extrude: along the new axes
  bool center = false;
  int dimension = 0;     ///< embed: of the result; project: without a list of axes, how many are kept
  double thickness = 0;  ///< embed
  std::string name;      ///< part, measure
};

/// Whether a node of this kind is read by the functions here.
bool is_any_node(NodeKind kind);

/// The solid of a node without children, from simplex to torus. @throws bsp2::Error without a position.
Expression make_any_primitive(NodeKind kind, const Arguments& arguments, NodePool& pool);

/// The arguments of a node with children, from complement to sweep. @throws bsp2::Error without a position.
NdNode read_nd_node(NodeKind kind, const Arguments& arguments);

/// What such a node makes of its operands, none of them empty or of no dimension, and one but for product,
/// the Booleans.
/// @throws bsp2::Error without a position, for operands of dimensions that it cannot take.
Expression make_nd_node(NodeKind kind, const NdNode& node, std::span<const Expression> operands,
                        NodePool& pool);

/// The square matrix of a multmatrix node, row-major; empty if it is not square, or for children of two or
/// three dimensions, whose matrix OpenSCAD reads in its own way.
std::vector<double> read_square_matrix(const Arguments& arguments);

}  // namespace bsp2::model
