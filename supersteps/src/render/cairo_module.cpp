#include "render/cairo_module.hpp"

#include <cairo-pdf.h>
#include <cairo-svg.h>
#include <cairo.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
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
constexpr Colour line_colour{0.12, 0.13, 0.16};
constexpr int bytes_of_a_strip = 2 << 20, most_strips = 255;

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

Surface vector_surface(PictureFormat format, std::string& bytes, int width, int height) {
  const auto create = format == PictureFormat::svg ? cairo_svg_surface_create_for_stream
                                                   : cairo_pdf_surface_create_for_stream;
  Surface surface(create(append, &bytes, width, height), cairo_surface_destroy);
  check(cairo_surface_status(surface.get()));
  if (format == PictureFormat::svg) cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
  return surface;
}

class CairoCanvas final : public Canvas {
 public:
  CairoCanvas(int width, int height);
  [[nodiscard]] int strips() const override { return (height_ + strip_height_ - 1) / strip_height_; }
  [[nodiscard]] std::array<std::uint8_t, 2> strips_between(double low, double high) const override;
  void begin_strip(int strip) override;
  void fill(std::span<const std::array<double, 2>> polygon, const Ink& ink) override;
  [[nodiscard]] Layer take() override;
  void put(const Layer& layer) override;
  void end_strip(const Colour& background) override;
  [[nodiscard]] std::string file() override;

 private:
  static constexpr int samples = 3;  // an edge of a pixel

  int width_, height_, strip_height_, strip_ = 0;
  Surface surface_, tile_, image_{nullptr, cairo_surface_destroy};
  std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context_;
  std::array<double, 2> low_, high_;  // of what has been drawn, in samples of the strip

  void forget();
  void set_source(const Ink& ink);
  std::uint32_t* row(int y);
};

CairoCanvas::CairoCanvas(int width, int height)
    : width_(width),
      height_(height),
      strip_height_(std::clamp(bytes_of_a_strip / (samples * samples * 4 * width),
                               (height + most_strips - 1) / most_strips, height)),
      surface_(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, samples * width, samples * strip_height_),
               cairo_surface_destroy),
      tile_(cairo_image_surface_create(CAIRO_FORMAT_ARGB32, samples, samples), cairo_surface_destroy),
      context_(cairo_create(surface_.get()), cairo_destroy) {
  check(cairo_surface_status(surface_.get()));
  check(cairo_surface_status(tile_.get()));
  check(cairo_status(context_.get()));
  cairo_set_antialias(context_.get(), CAIRO_ANTIALIAS_NONE);
  cairo_set_line_width(context_.get(), samples * line_width);
  cairo_set_line_join(context_.get(), CAIRO_LINE_JOIN_ROUND);
  forget();
}

std::array<std::uint8_t, 2> CairoCanvas::strips_between(double low, double high) const {
  if (high < -1 || low > height_ + 1) return {1, 0};
  const auto strip = [&](double y) {
    return static_cast<std::uint8_t>(
        std::clamp(static_cast<int>(std::floor(y)) / strip_height_, 0, strips() - 1));
  };
  return {strip(std::max(0.0, low - 1)), strip(std::min<double>(height_, high + 1))};
}

void CairoCanvas::begin_strip(int strip) {
  strip_ = strip;
  cairo_surface_flush(surface_.get());
  for (int y = 0; y < samples * strip_height_; ++y) std::fill_n(row(y), samples * width_, 0);
  cairo_surface_mark_dirty(surface_.get());
  cairo_set_operator(context_.get(), CAIRO_OPERATOR_OVER);
  forget();
}

void CairoCanvas::forget() {
  low_.fill(std::numeric_limits<double>::infinity());
  high_.fill(-std::numeric_limits<double>::infinity());
}

std::uint32_t* CairoCanvas::row(int y) {
  unsigned char* data = cairo_image_surface_get_data(surface_.get());
  return reinterpret_cast<std::uint32_t*>(data +
                                          std::ptrdiff_t{y} * cairo_image_surface_get_stride(surface_.get()));
}

/// What is translucent: a tile of one pixel, some of its samples the colour and the others nothing.
void CairoCanvas::set_source(const Ink& ink) {
  cairo_t* cr = context_.get();
  constexpr int all = samples * samples;
  const int covered = std::clamp(static_cast<int>(std::lround(ink.opacity * all)), 0, all);
  if (covered == all) return cairo_set_source_rgb(cr, ink.colour[0], ink.colour[1], ink.colour[2]);
  static constexpr std::array<int, all> order{4, 0, 8, 2, 6,
                                              1, 7, 3, 5};  // of the samples of a pixel, evenly
  std::uint32_t colour = 0xff;
  for (const double channel : ink.colour)
    colour = colour << 8 | static_cast<std::uint32_t>(std::lround(255 * channel));
  cairo_surface_flush(tile_.get());
  unsigned char* data = cairo_image_surface_get_data(tile_.get());
  for (int i = 0; i < all; ++i) {
    const std::uint32_t sample = i < covered ? colour : 0;
    std::memcpy(data + std::ptrdiff_t{order[i] / samples} * cairo_image_surface_get_stride(tile_.get()) +
                    std::ptrdiff_t{4} * (order[i] % samples),
                &sample, sizeof sample);
  }
  cairo_surface_mark_dirty(tile_.get());
  cairo_set_source_surface(cr, tile_.get(), 0, 0);
  cairo_pattern_set_extend(cairo_get_source(cr), CAIRO_EXTEND_REPEAT);
  cairo_pattern_set_filter(cairo_get_source(cr), CAIRO_FILTER_NEAREST);
}

