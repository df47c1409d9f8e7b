#pragma once

#include <string>

#include "bsp2/drawing/sheets/drawing.hpp"
#include "sheets/layout.hpp"

namespace bsp2::drawing {

/// Numbers of the layers of a drawing.
enum LayerNumber : std::uint32_t {
  visible_layer,
  smooth_layer,
  hidden_layer,
  section_layer,
  center_layer,
  dimension_layer,
  frame_layer,
  layer_count
};
std::vector<io::Sheet::Layer> drawing_layers();

/// Puts on a sheet what is no line of the solid.
class Annotator {
 public:
  explicit Annotator(io::Sheet& sheet) : sheet_(sheet) {}

  void line(LayerNumber layer, const Point2& from, const Point2& to);
  /// @param width that the text may have; it becomes smaller where it is longer. 0: any.
  void text(LayerNumber layer, const Point2& at, double height, const std::string& words,
            io::Sheet::Anchor anchor = io::Sheet::Anchor::start, double width = 0, double turn = 0);
  /// Its point is at `tip`.
  void arrow(LayerNumber layer, const Point2& tip, const Point2& direction);
  /// A dimension between two points, its line beside them. @param offset to the left of the way from one to
  /// the other.
  void distance(const Point2& from, const Point2& to, double offset, double value);
  void frame_and_title(const DrawingOptions& options, double scale);
  /// Where a section cuts a view: its line has ends with arrows and the section's name.
  void cutting_line(const Point2& from, const Point2& to, const Point2& looking, const std::string& name);

 private:
  io::Sheet& sheet_;

  void rectangle(const Point2& lower, const Point2& upper);
  void field(const Point2& lower, double width, double height, const std::string& caption,
             const std::string& value, double letters = 3);
  void projection_symbol(const Point2& at, Projection projection);
};

/// As many digits as a draughtsman writes: thousandths, or three of what is smaller.
std::string dimension_text(double value);

/// About how wide a text is.
double width_of(const std::string& words, double height);

}  // namespace bsp2::drawing
