#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace bsp2::model {

/// The box [0, size_0] x ... x [0, size_{D-1}].
struct Cuboid {
  std::vector<double> size;  ///< D lengths, all > 0
  friend bool operator==(const Cuboid&, const Cuboid&) = default;
};

/// The convex solid between regular polygons ("rings") stacked along +z: prisms, cones, and OpenSCAD's spheres.
///
/// Vertex j of ring i is (radius_i * cos(360 j / sides), radius_i * sin(360 j / sides), z_i), degrees. The caller
/// guarantees that the rings ascend in z and that the stack is convex. A ring of radius 0 (an apex) may be the first
/// or the last one.
struct Lathe {
  struct Ring {
    double radius, z;
    friend bool operator==(const Ring&, const Ring&) = default;
  };
  std::uint32_t sides = 3;  ///< >= 3
  std::vector<Ring> rings;  ///< >= 2
  friend bool operator==(const Lathe&, const Lathe&) = default;
};

/// The solid enclosed by a closed triangle mesh: the points around which the mesh winds a non-zero number of times.
///
/// Triangles are counter-clockwise seen from outside; every edge is used equally often in both directions. Built by
/// `polyhedron()`, which repairs and checks its input.
struct TriangleMesh {
  std::vector<std::array<double, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  friend bool operator==(const TriangleMesh&, const TriangleMesh&) = default;
};

using Primitive = std::variant<Cuboid, Lathe, TriangleMesh>;

enum class Operation : std::uint8_t { unite, intersect, subtract, symmetric_difference, complement };

struct Node;

/// An immutable generative expression of a solid in E^D: a DAG whose nodes are shared, never changed.
///
/// A value: copying copies a pointer. Equal sub-expressions that come from one builder call or one file are one node.
/// Thread rule: any number of threads may read.
/// Source: the paper, sections 1 and 4.1.
class Expression {
 public:
  /// The empty solid of dimension `dimension` (a union of nothing).
  explicit Expression(int dimension = 3);
  explicit Expression(std::shared_ptr<const Node> node) : node_(std::move(node)) {}  // shared: a DAG has many parents
  [[nodiscard]] const Node& node() const { return *node_; }
  [[nodiscard]] int dimension() const;
  /// Whether both are the same node (not whether they are the same solid).
  [[nodiscard]] bool same_node(const Expression& other) const { return node_ == other.node_; }

 private:
  friend struct Node;                 // whose destructor takes chains apart
  std::shared_ptr<const Node> node_;  // shared: a DAG has many parents
};

/// An n-ary Boolean. `subtract` is its first child without the others, `complement` has one child; a union of no
/// children is empty.
struct Boolean {
  Operation operation;
  std::vector<Expression> children;
};

/// The image of the child under an affine map.
struct Transform {
  std::vector<double> matrix;  ///< (D+1) x (D+1), row-major; the last row is 0 ... 0 1; not singular
  Expression child;
};

struct Node {
  int dimension;
  std::variant<Primitive, Boolean, Transform> value;
  Node(int dimension_, std::variant<Primitive, Boolean, Transform> value_) : dimension(dimension_), value(std::move(value_)) {}
  Node(const Node&) = delete;
  Node& operator=(const Node&) = delete;
  ~Node();  ///< releases deep chains without recursion
};

}  // namespace bsp2::model
