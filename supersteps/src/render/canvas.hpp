#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "bsp2/supersteps/render/picture_format.hpp"

/// What a picture is drawn on: samples (Canvas) or a list of polygons (Drawing). Both can be taken off as
/// layers, which travel and are put over each other again, so that the picture does not depend on who drew
/// what. The origin is the upper left corner, y shows down, lengths are in pixels.
namespace bsp2::supersteps {

using Colour = std::array<double, 3>;  ///< red, green, blue in [0, 1]

/// How a polygon is drawn.
struct Ink {
  Colour colour{};
  double opacity = 1;
  bool edges = false;  ///< its outline as a dark line
};

/// What has been drawn on a canvas, without what has not: it travels, and is put over what lies behind it.
///
/// A rectangle of samples, row by row, as runs of equal ones: a count and the colour, 0 for nothing.
struct Layer {
  std::int32_t x = 0, y = 0, width = 0, height = 0;
  std::vector<std::uint32_t> runs;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& x& y& width& height& runs;
  }
};

/// An image that polygons are filled into.
///
/// Drawn at three times its size without antialiasing and averaged at the end: polygons that share an edge
/// then leave no seam, as they would if each were blended with what is behind it. What is translucent covers
/// some of a pixel's samples, always the same ones. So every sample has the colour of one polygon, and a
/// picture may be drawn in layers by several canvases, and is the same, sample for sample. The samples of a
/// whole image are many. So it is drawn in strips, one after the other from the top, each in layers.
class Canvas {
 public:
  using Layer = supersteps::Layer;
  virtual ~Canvas() = default;

  [[nodiscard]] virtual int strips() const = 0;
  /// The first and the last strip that a polygon between two heights touches; in that order, but where it
  /// touches none.
  [[nodiscard]] virtual std::array<std::uint8_t, 2> strips_between(double low, double high) const = 0;
  /// What is drawn from now on, and put: of the others nothing is. The canvas is empty.
  virtual void begin_strip(int strip) = 0;
  virtual void fill(std::span<const std::array<double, 2>> polygon, const Ink& ink) = 0;
  /// What has been drawn; the canvas is empty again.
  [[nodiscard]] virtual Layer take() = 0;
  /// Puts a layer of this strip over what has been drawn.
  virtual void put(const Layer& layer) = 0;
  /// Puts the strip before a background and into the image.
  virtual void end_strip(const Colour& background) = 0;
  /// The image as the bytes of a PNG file. Call once, after all strips.
  [[nodiscard]] virtual std::string file() = 0;
};

std::unique_ptr<Canvas> make_canvas(int width, int height);

/// A list of polygons that becomes an SVG or PDF file.
class Drawing {
 public:
  /// Polygons in the order in which they are drawn.
  struct Layer {
    std::vector<double> points;       ///< x and y
    std::vector<std::uint32_t> ends;  ///< of each polygon in the points
    std::vector<float> inks;          ///< red, green, blue, opacity, and 1 for edges

    template <class Archive>
    void serialize(Archive& archive, unsigned) {
      archive& points& ends& inks;
    }
  };
  Drawing(int width, int height, PictureFormat format) : width_(width), height_(height), format_(format) {}

  [[nodiscard]] static int strips() { return 1; }
  [[nodiscard]] static std::array<std::uint8_t, 2> strips_between(double, double) { return {0, 0}; }
  void begin_strip(int) {}
  void fill(std::span<const std::array<double, 2>> polygon, const Ink& ink);
  [[nodiscard]] Layer take();
  void put(const Layer& layer);
  void end_strip(const Colour& background) { background_ = background; }
  /// The drawing before its background as the bytes of a file. Call once, at the end.
  [[nodiscard]] std::string file();

 private:
  int width_, height_;
  PictureFormat format_;
  Colour background_{};
  Layer all_;
};

}  // namespace bsp2::supersteps
