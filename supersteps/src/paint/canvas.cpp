#include "paint/canvas.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "bsp2/geometry/support/interruption.hpp"
#include "bsp2/geometry/support/module.hpp"
#include "paint/seen_edges.hpp"
#include "pixels/png.hpp"
#include "render/cairo_module.hpp"

namespace bsp2::supersteps {
namespace {

const CairoModule& cairo_module() { return loaded_module<CairoModule>(BSP2_MODULE_LAYOUT); }

constexpr int bytes_of_a_strip = 2 << 20, most_strips = 255;
constexpr double outline_width = 0.6, edge_width = 0.7;  // pixels of a picture of a thousand or less

/// Of what is drawn at a fixed size in a picture of a thousand pixels.
double enlargement(const PictureOptions& options) {
  return std::max(1.0, std::min(options.width, options.height) / 1000.0);
}

std::uint32_t packed(const Colour& colour) {
  std::uint32_t result = 0;
  for (const double channel : colour)
    result = result << 8 | static_cast<std::uint32_t>(255 * std::clamp(channel, 0.0, 1.0) + 0.5);
  return result;
}

/// What each byte is of the largest one: to divide takes longer than to look it up.
const std::array<double, 256> share_of_byte = [] {
  std::array<double, 256> shares{};
  for (std::size_t i = 0; i < shares.size(); ++i) shares[i] = static_cast<double>(i) / 255.0;
  return shares;
}();

Colour unpacked(std::uint32_t colour) {
  return {share_of_byte[colour >> 16 & 0xff], share_of_byte[colour >> 8 & 0xff],
          share_of_byte[colour & 0xff]};
}

/// The first of `count` samples, or rows, at a place or behind it.
int first_behind(double place, int count) {
  const double limited = std::clamp(place, 0.0, static_cast<double>(count));
  const int below = static_cast<int>(limited);
  return below < limited ? below + 1 : below;
}

}  // namespace

PictureMemory::PictureMemory() : parts_(std::make_unique<CanvasMemory>()) {}
PictureMemory::PictureMemory(PictureMemory&&) noexcept = default;
PictureMemory& PictureMemory::operator=(PictureMemory&&) noexcept = default;
PictureMemory::~PictureMemory() = default;

void check_pictures() { cairo_module(); }

Canvas::Canvas(const PictureOptions& options)
    : width_(options.width),
      height_(options.height),
      has_edges_(options.edges == Edges::feature),
      has_outlines_(options.edges == Edges::cells),
      is_transparent_(options.transparent),
      halo_(has_edges_ ? 1 + static_cast<int>(edge_width * enlargement(options)) : 0),
      strip_height_(std::clamp(bytes_of_a_strip / (all_samples * 4 * width_),
                               (height_ + most_strips - 1) / most_strips, height_)),
      line_width_(enlargement(options)),
      memory_(options.memory != nullptr ? options.memory->parts() : own_) {
  memory_.samples.resize(static_cast<std::size_t>(columns()) * static_cast<std::size_t>(rows()));
  memory_.low.resize(static_cast<std::size_t>(rows()));
  memory_.high.resize(static_cast<std::size_t>(rows()));
  memory_.on_edge.resize(has_edges_ ? memory_.samples.size() : 0);
  memory_.image.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), 0);
  forget();
}

std::array<std::uint8_t, 2> Canvas::strips_between(double low, double high) const {
  const double beyond = 1 + halo_;
  if (high < -beyond || low > height_ + beyond) return {1, 0};
  const auto strip = [&](double y) {
    return static_cast<std::uint8_t>(
        std::clamp(static_cast<int>(std::floor(y)) / strip_height_, 0, strips() - 1));
  };
  return {strip(std::max(0.0, low - beyond)), strip(std::min<double>(height_, high + beyond))};
}

void Canvas::begin_strip(int strip) {
  strip_ = strip;
  std::fill(memory_.samples.begin(), memory_.samples.end(), 0);
  forget();
}

void Canvas::forget() {
  const int down = (rows() + tile - 1) / tile;
  memory_.free.resize(static_cast<std::size_t>(tiles_across()) * static_cast<std::size_t>(down));
  for (int v = 0; v < down; ++v)
    for (int u = 0; u < tiles_across(); ++u)
      memory_.free[static_cast<std::size_t>(v * tiles_across() + u)] =
          static_cast<std::uint8_t>(std::min(tile, columns() - u * tile) * std::min(tile, rows() - v * tile));
  drawn_ = {columns(), 0, rows(), 0};
  memory_.facets.clear();
}

