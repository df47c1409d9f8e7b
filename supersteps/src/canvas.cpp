#include "canvas.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
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

Canvas::Canvas(int size)
    : size_(size),
      surface_(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, samples * size, samples * size),
               cairo_surface_destroy),
      context_(cairo_create(surface_.get()), cairo_destroy) {
  check(cairo_surface_status(surface_.get()));
  check(cairo_status(context_.get()));
  cairo_set_antialias(context_.get(), CAIRO_ANTIALIAS_NONE);
  forget();
}

void Canvas::forget() {
  low_.fill(std::numeric_limits<double>::infinity());
  high_.fill(-std::numeric_limits<double>::infinity());
}

std::uint32_t* Canvas::row(int y) {
  unsigned char* data = cairo_image_surface_get_data(surface_.get());
  return reinterpret_cast<std::uint32_t*>(data + std::ptrdiff_t{y} * cairo_image_surface_get_stride(surface_.get()));
}

void Canvas::fill(std::span<const std::array<double, 2>> polygon, const Colour& colour) {
  cairo_t* cr = context_.get();
  for (const auto& point : polygon) {
    cairo_line_to(cr, samples * point[0], samples * point[1]);
    for (const int axis : {0, 1}) {
      low_[axis] = std::min(low_[axis], samples * point[axis]);
      high_[axis] = std::max(high_[axis], samples * point[axis]);
    }
  }
  cairo_set_source_rgb(cr, colour[0], colour[1], colour[2]);
  cairo_fill(cr);
}

Layer Canvas::take() {
  check(cairo_status(context_.get()));
  cairo_surface_flush(surface_.get());
  Layer layer;
  if (!(low_[0] <= high_[0])) return layer;
  const double end = samples * size_;
  const auto begin_of = [&](int axis) { return static_cast<std::int32_t>(std::clamp(std::floor(low_[axis]) - 1, 0.0, end)); };
  const auto end_of = [&](int axis) { return static_cast<std::int32_t>(std::clamp(std::ceil(high_[axis]) + 1, 0.0, end)); };
  layer.x = begin_of(0);
  layer.y = begin_of(1);
  layer.width = end_of(0) - layer.x;
  layer.height = end_of(1) - layer.y;
  for (int y = layer.y; y < layer.y + layer.height; ++y) {
    std::uint32_t* samples_of_row = row(y) + layer.x;
    for (int x = 0; x < layer.width; ++x) {
      if (layer.runs.empty() || layer.runs.back() != samples_of_row[x])
        layer.runs.insert(layer.runs.end(), {1, samples_of_row[x]});
      else
        ++layer.runs[layer.runs.size() - 2];
    }
    std::fill_n(samples_of_row, layer.width, 0);
  }
  cairo_surface_mark_dirty(surface_.get());
  forget();
  return layer;
}

void Canvas::put(const Layer& layer) {
  if (layer.x < 0 || layer.y < 0 || layer.x + layer.width > samples * size_ || layer.y + layer.height > samples * size_)
    throw std::out_of_range("a layer that is larger than its canvas");
  cairo_surface_flush(surface_.get());
  std::size_t at = 0;  // in the layer, row by row
  const std::size_t all = static_cast<std::size_t>(layer.width) * static_cast<std::size_t>(layer.height);
  for (std::size_t run = 0; run + 1 < layer.runs.size(); run += 2) {
    const std::size_t last = std::min(all, at + layer.runs[run]);
    const std::uint32_t colour = layer.runs[run + 1];
    for (; at < last && colour != 0; ++at) {
      const auto width = static_cast<std::size_t>(layer.width);
      row(layer.y + static_cast<int>(at / width))[layer.x + static_cast<int>(at % width)] = colour;
    }
    at = last;
  }
  cairo_surface_mark_dirty(surface_.get());
  low_ = {0, 0};
  high_.fill(samples * size_);
}

std::string Canvas::png(const Colour& background) {
  cairo_set_operator(context_.get(), CAIRO_OPERATOR_DEST_OVER);
  cairo_set_source_rgb(context_.get(), background[0], background[1], background[2]);
  cairo_paint(context_.get());
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
