#include "render/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bsp2::supersteps {

double brightness(const Vector& normal) {
  // The second light is for what is turned away from the first one.
  static const Vector light = normalized({-0.5, 0.6, 0.7}), from_beside = normalized({0.9, 0.1, 0.4});
  return 0.5 + 0.1 * normal[1] + 0.48 * std::max(0.0, dot(normal, light)) +
         0.18 * std::max(0.0, dot(normal, from_beside));
}

Lighting::Lighting(const Camera& camera, const Frame& frame, const RoundFaces* round,
                   std::span<const Vector> shifts, double radius, double skin)
    : camera_(camera), frame_(frame), round_(round), radius_(radius), skin_(skin) {
  if (round == nullptr) return;
  placements_ = round->seen(camera);
  for (const Vector& shift : shifts) shifts_.push_back(camera.turn(shift));
}

Vector Lighting::point(const SeenFacet& facet, const Point2& place) const {
  return camera_.meet(facet.plane, frame_.unplace(place));
}

Vector Lighting::normal(const SeenFacet& facet, const Vector& point) const {
  if (facet.round.body < 0 || round_ == nullptr) return facet.normal();
  const Vector unmoved = facet.region < shifts_.size() ? difference(point, shifts_[facet.region]) : point;
  return round_->normal(facet.round, placements_[static_cast<std::size_t>(facet.round.body)], unmoved,
                        facet.normal());
}

bool Lighting::is_edge(const SeenFacet* a, const Point2& at_a, const SeenFacet* b, const Point2& at_b) const {
  if (a == nullptr || b == nullptr) return true;
  if (!a->is_lit() || !b->is_lit()) return false;
  const Vector here = point(*a, at_a), there = point(*b, at_b);
  static const double least = std::cos(30 * std::numbers::pi / 180);
  if (dot(normal(*a, here), normal(*b, there)) < least) return true;
  // Beside each other: from one place to the other both planes change so much at most, and the depths differ
  // by no more. A skin has steps, as thick as it is.
  const double change = std::fabs(point(*a, at_b)[2] - here[2]) + std::fabs(point(*b, at_a)[2] - there[2]);
  const double sample = std::fabs(at_a[0] - at_b[0]) + std::fabs(at_a[1] - at_b[1]);
  const double size = (camera_.is_perspective() ? -here[2] : 1) * sample / frame_.scale();
  const double step = a->round.side != 0 && b->round.side != 0 ? 4 * skin_ : 0;
  return !(std::fabs(here[2] - there[2]) <= 1.5 * change + size + step);
}

