#include "paint/occlusion.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace bsp2::supersteps {

Occlusion::Occlusion(const Lighting& lighting, int width, int height, std::vector<Seen>& seen, Emit emit)
    : lighting_(lighting),
      width_(width),
      height_(height),
      radius_(lighting.radius()),
      step_(std::max(2, std::min(width, height) / 300)),
      columns_((width + step_ - 1) / step_),
      rows_((height + step_ - 1) / step_),
      far_(4 + std::max(width, height) / 10),
      kept_pixels_(std::min(height, 2 * (far_ + kept * step_))),
      seen_(seen),
      emit_(std::move(emit)),
      knots_(static_cast<std::size_t>(columns_ * kept)),
      dark_(knots_.size()),
      smoothed_(knots_.size()),
      row_(static_cast<std::size_t>(width)) {
  seen_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(kept_pixels_));
  for (int y = 0; y < height; ++y)
    start_.push_back(static_cast<std::size_t>(y % kept_pixels_) * static_cast<std::size_t>(width));
  for (int turn = 0; turn < pattern * pattern; ++turn)
    for (int i = 0; i < taps; ++i) {
      const double angle = 2.399963229728653 * i + 1.7 * turn * (2 * std::numbers::pi / taps);
      const double r = std::sqrt((i + 0.5) / taps);
      taps_[static_cast<std::size_t>(turn)][static_cast<std::size_t>(i)] = {r * std::cos(angle),
                                                                            r * std::sin(angle)};
    }
}

std::span<Seen> Occlusion::begin_row() {
  const std::span<Seen> row = std::span(seen_).subspan(index(0, begun_++), static_cast<std::size_t>(width_));
  std::fill(row.begin(), row.end(), Seen{});
  return row;
}

void Occlusion::end_row() {
  ++there_;
  for (; next_dark_ < rows_ && there_ >= std::min(height_, (next_dark_ + 1) * step_ + far_); ++next_dark_) {
    make_dark(next_dark_);
    const int ready = next_dark_ + 1 == rows_ ? rows_ : next_dark_ + 3 - pattern;
    for (; next_smooth_ < ready; ++next_smooth_) smooth(next_smooth_);
    for (; next_pixel_ < height_ && below(next_pixel_) < next_smooth_; ++next_pixel_) emit(next_pixel_);
  }
}

Vector Occlusion::point(int x, int y) const {
  const Point2 place = lighting_.frame().unplace({x + 0.5, y + 0.5});
  const double depth = at(x, y).depth, spread = lighting_.camera().is_perspective() ? depth : 1;
  return {spread * place[0], spread * place[1], -depth};
}

Vector Occlusion::normal(int x, int y) const {
  const auto& n = at(x, y).normal;
  const double u = n[0] / 32767.0, v = n[1] / 32767.0;
  return {u, v, std::sqrt(std::max(0.0, 1 - u * u - v * v))};
}

void Occlusion::make_dark(int row) {
  for (int x = 0; x < columns_; ++x) {
    const std::size_t i = index_of_knot(x, row);
    knots_[i] = knot_at(x, row);
    dark_[i] = knots_[i].is_there ? darkness(knots_[i], x, row) : 0;
  }
}

/// The first pixel of its square in which something is seen.
Occlusion::Knot Occlusion::knot_at(int column, int row) const {
  for (int y = row * step_; y < std::min(height_, (row + 1) * step_); ++y)
    for (int x = column * step_; x < std::min(width_, (column + 1) * step_); ++x)
      if (at(x, y).is_there()) return {{x + 0.5, y + 0.5}, point(x, y), normal(x, y), true};
  return {};
}

