#pragma once

#include <cairo.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace bsp2::supersteps {

using Colour = std::array<double, 3>;  ///< red, green, blue in [0, 1]

/// What has been drawn on a canvas, without what has not: it travels, and is put over what lies behind it.
///
/// A rectangle of samples, row by row, as runs of equal ones: a count and the colour, 0 for nothing.
struct Layer {
  std::int32_t x = 0, y = 0, width = 0, height = 0;
  std::vector<std::uint32_t> runs;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive & x & y & width & height & runs;
  }
};

/// A square image that polygons are filled into.
///
/// Drawn at twice its size without antialiasing and averaged at the end: polygons that share an edge then leave no seam, as
/// they would if each were blended with what is behind it. So a picture may be drawn in layers by several canvases, and is
/// the same, sample for sample.
class Canvas {
 public:
  explicit Canvas(int size);

  /// Fills a polygon; the origin of the image is its upper left corner, y shows down, lengths are in its
  /// pixels.
  void fill(std::span<const std::array<double, 2>> polygon, const Colour& colour);
  /// What has been drawn; the canvas is empty again.
  [[nodiscard]] Layer take();
  /// Puts a layer over what has been drawn.
  void put(const Layer& layer);
  /// The image before a background as the bytes of a PNG file. Call once, at the end.
  [[nodiscard]] std::string png(const Colour& background);

 private:
  static constexpr int samples = 2;  // an edge of a pixel

  int size_;
  std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface_;
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context_;
  std::array<double, 2> low_, high_;  // of what has been drawn, in samples

  void forget();
  std::uint32_t* row(int y);
};

}  // namespace bsp2::supersteps
