#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "bsp2/meshing/complex/complex.hpp"

namespace bsp2::meshing {

/// The tetrahedra around a point, to be asked what they would be like if it were elsewhere.
///
/// Shape: of each the triangle opposite of the point, with what does not change when the point moves.
/// Thread rule: as a vector.
class Star {
 public:
  void clear() { spokes_.clear(); }
  /// @param a, b, c such that a b c and the point are right side out. What is added first is asked first: the
  /// worst one should be.
  void add(const Point& a, const Point& b, const Point& c);

  /// The middle of the triangles' corners, each as often as it is one.
  [[nodiscard]] Point middle() const;

  /// The worst shape (`shape_of`) with the point at x; what is not above `enough` does not matter.
  [[nodiscard]] double worst(const Point& x, double enough) const;

  /// The way in which all that are nearly as bad as the worst one become better, as long as makes the sine of
  /// its angle about half as large again; none where they hinder each other.
  /// Source: Freitag, Ollivier-Gooch, "Tetrahedral mesh improvement using swapping and smoothing" (1997); the
  /// shortest vector of the gradients' hull by Gilbert, "An iterative procedure for computing the minimum of
  /// a quadratic form on a convex set" (1966).
  [[nodiscard]] std::optional<Point> ascent(const Point& x);

 private:
  struct Spoke {
    Point a, b, c, normal;    // as long as the area is twice, away from the point
    double area, ab, ac, bc;  // squared: twice the area, and lengths
  };
  /// Of the tetrahedron over a spoke.
  struct Look {
    Point ad, bd, cd, n0, n1, n2;
    double six_volumes, a0, a1, a2, lengths;
    int edge;       // where its angle is smallest; no_edge: its fullness is less than the sine of that
    double square;  // of which of both is less
  };
  static constexpr int no_edge = 6;
  struct Slope {
    double square;
    Point gradient;  // of the square's logarithm
  };
  std::vector<Spoke> spokes_;
  std::vector<Slope> slopes_;  // kept for their memory

  [[gnu::always_inline]] static inline Look look(const Spoke& spoke, const Point& x);
  static Point gradient(const Spoke& spoke, const Look& look);
};

}  // namespace bsp2::meshing
