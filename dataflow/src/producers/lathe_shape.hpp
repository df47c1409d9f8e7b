#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "bsp2/dataflow/shapes/lathe.hpp"
#include "bsp2/geometry/exact/covector.hpp"
#include "process/transformer.hpp"

namespace bsp2::dataflow {

/// A lathe with very many facets in its normalized frame, and the planes that part its facets.
struct LatheShape {
  /// @param facets the covectors of geometry::lathe. Those of the parting planes are appended: they bound
  /// nothing.
  LatheShape(std::uint32_t sides, std::vector<double> radius, std::vector<double> z,
             std::vector<geometry::Covector<3>>& covectors);

  Lathe lathe;                         ///< all but what depends on the place
  std::size_t cap_count, facet_count;  ///< among the covectors: caps, then sides, then parting planes
};

/// The lathe as a producer of the model.
/// @param planes the merged hyperplanes of all covectors. @param radius a bound of the model's coordinates.
/// @param moved how far merging may have moved a hyperplane.
Lathe place_lathe(const LatheShape& shape, const Transformer<3>& placement,
                  std::span<const geometry::OrientedHyperplane> planes, double radius, double moved);

}  // namespace bsp2::dataflow
