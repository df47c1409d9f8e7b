#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "bsp2/meshing/tetrahedra/tetrahedra.hpp"

namespace bsp2::meshing {

/// How sharp the solid is at edges of its mesh.
///
/// A wedge is what of one part is between two faces on the outside or on interfaces that meet in an edge:
/// some of the tetrahedra around it, or all around an edge inside. No mesh has tetrahedra there with larger
/// angles.
class Wedges {
 public:
  using Edge = std::array<std::uint32_t, 2>;  ///< ascending
  static Edge edge_between(std::uint32_t u, std::uint32_t v) { return {std::min(u, v), std::max(u, v)}; }

  /// @param edges those that are asked for.
  Wedges(const Tetrahedra& mesh, const std::vector<Edge>& edges);

  /// The angle, in degrees, of the wedge at an edge that a tetrahedron is a part of.
  [[nodiscard]] double angle(const Edge& edge, std::uint32_t tetrahedron) const;

 private:
  /// A tetrahedron at an edge.
  struct Slice {
    std::uint32_t tetrahedron;
    std::array<std::uint32_t, 2> beside;  ///< its other points
    double angle;
    double of_wedge = 0;
  };
  const Tetrahedra& mesh_;
  std::map<Edge, std::vector<Slice>> slices_;
  std::map<Edge, std::vector<std::uint32_t>> borders_;  ///< third points of triangles of the mesh

  void find_slices();
  void find_borders();
  void join(const Edge& edge, std::vector<Slice>& slices) const;
};

}  // namespace bsp2::meshing