void Canvas::fill(std::span<const Point2> polygon, const Ink& ink) {
  const int covered = std::clamp(static_cast<int>(std::lround(ink.opacity * all_samples)), 0, all_samples);
  if (ink.edges) draw_outline(polygon, ink);
  memory_.facets.push_back({ink.plane, packed(ink.colour), ink.round, ink.region});
  fill_convex(polygon, static_cast<std::uint32_t>(memory_.facets.size()), covered);
}

bool Canvas::is_covered(const Point2& low, const Point2& high) const {
  const double first_row = strip_ * strip_height_ - halo_;
  const double beyond = has_outlines_ ? line_width_ : 0;
  const auto tile_at = [&](double place, int count) {
    return static_cast<int>(std::clamp(samples * place, 0.0, count - 1.0)) / tile;
  };
  const int left = tile_at(low[0] - beyond, columns()), right = tile_at(high[0] + beyond, columns());
  const int top = tile_at(low[1] - beyond - first_row, rows()),
            bottom = tile_at(high[1] + beyond - first_row, rows());
  for (int v = top; v <= bottom; ++v)
    for (int u = left; u <= right; ++u)
      if (memory_.free[static_cast<std::size_t>(v * tiles_across() + u)] != 0) return false;
  return true;
}

/// Each edge is walked from its upper end, so both its polygons find the same places on it. Going down and
/// up it bounds the polygon on different sides.
void Canvas::fill_convex(std::span<const Point2> polygon, std::uint32_t facet, int covered) {
  const double first_row = strip_ * strip_height_ - halo_;
  memory_.polygon.clear();
  double low = std::numeric_limits<double>::infinity(), high = -low, area = 0;
  for (const Point2& p : polygon) {
    memory_.polygon.push_back({samples * p[0], samples * (p[1] - first_row)});
    low = std::min(low, memory_.polygon.back()[1]);
    high = std::max(high, memory_.polygon.back()[1]);
  }
  const int top = first_behind(low - 0.5, rows()), bottom = first_behind(high - 0.5, rows());
  if (top >= bottom) return;
  const std::size_t corners = memory_.polygon.size();
  for (std::size_t i = 0; i < corners; ++i) {
    const Point2 &p = memory_.polygon[i], &q = memory_.polygon[i + 1 < corners ? i + 1 : 0];
    area += (p[0] - memory_.polygon[0][0]) * (q[1] - memory_.polygon[0][1]) -
            (q[0] - memory_.polygon[0][0]) * (p[1] - memory_.polygon[0][1]);
  }
  for (std::size_t i = 0; i < corners; ++i) {
    const Point2 &p = memory_.polygon[i], &q = memory_.polygon[i + 1 < corners ? i + 1 : 0];
    const bool goes_down = p[1] < q[1];
    const Point2 &upper = goes_down ? p : q, &lower = goes_down ? q : p;
    const int begin = first_behind(upper[1] - 0.5, rows()), end = first_behind(lower[1] - 0.5, rows());
    if (begin >= end) continue;
    const double slope = (lower[0] - upper[0]) / (lower[1] - upper[1]);
    double* side = goes_down == (area > 0) ? memory_.high.data() : memory_.low.data();
    for (int y = begin; y < end; ++y) side[y] = upper[0] + (y + 0.5 - upper[1]) * slope;
  }
  int left = columns(), right = 0;
  for (int y = top; y < bottom; ++y) {
    const double middle = middle_in_row[static_cast<std::size_t>(y % samples)];
    const int begin = first_behind(memory_.low[static_cast<std::size_t>(y)] - middle, columns()),
              end = first_behind(memory_.high[static_cast<std::size_t>(y)] - middle, columns());
    if (begin >= end) continue;
    fill_row(y, begin, end, facet, covered);
    left = std::min(left, begin);
    right = std::max(right, end);
  }
  drawn_ = {std::min(drawn_[0], left), std::max(drawn_[1], right), std::min(drawn_[2], top),
            std::max(drawn_[3], bottom)};
}