namespace {

/// A coarse grid of what is seen, and how dark it is there.
class Occlusion {
 public:
  Occlusion(const Lighting& lighting, std::span<const Seen> seen, int width, int height, double radius)
      : lighting_(lighting),
        seen_(seen),
        width_(width),
        height_(height),
        radius_(radius),
        step_(std::max(2, std::min(width, height) / 300)),
        columns_((width + step_ - 1) / step_),
        rows_((height + step_ - 1) / step_),
        knots_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)),
        dark_(knots_.size()) {
    for (int turn = 0; turn < pattern * pattern; ++turn)
      for (int i = 0; i < taps; ++i) {
        const double angle = 2.399963229728653 * i + 1.7 * turn * (2 * std::numbers::pi / taps);
        const double r = std::sqrt((i + 0.5) / taps);
        taps_[static_cast<std::size_t>(turn)][static_cast<std::size_t>(i)] = {r * std::cos(angle),
                                                                              r * std::sin(angle)};
      }
  }

  std::vector<std::uint8_t> run() {
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) knot(x, y) = knot_at(x, y);
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x)
        if (knot(x, y).is_there) dark(x, y) = darkness(knot(x, y), x, y);
    smooth();
    std::vector<std::uint8_t> result(seen_.size());
    for (int y = 0; y < height_; ++y)
      for (int x = 0; x < width_; ++x)
        if (at(x, y).is_there()) result[index(x, y)] = between(x, y);
    return result;
  }

 private:
  struct Knot {
    Point2 place{};  // in pixels
    Vector point{}, normal{};
    bool is_there = false;
  };
  /// Taps in a spiral, turned from knot to knot, so that there are no rings; what they differ by is smoothed.
  static constexpr int taps = 12, pattern = 4;
  std::array<std::array<Point2, taps>, pattern * pattern> taps_;

  const Lighting& lighting_;
  std::span<const Seen> seen_;
  int width_, height_;
  double radius_;
  int step_, columns_, rows_;
  std::vector<Knot> knots_;
  std::vector<float> dark_;

  [[nodiscard]] std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  }
  [[nodiscard]] const Seen& at(int x, int y) const { return seen_[index(x, y)]; }
  Knot& knot(int x, int y) { return knots_[static_cast<std::size_t>(y * columns_ + x)]; }
  float& dark(int x, int y) { return dark_[static_cast<std::size_t>(y * columns_ + x)]; }

  [[nodiscard]] Vector point(int x, int y) const {
    const Point2 place = lighting_.frame().unplace({x + 0.5, y + 0.5});
    const double depth = at(x, y).depth, spread = lighting_.camera().is_perspective() ? depth : 1;
    return {spread * place[0], spread * place[1], -depth};
  }
  [[nodiscard]] Vector normal(int x, int y) const {
    const auto& n = at(x, y).normal;
    const double u = n[0] / 32767.0, v = n[1] / 32767.0;
    return {u, v, std::sqrt(std::max(0.0, 1 - u * u - v * v))};
  }

  /// The first pixel of its square in which something is seen.
  [[nodiscard]] Knot knot_at(int column, int row) const {
    for (int y = row * step_; y < std::min(height_, (row + 1) * step_); ++y)
      for (int x = column * step_; x < std::min(width_, (column + 1) * step_); ++x)
        if (at(x, y).is_there()) return {{x + 0.5, y + 0.5}, point(x, y), normal(x, y), true};
    return {};
  }

  [[nodiscard]] float darkness(const Knot& knot, int column, int row) const {
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
  [[nodiscard]] float likeness(const Vector& point, const Vector& normal, const Knot& knot) const {
    if (!knot.is_there) return 0;
    const double off = std::fabs(dot(difference(knot.point, point), normal)) / (0.25 * radius_);
    const double bent = std::max(0.0, dot(normal, knot.normal));
    return static_cast<float>(std::max(0.0, 1 - off) * bent * bent + 1e-4);
  }

  /// Over as many knots as the pattern has.
  void smooth() {
    std::vector<float> smoothed(dark_.size());
    for (int y = 0; y < rows_; ++y)
      for (int x = 0; x < columns_; ++x) {
        const Knot& here = knot(x, y);
        if (!here.is_there) continue;
        float sum = 0, weights = 0;
        for (int v = std::max(0, y - 1); v < std::min(rows_, y - 1 + pattern); ++v)
          for (int u = std::max(0, x - 1); u < std::min(columns_, x - 1 + pattern); ++u) {
            const float weight = likeness(here.point, here.normal, knot(u, v));
            sum += weight * dark(u, v);
            weights += weight;
          }
        smoothed[static_cast<std::size_t>(y * columns_ + x)] = weights > 0 ? sum / weights : dark(x, y);
      }
    dark_ = std::move(smoothed);
  }

  /// From the knots around a pixel; they count by how much what is seen there is like what is seen here, but
  /// where they are equally dark.
  [[nodiscard]] std::uint8_t between(int x, int y) {
    constexpr float alike = 1.0F / 64;
    const double u = (x + 0.5) / step_ - 0.5, v = (y + 0.5) / step_ - 0.5;
    const int left = std::max(0, static_cast<int>(u)), above = std::max(0, static_cast<int>(v));
    const int right = std::min(left + 1, columns_ - 1), below = std::min(above + 1, rows_ - 1);
    const std::array<float, 4> darks{dark(left, above), dark(right, above), dark(left, below),
                                     dark(right, below)};
    const std::array<const Knot*, 4> knots{&knot(left, above), &knot(right, above), &knot(left, below),
                                           &knot(right, below)};
    const double s = std::clamp(u - left, 0.0, 1.0), t = std::clamp(v - above, 0.0, 1.0);
    const std::array<double, 4> shares{(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t};
    const auto [least, most] = std::minmax_element(darks.begin(), darks.end());
    const bool are_there =
        knots[0]->is_there && knots[1]->is_there && knots[2]->is_there && knots[3]->is_there;
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
};

}  // namespace

std::vector<std::uint8_t> occlusion(const Lighting& lighting, std::span<const Seen> seen, int width,
                                    int height, double radius) {
  return Occlusion(lighting, seen, width, height, radius).run();
}

}  // namespace bsp2::supersteps