void CairoCanvas::fill(std::span<const std::array<double, 2>> polygon, const Ink& ink) {
  cairo_t* cr = context_.get();
  for (const auto& point : polygon) {
    const std::array<double, 2> at{point[0], point[1] - strip_ * strip_height_};
    cairo_line_to(cr, samples * at[0], samples * at[1]);
    for (const int axis : {0, 1}) {
      low_[axis] = std::min(low_[axis], samples * (at[axis] - line_width));
      high_[axis] = std::max(high_[axis], samples * (at[axis] + line_width));
    }
  }
  cairo_close_path(cr);
  set_source(ink);
  if (!ink.edges) return cairo_fill(cr);
  cairo_fill_preserve(cr);
  set_source({line_colour, ink.opacity});
  cairo_stroke(cr);
}

Canvas::Layer CairoCanvas::take() {
  check(cairo_status(context_.get()));
  cairo_surface_flush(surface_.get());
  Layer layer;
  if (!(low_[0] <= high_[0])) return layer;
  const std::array<double, 2> end{static_cast<double>(samples * width_),
                                  static_cast<double>(samples * strip_height_)};
  const auto begin_of = [&](int axis) {
    return static_cast<std::int32_t>(std::clamp(std::floor(low_[axis]) - 1, 0.0, end[axis]));
  };
  const auto end_of = [&](int axis) {
    return static_cast<std::int32_t>(std::clamp(std::ceil(high_[axis]) + 1, 0.0, end[axis]));
  };
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

void CairoCanvas::put(const Layer& layer) {
  if (layer.x < 0 || layer.y < 0 || layer.x + layer.width > samples * width_ ||
      layer.y + layer.height > samples * strip_height_)
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
  high_ = {static_cast<double>(samples * width_), static_cast<double>(samples * strip_height_)};
}

void CairoCanvas::end_strip(const Colour& background) {
  cairo_set_operator(context_.get(), CAIRO_OPERATOR_DEST_OVER);
  cairo_set_source_rgb(context_.get(), background[0], background[1], background[2]);
  cairo_paint(context_.get());
  check(cairo_status(context_.get()));
  cairo_surface_flush(surface_.get());
  if (!image_) image_.reset(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width_, height_));
  check(cairo_surface_status(image_.get()));
  cairo_surface_flush(image_.get());
  const unsigned char* data = cairo_image_surface_get_data(surface_.get());
  const int stride = cairo_image_surface_get_stride(surface_.get()), first = strip_ * strip_height_;
  unsigned char* pixels = cairo_image_surface_get_data(image_.get()) +
                          std::ptrdiff_t{first} * cairo_image_surface_get_stride(image_.get());
  for (int y = 0; y < std::min(strip_height_, height_ - first); ++y) {
    for (int x = 0; x < width_; ++x) {
      std::array<unsigned, 4> sum{};
      for (int i = 0; i < samples; ++i) {
        const unsigned char* row =
            data + std::ptrdiff_t{samples * y + i} * stride + std::ptrdiff_t{4} * samples * x;
        for (int byte = 0; byte < 4 * samples; ++byte) sum[byte % 4] += row[byte];
      }
      unsigned char* pixel =
          pixels + std::ptrdiff_t{y} * cairo_image_surface_get_stride(image_.get()) + std::ptrdiff_t{4} * x;
      for (int byte = 0; byte < 4; ++byte) {
        pixel[byte] = static_cast<unsigned char>((sum[byte] + samples * samples / 2) / (samples * samples));
      }
    }
  }
  cairo_surface_mark_dirty(image_.get());
}

std::string CairoCanvas::file() {
  std::string bytes;
  check(cairo_surface_write_to_png_stream(image_.get(), append, &bytes));
  return bytes;
}

std::string draw_vectors(PictureFormat format, int width, int height, const Colour& background,
                         const Drawing::Layer& all) {
  std::string bytes;
  {
    const Surface surface = vector_surface(format, bytes, width, height);
    const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface.get()),
                                                                     cairo_destroy);
    cairo_t* cr = context.get();
    cairo_set_line_join(cr, CAIRO_LINE_JOIN_ROUND);
    cairo_set_line_width(cr, line_width);
    cairo_set_source_rgb(cr, background[0], background[1], background[2]);
    cairo_paint(cr);
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
    check(cairo_status(cr));
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

std::unique_ptr<Canvas> new_canvas(int width, int height) {
  return std::make_unique<CairoCanvas>(width, height);
}

}  // namespace
}  // namespace bsp2::supersteps

BSP2_DEFINE_MODULE(bsp2::supersteps::CairoModule, bsp2::supersteps::new_canvas,
                   bsp2::supersteps::draw_vectors)