float Occlusion::darkness(const Knot& knot, int column, int row) const {
  const double spread = lighting_.camera().is_perspective() ? std::max(1e-300, -knot.point[2]) : 1;
  const double reach =
      std::clamp(radius_ * lighting_.frame().scale() / spread, 3.0, 0.1 * std::max(width_, height_));
  const double one = 1 / radius_;
  double sum = 0;
  for (const Point2& tap : taps_[static_cast<std::size_t>(column % pattern + pattern * (row % pattern))]) {
    const double u = knot.place[0] + reach * tap[0], v = knot.place[1] + reach * tap[1];
    if (!(u >= 0 && v >= 0 && u < width_ && v < height_)) continue;
    const int x = static_cast<int>(u), y = static_cast<int>(v);
    if (!at(x, y).is_there()) continue;
    const Vector way = difference(point(x, y), knot.point);
    sum += std::max(0.0, one * dot(way, knot.normal) - 0.02) / (one * one * dot(way, way) + 0.03);
  }
  return static_cast<float>(std::min(1.0, 0.8 * sum / taps));
}

/// Whether what is seen in one place says something about another one.
float Occlusion::likeness(const Vector& point, const Vector& normal, const Knot& knot) const {
  if (!knot.is_there) return 0;
  const double off = std::fabs(dot(difference(knot.point, point), normal)) / (0.25 * radius_);
  const double bent = std::max(0.0, dot(normal, knot.normal));
  return static_cast<float>(std::max(0.0, 1 - off) * bent * bent + 1e-4);
}

/// Over as many knots as the pattern has.
void Occlusion::smooth(int row) {
  for (int x = 0; x < columns_; ++x) {
    const Knot& here = knot(x, row);
    float& result = smoothed_[index_of_knot(x, row)];
    result = 0;
    if (!here.is_there) continue;
    float sum = 0, weights = 0;
    for (int v = std::max(0, row - 1); v < std::min(rows_, row - 1 + pattern); ++v)
      for (int u = std::max(0, x - 1); u < std::min(columns_, x - 1 + pattern); ++u) {
        const float weight = likeness(here.point, here.normal, knot(u, v));
        sum += weight * dark_[index_of_knot(u, v)];
        weights += weight;
      }
    result = weights > 0 ? sum / weights : dark_[index_of_knot(x, row)];
  }
}

void Occlusion::emit(int y) {
  for (int x = 0; x < width_; ++x)
    row_[static_cast<std::size_t>(x)] = at(x, y).is_there() ? between(x, y) : std::uint8_t{0};
  emit_(y, row_);
}

/// The row of knots above the middle of a row of pixels.
int Occlusion::above(int y) const { return std::max(0, static_cast<int>((y + 0.5) / step_ - 0.5)); }

/// From the knots around a pixel; they count by how much what is seen there is like what is seen here, but
/// where they are equally dark.
std::uint8_t Occlusion::between(int x, int y) const {
  constexpr float alike = 1.0F / 64;
  const double u = (x + 0.5) / step_ - 0.5, v = (y + 0.5) / step_ - 0.5;
  const int left = std::max(0, static_cast<int>(u)), above = this->above(y);
  const int right = std::min(left + 1, columns_ - 1), below = this->below(y);
  const auto dark = [&](int column, int row) { return smoothed_[index_of_knot(column, row)]; };
  const std::array<float, 4> darks{dark(left, above), dark(right, above), dark(left, below),
                                   dark(right, below)};
  const std::array<const Knot*, 4> knots{&knot(left, above), &knot(right, above), &knot(left, below),
                                         &knot(right, below)};
  const double s = std::clamp(u - left, 0.0, 1.0), t = std::clamp(v - above, 0.0, 1.0);
  const std::array<double, 4> shares{(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
  const auto [least, most] = std::minmax_element(darks.begin(), darks.end());
  const bool are_there = knots[0]->is_there && knots[1]->is_there && knots[2]->is_there && knots[3]->is_there;
  const bool are_alike = are_there && *most - *least < alike;
  const Vector p = are_alike ? Vector{} : point(x, y), n = are_alike ? Vector{} : normal(x, y);
  double sum = 0, weights = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double weight = are_alike ? shares[i] : (shares[i] + 1e-3) * likeness(p, n, *knots[i]);
    sum += weight * darks[i];
    weights += weight;
  }
  return static_cast<std::uint8_t>(weights > 0 ? 255 * sum / weights + 0.5 : 0);
}
}  // namespace bsp2::supersteps
