#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/shapes/mesh.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// A triangle mesh in a normalized frame: integer points p, coordinates p 2^-53 in [-1, 1], and the exact
/// planes through its triangles.
struct MeshShape {
  explicit MeshShape(const model::TriangleMesh& mesh);

  double scale = 1;  ///< a power of two: units of the primitive's frame per unit of the normalized one
  std::array<double, 3>
      origin{};  ///< of the normalized frame in the primitive's: not 0 where the mesh is far from there
  std::vector<std::array<std::int64_t, 3>> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< those that are not flat
  std::vector<geometry::Covector<3>> covectors;         ///< one a triangle
  std::array<double, 3> lower, upper;
  bool convex = false;                ///< the intersection of its half-spaces
  const model::TriangleMesh* source;  ///< by its address: which of the model's; it may be gone

 private:
  void choose_frame(const model::TriangleMesh& mesh);
  [[nodiscard]] bool is_convex() const;
};

/// On which side of a plane of the normalized frame a point there lies, exactly. @param point times 2^53.
[[nodiscard]] int side(const geometry::Covector<3>& plane, const std::array<std::int64_t, 3>& point);

/// The mesh as a producer of the model. @param planes the merged hyperplane of each triangle.
Mesh place_mesh(const MeshShape& shape, const geometry::Matrix<3>& matrix, int grid_exponent,
                std::span<const geometry::OrientedHyperplane> planes);

/// Mesh::is_exact, which is to be set. @pre `first` is.
[[nodiscard]] bool has_exact_planes(const geometry::HyperplaneTable<3>& table, const Mesh& mesh);

/// The tree over a mesh's facets, which is made when it is first asked for. Any number of threads may ask.
const FacetTree& facet_tree(const Mesh& mesh);

}  // namespace bsp2::dataflow
