#pragma once

#include <cstddef>
#include <vector>

#include "mesh/mesh_closing.hpp"

namespace bsp2::model {

/// A mesh of which corners were merged.
struct MergedCorners {
  FaceCycles faces;
  std::size_t count = 0;  ///< corners that are gone
  double distance = 0;    ///< the longest way that one was moved
};

/// Merges corners that noise has driven apart: ends of edges at which a single face lies that are near each
/// other, for the size of the mesh (at most a thousandth of it) and for the edges there (at most half the
/// shortest one at either). So no edge vanishes, and a mesh of fine detail keeps it. The distance within
/// which corners are merged is the least that closes about as many edges as the largest one.
///
/// Of corners that are merged the one that most faces use stays, where it is. Time: n log n.
MergedCorners merged_corners(const std::vector<Point3>& points, const FaceCycles& faces);

}  // namespace bsp2::model