/// What is translucent covers the same samples of all pixels, spread evenly.
void Canvas::fill_row(int y, int begin, int end, std::uint32_t facet, int covered) {
  static constexpr std::array<int, all_samples> turn{1, 5, 3, 7, 0, 6, 4, 8, 2};  // of each sample of a pixel
  const int* turns = turn.data() + samples * (y % samples);
  std::uint8_t* free = memory_.free.data() + std::ptrdiff_t{y / tile} * tiles_across();
  std::uint32_t* of_row = row(y);
  for (int x = begin; x < end;) {
    const int next = std::min(end, (x / tile + 1) * tile);
    std::uint8_t& of_tile = free[x / tile];
    if (of_tile == 0) {
      x = next;
      continue;
    }
    unsigned filled = 0;
    for (; x < next; ++x)
      if (of_row[x] == 0 && turns[x % samples] < covered) {
        of_row[x] = facet;
        ++filled;
      }
    of_tile = static_cast<std::uint8_t>(of_tile - filled);
  }
}

void Canvas::draw_outline(std::span<const Point2> polygon, const Ink& ink) {
  const int covered = std::clamp(static_cast<int>(std::lround(ink.opacity * all_samples)), 0, all_samples);
  memory_.facets.push_back({{}, packed(line_colour), {}, 0});
  const double half = outline_width / 2 * line_width_;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Point2 &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double length = std::hypot(q[0] - p[0], q[1] - p[1]);
    if (!(length > 0)) continue;
    const double u = half * (q[0] - p[0]) / length, v = half * (q[1] - p[1]) / length;
    const std::array<Point2, 4> line{Point2{p[0] - u + v, p[1] - v - u}, Point2{q[0] + u + v, q[1] + v - u},
                                     Point2{q[0] + u - v, q[1] + v + u}, Point2{p[0] - u - v, p[1] - v + u}};
    fill_convex(line, static_cast<std::uint32_t>(memory_.facets.size()), covered);
  }
}

Canvas::Layer Canvas::take() {
  Layer layer;
  if (drawn_[0] >= drawn_[1]) {
    forget();
    return layer;
  }
  layer.x = drawn_[0];
  layer.y = drawn_[2];
  layer.width = drawn_[1] - drawn_[0];
  layer.height = drawn_[3] - drawn_[2];
  std::vector<std::uint32_t> number(memory_.facets.size() + 1);  // of those that are seen
  for (int y = layer.y; y < layer.y + layer.height; ++y) {
    std::uint32_t* of_row = row(y) + layer.x;
    for (int x = 0; x < layer.width; ++x) {
      const std::uint32_t facet = of_row[x];
      if (facet != 0 && number[facet] == 0) {
        layer.facets.push_back(memory_.facets[facet - 1]);
        number[facet] = static_cast<std::uint32_t>(layer.facets.size());
      }
      if (layer.runs.empty() || layer.runs.back() != number[facet])
        layer.runs.insert(layer.runs.end(), {1, number[facet]});
      else
        ++layer.runs[layer.runs.size() - 2];
    }
    std::fill_n(of_row, layer.width, 0);
  }
  forget();
  return layer;
}

void Canvas::put(const Layer& layer) {
  if (layer.x < 0 || layer.y < 0 || layer.x + layer.width > columns() || layer.y + layer.height > rows())
    throw std::out_of_range("a layer that is larger than its canvas");
  const auto before = static_cast<std::uint32_t>(memory_.facets.size());
  memory_.facets.insert(memory_.facets.end(), layer.facets.begin(), layer.facets.end());
  const auto width = static_cast<std::size_t>(layer.width),
             all = width * static_cast<std::size_t>(layer.height);
  std::size_t at = 0;  // in the layer, row by row
  for (std::size_t run = 0; run + 1 < layer.runs.size(); run += 2) {
    const std::size_t last = std::min(all, at + layer.runs[run]);
    const std::uint32_t facet = layer.runs[run + 1];
    if (facet > layer.facets.size()) throw std::out_of_range("a layer that lacks a facet");
    for (; at < last && facet != 0; ++at)
      row(layer.y + static_cast<int>(at / width))[layer.x + static_cast<int>(at % width)] = before + facet;
    at = last;
  }
  drawn_ = {0, columns(), 0, rows()};
}

Point2 Canvas::place_of_sample(int x, int y) const {
  return {(x + middle_in_row[static_cast<std::size_t>(y % samples)]) / samples,
          strip_ * strip_height_ - halo_ + (y + 0.5) / samples};
}

