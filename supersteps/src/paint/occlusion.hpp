#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "paint/lighting.hpp"

namespace bsp2::supersteps {

/// What is seen in a pixel.
struct Seen {
  static constexpr float nothing = -std::numeric_limits<float>::infinity();
  float depth = nothing;                 ///< from the eye, or from a plane through the origin
  std::array<std::int16_t, 2> normal{};  ///< x and y in the picture's axes; 32767 is 1
  [[nodiscard]] bool is_there() const { return depth != nothing; }
};

/// How much light the surroundings keep away from each pixel, 0 to 255: corners and gaps are darker.
///
/// Ambient occlusion by what is seen within `Lighting::radius`; a length of the model, so it is the same from
/// wherever one looks. Rows come from the top, and go once all that they depend on is there: of a square
/// picture a quarter is in memory. Source: McGuire, Osman, Bukowski, Hennessy, "The alchemy screen-space
/// ambient obscurance algorithm" (2011).
class Occlusion {
 public:
  /// Told each row in their order, with a number a pixel.
  using Emit = std::function<void(int y, std::span<const std::uint8_t> darkness)>;
  /// @param seen its memory, of any size. @param lighting is kept as a reference.
  Occlusion(const Lighting& lighting, int width, int height, std::vector<Seen>& seen, Emit emit);

  /// The next row, in which nothing is seen yet.
  std::span<Seen> begin_row();
  /// It is as it should be.
  void end_row();

 private:
  struct Knot {
    Point2 place{};  // in pixels
    Vector point{}, normal{};
    bool is_there = false;
  };
  /// Taps in a spiral, turned from knot to knot, so that there are no rings; what they differ by is smoothed.
  static constexpr int taps = 12, pattern = 4;
  static constexpr int kept = 8;  // rows of knots
  std::array<std::array<Point2, taps>, pattern * pattern> taps_;

  const Lighting& lighting_;
  int width_, height_;
  double radius_;
  int step_, columns_, rows_;  // of knots: a coarse grid of what is seen
  int far_, kept_pixels_;      // how many rows away what makes dark can be; how many rows of pixels are kept
  std::vector<Seen>& seen_;
  Emit emit_;
  int begun_ = 0, there_ = 0, next_dark_ = 0, next_smooth_ = 0, next_pixel_ = 0;  // rows
  std::vector<Knot> knots_;
  std::vector<float> dark_, smoothed_;
  std::vector<std::uint8_t> row_;
  std::vector<std::size_t> start_;  // where each row of pixels begins among those that are kept

  [[nodiscard]] std::size_t index(int x, int y) const {
    return start_[static_cast<std::size_t>(y)] + static_cast<std::size_t>(x);
  }
  [[nodiscard]] std::size_t index_of_knot(int column, int row) const {
    return static_cast<std::size_t>(row % kept * columns_ + column);
  }
  [[nodiscard]] const Seen& at(int x, int y) const { return seen_[index(x, y)]; }
  [[nodiscard]] const Knot& knot(int x, int y) const { return knots_[index_of_knot(x, y)]; }
  [[nodiscard]] Vector point(int x, int y) const;
  [[nodiscard]] Vector normal(int x, int y) const;
  void make_dark(int row);
  [[nodiscard]] Knot knot_at(int column, int row) const;
  [[nodiscard]] float darkness(const Knot& knot, int column, int row) const;
  [[nodiscard]] float likeness(const Vector& point, const Vector& normal, const Knot& knot) const;
  void smooth(int row);
  void emit(int y);
  [[nodiscard]] int above(int y) const;
  [[nodiscard]] int below(int y) const { return std::min(above(y) + 1, rows_ - 1); }
  [[nodiscard]] std::uint8_t between(int x, int y) const;
};

}  // namespace bsp2::supersteps
