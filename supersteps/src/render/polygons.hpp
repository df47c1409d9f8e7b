#pragma once

#include <cstdint>
#include <vector>

#include "render/ink.hpp"

namespace bsp2::supersteps {

/// Polygons in the order in which they are drawn, and lines before them.
struct Polygons {
  std::vector<double> points;       ///< x and y
  std::vector<std::uint32_t> ends;  ///< of each polygon in the points
  std::vector<float> inks;          ///< red, green, blue, opacity, and 1 for edges
  std::vector<SeenFacet> facets;    ///< what each polygon shows; empty where nobody asks
  std::vector<double> line_points;  ///< likewise
  std::vector<std::uint32_t> line_ends;
  double line_width = 0.7;  ///< pixels

  /// Without lines: they are made when all polygons are there.
  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& points& ends& inks& facets;
  }
};

}  // namespace bsp2::supersteps