void Canvas::find_edges(const Lighting& lighting) {
  std::fill(memory_.on_edge.begin(), memory_.on_edge.end(), 0);
  const auto facet = [&](std::uint32_t number) {
    return number == 0 ? nullptr : &memory_.facets[number - 1];
  };
  const auto compare = [&](int x, int y, int u, int v) {
    const std::uint32_t a = row(y)[x], b = row(v)[u];
    if (a == b || !lighting.is_edge(facet(a), place_of_sample(x, y), facet(b), place_of_sample(u, v))) return;
    mark_edge(x, y);
    mark_edge(u, v);
  };
  for (int y = std::max(0, drawn_[2] - 1); y < std::min(drawn_[3], rows() - 1); ++y)
    for (int x = std::max(0, drawn_[0] - 1); x < std::min(drawn_[1], columns() - 1); ++x) {
      compare(x, y, x + 1, y);
      compare(x, y, x, y + 1);
    }
}

/// The samples around one that is beside an edge.
void Canvas::mark_edge(int x, int y) {
  const double reach = edge_width / 2 * samples * line_width_ - 0.5;
  const int far = static_cast<int>(reach);
  for (int v = std::max(0, y - far); v <= std::min(rows() - 1, y + far); ++v)
    for (int u = std::max(0, x - far); u <= std::min(columns() - 1, x + far); ++u)
      if ((u - x) * (u - x) + (v - y) * (v - y) <= reach * reach) memory_.on_edge[index_of_sample(u, v)] = 1;
}

/// The line of an edge over samples: those that show something, and some beside them. @return how many are
/// covered then.
double Canvas::draw_line(Colour& sum, int covered, int on_edges) {
  constexpr double hides = 0.75;  // of what is below
  const double over = covered > 0 ? hides * std::min(on_edges, covered) / covered : 0,
               beside = hides * std::max(0, on_edges - covered);
  for (std::size_t k = 0; k < 3; ++k)
    sum[k] += over * (covered * line_colour[k] - sum[k]) + beside * line_colour[k];
  return covered + beside;
}

Colour Canvas::light(const SeenFacet& facet, std::size_t column, const Point2& middle,
                     const Lighting& lighting, bool is_there) {
  Colour colour = unpacked(facet.colour);
  if (!facet.is_lit()) return colour;
  const Vector point = lighting.point(facet, middle), normal = lighting.normal(facet, point);
  const double light = brightness(normal);
  if (is_there && !seen_row_.empty())
    seen_row_[column] = {
        static_cast<float>(-point[2]),
        {static_cast<std::int16_t>(32767 * normal[0]), static_cast<std::int16_t>(32767 * normal[1])}};
  for (double& channel : colour) channel = std::min(1.0, light * channel);
  return colour;
}

void Canvas::light_pixel(int x, int y, const Lighting& lighting) {
  const int first_row = samples * (y - strip_ * strip_height_ + halo_);
  std::array<std::uint32_t, all_samples> facets;
  int on_edges = 0;
  for (int i = 0; i < samples; ++i) {
    std::copy_n(row(first_row + i) + std::ptrdiff_t{samples} * x, samples, facets.begin() + samples * i);
    if (!has_edges_) continue;
    const std::uint8_t* on_edge = memory_.on_edge.data() + index_of_sample(samples * x, first_row + i);
    for (int k = 0; k < samples; ++k) on_edges += on_edge[k];
  }
  const bool is_uniform = std::equal(facets.begin() + 1, facets.end(), facets.begin());
  if (is_uniform && facets[0] == 0 && on_edges == 0) return;
  const Point2 middle{x + 0.5, y + 0.5};
  const auto pixel =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  if (is_uniform && facets[0] != 0 && on_edges == 0) {
    memory_.image[pixel] = 0xff000000U | packed(light(memory_.facets[facets[0] - 1],
                                                      static_cast<std::size_t>(x), middle, lighting, true));
    return;
  }
  const std::uint32_t first =
      *std::find_if(facets.begin(), facets.end() - 1, [](std::uint32_t f) { return f != 0; });
  const std::uint32_t centre = facets[all_samples / 2] != 0 ? facets[all_samples / 2] : first;
  int covered = 0;
  Colour sum{};
  for (std::size_t i = 0, same = 0; i < all_samples; i = same) {  // those of one facet at once
    for (same = i + 1; same < all_samples && facets[same] == facets[i]; ++same) {
    }
    if (facets[i] == 0) continue;
    const Colour colour = light(memory_.facets[facets[i] - 1], static_cast<std::size_t>(x), middle, lighting,
                                facets[i] == centre);
    for (std::size_t k = 0; k < 3; ++k) sum[k] += static_cast<double>(same - i) * colour[k];
    covered += static_cast<int>(same - i);
  }
  const double opaque = draw_line(sum, covered, on_edges);
  for (double& channel : sum) channel /= all_samples;
  memory_.image[pixel] = static_cast<std::uint32_t>(255 * opaque / all_samples + 0.5) << 24 | packed(sum);
}

