#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "bsp2/dataflow/shapes/facet_tree.hpp"
#include "bsp2/geometry/exact/affine_map.hpp"
#include "bsp2/geometry/exact/hyperplane.hpp"
#include "bsp2/geometry/hyperplanes/hyperplane_table.hpp"
#include "bsp2/model/expression/expression.hpp"

namespace bsp2::dataflow {

/// A placed triangle mesh: a producer that is not convex.
///
/// Inside are the points around which the mesh winds a non-zero number of times. Coordinates are rounded,
/// good to `error`; they only ever rule facets out of a cell. What decides is exact: the facets' hyperplanes,
/// and the exact places of the points where a winding number is asked for that rounding leaves open.
struct Mesh {
  struct Facet {
    std::array<std::uint32_t, 3> corners;
    geometry::OrientedHyperplane plane;
  };
  std::vector<std::array<std::int64_t, 3>>
      frame_points;            ///< the points in the mesh's own frame, times 2^53, exactly
  geometry::AffineMap<3> map;  ///< places them in the model
  int grid_exponent = 0;
  const model::TriangleMesh* source = nullptr;  ///< by its address: which of the model's; it may be gone
  std::vector<std::array<double, 3>> points;    ///< in the model, rounded
  double error = 0;                             ///< bound of the coordinates' error
  std::vector<Facet> facets;
  geometry::HyperplaneTable<3>::Source
      first{};  ///< where the plane of the first facet came from, before merging; those of others follow
  bool is_exact = false;  ///< merging has moved no facet: the hyperplane of each passes through its corners
  /// Who looks for the surface without cells has proven that facets meet in edges and corners alone, and that
  /// the mesh winds once around what they bound.
  bool is_embedded = false;
  /// Hyperplanes of the facets around each point, sorted: point i has [incident_offset[i], incident_offset[i
  /// + 1]).
  std::vector<std::uint32_t> incident_offset;
  std::vector<geometry::HyperplaneId> incident;
  /// A hyperplane that merging has put in the place of facets, and how far their corners are from it at most.
  struct Moved {
    geometry::HyperplaneId plane;
    double distance;
  };
  std::vector<Moved> moved;  ///< those that miss corners by more than rounding, by id
  std::shared_ptr<LazyFacetTree> tree =
      std::make_shared<LazyFacetTree>();  ///< of `facets`; shared by copies, which have the same ones
};

}  // namespace bsp2::dataflow
