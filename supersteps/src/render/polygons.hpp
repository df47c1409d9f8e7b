#pragma once

#include <cstdint>
#include <vector>

namespace bsp2::supersteps {

/// Polygons in the order in which they are drawn.
struct Polygons {
  std::vector<double> points;       ///< x and y
  std::vector<std::uint32_t> ends;  ///< of each polygon in the points
  std::vector<float> inks;          ///< red, green, blue, opacity, and 1 for edges

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& points& ends& inks;
  }
};

}  // namespace bsp2::supersteps
