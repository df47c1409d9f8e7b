#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bsp2/supersteps/render/picture_format.hpp"
#include "bsp2/supersteps/render/rendering.hpp"
#include "paint/lighting.hpp"
#include "paint/occlusion.hpp"
#include "render/camera.hpp"
#include "render/ink.hpp"
#include "render/overlay.hpp"
#include "render/polygons.hpp"

/// What a picture is drawn on: samples (Canvas) or a list of polygons (Drawing). Both can be taken off as
/// layers, which travel and are put over each other again, so that the picture does not depend on who drew
/// what. The origin is the upper left corner, y shows down, lengths are in pixels.
namespace bsp2::supersteps {

/// What has been drawn on a canvas, without what has not: it travels, and is put over what lies behind it.
///
/// A rectangle of samples, row by row, as runs of equal ones: a count and a facet's number from 1, 0 for
/// nothing; and the facets.
struct Layer {
  std::int32_t x = 0, y = 0, width = 0, height = 0;
  std::vector<std::uint32_t> runs;
  std::vector<SeenFacet> facets;

  template <class Archive>
  void serialize(Archive& archive, unsigned) {
    archive& x& y& width& height& runs& facets;
  }
};

/// What a canvas has in memory: large parts that the next one can have.
struct CanvasMemory {
  std::vector<SeenFacet> facets;
  std::vector<std::uint32_t> samples;  ///< of the strip and its halos: a facet's number from 1
  std::vector<std::uint8_t> free;      ///< samples of each tile that show nothing yet
  std::vector<Point2> polygon;         ///< that is drawn, in samples
  std::vector<double> low, high;       ///< likewise, by row
  std::vector<std::uint8_t> on_edge;   ///< by sample
  std::vector<std::uint32_t> image;    ///< 0xaarrggbb, colours multiplied by the opacity
  std::vector<Seen> seen;              ///< of Occlusion
};

/// An image that polygons are filled into.
///
/// It has nine samples a pixel, each of which knows the facet that is seen there; light comes at the end.
/// Whether a sample is in a polygon is asked without antialiasing, and an edge that two share is one to both:
/// neighbouring polygons leave no seam, as they would if each were blended with what is behind it. What is
/// translucent covers some of a pixel's samples, always the same ones. So every sample has one facet: the
/// first one, since what is near is drawn first, and what is hidden need not be drawn. A picture may be drawn
/// in layers by several canvases, and is the same, sample for sample. The samples of a
/// whole image are many. So it is drawn in strips, one after the other from the top, each in layers.
class Canvas {
 public:
  using Layer = supersteps::Layer;
  explicit Canvas(const PictureOptions& options);

  [[nodiscard]] int strips() const { return (height_ + strip_height_ - 1) / strip_height_; }
  /// The first and the last strip that a polygon between two heights touches; in that order, but where it
  /// touches none.
  [[nodiscard]] std::array<std::uint8_t, 2> strips_between(double low, double high) const;
  /// What is drawn from now on, and put: of the others nothing is. The canvas is empty.
  void begin_strip(int strip);
  static constexpr bool is_front_first = true;  ///< what is drawn is behind what has been drawn
  void fill(std::span<const Point2> polygon, const Ink& ink);
  /// Whether nothing drawn in a box would be seen in this strip.
  [[nodiscard]] bool is_covered(const Point2& low, const Point2& high) const;
  /// What has been drawn; the canvas is empty again.
  [[nodiscard]] Layer take();
  /// Puts a layer of this strip over what has been drawn.
  void put(const Layer& layer);
  /// Puts the strip into the image, lit. The lighting is that of all strips.
  void end_strip(const Lighting& lighting);
  /// The image as the bytes of a PNG file. Call once, after all strips.
  [[nodiscard]] std::string file(const Lighting& lighting, const Overlay& overlay);

 private:
  static constexpr int samples = 3;  // along an edge of a pixel
  static constexpr int all_samples = samples * samples;
  static constexpr int tile = 12;  // samples
  /// The middle of a sample along x: each row of a pixel has other ones, so steep edges have nine steps.
  static constexpr std::array<double, samples> middle_in_row{0.5 - 1.0 / 3, 0.5, 0.5 + 1.0 / 3};

  int width_, height_;
  bool has_edges_, has_outlines_;  // of the solid, of cells
  bool is_transparent_;
  int halo_, strip_height_, strip_ = 0;  // pixels; the halo: rows above and below a strip that are drawn, too
  double line_width_;
  CanvasMemory own_, &memory_;  // what is used: that of who asks for pictures, if there is one
  std::array<int, 4> drawn_{};  // x and y, first and end, of what has been drawn
  std::optional<Occlusion> occlusion_;
  std::span<Seen> seen_row_;  // of it; empty: corners are as bright as all else

  [[nodiscard]] int columns() const { return samples * width_; }
  [[nodiscard]] int rows() const { return samples * (strip_height_ + 2 * halo_); }
  [[nodiscard]] std::uint32_t* row(int y) { return memory_.samples.data() + std::ptrdiff_t{y} * columns(); }
  [[nodiscard]] int tiles_across() const { return (columns() + tile - 1) / tile; }
  void forget();
  void fill_convex(std::span<const Point2> polygon, std::uint32_t facet, int covered);
  void fill_row(int y, int begin, int end, std::uint32_t facet, int covered);
  void draw_outline(std::span<const Point2> polygon, const Ink& ink);
  void find_edges(const Lighting& lighting);
  void mark_edge(int x, int y);
  void light_pixel(int x, int y, const Lighting& lighting);
  /// @param is_there it is what is seen in the pixel.
  Colour light(const SeenFacet& facet, std::size_t column, const Point2& middle, const Lighting& lighting,
               bool is_there);
  void finish_row(int y, std::span<const std::uint8_t> darkness);
  static double draw_line(Colour& sum, int covered, int on_edges);
  [[nodiscard]] std::size_t index_of_sample(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns()) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] Point2 place_of_sample(int x, int y) const;
};

/// A list of polygons that becomes an SVG or PDF file.
class Drawing {
 public:
  using Layer = Polygons;
  explicit Drawing(const PictureOptions& options);

  [[nodiscard]] static int strips() { return 1; }
  [[nodiscard]] static std::array<std::uint8_t, 2> strips_between(double, double) { return {0, 0}; }
  void begin_strip(int) {}
  static constexpr bool is_front_first = false;  ///< what is drawn is before what has been drawn
  [[nodiscard]] static bool is_covered(const Point2&, const Point2&) { return false; }
  void fill(std::span<const Point2> polygon, const Ink& ink);
  [[nodiscard]] Layer take();
  void put(const Layer& layer);
  void end_strip(const Lighting&) {}
  /// The drawing before its background as the bytes of a file. Call once, at the end.
  [[nodiscard]] std::string file(const Lighting& lighting, const Overlay& overlay);

 private:
  int width_, height_;
  PictureFormat format_;
  bool has_edges_, is_transparent_;  // edges: of the solid
  double line_width_;
  Layer all_;
};

}  // namespace bsp2::supersteps
