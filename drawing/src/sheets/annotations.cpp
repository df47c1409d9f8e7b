#include "sheets/annotations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace bsp2::drawing {

using io::Sheet;

std::vector<Sheet::Layer> drawing_layers() {
  // ISO 128: two widths of lines, one to two.
  std::vector<Sheet::Layer> layers(layer_count);
  layers[visible_layer] = {"VISIBLE", {0, 0, 0}, 0.5, {}};
  layers[smooth_layer] = {"SMOOTH", {90, 90, 90}, 0.18, {}};
  layers[hidden_layer] = {"HIDDEN", {70, 70, 70}, 0.25, {3, 1.5}};
  layers[section_layer] = {"SECTION", {0, 60, 140}, 0.18, {}};
  layers[center_layer] = {"CENTER", {160, 40, 0}, 0.18, {8, 1.2, 0.6, 1.2}};
  layers[dimension_layer] = {"DIMENSION", {0, 90, 40}, 0.25, {}};
  layers[frame_layer] = {"FRAME", {0, 0, 0}, 0.35, {}};
  return layers;
}

std::string dimension_text(double value) {
  std::array<char, 40> digits;
  const double size = std::fabs(value);
  const char* const form = size >= 1e9 ? "%.9g" : size >= 1 ? "%.3f" : "%.3g";
  std::snprintf(digits.data(), digits.size(), form, value);
  std::string text = digits.data();
  if (text.find('.') != std::string::npos && text.find('e') == std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

double width_of(const std::string& words, double height) {
  const auto is_first = [](char c) { return (static_cast<unsigned char>(c) & 0xc0U) != 0x80; };
  return 0.8 * height * static_cast<double>(std::count_if(words.begin(), words.end(), is_first));
}

void Annotator::line(LayerNumber layer, const Point2& from, const Point2& to) {
  sheet_.paths.push_back({layer, false, {from, to}});
}

void Annotator::text(LayerNumber layer, const Point2& at, double height, const std::string& words,
                     Sheet::Anchor anchor, double width, double turn) {
  if (words.empty()) return;
  if (const double needed = width_of(words, height); width > 0 && needed > width) height *= width / needed;
  sheet_.labels.push_back({layer, at, height, words, anchor, turn});
}

void Annotator::arrow(LayerNumber layer, const Point2& tip, const Point2& direction) {
  constexpr double length = 3, half_width = 0.5;
  const double size = std::hypot(direction[0], direction[1]);
  const Point2 along{direction[0] / size, direction[1] / size};
  const Point2 base{tip[0] - length * along[0], tip[1] - length * along[1]};
  geometry::OutlinePath triangle{{tip,
                                  {base[0] - half_width * along[1], base[1] + half_width * along[0]},
                                  {base[0] + half_width * along[1], base[1] - half_width * along[0]}},
                                 {}};
  sheet_.areas.push_back({layer, sheet_.layers[layer].colour, 1, {std::move(triangle)}});
}

void Annotator::distance(const Point2& from, const Point2& to, double offset, double value) {
  constexpr double clear = 1, beyond = 2, letters = 2.5, smallest = 9;
  const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
  if (!(length > 0)) return;
  const Point2 along{(to[0] - from[0]) / length, (to[1] - from[1]) / length}, aside{-along[1], along[0]};
  const auto shifted = [&](const Point2& p, double s, double t) {
    return Point2{p[0] + s * along[0] + t * aside[0], p[1] + s * along[1] + t * aside[1]};
  };
  const double way = offset < 0 ? -1 : 1;
  for (const Point2& end : {from, to})
    line(dimension_layer, shifted(end, 0, way * clear), shifted(end, 0, offset + way * beyond));
  const Point2 first = shifted(from, 0, offset), last = shifted(to, 0, offset);
  const bool outside = length < smallest;  // no room for arrows between
  line(dimension_layer, outside ? shifted(first, -6, 0) : first, outside ? shifted(last, 6, 0) : last);
  arrow(dimension_layer, first, outside ? along : Point2{-along[0], -along[1]});
  arrow(dimension_layer, last, outside ? Point2{-along[0], -along[1]} : along);
  // Read from below or from the right.
  double turn = std::atan2(along[1], along[0]) * 180 / std::numbers::pi;
  const bool is_over = turn > 90 + 1e-6 || turn <= -90 + 1e-6;
  if (is_over) turn += turn > 0 ? -180 : 180;
  const Point2 middle = shifted(first, length / 2, is_over ? -clear : clear);
  text(dimension_layer, middle, letters, dimension_text(value), Sheet::Anchor::middle, 0, turn);
}

void Annotator::rectangle(const Point2& lower, const Point2& upper) {
  sheet_.paths.push_back({frame_layer, true, {lower, {upper[0], lower[1]}, upper, {lower[0], upper[1]}}});
}

void Annotator::field(const Point2& lower, double width, double height, const std::string& caption,
                      const std::string& value, double letters) {
  constexpr double inset = 1.5, caption_letters = 1.6;
  rectangle(lower, {lower[0] + width, lower[1] + height});
  text(frame_layer, {lower[0] + inset, lower[1] + height - inset - caption_letters}, caption_letters,
       caption);
  text(frame_layer, {lower[0] + inset, lower[1] + inset + 0.3}, letters, value, Sheet::Anchor::start,
       width - 2 * inset);
}

/// The cone of ISO 5456-2, from its side and from its end.
void Annotator::projection_symbol(const Point2& at, Projection projection) {
  constexpr double large = 2.6, small = 1.3, length = 5.2, apart = 5.6;
  const bool is_first = projection == Projection::first;
  const double cone = is_first ? at[0] : at[0] + apart, end = is_first ? at[0] + 2 * apart : at[0];
  // First angle: what is seen from the left, the small end, is on the right.
  sheet_.paths.push_back({frame_layer,
                          true,
                          {{cone, at[1] - small},
                           {cone, at[1] + small},
                           {cone + length, at[1] + large},
                           {cone + length, at[1] - large}}});
  for (const double radius : {large, small}) {
    Sheet::Path circle{frame_layer, true, {}};
    for (int i = 0; i < 48; ++i) {
      const double angle = i * std::numbers::pi / 24;
      circle.points.push_back({end + radius * std::cos(angle), at[1] + radius * std::sin(angle)});
    }
    sheet_.paths.push_back(std::move(circle));
  }
}

void Annotator::frame_and_title(const DrawingOptions& options, double scale) {
  const Point2 lower{binding_margin, margin},
      upper{options.size.width - margin, options.size.height - margin};
  rectangle(lower, upper);
  constexpr double row = block_height / 4;
  const double left = upper[0] - block_width, bottom = lower[1];
  field({left, bottom + 2 * row}, 120, 2 * row, "Title", options.title, 5);
  field({left + 120, bottom + 3 * row}, 60, row, "Number", options.number);
  field({left + 120, bottom + 2 * row}, 30, row, "Scale", scale_text(scale));
  field({left + 150, bottom + 2 * row}, 30, row, "Sheet", std::string(options.size.name));
  field({left, bottom + row}, 60, row, "Author", options.author);
  field({left + 60, bottom + row}, 60, row, "Date", options.date);
  field({left + 120, bottom + row}, 60, row, "Material", options.material);
  field({left, bottom}, 60, row, "Units", "mm");
  field({left + 60, bottom}, 60, row, "Drawn by", "bsp2");
  const bool is_first = options.projection == Projection::first;
  field({left + 120, bottom}, 60, row, "Projection", is_first ? "First angle" : "Third angle");
  projection_symbol({left + 120 + 39 + (is_first ? 0 : 3), bottom + row / 2}, options.projection);
}

void Annotator::cutting_line(const Point2& from, const Point2& to, const Point2& looking,
                             const std::string& name) {
  constexpr double end = 6, letters = 4;
  const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
  const Point2 along{(to[0] - from[0]) / length, (to[1] - from[1]) / length};
  line(center_layer, from, to);
  for (const double way : {-1.0, 1.0}) {
    const Point2& tip = way < 0 ? from : to;
    const Point2 outer{tip[0] + way * end * along[0], tip[1] + way * end * along[1]};
    line(visible_layer, tip, outer);
    const Point2 shaft{outer[0] - 7 * looking[0], outer[1] - 7 * looking[1]};
    line(dimension_layer, shaft, outer);
    arrow(dimension_layer, outer, looking);
    text(dimension_layer,
         {shaft[0] - 3 * looking[0] + way * 1 * along[0],
          shaft[1] - 3 * looking[1] + way * 1 * along[1] - letters / 2},
         letters, name, Sheet::Anchor::middle);
  }
}

}  // namespace bsp2::drawing
