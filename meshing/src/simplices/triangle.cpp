#include "simplices/triangle.hpp"

#include "simplices/shape.hpp"

namespace bsp2::meshing {

/// Source: Ericson, "Real-Time Collision Detection" (2005), 5.1.5.
std::array<double, 3> nearest_weights(const std::array<Point, 3>& corner, const Point& place) {
  const Point ab = corner[1] - corner[0], ac = corner[2] - corner[0];
  const Point from_a = place - corner[0], from_b = place - corner[1], from_c = place - corner[2];
  const double a1 = dot(ab, from_a), a2 = dot(ac, from_a);
  if (a1 <= 0 && a2 <= 0) return {1, 0, 0};
  const double b1 = dot(ab, from_b), b2 = dot(ac, from_b);
  if (b1 >= 0 && b2 <= b1) return {0, 1, 0};
  const double c1 = dot(ab, from_c), c2 = dot(ac, from_c);
  if (c2 >= 0 && c1 <= c2) return {0, 0, 1};
  const double of_a = b1 * c2 - c1 * b2, of_b = c1 * a2 - a1 * c2, of_c = a1 * b2 - b1 * a2;
  if (of_c <= 0 && a1 >= 0 && b1 <= 0) return {1 - a1 / (a1 - b1), a1 / (a1 - b1), 0};
  if (of_b <= 0 && a2 >= 0 && c2 <= 0) return {1 - a2 / (a2 - c2), 0, a2 / (a2 - c2)};
  if (of_a <= 0 && b2 - b1 >= 0 && c1 - c2 >= 0) {
    const double share = (b2 - b1) / ((b2 - b1) + (c1 - c2));
    return {0, 1 - share, share};
  }
  const double sum = of_a + of_b + of_c;
  return {of_a / sum, of_b / sum, of_c / sum};
}

}  // namespace bsp2::meshing
