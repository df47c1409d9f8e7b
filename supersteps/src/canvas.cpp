#include "canvas.hpp"

#include <cstdint>
#include <cstring>
#include <new>
#include <stdexcept>

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

}  // namespace

Canvas::Canvas(int size, const Colour& background)
    : size_(size),
      surface_(cairo_image_surface_create(CAIRO_FORMAT_RGB24, samples * size, samples * size),
               cairo_surface_destroy),
      context_(cairo_create(surface_.get()), cairo_destroy) {
  check(cairo_surface_status(surface_.get()));
  check(cairo_status(context_.get()));
  cairo_set_antialias(context_.get(), CAIRO_ANTIALIAS_NONE);
  cairo_set_source_rgb(context_.get(), background[0], background[1], background[2]);
  cairo_paint(context_.get());
}

void Canvas::fill(std::span<const std::array<double, 2>> polygon, const Colour& colour) {
  cairo_t* cr = context_.get();
  for (const auto& [x, y] : polygon) cairo_line_to(cr, samples * x, samples * y);
  cairo_set_source_rgb(cr, colour[0], colour[1], colour[2]);
  cairo_fill(cr);
}

std::string Canvas::png() {
  check(cairo_status(context_.get()));
  cairo_surface_flush(surface_.get());
  unsigned char* data = cairo_image_surface_get_data(surface_.get());
  const int stride = cairo_image_surface_get_stride(surface_.get());
  // Averages in place: a result pixel lies before all samples that are still to be read.
  for (int y = 0; y < size_; ++y) {
    for (int x = 0; x < size_; ++x) {
      std::array<unsigned, 4> sum{};
      for (int i = 0; i < samples; ++i) {
        const unsigned char* row =
            data + std::ptrdiff_t{samples * y + i} * stride + std::ptrdiff_t{4} * samples * x;
        for (int byte = 0; byte < 4 * samples; ++byte) sum[byte % 4] += row[byte];
      }
      unsigned char* pixel = data + std::ptrdiff_t{y} * stride + std::ptrdiff_t{4} * x;
      for (int byte = 0; byte < 4; ++byte) {
        pixel[byte] = static_cast<unsigned char>((sum[byte] + samples * samples / 2) / (samples * samples));
      }
    }
  }
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> image(
      cairo_image_surface_create_for_data(data, CAIRO_FORMAT_RGB24, size_, size_, stride),
      cairo_surface_destroy);
  std::string bytes;
  check(cairo_surface_write_to_png_stream(image.get(), append, &bytes));
  return bytes;
}

}  // namespace bsp2::supersteps
