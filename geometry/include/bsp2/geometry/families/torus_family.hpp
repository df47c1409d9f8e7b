#pragma once

#include <array>
#include <cstdint>

#include "bsp2/geometry/families/round_family.hpp"

namespace bsp2::geometry {

/// The hyperplanes that enclose a torus level by level, each under a number, computed when asked for. D = 3.
///
/// The torus, in its frame: (rho - 1)^2 + z^2 <= minor^2, rho = |(x, y)|. Around the axis it is divided into
/// the wedges of a RoundFamily with two axes. For the points of a wedge with direction d,
///   least d.x <= rho <= most d.x      (`Span`)
/// so a half-plane of (rho, z) is held between two half-spaces of the wedge. Across the tube, directions
/// (*arcs*) are divided like the wedges are. An arc has an *outer* plane, which has all of the torus in this
/// wedge on its negative side, and an *inner* one, which cuts off as much as the chord of the arc does.
/// Rounded to multiples of 2^-44, by a margin of 2^-38 to the safe side. docs/curved.md.
class TorusFamily {
 public:
  using Wedge = RoundFamily<3>::Wedge;
  /// @param minor in (0, 1]: of the tube; that of its circle is 1.
  TorusFamily(double minor, std::uint64_t limit);

  struct Span {
    double least, most;
  };
  /// A direction (rho, z) out of the circle: the face of a square (rho, -rho, z, -z), and the place on it.
  struct Arc {
    std::uint32_t face = 0, at = 0;
    friend bool operator==(const Arc&, const Arc&) = default;
  };

  [[nodiscard]] double minor() const { return minor_; }
  [[nodiscard]] std::uint32_t levels() const { return levels_; }
  [[nodiscard]] std::uint32_t count() const { return first_of_level_[levels_ + 1]; }
  /// The direction of a wedge, not of unit length: (dx, dy).
  [[nodiscard]] static std::array<double, 2> direction(const Wedge& wedge);
  /// Rounded outward. Of the direction above.
  [[nodiscard]] static Span span(const Wedge& wedge);
  /// The arc, at the level that goes with a wedge's, in whose direction (rho - 1, z) lies.
  [[nodiscard]] Arc arc_towards(std::uint32_t wedge_level, double rho, double z) const;
  /// Its middle direction, of unit length but for rounding.
  [[nodiscard]] std::array<double, 2> middle(std::uint32_t wedge_level, const Arc& arc) const;
  [[nodiscard]] std::uint32_t outer(const Wedge& wedge, const Arc& arc) const;
  [[nodiscard]] std::uint32_t inner(const Wedge& wedge, const Arc& arc) const {
    return outer(wedge, arc) + 1;
  }

  [[nodiscard]] std::array<LocalInteger, 4> exact(std::uint32_t number) const;
  [[nodiscard]] std::array<long double, 4> rounded(std::uint32_t number) const;

 private:
  static constexpr std::uint32_t most_levels = 14;
  double minor_;
  std::uint32_t levels_ = 0, lag_ = 0;
  std::array<std::uint32_t, most_levels + 2> first_of_level_{};

  /// Arcs of a small tube are as wide as the wedges' curvature is worth.
  [[nodiscard]] std::uint32_t arc_level(std::uint32_t wedge_level) const {
    return wedge_level > lag_ + 1 ? wedge_level - lag_ : 1;
  }
  [[nodiscard]] std::array<std::int64_t, 4> plane(std::uint32_t number) const;
};

}  // namespace bsp2::geometry