void Canvas::end_strip(const Lighting& lighting) {
  if (has_edges_) find_edges(lighting);
  if (strip_ == 0 && lighting.radius() > 0)
    occlusion_.emplace(lighting, width_, height_, memory_.seen,
                       [this](int y, std::span<const std::uint8_t> darkness) { finish_row(y, darkness); });
  const int first = strip_ * strip_height_;
  // What has been drawn, and lines beside it; nothing is elsewhere.
  const int left = std::max(0, drawn_[0] / samples - halo_),
            right = std::min(width_, (drawn_[1] + samples - 1) / samples + halo_);
  for (int y = first; y < std::min(first + strip_height_, height_); ++y) {
    geometry::Interruption::check();
    if (occlusion_) seen_row_ = occlusion_->begin_row();
    for (int x = left; x < right; ++x) light_pixel(x, y, lighting);
    if (occlusion_)
      occlusion_->end_row();
    else
      finish_row(y, {});
  }
}

/// What lies behind what is seen, and the light that corners lose.
void Canvas::finish_row(int y, std::span<const std::uint8_t> darkness) {
  constexpr double most = 0.75;  // of the light
  const std::uint32_t empty = is_transparent_ ? 0 : 0xff000000U | packed(background);
  const auto width = static_cast<std::size_t>(width_);
  const std::span<std::uint32_t> row =
      std::span(memory_.image).subspan(static_cast<std::size_t>(y) * width, width);
  for (std::size_t x = 0; x < width; ++x) {
    const std::uint32_t opacity = row[x] >> 24;
    const double lit = darkness.empty() ? 1 : 1 - most / 255 * darkness[x];
    if (opacity == 0) {
      row[x] = empty;
    } else if (opacity < 255 || lit < 1) {
      Colour colour = unpacked(row[x]);
      const double behind = is_transparent_ ? 0 : (255 - opacity) / 255.0;
      for (std::size_t k = 0; k < 3; ++k) colour[k] = lit * colour[k] + behind * background[k];
      row[x] = (is_transparent_ ? opacity << 24 : 0xff000000U) | packed(colour);
    }
  }
}

std::string Canvas::file(const Lighting&, const Overlay& overlay) {
  occlusion_.reset();
  if (!overlay.is_empty()) cairo_module().draw_overlay(memory_.image.data(), width_, height_, overlay);
  return png_file(memory_.image, width_, height_, is_transparent_);
}

Drawing::Drawing(const PictureOptions& options)
    : width_(options.width),
      height_(options.height),
      format_(options.format),
      has_edges_(options.edges == Edges::feature),
      is_transparent_(options.transparent),
      line_width_(edge_width * enlargement(options)) {}

void Drawing::fill(std::span<const Point2> polygon, const Ink& ink) {
  for (const auto& point : polygon) all_.points.insert(all_.points.end(), point.begin(), point.end());
  all_.ends.push_back(static_cast<std::uint32_t>(all_.points.size() / 2));
  const Vector normal{ink.plane[0], ink.plane[1], ink.plane[2]};
  const double light = dot(normal, normal) > 0 ? brightness(normal) : 1;
  for (const double channel : ink.colour)
    all_.inks.push_back(static_cast<float>(std::clamp(light * channel, 0.0, 1.0)));
  all_.inks.insert(all_.inks.end(), {static_cast<float>(ink.opacity), ink.edges ? 1.0F : 0.0F});
  if (has_edges_) all_.facets.push_back({ink.plane, packed(ink.colour), ink.round, ink.region});
}

Drawing::Layer Drawing::take() { return std::exchange(all_, {}); }

void Drawing::put(const Layer& layer) {
  const auto first = static_cast<std::uint32_t>(all_.points.size() / 2);
  all_.points.insert(all_.points.end(), layer.points.begin(), layer.points.end());
  for (const std::uint32_t end : layer.ends) all_.ends.push_back(first + end);
  all_.inks.insert(all_.inks.end(), layer.inks.begin(), layer.inks.end());
  all_.facets.insert(all_.facets.end(), layer.facets.begin(), layer.facets.end());
}

std::string Drawing::file(const Lighting& lighting, const Overlay& overlay) {
  all_.line_width = line_width_;
  if (has_edges_) add_seen_edges(all_, lighting, width_, height_);
  return cairo_module().draw_vectors(format_, width_, height_, is_transparent_ ? nullptr : &background, all_,
                                     overlay);
}

}  // namespace bsp2::supersteps
