#pragma once

#include <vector>

#include "bsp2/drawing/sheets/drawing.hpp"

namespace bsp2::drawing {

/// What frame and title block leave of a sheet, and where; millimetres.
inline constexpr double binding_margin = 20, margin = 10, block_width = 180, block_height = 36;
/// Around views: room for dimensions and names.
inline constexpr double gap = 24;

/// A view on the sheet.
struct PlacedView {
  ViewKind kind = ViewKind::front;
  const Section* section = nullptr;  ///< of which it is the view, or null
  std::size_t cut = 0;               ///< its number
  Point2 lower{}, upper{};           ///< as the solid is seen, in the model's units
  Point2 origin{};                   ///< where `lower` is on the sheet
};

struct Layout {
  double scale = 1;
  std::vector<PlacedView> views;
};

/// Places the views, and finds the scale. @throws bsp2::Error if they do not fit.
Layout layout_of(const std::vector<Point3>& points, const DrawingOptions& options);

/// "1:2", "5:1".
std::string scale_text(double scale);

}  // namespace bsp2::drawing
