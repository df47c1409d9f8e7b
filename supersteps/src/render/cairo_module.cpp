#include "render/cairo_module.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string_view>

#include "bsp2/geometry/support/module.hpp"

namespace bsp2::supersteps {
namespace {

void check(cairo_status_t status) {
  if (status == CAIRO_STATUS_NO_MEMORY) throw std::bad_alloc();
  if (status != CAIRO_STATUS_SUCCESS)
    throw std::runtime_error(std::string("cairo: ") + cairo_status_to_string(status));
}

cairo_status_t append(void* closure, const unsigned char* data, unsigned int length) {
  static_cast<std::string*>(closure)->append(reinterpret_cast<const char*>(data), length);
  return CAIRO_STATUS_SUCCESS;
}

constexpr double line_width = 0.6;  // pixels

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

Surface vector_surface(PictureFormat format, std::string& bytes, int width, int height) {
  const auto create = format == PictureFormat::svg ? cairo_svg_surface_create_for_stream
                                                   : cairo_pdf_surface_create_for_stream;
  Surface surface(create(append, &bytes, width, height), cairo_surface_destroy);
  check(cairo_surface_status(surface.get()));
  if (format == PictureFormat::svg)
    cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  else  // none, so that the same picture is the same file
    cairo_pdf_surface_set_metadata(surface.get(), CAIRO_PDF_METADATA_CREATE_DATE, nullptr);
  return surface;
}

void set_colour(cairo_t* cr, const Colour& colour, double opacity = 1) {
  cairo_set_source_rgba(cr, colour[0], colour[1], colour[2], opacity);
}

void draw(cairo_t* cr, const Overlay& overlay) {
  for (const Overlay::Box& box : overlay.boxes) {
    cairo_rectangle(cr, box.low[0], box.low[1], box.high[0] - box.low[0], box.high[1] - box.low[1]);
    set_colour(cr, box.colour, box.opacity);
    cairo_fill(cr);
  }
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_ROUND);
  for (const Overlay::Line& line : overlay.lines) {
    cairo_move_to(cr, line.from[0], line.from[1]);
    cairo_line_to(cr, line.to[0], line.to[1]);
    cairo_set_line_width(cr, line.width);
    set_colour(cr, line.colour);
    cairo_stroke(cr);
  }
  cairo_select_font_face(cr, "sans-serif", CAIRO_FONT_SLANT_NORMAL, CAIRO_FONT_WEIGHT_NORMAL);
  for (const Overlay::Text& text : overlay.texts) {
    cairo_set_font_size(cr, text.size);
    cairo_text_extents_t extents;
    cairo_text_extents(cr, text.words.c_str(), &extents);
    cairo_move_to(cr, text.at[0] - text.align * extents.x_advance, text.at[1]);
    set_colour(cr, text.colour);
    cairo_show_text(cr, text.words.c_str());
  }
  check(cairo_status(cr));
}

void draw_overlay(std::uint32_t* pixels, int width, int height, const Overlay& overlay) {
  const Surface surface(
      cairo_image_surface_create_for_data(reinterpret_cast<unsigned char*>(pixels), CAIRO_FORMAT_ARGB32,
                                          width, height, width * static_cast<int>(sizeof *pixels)),
      cairo_surface_destroy);
  check(cairo_surface_status(surface.get()));
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                   cairo_destroy);
  draw(context.get(), overlay);
  cairo_surface_flush(surface.get());
}

void draw_lines(cairo_t* cr, const Polygons& all) {
  constexpr double hides = 0.75;  // of what is below, as in pictures of pixels
  if (all.line_ends.empty()) return;
  std::uint32_t point = 0;
  for (const std::uint32_t end : all.line_ends) {
    cairo_new_sub_path(cr);
    for (; point < end; ++point)
      cairo_line_to(cr, all.line_points[2 * point], all.line_points[2 * point + 1]);
  }
  cairo_set_line_cap(cr, CAIRO_LINE_CAP_ROUND);
  cairo_set_line_width(cr, all.line_width);
  set_colour(cr, line_colour, hides);
  cairo_stroke(cr);
}

std::string draw_vectors(PictureFormat format, int width, int height, const Colour* background,
                         const Polygons& all, const Overlay& overlay) {
  std::string bytes;
  {
    const Surface surface = vector_surface(format, bytes, width, height);
    const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                     cairo_destroy);
    cairo_t* cr = context.get();
    cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(cr, line_width);
    if (background != nullptr) {
      set_colour(cr, *background);
      cairo_paint(cr);
    }
    std::uint32_t point = 0;
    for (std::size_t polygon = 0; polygon < all.ends.size(); ++polygon) {
      for (; point < all.ends[polygon]; ++point)
        cairo_line_to(cr, all.points[2 * point], all.points[2 * point + 1]);
      cairo_close_path(cr);
      const float* ink = all.inks.data() + 5 * polygon;
      cairo_set_source_rgba(cr, ink[0], ink[1], ink[2], ink[3]);
      const bool edges = ink[4] > 0;
      if (ink[3] < 1 && !edges) {
        cairo_fill(cr);
        continue;
      }
      // Viewers blend the edges of polygons with what is behind: a line of the same colour closes the seams.
      cairo_fill_preserve(cr);
      if (edges) cairo_set_source_rgba(cr, line_colour[0], line_colour[1], line_colour[2], ink[3]);
      cairo_stroke(cr);
    }
    draw_lines(cr, all);
    draw(cr, overlay);
    cairo_surface_finish(surface.get());
    check(cairo_surface_status(surface.get()));
  }
  // Cairo numbers the surfaces of a process; a picture is the same whatever was drawn before it.
  const std::string_view id = "id=\"surface";
  if (const auto at = bytes.find(id); format == PictureFormat::svg && at != std::string::npos) {
    const auto digits = at + id.size();
    bytes.erase(digits, bytes.find('"', digits) - digits);
  }
  return bytes;
}

}  // namespace
}  // namespace bsp2::supersteps

BSP2_DEFINE_MODULE(bsp2::supersteps::CairoModule, bsp2::supersteps::draw_vectors,
                   bsp2::supersteps::draw_overlay)
