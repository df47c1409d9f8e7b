#include "drawing/svg_page.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bsp2::model::svg {
namespace {

/// Width or height of the page in millimetres. Percentages and what is missing take it from the view box.
double page_length(const xmlNode* svg, const char* name, double box, bool has_box, double dpi) {
  const std::optional<Length> length = read_length(attribute(svg, name));
  if (!length || length->number < 0) return has_box ? box * 25.4 / dpi : 0;
  const double unit = millimetres_in(length->unit, dpi);
  if (unit == 0) return has_box ? box : 0;
  return length->number * unit;
}

}  // namespace

Affine map_of(const std::string& text) {
  Affine map;
  for (std::size_t begin = 0, open = 0; (open = text.find('(', begin)) != std::string::npos;) {
    const std::size_t close = std::min(text.find(')', open), text.size());
    const auto v = numbers_of(text.substr(open + 1, close - open - 1));
    const auto at = [&](std::size_t i, double missing) { return i < v.size() ? v[i] : missing; };
    const std::string name = text.substr(begin, open - begin);
    const auto is = [&](const char* what) { return name.find(what) != std::string::npos; };
    Affine next;
    if (is("matrix") && v.size() == 6) next = {v[0], v[1], v[2], v[3], v[4], v[5]};
    if (is("translate")) next = {1, 0, 0, 1, at(0, 0), at(1, 0)};
    if (is("scale")) next = {at(0, 1), 0, 0, at(1, at(0, 1)), 0, 0};
    if (is("skewX")) next.c = std::tan(at(0, 0) * std::numbers::pi / 180);
    if (is("skewY")) next.b = std::tan(at(0, 0) * std::numbers::pi / 180);
    if (is("rotate")) {
      const double c = cosine(at(0, 0)), s = sine(at(0, 0)), x = at(1, 0), y = at(2, 0);
      next = {c, s, -s, c, x - c * x + s * y, y - s * x - c * y};
    }
    map = map.after(next);
    begin = std::min(close + 1, text.size());
  }
  return map;
}

std::vector<double> view_box(const xmlNode* node) {
  std::vector<double> v = numbers_of(attribute(node, "viewBox"));
  return v.size() == 4 && v[2] > 0 && v[3] > 0 ? v : std::vector<double>();
}

Fit::Fit(const xmlNode* node, const std::vector<double>& box, double width, double height)
    : sx(width / box[2]), sy(height / box[3]) {
  const std::string aspect = attribute(node, "preserveAspectRatio");
  if (aspect.find("none") != std::string::npos) return;
  sx = sy = aspect.find("slice") != std::string::npos ? std::max(sx, sy) : std::min(sx, sy);
  const auto aligned = [&](char axis, double room) {
    const auto at = aspect.find(axis);
    const std::string where = at == std::string::npos ? "" : aspect.substr(at + 1, 3);
    return where == "Min" ? 0 : where == "Max" ? room : room / 2;
  };
  align = {aligned('x', width - sx * box[2]), aligned('Y', height - sy * box[3])};
}

void Page::read(const xmlNode* svg, double dpi) {
  const std::vector<double> v = view_box(svg);
  const bool has_box = !v.empty();
  const double width = page_length(svg, "width", has_box ? v[2] : 0, has_box, dpi);
  height = page_length(svg, "height", has_box ? v[3] : 0, has_box, dpi);
  if (!has_box) return;
  box = {v[0], v[1]};
  const Fit fit(svg, v, width, height);
  sx = fit.sx, sy = fit.sy, align = fit.align;
}

void place(std::vector<PlaneDrawing>& drawings, const Page& page, bool center) {
  std::optional<Point> centre;
  if (center && !drawings.empty()) {
    Point low = drawings[0].points[0], high = low;
    for (const PlaneDrawing& drawing : drawings)
      for (const Point& p : drawing.points)
        for (int i = 0; i < 2; ++i) low[i] = std::min(low[i], p[i]), high[i] = std::max(high[i], p[i]);
    centre = Point{(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
  }
  const Affine map = page.map(centre);
  for (PlaneDrawing& drawing : drawings)
    for (Point& p : drawing.points) p = map(p);
}

}  // namespace bsp2::model::svg
