#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_closing.hpp"

namespace bsp2::model {

/// A mesh of several.
struct MeshView {
  const std::vector<Point3>& points;
  const FaceCycles& faces;
};

/// Which meshes bound a solid only together: parts of a surface that touch each other have nothing between
/// them. Points are one where they are equal.
/// @return sets of their numbers, by the first one: a mesh is alone if it is closed by itself, or if no
/// others close it.
std::vector<std::vector<std::size_t>> closed_together(const std::vector<MeshView>& meshes);

}  // namespace bsp2::model
