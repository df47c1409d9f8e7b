#include "surfaces/thumbnail.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "surfaces/zip.hpp"

namespace bsp2::io {
namespace {

constexpr int size = 256, samples = 2, raster = size * samples;  // samples a pixel, across and down

/// Right, up and towards the eye; of length 1.
struct View {
  std::array<double, 3> right{0.9063, 0.4226, 0}, up{-0.2113, 0.4532, 0.8660}, eye{0.3660, -0.7849, 0.5};
};

double along(const std::array<double, 3>& axis, const std::array<float, 3>& point) {
  return axis[0] * point[0] + axis[1] * point[1] + axis[2] * point[2];
}

using Rgb = std::array<std::uint8_t, 3>;
using Seen = std::array<double, 3>;  // right and up in samples, and depth

class Canvas256 {
 public:
  /// What is nearest to the eye is seen.
  void draw(const std::array<Seen, 3>& corners, const Rgb& colour) {
    const auto& [a, b, c] = corners;
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (!(area > 0)) return;  // looks away
    const auto [left, right] = std::minmax({a[0], b[0], c[0]});
    const auto [low, high] = std::minmax({a[1], b[1], c[1]});
    for (int y = first(low); y <= last(high); ++y)
      for (int x = first(left); x <= last(right); ++x) {
        const auto side = [&](const Seen& from, const Seen& to) {
          return (to[0] - from[0]) * (y - from[1]) - (to[1] - from[1]) * (x - from[0]);
        };
        const double u = side(b, c), v = side(c, a), w = side(a, b);
        if (u < 0 || v < 0 || w < 0) continue;
        const double depth = (u * a[2] + v * b[2] + w * c[2]) / area;
        const auto at = static_cast<std::size_t>(y * raster + x);
        if (depth <= depth_[at]) continue;
        depth_[at] = depth;
        colour_[at] = colour;
      }
  }

  /// Rows of a filter byte and red, green, blue, opacity, from above.
  [[nodiscard]] std::string rows() const {
    std::string bytes;
    for (int y = size - 1; y >= 0; --y) {
      bytes += '\0';
      for (int x = 0; x < size; ++x) {
        std::array<int, 3> sum{};
        int covered = 0;
        for (int i = 0; i < samples * samples; ++i) {
          const auto at =
              static_cast<std::size_t>((y * samples + i / samples) * raster + x * samples + i % samples);
          if (depth_[at] == nothing) continue;
          ++covered;
          for (std::size_t k = 0; k < 3; ++k) sum[k] += colour_[at][k];
        }
        for (const int channel : sum) bytes += static_cast<char>(covered > 0 ? channel / covered : 0);
        bytes += static_cast<char>(255 * covered / (samples * samples));
      }
    }
    return bytes;
  }

 private:
  static constexpr double nothing = -std::numeric_limits<double>::infinity();
  std::vector<double> depth_ = std::vector<double>(std::size_t{raster} * raster, nothing);
  std::vector<Rgb> colour_ = std::vector<Rgb>(std::size_t{raster} * raster);

  static int first(double x) { return std::max(0, static_cast<int>(std::ceil(x))); }
  static int last(double x) { return std::min(raster - 1, static_cast<int>(std::floor(x))); }
};

void add_chunk(std::string& png, std::string_view name, std::string_view content) {
  const auto number = [&](std::uint32_t value) {
    for (int shift = 24; shift >= 0; shift -= 8) png += static_cast<char>(value >> shift & 0xff);
  };
  std::string chunk(name);
  chunk += content;
  number(static_cast<std::uint32_t>(content.size()));
  png += chunk;
  number(crc32_of(chunk));
}

std::string png_of(const Canvas256& canvas) {
  const auto wide = static_cast<char>(size >> 8), narrow = static_cast<char>(size & 0xff);
  const std::string header{0, 0, wide, narrow, 0, 0, wide, narrow, 8, 6, 0, 0, 0};  // 8 bits, with opacity
  std::string png = "\x89PNG\r\n\x1a\n";
  add_chunk(png, "IHDR", header);
  add_chunk(png, "IDAT", deflated(canvas.rows(), Wrapping::zlib));
  add_chunk(png, "IEND", "");
  return png;
}

/// Of a face of this colour, as bright as the light on it.
Rgb lit(const SurfaceParts::Colour& colour, const Point3Of<float>& p, const Point3Of<float>& q,
        const Point3Of<float>& r) {
  std::array<double, 3> n;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t l = (k + 1) % 3, m = (k + 2) % 3;
    n[k] = (double{q[l]} - p[l]) * (double{r[m]} - p[m]) - (double{q[m]} - p[m]) * (double{r[l]} - p[l]);
  }
  const double length = std::hypot(n[0], n[1], n[2]);
  const double towards_light = length > 0 ? (0.2 * n[0] - 0.5 * n[1] + 0.84 * n[2]) / length : 0;
  const double light = 0.45 + 0.55 * std::max(0.0, towards_light);
  Rgb result;
  for (std::size_t k = 0; k < 3; ++k) result[k] = static_cast<std::uint8_t>(light * colour[k]);
  return result;
}

/// Where points are in the picture, which all of them fill.
class Projection {
 public:
  explicit Projection(const std::vector<PrintedObject>& objects) {
    low_.fill(std::numeric_limits<double>::max());
    high_.fill(std::numeric_limits<double>::lowest());
    for (const PrintedObject& object : objects)
      for (const auto& point : object.mesh.points) {
        const Seen at = turned(point);
        for (std::size_t k = 0; k < 3; ++k) {
          low_[k] = std::min(low_[k], at[k]);
          high_[k] = std::max(high_[k], at[k]);
        }
      }
    const double extent = std::max(high_[0] - low_[0], high_[1] - low_[1]);
    scale_ = extent > 0 ? 0.94 * raster / extent : 1;
  }
  [[nodiscard]] Seen operator()(const Point3Of<float>& point) const {
    Seen at = turned(point);
    for (std::size_t k = 0; k < 2; ++k) at[k] = raster / 2.0 + scale_ * (at[k] - (low_[k] + high_[k]) / 2);
    return at;
  }

 private:
  View view_;
  Seen low_, high_;
  double scale_;

  [[nodiscard]] Seen turned(const Point3Of<float>& point) const {
    return {along(view_.right, point), along(view_.up, point), along(view_.eye, point)};
  }
};

}  // namespace

std::string thumbnail(const std::vector<PrintedObject>& objects, const PartLabels& labels) {
  const Projection seen(objects);
  Canvas256 canvas;
  for (const PrintedObject& object : objects) {
    const auto colour = labels.shown_colour(object.owner);
    for (const auto& [a, b, c] : object.mesh.triangles) {
      const auto &p = object.mesh.points[a], &q = object.mesh.points[b], &r = object.mesh.points[c];
      canvas.draw({seen(p), seen(q), seen(r)}, lit(colour, p, q, r));
    }
  }
  return png_of(canvas);
}

}  // namespace bsp2::io
