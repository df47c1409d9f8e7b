#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "bsp2/geometry/exact/exact.hpp"

namespace bsp2::geometry {

/// The hyperplanes that enclose a round solid level by level, each under a number, computed when asked for.
///
/// The solid, in its frame: |(x_1 .. x_axes)| <= radius, which is 1, or for a cone goes linearly from
/// `bottom` to `top` where x_(axes+1) goes from 0 to 1. The directions around it are divided like the faces
/// of a cube, and each face into a grid of 2^level wedges along each of its axes.
///
/// A wedge w has a direction d of integers. Its *tangent* d.x = T radius has the whole solid on its negative
/// side. Before its *chord* d.x = C radius, inside the wedge, is only solid. *Radial* hyperplanes x_i = t x_a
/// bound and halve wedges. T and C are rounded to multiples of 2^-40, outward and inward. Source: the paper,
/// section 4.1 and figure 5; docs/curved.md has the proof.
template <int D>
class RoundFamily {
 public:
  /// @param axes how many axes are round, 2 .. D. @param limit there are at most so many hyperplanes.
  /// @pre bottom, top in [0, 1], not both 0; both 1 if axes = D.
  RoundFamily(int axes, double bottom, double top, std::uint64_t limit);

  /// A wedge: the face of the cube (2 axis, plus 1 on the negative side), and its place in the grid of this
  /// level, along the other round axes in their order.
  struct Wedge {
    std::uint32_t face = 0, level = 0;
    std::array<std::uint32_t, D> at{};
    [[nodiscard]] int axis() const { return static_cast<int>(face / 2); }
    [[nodiscard]] int sign() const { return face % 2 == 0 ? 1 : -1; }
    friend bool operator==(const Wedge&, const Wedge&) = default;
  };
  /// A radial hyperplane: its number, and whether its positive side is where x_i / |x_a| is smaller.
  struct Radial {
    std::uint32_t number;
    bool flipped;
  };

  [[nodiscard]] int axes() const { return axes_; }
  [[nodiscard]] double bottom() const { return bottom_; }
  [[nodiscard]] double top() const { return top_; }
  /// Wedges are divided up to this level.
  [[nodiscard]] std::uint32_t levels() const { return levels_; }
  [[nodiscard]] std::uint32_t count() const { return count_; }

  /// The round axis that coordinate `place` of a wedge goes along.
  [[nodiscard]] static int axis_at(const Wedge& wedge, int place) {
    return place < wedge.axis() ? place : place + 1;
  }
  /// d: D entries, 0 on the axes that are not round. Exact.
  [[nodiscard]] std::array<double, D> direction(const Wedge& wedge) const;
  [[nodiscard]] std::uint32_t tangent(const Wedge& wedge) const { return number_of(wedge); }
  [[nodiscard]] std::uint32_t chord(const Wedge& wedge) const { return number_of(wedge) + 1; }
  /// What halves the wedge along a coordinate. @pre wedge.level < levels().
  [[nodiscard]] Radial halving(const Wedge& wedge, int place) const;
  /// What bounds the wedge along a coordinate, below (-1) or above (+1).
  [[nodiscard]] Radial bound(const Wedge& wedge, int place, int side) const;

  /// The covector in the solid's frame, inside negative: exactly, and each entry with a relative error below
  /// 2^-62.
  [[nodiscard]] std::array<LocalInteger, D + 1> exact(std::uint32_t number) const;
  [[nodiscard]] std::array<long double, D + 1> rounded(std::uint32_t number) const;

 private:
  static constexpr std::uint32_t most_levels = 20;
  static constexpr int fraction_bits = 40;  // of T and C

  int axes_;
  double bottom_, top_;
  std::uint32_t levels_ = 0, count_ = 0, radials_ = 0;
  std::array<std::uint32_t, most_levels + 2> first_of_level_{};

  /// A hyperplane of small integers: normal . x + offset radius, or without the radius.
  struct Small {
    std::array<std::int64_t, D> normal{};
    std::int64_t offset = 0;
  };
  [[nodiscard]] bool is_tapered() const { return bottom_ != 1 || top_ != 1; }
  [[nodiscard]] std::uint32_t number_of(const Wedge& wedge) const;
  [[nodiscard]] Radial radial(int i, int a, std::int64_t t) const;
  [[nodiscard]] Small small(std::uint32_t number) const;
  [[nodiscard]] std::int64_t tangent_offset(const std::array<std::int64_t, D>& d) const;
  [[nodiscard]] std::int64_t chord_offset(const Wedge& wedge, const std::array<std::int64_t, D>& d) const;
  [[nodiscard]] static std::uint64_t size_with(int axes, std::uint32_t levels);
};

}  // namespace bsp2::geometry
