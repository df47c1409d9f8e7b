#include <cairo-pdf.h>
#include <cairo.h>

#include <cmath>
#include <memory>
#include <new>
#include <numbers>
#include <stdexcept>
#include <string>

#include "outputs/modules.hpp"

namespace bsp2::io {
namespace {

constexpr double points_of_a_millimetre = 72 / 25.4;
constexpr double size_of_capitals = 0.72;  // as a share of a sans-serif font's size

void check(cairo_status_t status) {
  if (status == CAIRO_STATUS_NO_MEMORY) throw std::bad_alloc();
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(std::string("cairo: ") + cairo_status_to_string(status));
}

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

class PdfWriter {
 public:
  PdfWriter(cairo_t* context, const Sheet& sheet) : cr_(context), sheet_(sheet) {}

  void draw() {
    for (const Sheet::Area& area : sheet_.areas) fill(area);
    for (std::uint32_t layer = 0; layer < sheet_.layers.size(); ++layer) {
      begin(sheet_.layers[layer]);
      for (const Sheet::Path& path : sheet_.paths)
        if (path.layer == layer) {
          trace(path.points, path.is_closed);
          cairo_stroke(cr_);
        }
      for (const Sheet::Label& label : sheet_.labels)
        if (label.layer == layer) write(label);
    }
  }

 private:
  cairo_t* cr_;
  const Sheet& sheet_;

  /// From the lower left corner up, in millimetres, to the upper left one down, in points.
  [[nodiscard]] Sheet::Point on_page(const Sheet::Point& p) const {
    return {(p[0] - sheet_.lower[0]) * points_of_a_millimetre,
            (sheet_.upper[1] - p[1]) * points_of_a_millimetre};
  }

  void set_colour(const Sheet::Rgb& colour, double opacity = 1) {
    cairo_set_source_rgba(cr_, colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0, opacity);
  }

  void trace(const std::vector<Sheet::Point>& points, bool is_closed) {
    for (const auto& p : points) {
      const auto at = on_page(p);
      cairo_line_to(cr_, at[0], at[1]);
    }
    if (is_closed) cairo_close_path(cr_);
    cairo_new_sub_path(cr_);
  }

  /// A closed path with its arcs. y is down on the page: what turns to the left goes against the angles.
  void trace(const geometry::OutlinePath& loop) {
    if (loop.bulges.empty()) return trace(loop.corners, true);
    for (std::size_t i = 0; i < loop.corners.size(); ++i) {
      const Sheet::Point &from = loop.corners[i], &to = loop.corners[(i + 1) % loop.corners.size()];
      const auto begin = on_page(from), end = on_page(to);
      if (i == 0) cairo_move_to(cr_, begin[0], begin[1]);
      if (loop.bulges[i] != 0) {
        const geometry::OutlineArc arc(from, to, loop.bulges[i]);
        const auto centre = on_page(arc.centre);
        const auto angle = [&](const Sheet::Point& p) {
          return std::atan2(p[1] - centre[1], p[0] - centre[0]);
        };
        (loop.bulges[i] > 0 ? cairo_arc_negative : cairo_arc)(
            cr_, centre[0], centre[1], arc.radius * points_of_a_millimetre, angle(begin), angle(end));
      }
      cairo_line_to(cr_, end[0], end[1]);
    }
    cairo_close_path(cr_);
    cairo_new_sub_path(cr_);
  }

  void fill(const Sheet::Area& area) {
    set_colour(area.fill, area.opacity);
    cairo_set_fill_rule(cr_, CAIRO_FILL_RULE_EVEN_ODD);
    for (const auto& loop : area.loops) trace(loop);
    cairo_fill(cr_);
  }

  void begin(const Sheet::Layer& layer) {
    set_colour(layer.colour);
    cairo_set_line_cap(cr_, CAIRO_LINE_CAP_ROUND);
    cairo_set_line_join(cr_, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(cr_, std::max(layer.width, 0.05) * points_of_a_millimetre);
    std::vector<double> dashes = layer.dashes;
    for (double& dash : dashes) dash *= points_of_a_millimetre;
    cairo_set_dash(cr_, dashes.data(), static_cast<int>(dashes.size()), 0);
  }

  void write(const Sheet::Label& label) {
    cairo_select_font_face(cr_, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
    cairo_set_font_size(cr_, label.height / size_of_capitals * points_of_a_millimetre);
    cairo_text_extents_t extents;
    cairo_text_extents(cr_, label.text.c_str(), &extents);
    const double share = label.anchor == Sheet::Anchor::start    ? 0
                         : label.anchor == Sheet::Anchor::middle ? 0.5
                                                                 : 1;
    const auto at = on_page(label.at);
    cairo_save(cr_);
    cairo_translate(cr_, at[0], at[1]);
    cairo_rotate(cr_, -label.turn * std::numbers::pi / 180);
    cairo_move_to(cr_, -share * extents.x_advance, 0);
    cairo_show_text(cr_, label.text.c_str());
    cairo_restore(cr_);
    cairo_new_path(cr_);
  }
};

std::string to_pdf(const Sheet& sheet) {
  std::string bytes;
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> surface(
      cairo_pdf_surface_create_for_stream(append, &bytes,
                                          (sheet.upper[0] - sheet.lower[0]) * points_of_a_millimetre,
                                          (sheet.upper[1] - sheet.lower[1]) * points_of_a_millimetre),
      cairo_surface_destroy);
  check(cairo_surface_status(surface.get()));
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_TITLE, sheet.title.c_str());
  // That of the title block is enough, and the same sheet is the same file.
  cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, nullptr);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                   cairo_destroy);
  PdfWriter(context.get(), sheet).draw();
  check(cairo_status(context.get()));
  cairo_surface_finish(surface.get());
  check(cairo_surface_status(surface.get()));
  return bytes;
}

}  // namespace
}  // namespace bsp2::io

BSP2_DEFINE_MODULE(bsp2::io::PdfModule, bsp2::io::to_pdf)
