#pragma once

#include <libxml/tree.h>

#include <optional>
#include <string>
#include <vector>

#include "drawing/svg_shapes.hpp"
#include "import/imports.hpp"

/// Where the shapes of a drawing lie.
namespace bsp2::model::svg {

/// The affine map (x, y) -> (a x + c y + e, b x + d y + f), as SVG writes it.
struct Affine {
  double a = 1, b = 0, c = 0, d = 1, e = 0, f = 0;
  [[nodiscard]] Point operator()(const Point& p) const {
    return {a * p[0] + c * p[1] + e, b * p[0] + d * p[1] + f};
  }
  [[nodiscard]] Affine after(const Affine& m) const {
    return {a * m.a + c * m.b, b * m.a + d * m.b,     a * m.c + c * m.d,
            b * m.c + d * m.d, a * m.e + c * m.f + e, b * m.e + d * m.f + f};
  }
};

/// What the attribute `transform` says.
Affine map_of(const std::string& text);

/// The four numbers of a view box; none if it has no area.
std::vector<double> view_box(const xmlNode* node);

/// How a view box lies in what is `width` wide and `height` high.
struct Fit {
  double sx = 1, sy = 1;
  Point align{};

  Fit(const xmlNode* node, const std::vector<double>& box, double width, double height);
};

/// How the drawing lies on its page, y upwards. As in OpenSCAD the last `svg` element counts, without a view
/// box a unit is a millimetre, and the lower edge of the view box moves the drawing the wrong way.
struct Page {
  double sx = 1, sy = 1;
  Point box{}, align{};
  double height = 0;

  void read(const xmlNode* svg, double dpi);

  /// @param centre of what is drawn, if it is to lie at the origin.
  [[nodiscard]] Affine map(const std::optional<Point>& centre) const {
    if (centre) return {sx, 0, 0, -sy, -sx * (box[0] + (*centre)[0]), -sy * (box[1] - (*centre)[1])};
    return {sx, 0, 0, -sy, align[0] - sx * box[0], height - align[1] - sy * box[1]};
  }
};

/// Moves all drawings from their own units to the page.
void place(std::vector<PlaneDrawing>& drawings, const Page& page, bool center);

}  // namespace bsp2::model::svg
