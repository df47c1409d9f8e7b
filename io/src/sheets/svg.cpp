#include <algorithm>
#include <cmath>
#include <cstdio>
#include <set>
#include <string>

#include "files/xml.hpp"
#include "sheets/writers.hpp"
#include "surfaces/text.hpp"

namespace bsp2::io {
namespace {

/// Writes coordinates as the sheet wants them: y down.
class SvgWriter {
 public:
  explicit SvgWriter(const Sheet& sheet) : sheet_(sheet) {}

  std::string file() {
    const double width = sheet_.upper[0] - sheet_.lower[0], height = sheet_.upper[1] - sheet_.lower[1];
    text_ << "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"";
    number(width) << "mm\" height=\"";
    number(height) << "mm\" viewBox=\"";
    number(sheet_.lower[0]) << ' ';
    number(-sheet_.upper[1]) << ' ';
    number(width) << ' ';
    number(height) << "\">\n";
    if (!sheet_.title.empty()) text_ << "<title>" << quoted(sheet_.title) << "</title>\n";
    for (std::uint32_t layer = 0; layer < sheet_.layers.size(); ++layer) write_areas(layer);
    for (std::uint32_t layer = 0; layer < sheet_.layers.size(); ++layer) write_lines(layer);
    text_ << "</svg>\n";
    return text_.take();
  }

 private:
  const Sheet& sheet_;
  Text text_;
  std::set<std::string> ids_;  // that are given

  /// A layer's name, and a number where there is one of that name.
  std::string new_id(std::uint32_t layer) {
    const std::string name = quoted(sheet_.layers[layer].name);
    std::string id = name;
    for (int number = 2; !ids_.insert(id).second; ++number) id = name + "_" + std::to_string(number);
    return id;
  }

  /// Lines and words of a layer are a group, which has its name.
  [[nodiscard]] bool has_group(std::uint32_t layer) const {
    const auto is_in = [layer](const auto& thing) { return thing.layer == layer; };
    return std::ranges::any_of(sheet_.paths, is_in) || std::ranges::any_of(sheet_.labels, is_in);
  }

  Text& number(double x) {
    if (!sheet_.decimals) return text_ << x + 0.0;
    const double unit = std::pow(10, *sheet_.decimals);
    const auto rounded = static_cast<std::int64_t>(std::llround(x * unit));
    return text_ << static_cast<double>(rounded) / unit + 0.0;
  }

  void points(const std::vector<Sheet::Point>& all, bool is_closed) {
    text_ << 'M';
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (i > 0) text_ << (i == 1 ? 'L' : ' ');
      place(all[i]);
    }
    if (is_closed) text_ << 'z';
  }

  Text& place(const Sheet::Point& p) {
    number(p[0]) << ' ';
    return number(-p[1]);
  }

  /// A closed path with its arcs. y is down here: what turns to the left goes against the angles.
  void loop(const geometry::OutlinePath& path) {
    if (path.bulges.empty()) return points(path.corners, true);
    text_ << 'M';
    place(path.corners[0]);
    for (std::size_t i = 0; i < path.corners.size(); ++i) {
      const Sheet::Point &from = path.corners[i], &to = path.corners[(i + 1) % path.corners.size()];
      const double bulge = path.bulges[i];
      if (bulge == 0) {
        if (i + 1 == path.corners.size()) break;
        text_ << (i == 0 || path.bulges[i - 1] != 0 ? 'L' : ' ');
      } else {
        const double radius = geometry::OutlineArc(from, to, bulge).radius;
        text_ << 'A';
        number(radius) << ' ';
        number(radius) << " 0 0 " << (bulge > 0 ? 0 : 1) << ' ';
      }
      place(to);
    }
    text_ << 'z';
  }

  void colour(const Sheet::Rgb& rgb) {
    constexpr std::string_view digits = "0123456789abcdef";
    text_ << '#';
    for (const unsigned channel : rgb) text_ << digits[channel / 16] << digits[channel % 16];
  }

  void write_areas(std::uint32_t layer) {
    const bool is_named = !has_group(layer);
    for (const Sheet::Area& area : sheet_.areas) {
      if (area.layer != layer) continue;
      text_ << "<path ";
      if (is_named) text_ << "id=\"" << new_id(layer) << "\" ";
      text_ << "fill=\"";
      colour(area.fill);
      if (area.opacity < 1) text_ << "\" fill-opacity=\"" << area.opacity;
      text_ << "\" fill-rule=\"evenodd\" stroke=\"none\" d=\"";
      for (const auto& path : area.loops) {
        loop(path);
        text_ << '\n';
      }
      text_ << "\"/>\n";
    }
  }

  void write_lines(std::uint32_t number_of_layer) {
    const Sheet::Layer& layer = sheet_.layers[number_of_layer];
    bool is_open = false;
    const auto open = [&] {
      if (std::exchange(is_open, true)) return;
      text_ << "<g id=\"" << new_id(number_of_layer) << "\" fill=\"none\" stroke=\"";
      colour(layer.colour);
      text_ << "\" stroke-width=\"" << std::max(layer.width, 0.05)
            << "\" stroke-linecap=\"round\" stroke-linejoin=\"round\"";
      if (!layer.dashes.empty()) {
        text_ << " stroke-dasharray=\"";
        text_.list(layer.dashes, " ") << '"';
      }
      text_ << ">\n";
    };
    bool is_begun = false;  // one element for all paths
    for (const Sheet::Path& path : sheet_.paths) {
      if (path.layer != number_of_layer) continue;
      open();
      text_ << (std::exchange(is_begun, true) ? "\n" : "<path d=\"");
      points(path.points, path.is_closed);
    }
    if (is_begun) text_ << "\"/>\n";
    for (const Sheet::Label& label : sheet_.labels) {
      if (label.layer != number_of_layer) continue;
      open();
      write_label(label, layer);
    }
    if (is_open) text_ << "</g>\n";
  }

  void write_label(const Sheet::Label& label, const Sheet::Layer& layer) {
    constexpr double size_of_capitals = 0.72;  // as a share of a sans-serif font's size
    text_ << "<text transform=\"translate(";
    number(label.at[0]) << ' ';
    number(-label.at[1]) << ')';
    if (label.turn != 0) {
      text_ << " rotate(";
      number(-label.turn) << ')';
    }
    text_ << "\" font-family=\"Helvetica,Arial,sans-serif\" stroke=\"none\" font-size=\"";
    number(label.height / size_of_capitals) << "\" fill=\"";
    colour(layer.colour);
    if (label.anchor != Sheet::Anchor::start)
      text_ << "\" text-anchor=\"" << (label.anchor == Sheet::Anchor::middle ? "middle" : "end");
    text_ << "\">" << quoted(label.text) << "</text>\n";
  }
};

}  // namespace

std::string to_svg(const Sheet& sheet) { return SvgWriter(sheet).file(); }

}  // namespace bsp2::io
