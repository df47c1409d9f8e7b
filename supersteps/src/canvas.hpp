#pragma once

#include <cairo.h>

#include <array>
#include <memory>
#include <span>
#include <string>

namespace bsp2::supersteps {

using Colour = std::array<double, 3>;  ///< red, green, blue in [0, 1]

/// A square image that polygons are filled into.
///
/// Drawn at twice its size without antialiasing and averaged at the end: polygons that share an edge then
/// leave no seam, as they would if each were blended with what is behind it.
class Canvas {
 public:
  Canvas(int size, const Colour& background);

  /// Fills a polygon; the origin of the image is its upper left corner, y shows down, lengths are in its
  /// pixels.
  void fill(std::span<const std::array<double, 2>> polygon, const Colour& colour);
  /// The image as the bytes of a PNG file. Call once, at the end.
  [[nodiscard]] std::string png();

 private:
  static constexpr int samples = 2;  // an edge of a pixel

  int size_;
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context_;
};

}  // namespace bsp2::supersteps
